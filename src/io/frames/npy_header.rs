//! The header of a `.npy` file: magic, version, length, then a Python dictionary of three entries.
//!
//! Read by hand because the header comes from outside: a general reader of Python literals recurses as
//! deep as the text nests, and shapes may overflow any product.

use crate::{Error, Result};
use std::path::Path;

/// What the header says about the array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NpyHeader {
    /// 4 or 8 bytes.
    pub(super) item_size: usize,
    pub(super) big_endian: bool,
    pub(super) fortran_order: bool,
    pub(super) shape: Vec<u64>,
    /// Where the numbers begin, in bytes from the start of the file.
    pub(super) data_offset: usize,
}

/// Bytes that hold any header worth reading: the longest version 1 can state.
pub(super) const LONGEST: usize = 10 + u16::MAX as usize;

/// Parses the header at the start of `bytes` (the file's first [`LONGEST`] bytes, or all it has).
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<NpyHeader> {
    let error = |at: usize, found: &str, expected: &str| Error::binary(path, at, found, expected);
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(error(0, "another kind of file", "a NumPy array (.npy)"));
    }
    let (text_at, length): (usize, usize) = match (bytes.get(6..8), bytes.get(8..10), bytes.get(8..12)) {
        (Some([1, 0]), Some(&[a, b]), _) => (10, usize::from(u16::from_le_bytes([a, b]))),
        (Some([2 | 3, 0]), _, Some(&[a, b, c, d])) => (12, u32::from_le_bytes([a, b, c, d]) as usize),
        (None, ..) | (Some([1..=3, 0]), ..) => {
            return Err(error(bytes.len(), "the end of the file", "the length of the header"));
        }
        (Some(version), ..) => {
            let found = format!("version {}.{}", version[0], version[1]);
            return Err(error(6, &found, "version 1.0, 2.0 or 3.0 of the .npy format"));
        }
    };
    let Some(text) = text_at.checked_add(length).and_then(|end| bytes.get(text_at..end)) else {
        let expected = format!("a header of {length} bytes");
        return Err(match length > LONGEST {
            true => error(8, &expected, "a shorter header"),
            false => error(bytes.len(), "the end of the file", &expected),
        });
    };
    let mut dictionary = Dictionary { path, text, begin: text_at, at: 0 };
    let (item_size, big_endian, fortran_order, shape) = dictionary.parse()?;
    Ok(NpyHeader { item_size, big_endian, fortran_order, shape, data_offset: text_at + length })
}

/// `{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }` in any order.
struct Dictionary<'a> {
    path: &'a Path,
    text: &'a [u8],
    begin: usize,
    at: usize,
}

impl<'a> Dictionary<'a> {
    fn parse(&mut self) -> Result<(usize, bool, bool, Vec<u64>)> {
        let (mut kind, mut order, mut shape) = (None, None, None);
        self.take(b'{')?;
        while !self.next_is(b'}') {
            let at = self.at;
            let key = self.string()?;
            self.take(b':')?;
            match key {
                b"descr" => kind = Some(self.kind()?),
                b"fortran_order" => order = Some(self.boolean()?),
                b"shape" => shape = Some(self.shape()?),
                _ => return Err(self.error(at, "'descr', 'fortran_order' or 'shape'")),
            }
            if !self.next_is(b'}') {
                self.take(b',')?;
            }
        }
        match (kind, order, shape) {
            (Some((size, big)), Some(order), Some(shape)) => Ok((size, big, order, shape)),
            _ => {
                Err(self.error(self.at, "'descr', 'fortran_order' and 'shape' before the end of the header"))
            }
        }
    }

    /// The error that what stands at `at` is not what was expected.
    fn error(&self, at: usize, expected: &str) -> Error {
        let found = match self.text.get(at..) {
            None | Some([]) => "the end of the header".to_owned(),
            Some(rest) => format!("'{}'", String::from_utf8_lossy(&rest[..rest.len().min(12)]).trim_end()),
        };
        Error::binary(self.path, self.begin + at, found, expected)
    }

    fn next_is(&mut self, sign: u8) -> bool {
        while self.text.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        self.text.get(self.at) == Some(&sign)
    }

    fn take(&mut self, sign: u8) -> Result<()> {
        if self.next_is(sign) {
            self.at += 1;
            return Ok(());
        }
        Err(self.error(self.at, &format!("'{}'", char::from(sign))))
    }

    fn string(&mut self) -> Result<&'a [u8]> {
        let quote = if self.next_is(b'"') { b'"' } else { b'\'' };
        let at = self.at;
        self.take(quote).map_err(|_| self.error(at, "a text in quotes"))?;
        let begin = self.at;
        match self.text[begin..].iter().position(|&b| b == quote) {
            Some(length) => {
                self.at += length + 1;
                Ok(&self.text[begin..begin + length])
            }
            None => Err(self.error(at, "a text in quotes")),
        }
    }

    fn kind(&mut self) -> Result<(usize, bool)> {
        self.next_is(b' ');
        let at = self.at;
        const EXPECTED: &str = "'<f4', '<f8', '>f4' or '>f8' (an array of floats)";
        let native_big = cfg!(target_endian = "big");
        let kind = self.string().map_err(|_| self.error(at, EXPECTED))?;
        match kind {
            [order, b'f', size @ (b'4' | b'8')] if b"<>=".contains(order) => {
                Ok((usize::from(size - b'0'), *order == b'>' || (*order == b'=' && native_big)))
            }
            _ => {
                let found = format!("'{}'", String::from_utf8_lossy(kind));
                Err(Error::binary(self.path, self.begin + at, found, EXPECTED))
            }
        }
    }

    fn boolean(&mut self) -> Result<bool> {
        self.next_is(b' ');
        for (word, value) in [("True", true), ("False", false)] {
            if self.text[self.at..].starts_with(word.as_bytes()) {
                self.at += word.len();
                return Ok(value);
            }
        }
        Err(self.error(self.at, "True or False"))
    }

    fn shape(&mut self) -> Result<Vec<u64>> {
        self.take(b'(')?;
        let mut shape = Vec::new();
        while !self.next_is(b')') {
            let digits = self.text[self.at..].iter().take_while(|b| b.is_ascii_digit()).count();
            let size =
                std::str::from_utf8(&self.text[self.at..self.at + digits]).ok().and_then(|d| d.parse().ok());
            shape.push(size.ok_or_else(|| self.error(self.at, "a size of the array"))?);
            self.at += digits;
            if !self.next_is(b')') {
                self.take(b',')?;
            }
        }
        self.at += 1;
        Ok(shape)
    }
}
