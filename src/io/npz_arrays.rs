//! Arrays by name in an archive (`.npz`), whatever they mean.

use super::npy::{Mismatch, NpyHeader};
use super::zip::{Entry, EntryReader, ZipReader};
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// An open archive of arrays.
pub(super) struct Arrays {
    path: PathBuf,
    /// Taken while an entry is being read; after a failure there is none.
    zip: Option<ZipReader>,
}

/// An array that was read whole.
pub(super) struct Array {
    /// Where its entry starts in the file, for messages.
    pub at: u64,
    /// Its shape and kind.
    pub header: NpyHeader,
    bytes: Vec<u8>,
}

impl Array {
    /// Its numbers in the order of the file. f32, f64 and integers up to 2^53 are exact.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        self.bytes.chunks_exact(self.header.size).map(|bytes| self.header.number(bytes))
    }
}

impl Arrays {
    pub fn open(path: &Path) -> Result<Self> {
        Ok(Self { path: path.into(), zip: Some(ZipReader::open(path)?) })
    }

    /// The names of all arrays.
    pub fn names(&self) -> Vec<&str> {
        let entries = self.zip.iter().flat_map(|zip| &zip.entries);
        entries.filter_map(|e| e.name.strip_suffix(".npy")).collect()
    }

    fn find(&self, name: &str) -> Option<Entry> {
        let mut entries = self.zip.iter().flat_map(|zip| &zip.entries);
        entries.find(|e| e.name.strip_suffix(".npy") == Some(name)).cloned()
    }

    /// Reads an array of at most `limit` bytes, none if there is no such name. Its shape must please `fits`; `expected` says
    /// what would.
    pub fn load(
        &mut self,
        name: &str,
        limit: u64,
        fits: impl Fn(&[u64]) -> bool,
        expected: &str,
    ) -> Result<Option<Array>> {
        let Some(entry) = self.find(name) else { return Ok(None) };
        let Some(zip) = self.zip.take() else { return Ok(None) };
        let mut reader = zip.entry(&entry)?;
        let header = read_header(&self.path, &mut reader, &entry)?;
        let size = header.count().and_then(|n| n.checked_mul(header.size as u64));
        if !fits(&header.shape) || size != Some(reader.left()) {
            return Err(shape_error(&self.path, &entry, &header, reader.left(), expected));
        }
        let bytes = reader.read_rest(limit)?;
        self.zip = Some(reader.close());
        Ok(Some(Array { at: entry.at, header, bytes }))
    }

    /// Turns the archive to an array that is read piece by piece, its header first.
    pub fn turn_to(mut self, name: &str) -> Result<Option<(EntryReader, Entry)>> {
        let Some(entry) = self.find(name) else { return Ok(None) };
        let Some(zip) = self.zip.take() else { return Ok(None) };
        Ok(Some((zip.entry(&entry)?, entry)))
    }
}

/// Reads the header of an array.
pub(super) fn read_header(path: &Path, reader: &mut EntryReader, entry: &Entry) -> Result<NpyHeader> {
    let place = |Mismatch { at, found, expected }: Mismatch| {
        let found = format!("{found} at byte {at} of '{}'", entry.name);
        Error::binary(path, entry.at as usize, found, expected)
    };
    let mut bytes = vec![0; 12];
    reader.read_exact(&mut bytes)?;
    let (before, length) = NpyHeader::lengths(&bytes).map_err(place)?;
    // A version 1 header begins two bytes before the end of these twelve.
    bytes.resize((before + length).max(12), 0);
    reader.read_exact(&mut bytes[12..])?;
    let header = NpyHeader::parse(&bytes).map_err(place)?;
    if header.fortran_order {
        let found = format!("the array '{}' in Fortran order", entry.name);
        let expected = "C order (np.ascontiguousarray gives it)";
        return Err(Error::binary(path, entry.at as usize, found, expected));
    }
    Ok(header)
}

/// The error that an array has another shape than expected, or other bytes than its shape has.
pub(super) fn shape_error(path: &Path, entry: &Entry, npy: &NpyHeader, bytes: u64, expected: &str) -> Error {
    let found = format!("the shape {:?} in {bytes} bytes of '{}'", npy.shape, entry.name);
    Error::binary(path, entry.at as usize, found, format_args!("{expected}, and as many bytes"))
}
