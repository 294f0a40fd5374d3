//! A file that somebody else may change.

use super::state::{Content, Kind};
use crate::io::output::Output;
use crate::io::text::{line_and_column, read_bytes};
use crate::mesh::StitchMesh;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;
use xxhash_rust::xxh3::xxh3_64;

/// Reads the meshes that this program reads.
pub type MeshReader = Arc<dyn Fn(&Path) -> Result<StitchMesh> + Send + Sync>;

/// The file that is shown.
pub struct Disk {
    /// Its name; without, what is shown is not on disk yet.
    pub path: Option<PathBuf>,
    stamp: Option<(SystemTime, u64)>,
    hash: Option<u64>,
    reader: MeshReader,
}

impl Disk {
    /// No file yet.
    pub fn nowhere(reader: MeshReader) -> Self {
        Self { path: None, stamp: None, hash: None, reader }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// One that cannot be read, or is not text where it should be. Patterns need not be right.
    pub fn open(path: &Path, reader: MeshReader) -> Result<(Self, Content)> {
        let mut disk = Self { path: Some(path.into()), ..Self::nowhere(reader) };
        disk.stamp = stamp(path);
        let bytes = read_bytes(path)?;
        disk.hash = Some(xxh3_64(&bytes));
        let content = disk.content(path, bytes)?;
        Ok((disk, content))
    }

    fn content(&self, path: &Path, bytes: Vec<u8>) -> Result<Content> {
        Ok(match Kind::of(path)? {
            Kind::Mesh => Content::Mesh(Arc::new((self.reader)(path)?)),
            Kind::Picture => Content::Picture(bytes.into()),
            Kind::Pattern | Kind::Chart => Content::Text(
                String::from_utf8(bytes)
                    .map_err(|e| {
                        let at = e.utf8_error().valid_up_to();
                        let (line, column) = line_and_column(e.as_bytes(), at);
                        Error::input(path, line, column, "bytes that are not UTF-8", "a text file")
                    })?
                    .into(),
            ),
        })
    }

    /// What the file holds now, if that is something else than was read or written last. A file that is gone, or being written,
    /// is looked at again later.
    ///
    /// # Errors
    /// Those of [`Disk::open`], once for each change.
    pub fn look(&mut self) -> Result<Option<Content>> {
        let Some(path) = self.path.clone() else { return Ok(None) };
        let now = stamp(&path);
        if now.is_none() || now == self.stamp {
            return Ok(None);
        }
        let Ok(bytes) = read_bytes(&path) else { return Ok(None) };
        self.stamp = now;
        let hash = Some(xxh3_64(&bytes));
        if hash == self.hash {
            return Ok(None);
        }
        self.hash = hash;
        self.content(&path, bytes).map(Some)
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// No name, a mesh (which is not written as it was read), a file that cannot be written.
    pub fn save(&mut self, content: &Content) -> Result<()> {
        let Some(path) = self.path.clone() else {
            return Err(Error::invalid("found no file name, expected one to save under"));
        };
        let bytes = match content {
            Content::Text(text) => text.as_bytes(),
            Content::Picture(bytes) => bytes,
            Content::Mesh(_) => {
                return Err(Error::invalid("a mesh is saved under a name of its own: save the mesh"));
            }
        };
        let mut output = Output::create(&path)?;
        output.put(bytes)?;
        output.commit()?;
        (self.hash, self.stamp) = (Some(xxh3_64(bytes)), stamp(&path));
        Ok(())
    }
}

fn stamp(path: &Path) -> Option<(SystemTime, u64)> {
    let data = std::fs::metadata(path).ok()?;
    Some((data.modified().ok()?, data.len()))
}

impl std::fmt::Debug for Disk {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Disk").field("path", &self.path).field("hash", &self.hash).finish_non_exhaustive()
    }
}
