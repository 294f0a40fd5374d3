//! NumPy arrays (`.npy` and the entries of `.npz`): headers, and numbers of any size and byte order.
//!
//! A header is magic, version, length, then a Python dictionary of three entries. Read by hand because it
//! comes from outside: a general reader of Python literals recurses as deep as the text nests, and shapes
//! may overflow any product.

/// The header of an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NpyHeader {
    /// Kind (`f`, `i`, `u` or `b`), as NumPy abbreviates it.
    pub kind: u8,
    /// Bytes per number.
    pub size: usize,
    /// Whether the most significant byte comes first.
    pub big_endian: bool,
    /// Whether the first axis runs fastest.
    pub fortran_order: bool,
    /// Lengths of the axes.
    pub shape: Vec<u64>,
    /// Where the numbers begin, in bytes from the start of the array.
    pub data_offset: usize,
}

/// What is wrong with a header, for the caller to add the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// Bytes from the start of the array.
    pub at: usize,
    /// What stands there.
    pub found: String,
    /// What should.
    pub expected: String,
}

/// Opens a `.npy` file and reads its header.
///
/// # Errors
/// A file that cannot be read, or of another kind.
pub fn open(path: &std::path::Path) -> crate::Result<(std::fs::File, NpyHeader)> {
    use std::io::Read;
    let io = |e| crate::Error::io(path, e);
    let mut file = std::fs::File::open(path).map_err(io)?;
    let mut start = Vec::new();
    file.by_ref().take(LONGEST as u64).read_to_end(&mut start).map_err(io)?;
    let header = NpyHeader::parse(&start)
        .map_err(|Mismatch { at, found, expected }| crate::Error::binary(path, at, found, expected))?;
    Ok((file, header))
}

type Result<T> = std::result::Result<T, Mismatch>;

fn wrong<T>(at: usize, found: impl Into<String>, expected: impl Into<String>) -> Result<T> {
    Err(Mismatch { at, found: found.into(), expected: expected.into() })
}

/// Bytes that hold any header worth reading: the longest that version 1 can state.
pub const LONGEST: usize = 10 + u16::MAX as usize;

impl NpyHeader {
    /// Bytes before the dictionary, and of the dictionary: what the first 12 bytes of an array say.
    pub fn lengths(start: &[u8]) -> Result<(usize, usize)> {
        if !start.starts_with(b"\x93NUMPY") {
            return wrong(0, "another kind of file", "a NumPy array (.npy)");
        }
        let (before, length) = match (start.get(6..8), start.get(8..10), start.get(8..12)) {
            (Some([1, 0]), Some(&[a, b]), _) => (10, usize::from(u16::from_le_bytes([a, b]))),
            (Some([2 | 3, 0]), _, Some(&[a, b, c, d])) => (12, u32::from_le_bytes([a, b, c, d]) as usize),
            (None, ..) | (Some([1..=3, 0]), ..) => {
                return wrong(start.len(), "the end of the file", "the length of the header");
            }
            (Some(version), ..) => {
                let found = format!("version {}.{}", version[0], version[1]);
                return wrong(6, found, "version 1.0, 2.0 or 3.0 of the .npy format");
            }
        };
        if length > LONGEST {
            return wrong(8, format!("a header of {length} bytes"), "a shorter header");
        }
        Ok((before, length))
    }

    /// Reads the header at the start of `bytes`: the first [`LONGEST`] bytes of the array, or all it has.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let (before, length) = Self::lengths(bytes)?;
        let Some(text) = bytes.get(before..before + length) else {
            return wrong(bytes.len(), "the end of the file", format!("a header of {length} bytes"));
        };
        let header = Dictionary { text, begin: before, at: 0 }.parse()?;
        Ok(Self { data_offset: before + length, ..header })
    }

    /// Number of elements, or none if it overflows.
    pub fn count(&self) -> Option<u64> {
        self.shape.iter().try_fold(1u64, |n, &axis| n.checked_mul(axis))
    }

    /// The element that `bytes` start with, which must be at least [`NpyHeader::size`].
    pub fn number(&self, bytes: &[u8]) -> f64 {
        let mut word = [0; 8];
        word[..self.size].copy_from_slice(&bytes[..self.size]);
        if self.big_endian {
            word[..self.size].reverse();
        }
        let raw = u64::from_le_bytes(word);
        let unused = 64 - 8 * self.size as u32;
        match (self.kind, self.size) {
            (b'f', 4) => f32::from_bits(raw as u32) as f64,
            (b'f', _) => f64::from_bits(raw),
            (b'i', _) => (((raw << unused) as i64) >> unused) as f64,
            _ => raw as f64,
        }
    }
}

/// `{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }` in any order.
struct Dictionary<'a> {
    text: &'a [u8],
    begin: usize,
    at: usize,
}

impl<'a> Dictionary<'a> {
    fn parse(&mut self) -> Result<NpyHeader> {
        let (mut numbers, mut order, mut shape) = (None, None, None);
        self.take(b'{')?;
        while !self.next_is(b'}') {
            let at = self.at;
            let key = self.string()?;
            self.take(b':')?;
            match key {
                b"descr" => numbers = Some(self.numbers()?),
                b"fortran_order" => order = Some(self.boolean()?),
                b"shape" => shape = Some(self.shape()?),
                _ => return self.error(at, "'descr', 'fortran_order' or 'shape'"),
            }
            if !self.next_is(b'}') {
                self.take(b',')?;
            }
        }
        match (numbers, order, shape) {
            (Some((kind, size, big_endian)), Some(fortran_order), Some(shape)) => {
                Ok(NpyHeader { kind, size, big_endian, fortran_order, shape, data_offset: 0 })
            }
            _ => self.error(self.at, "'descr', 'fortran_order' and 'shape' before the end of the header"),
        }
    }

