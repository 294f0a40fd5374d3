//! Files that appear whole or not at all, and the names of numbered frames.

mod folder;

pub use folder::OutputFolder;

use crate::{Error, Result};
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use tempfile::NamedTempFile;

/// Temporary files and folders of outputs not yet finished, for a program that is told to stop.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the temporary files and folders of all unfinished outputs: for signal handlers, before the program exits.
pub fn discard_unfinished() {
    if let Ok(paths) = UNFINISHED.lock() {
        for path in paths.iter() {
            let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
        }
    }
}

fn forget(path: &Path) {
    if let Ok(mut paths) = UNFINISHED.lock() {
        paths.retain(|p| p != path);
    }
}

/// A file being written: a temporary one in the same folder until [`Output::commit`] gives it its name.
/// Dropped before that, it leaves nothing behind.
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    inner: BufWriter<Target>,
}

#[derive(Debug)]
enum Target {
    /// Renamed to the path at the end.
    Temporary(NamedTempFile, PathBuf),
    /// Devices and pipes, which cannot be renamed over.
    Direct(File),
}

impl Target {
    fn file(&mut self) -> &mut File {
        match self {
            Target::Temporary(file, _) => file.as_file_mut(),
            Target::Direct(file) => file,
        }
    }
}

impl Write for Target {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file().write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        self.file().flush()
    }
}

impl Seek for Target {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.file().seek(to)
    }
}

/// What went wrong, without the path that tempfile puts in.
fn kind_of(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" at path ").next().unwrap_or(&text).to_string()
}

impl Output {
    /// Starts writing `path`. An existing file stays as it is until the commit.
    pub fn create(path: &Path) -> Result<Self> {
        let target = Self::target(path).map_err(|e| Error::io(path, e))?;
        Ok(Self { path: path.into(), inner: BufWriter::with_capacity(1 << 18, target) })
    }

    fn target(path: &Path) -> std::io::Result<Target> {
        // A link is followed, so that the file it points to is replaced and not the link.
        let real = std::fs::canonicalize(path).unwrap_or_else(|_| path.into());
        let existing = std::fs::metadata(&real).ok();
        if existing.as_ref().is_some_and(|m| !m.is_file() && !m.is_dir()) {
            return Ok(Target::Direct(File::options().write(true).open(&real)?));
        }
        if existing.as_ref().is_some_and(|m| m.is_dir()) {
            return Err(std::io::Error::new(
                std::io::ErrorKind::IsADirectory,
                "is a directory, expected a file name",
            ));
        }
        let folder = match real.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".knotmesh-").suffix(".tmp");
        // Temporary files are private by default; results are ordinary files.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        // The message names the output, not the temporary file.
        let temporary =
            builder.tempfile_in(folder).map_err(|e| std::io::Error::new(e.kind(), kind_of(&e)))?;
        if let Ok(mut paths) = UNFINISHED.lock() {
            paths.push(temporary.path().into());
        }
        if let Some(existing) = existing {
            temporary.as_file().set_permissions(existing.permissions())?;
        }
        Ok(Target::Temporary(temporary, real))
    }

    /// Where the file will be.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes bytes; a failure names the file.
    pub fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.inner.write_all(bytes).map_err(|e| Error::io(&self.path, e))
    }

    /// Whether it is an ordinary file, in which one can go back.
    pub fn is_file(&self) -> bool {
        matches!(self.inner.get_ref(), Target::Temporary(..))
    }

    /// Goes back to `position` bytes from the start, writes `bytes` there and returns to the end.
    pub fn patch(&mut self, position: u64, bytes: &[u8]) -> Result<()> {
        let inner = &mut self.inner;
        inner
            .seek(SeekFrom::Start(position))
            .and_then(|_| inner.write_all(bytes))
            .and_then(|()| inner.seek(SeekFrom::End(0)))
            .map_err(|e| Error::io(&self.path, e))?;
        Ok(())
    }

    /// Gives the finished file its name.
    pub fn commit(self) -> Result<()> {
        let path = self.path;
        let mut target = self.inner.into_inner().map_err(|e| Error::io(&path, e.into_error()))?;
        target.flush().map_err(|e| Error::io(&path, e))?;
        if let Target::Temporary(file, real) = target {
            let temporary = file.path().to_path_buf();
            file.persist(real).map_err(|e| Error::io(&path, e.error))?;
            forget(&temporary);
        }
        Ok(())
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.inner.write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        self.inner.flush()
    }
}

impl Seek for Output {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.inner.seek(to)
    }
}

/// A file name with a place for the frame number: `out.%04d.bcc`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FramePattern {
    folder: PathBuf,
    before: String,
    /// Digits to fill with zeros; none: the name holds no number.
    digits: Option<usize>,
    after: String,
}

