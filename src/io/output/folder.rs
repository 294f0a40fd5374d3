//! Folders that appear whole or not at all.

use super::{UNFINISHED, forget, kind_of};
use crate::{Error, Result};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder being written: a temporary one beside its place until [`OutputFolder::commit`] gives it its name. Dropped before
/// that, it leaves nothing behind.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    temporary: TempDir,
}

impl OutputFolder {
    /// Starts a folder at a place where there is nothing yet.
    ///
    /// # Errors
    /// There is something, or the folder around it cannot be written to.
    pub fn create(path: &Path) -> Result<Self> {
        if path.symlink_metadata().is_ok() {
            let error =
                std::io::Error::new(ErrorKind::AlreadyExists, "is there already, expected a new name");
            return Err(Error::io(path, error));
        }
        let around = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".knotmesh-").suffix(".tmp");
        // Temporary folders are private by default; results are ordinary folders.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let temporary = builder
            .tempdir_in(around)
            .map_err(|e| Error::io(path, std::io::Error::new(e.kind(), kind_of(&e))))?;
        if let Ok(mut paths) = UNFINISHED.lock() {
            paths.push(temporary.path().into());
        }
        Ok(Self { path: path.into(), temporary })
    }

    /// Writes a file in it; folders on the way to it are made.
    ///
    /// # Errors
    /// The system's, with the name that the file was to have.
    pub fn put(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let place = self.temporary.path().join(name);
        let made = place.parent().map_or(Ok(()), std::fs::create_dir_all);
        made.and_then(|()| std::fs::write(&place, bytes)).map_err(|e| Error::io(&self.path.join(name), e))
    }

    /// Gives the finished folder its name.
    ///
    /// # Errors
    /// The system's: another one may have taken the name.
    pub fn commit(self) -> Result<()> {
        std::fs::rename(self.temporary.path(), &self.path).map_err(|e| Error::io(&self.path, e))
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        forget(self.temporary.path());
    }
}
