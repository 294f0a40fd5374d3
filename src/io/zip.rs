//! ZIP archives as NumPy uses them: stored entries are written, stored and deflated ones are read. Sizes are held
//! against the file's before anything is allocated.

use super::output::Output;
use crate::{Error, Result};
use self_cell::{MutBorrow, self_cell};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive};

/// The archive's file. After a failure it takes everything and keeps nothing: a [`zip::ZipWriter`] that is dropped
/// completes its archive, and would report the same failure again in words of its own.
struct Sink {
    out: Output,
    position: u64,
    failed: bool,
}

impl Sink {
    fn watch<T>(&mut self, result: std::io::Result<T>) -> std::io::Result<T> {
        self.failed |= result.is_err();
        result
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = if self.failed { Ok(bytes.len()) } else { self.out.write(bytes) };
        self.position += *written.as_ref().unwrap_or(&0) as u64;
        self.watch(written)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        let flushed = if self.failed { Ok(()) } else { self.out.flush() };
        self.watch(flushed)
    }
}

impl Seek for Sink {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let result = match (self.failed, to) {
            (false, to) => self.out.seek(to),
            (true, SeekFrom::Start(position)) => Ok(position),
            (true, _) => Ok(self.position),
        };
        self.position = *result.as_ref().unwrap_or(&self.position);
        self.watch(result)
    }
}

/// Writes stored entries one after the other, equal files from equal input.
pub struct ZipWriter {
    path: PathBuf,
    zip: zip::ZipWriter<Sink>,
}

impl ZipWriter {
    /// An archive without entries.
    ///
    /// # Errors
    /// The output is a device or a pipe: sizes and checksums are filled in when their entry is complete.
    pub fn new(out: Output) -> Result<Self> {
        let path = out.path().to_path_buf();
        if !out.is_file() {
            let path = path.display();
            return Err(Error::invalid(format_args!("{path}: found a device or a pipe, expected a file")));
        }
        Ok(Self { path, zip: zip::ZipWriter::new(Sink { out, position: 0, failed: false }) })
    }

    /// Completes the entry before and starts one of at most `size` bytes.
    pub fn begin(&mut self, name: &str, size: u64) -> Result<()> {
        // Entries with 64-bit sizes are beyond some simple readers, so that only large ones have them.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .large_file(size >= u32::MAX as u64);
        self.zip.start_file(name, options).map_err(|e| failed(&self.path, e))
    }

    /// Writes a piece of the entry.
    pub fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.zip.write_all(bytes).map_err(|e| Error::io(&self.path, e))
    }

    /// Writes the directory and gives the archive its name.
    pub fn finish(self) -> Result<()> {
        let sink = self.zip.finish().map_err(|e| failed(&self.path, e))?;
        if sink.failed {
            return Err(Error::io(&self.path, std::io::Error::other("a write failed before")));
        }
        sink.out.commit()
    }
}

fn failed(path: &Path, error: ZipError) -> Error {
    match error {
        ZipError::Io(error) => Error::io(path, error),
        error => Error::invalid(format_args!("{}: {error}", path.display())),
    }
}

type Archive = ZipArchive<BufReader<File>>;
type OpenEntry<'a> = zip::read::ZipFile<'a, BufReader<File>>;

self_cell!(
    /// An archive and one of its entries, which reads from it.
    struct OpenArchive {
        owner: MutBorrow<Archive>,
        #[not_covariant]
        dependent: OpenEntry,
    }
);

/// An entry of an archive that is read.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its name.
    pub name: String,
    /// Its bytes when unpacked, as the directory says.
    pub size: u64,
    /// Where its header starts in the file.
    pub at: u64,
    index: usize,
}

/// Reads the entries of an archive.
pub struct ZipReader {
    path: PathBuf,
    length: u64,
    archive: Archive,
    /// The directory.
    pub entries: Vec<Entry>,
}