impl FramePattern {
    /// Reads `%d` or `%0Nd` (at most one) in the file name; `%%` is a percent sign. Without a number and
    /// with `several` frames, `.%04d` goes before the extension.
    pub fn new(path: &Path, several: bool) -> Result<Self> {
        let invalid = |what: &str| {
            Error::invalid(format_args!(
                "{}: found {what} in the file name, expected at most one %d or %0Nd, and %% for a percent sign",
                path.display()
            ))
        };
        let name = path.file_name().ok_or_else(|| {
            Error::invalid(format_args!("{}: found no file name, expected one", path.display()))
        })?;
        let name = name.to_str().ok_or_else(|| invalid("bytes that are not UTF-8"))?;
        let mut parts = [String::new(), String::new()];
        let mut digits = None;
        let mut rest = name;
        while let Some(at) = rest.find('%') {
            let part = &mut parts[usize::from(digits.is_some())];
            part.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            if let Some(after) = rest.strip_prefix('%') {
                part.push('%');
                rest = after;
                continue;
            }
            let length = rest.bytes().take_while(u8::is_ascii_digit).count();
            let (width, after) = rest.split_at(length);
            rest = after.strip_prefix('d').ok_or_else(|| invalid("'%'"))?;
            if digits.is_some() {
                return Err(invalid("two frame numbers"));
            }
            let width = match width {
                "" => 0,
                zeros if zeros.starts_with('0') && zeros.len() <= 3 => zeros.parse().unwrap_or(0),
                _ => return Err(invalid("'%' and a width that does not start with 0")),
            };
            digits = Some(width);
        }
        parts[usize::from(digits.is_some())].push_str(rest);
        let [mut before, mut after] = parts;
        if digits.is_none() && several {
            digits = Some(4);
            // A leading dot makes a hidden file, not an extension.
            after = match before.rfind('.') {
                Some(dot) if dot > 0 => before.split_off(dot),
                _ => String::new(),
            };
            before.push('.');
        }
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Ok(Self { folder, before, digits, after })
    }

    /// The path of a frame.
    pub fn path(&self, frame: usize) -> PathBuf {
        let name = match self.digits {
            Some(width) => format!("{}{frame:0width$}{}", self.before, self.after),
            None => self.before.clone(),
        };
        self.folder.join(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(pattern: &str, several: bool, frame: usize) -> String {
        FramePattern::new(Path::new(pattern), several).unwrap().path(frame).display().to_string()
    }

    #[test]
    fn frame_names() {
        assert_eq!(name("a%b/out.%04d.bcc", true, 7), "a%b/out.0007.bcc");
        assert_eq!(name("out.%d.bcc", false, 12345), "out.12345.bcc");
        assert_eq!(name("out.bcc", true, 12), "out.0012.bcc");
        assert_eq!(name("out.bcc", false, 12), "out.bcc");
        assert_eq!(name("50%%.bcc", false, 12), "50%.bcc");
        assert_eq!(name("50%%_%03d%%.bcc", false, 1), "50%_001%.bcc");
        assert_eq!(name("50%%.bcc", true, 1), "50%.0001.bcc");
        assert_eq!(name(".hidden", true, 1), ".hidden.0001");
        for wrong in ["%s.bcc", "100%.bcc", "%d%d.bcc", "%4d.bcc", "%", "%0000000000000000009d", "a/.."] {
            assert!(FramePattern::new(Path::new(wrong), true).is_err(), "{wrong}");
        }
    }

    #[test]
    fn appears_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let mut out = Output::create(&path).unwrap();
        out.put(b"half").unwrap();
        drop(out);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let mut out = Output::create(&path).unwrap();
        out.put(b"whole").unwrap();
        out.patch(1, b"H").unwrap();
        out.put(b"!").unwrap();
        assert!(!path.exists());
        out.commit().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"wHole!");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::metadata(&path).unwrap().permissions().mode();
            assert_eq!(mode & 0o600, 0o600);
            let plain = folder.path().join("plain");
            std::fs::write(&plain, b"").unwrap();
            assert_eq!(mode, std::fs::metadata(&plain).unwrap().permissions().mode());
        }
        assert!(Output::create(folder.path()).is_err());
        assert!(Output::create(&folder.path().join("none/a.txt")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn devices_and_links_stay() {
        let mut out = Output::create(Path::new("/dev/null")).unwrap();
        out.put(b"gone").unwrap();
        out.commit().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        std::fs::write(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        let mut out = Output::create(&link).unwrap();
        out.put(b"new").unwrap();
        out.commit().unwrap();
        assert!(link.is_symlink());
        assert_eq!(std::fs::read(&real).unwrap(), b"new");
    }
}