    /// The error that what stands at `at` is not what was expected.
    fn error<T>(&self, at: usize, expected: &str) -> Result<T> {
        let found = match self.text.get(at..) {
            None | Some([]) => "the end of the header".to_owned(),
            Some(rest) => format!("'{}'", String::from_utf8_lossy(&rest[..rest.len().min(12)]).trim_end()),
        };
        wrong(self.begin + at, found, expected)
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
        self.error(self.at, &format!("'{}'", char::from(sign)))
    }

    fn string(&mut self) -> Result<&'a [u8]> {
        const EXPECTED: &str = "a text in quotes";
        let quote = if self.next_is(b'"') { b'"' } else { b'\'' };
        let at = self.at;
        self.take(quote).or_else(|_| self.error(at, EXPECTED))?;
        let begin = self.at;
        match self.text[begin..].iter().position(|&b| b == quote) {
            Some(length) => {
                self.at += length + 1;
                Ok(&self.text[begin..begin + length])
            }
            None => self.error(at, EXPECTED),
        }
    }

    /// Kind, size and byte order.
    fn numbers(&mut self) -> Result<(u8, usize, bool)> {
        const EXPECTED: &str = "floats of 4 or 8 bytes ('<f4', '<f8'), integers or booleans";
        self.next_is(b' ');
        let at = self.at;
        let name = self.string().or_else(|_| self.error(at, EXPECTED))?;
        match *name {
            [order, kind, size]
                if b"<>|=".contains(&order)
                    && matches!(
                        (kind, size),
                        (b'f', b'4' | b'8') | (b'i' | b'u', b'1' | b'2' | b'4' | b'8') | (b'b', b'1')
                    ) =>
            {
                let big_endian = order == b'>' || (order == b'=' && cfg!(target_endian = "big"));
                Ok((kind, usize::from(size - b'0'), big_endian))
            }
            _ => wrong(self.begin + at, format!("'{}'", String::from_utf8_lossy(name)), EXPECTED),
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
        self.error(self.at, "True or False")
    }

    fn shape(&mut self) -> Result<Vec<u64>> {
        self.take(b'(')?;
        let mut shape = Vec::new();
        while !self.next_is(b')') {
            let digits = self.text[self.at..].iter().take_while(|b| b.is_ascii_digit()).count();
            let size =
                std::str::from_utf8(&self.text[self.at..self.at + digits]).ok().and_then(|d| d.parse().ok());
            match size {
                Some(size) => shape.push(size),
                None => return self.error(self.at, "a size of the array"),
            }
            self.at += digits;
            // Python 2 marks long integers so.
            if self.text.get(self.at) == Some(&b'L') {
                self.at += 1;
            }
            if !self.next_is(b')') {
                self.take(b',')?;
            }
        }
        self.at += 1;
        Ok(shape)
    }
}

/// The bytes before an array's numbers: magic, version and header, padded so that the numbers are aligned.
/// `descr` is NumPy's type name (`<f4`).
pub fn header_bytes(descr: &str, shape: &[u64]) -> Vec<u8> {
    let axes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let axes = if shape.len() == 1 { axes.trim_end() } else { axes.trim_end_matches(", ") };
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({axes}), }}");
    let padding = 63 - (10 + text.len()) % 64;
    text.extend(std::iter::repeat_n(' ', padding));
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A header of any text.
    fn parse(text: &str) -> Result<NpyHeader> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        NpyHeader::parse(&bytes)
    }

    #[test]
    fn headers_round_trip() {
        for shape in [&[][..], &[3], &[2, 0, 3]] {
            let bytes = header_bytes("<f4", shape);
            assert_eq!(bytes.len() % 64, 0);
            let header = NpyHeader::parse(&bytes).unwrap();
            let expected = NpyHeader {
                kind: b'f',
                size: 4,
                big_endian: false,
                fortran_order: false,
                shape: shape.to_vec(),
                data_offset: bytes.len(),
            };
            assert_eq!(header, expected);
        }
    }

    #[test]
    fn numbers_of_all_kinds() {
        let number = |descr: &str, bytes: &[u8]| {
            parse(&format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ()}}"))
                .unwrap()
                .number(bytes)
        };
        assert_eq!(number("<f8", &1.5f64.to_le_bytes()), 1.5);
        assert_eq!(number(">f4", &1.5f32.to_be_bytes()), 1.5);
        assert_eq!(number("<i2", &(-2i16).to_le_bytes()), -2.0);
        assert_eq!(number(">u4", &7u32.to_be_bytes()), 7.0);
        assert_eq!(number("<u8", &u64::MAX.to_le_bytes()), u64::MAX as f64);
        assert_eq!(number("|b1", &[1]), 1.0);
        assert_eq!(number("|i1", &[255]), -1.0);
    }

    #[test]
    fn strange_headers() {
        for text in ["", "{}", "{'descr': '|O', ", "{'descr': é", "{'descr':'<f4','shape':(1,)}"] {
            assert!(parse(text).is_err(), "{text}");
        }
        let header =
            parse("{\"descr\":'<f4','fortran_order':True,'shape':(4294967296L,4294967296)}").unwrap();
        assert!(header.fortran_order);
        assert_eq!(header.count(), None);
    }
}
