//! Walks through a sequence; sizes are held against the file's before anything is believed.

use crate::{Error, Result};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// The head of a matrix of 4-byte values.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Matrix {
    /// Where it starts in the file.
    pub at: usize,
    pub rows: u32,
    pub columns: u32,
}

impl Matrix {
    /// Where its values start.
    pub fn data_at(&self) -> u64 {
        self.at as u64 + 8
    }

    /// Bytes of its values; the file has as many, so that nothing overflows.
    pub fn bytes(&self) -> u64 {
        self.rows as u64 * self.columns as u64 * 4
    }
}

/// A file and how far it was walked through.
pub(super) struct Scan {
    path: PathBuf,
    file: BufReader<File>,
    at: u64,
    length: u64,
}

impl Scan {
    pub fn open(path: &Path) -> Result<Self> {
        let io = |e| Error::io(path, e);
        let file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        Ok(Self { path: path.into(), file: BufReader::new(file), at: 0, length })
    }

    pub fn at(&self) -> usize {
        self.at as usize
    }

    pub fn length(&self) -> u64 {
        self.length
    }

    pub fn left(&self) -> u64 {
        self.length - self.at
    }

    pub fn into_file(self) -> File {
        self.file.into_inner()
    }

    fn need(&self, bytes: u64, expected: &str) -> Result<()> {
        if bytes <= self.left() {
            return Ok(());
        }
        Err(Error::binary(&self.path, self.length as usize, "the end of the file", expected))
    }

    fn fill(&mut self, bytes: &mut [u8], expected: &str) -> Result<()> {
        self.need(bytes.len() as u64, expected)?;
        self.file.read_exact(bytes).map_err(|e| Error::io(&self.path, e))?;
        self.at += bytes.len() as u64;
        Ok(())
    }

    fn array<const N: usize>(&mut self, expected: &str) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.fill(&mut bytes, expected).map(|()| bytes)
    }

    /// Reads so many bytes.
    pub fn bytes(&mut self, count: u64, expected: &str) -> Result<Vec<u8>> {
        self.need(count, expected)?;
        let mut bytes = vec![0; count as usize];
        self.fill(&mut bytes, expected).map(|()| bytes)
    }

    /// Passes over so many bytes.
    pub fn skip(&mut self, count: u64, expected: &str) -> Result<()> {
        self.need(count, expected)?;
        self.file.seek_relative(count as i64).map_err(|e| Error::io(&self.path, e))?;
        self.at += count;
        Ok(())
    }

    /// Reads a size.
    pub fn size(&mut self, expected: &str) -> Result<u64> {
        let [a] = self.array(expected)?;
        if a < 0x80 {
            return Ok(a.into());
        }
        let [b] = self.array(expected)?;
        let high = u64::from(a & 0x3f) << 8 | u64::from(b);
        if a & 0x40 == 0 {
            return Ok(high);
        }
        Ok(high << 16 | u64::from(u16::from_le_bytes(self.array(expected)?)))
    }

    /// Reads the head of a matrix, whose values are within the file.
    pub fn matrix(&mut self, name: &str) -> Result<Matrix> {
        let at = self.at();
        let [rows, columns] = [self.array(name)?, self.array(name)?].map(u32::from_le_bytes);
        let bytes = (rows as u64 * columns as u64).checked_mul(4);
        if bytes.is_none_or(|bytes| bytes > self.left()) {
            let found = format!("{name} of shape [{rows}, {columns}]");
            let expected = format!("at most {} bytes, which are left of the file", self.left());
            return Err(Error::binary(&self.path, at, found, expected));
        }
        Ok(Matrix { at, rows, columns })
    }

    /// Passes over what a frame says of obstacles.
    pub fn obstacles(&mut self) -> Result<()> {
        let matrix = |scan: &mut Self, name: &str| {
            let matrix = scan.matrix(name)?;
            scan.skip(matrix.bytes(), name)
        };
        // Each one takes bytes of the file, so that no number of them goes on for long.
        for _ in 0..self.size("the number of obstacles' motions")? {
            self.skip(4, "an obstacle's scale")?;
            matrix(self, "an obstacle's translation")?;
            matrix(self, "an obstacle's rotation")?;
        }
        for name in ["an obstacle's vertices", "an obstacle's faces"] {
            for _ in 0..self.size(name)? {
                matrix(self, name)?;
            }
        }
        Ok(())
    }
}