impl ZipReader {
    /// Reads the directory of an archive.
    pub fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, e))?;
        let length = file.metadata().map_err(|e| Error::io(path, e))?.len();
        let wrong = |at: u64, found: ZipError| {
            Error::binary(path, at as usize, found, "a ZIP archive of stored or deflated arrays (.npz)")
        };
        let archive = Archive::new(BufReader::new(file)).map_err(|e| wrong(0, e))?;
        let mut entries = Vec::new();
        for index in 0..archive.len() {
            let entry = archive.by_index_data(index).map_err(|e| wrong(0, e))?;
            let (at, size, packed) = (entry.header_start(), entry.size(), entry.compressed_size());
            let name = entry.name().map_err(|e| wrong(at, e))?.into_owned();
            // Deflate packs at most about 1032 to 1.
            let sizes_fit = match entry.compression() {
                CompressionMethod::Stored => size == packed,
                _ => size <= packed.saturating_mul(1040).saturating_add(64),
            };
            if packed > length || !sizes_fit {
                let found = format!("the entry '{name}' of {size} bytes, {packed} packed");
                let expected = format!("sizes that fit the file's {length} bytes");
                return Err(Error::binary(path, at as usize, found, expected));
            }
            entries.push(Entry { name, size, at, index });
        }
        Ok(Self { path: path.into(), length, archive, entries })
    }

    /// Turns the reader to an entry's unpacked bytes.
    pub fn entry(self, entry: &Entry) -> Result<EntryReader> {
        let open = OpenArchive::try_new(MutBorrow::new(self.archive), |archive| {
            archive.borrow_mut().by_index(entry.index)
        });
        let open = open.map_err(|e| {
            let found = format!("{e} in the entry '{}'", entry.name);
            Error::binary(&self.path, entry.at as usize, found, "a stored or deflated entry")
        })?;
        Ok(EntryReader {
            path: self.path,
            length: self.length,
            entries: self.entries,
            open,
            left: entry.size,
            entry: entry.clone(),
        })
    }
}

/// The unpacked bytes of one entry, read from front to back.
pub struct EntryReader {
    path: PathBuf,
    length: u64,
    entries: Vec<Entry>,
    open: OpenArchive,
    left: u64,
    entry: Entry,
}

impl EntryReader {
    /// Bytes not read yet.
    pub fn left(&self) -> u64 {
        self.left
    }

    fn broken(&self, found: &str, expected: &str) -> Error {
        let found = format!("{found} in the entry '{}'", self.entry.name);
        Error::binary(&self.path, self.entry.at as usize, found, expected)
    }

    /// Fills `bytes`. The last byte's arrival compares the checksum.
    pub fn read_exact(&mut self, bytes: &mut [u8]) -> Result<()> {
        let wanted = bytes.len() as u64;
        let Some(left) = self.left.checked_sub(wanted) else {
            let expected = format!("at least {}", self.entry.size - self.left + wanted);
            return Err(self.broken(&format!("only {} bytes", self.entry.size), &expected));
        };
        let read = self.open.with_dependent_mut(|_, source| {
            source.read_exact(bytes)?;
            // The checksum is compared where the entry ends, which takes one read more.
            if left > 0 { Ok(0) } else { source.read(&mut [0]) }
        });
        self.left = left;
        match read {
            Ok(0) => Ok(()),
            Ok(_) => Err(self.broken("too many bytes", &self.entry.size.to_string())),
            Err(e) => Err(self.broken(&format!("damaged data ({e})"), "data that can be unpacked")),
        }
    }

    /// Reads the rest, which may be at most `limit` bytes.
    pub fn read_rest(&mut self, limit: u64) -> Result<Vec<u8>> {
        if self.left > limit {
            let found = format!("{} bytes", self.entry.size);
            return Err(self.broken(&found, &format!("at most {limit}")));
        }
        // Grown as data arrives: a deflated entry's size is only a claim.
        let mut bytes = Vec::new();
        while self.left > 0 {
            let begin = bytes.len();
            bytes.resize(begin + self.left.min(1 << 20) as usize, 0);
            self.read_exact(&mut bytes[begin..])?;
        }
        Ok(bytes)
    }

    /// Back to the archive.
    pub fn close(self) -> ZipReader {
        let archive = self.open.into_owner().into_inner();
        ZipReader { path: self.path, length: self.length, archive, entries: self.entries }
    }
}
