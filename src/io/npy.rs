//! NumPy arrays (`.npy` and the entries of `.npz`): headers, and numbers of any size and byte order.

use std::fmt::Display;

/// The header of an array.
#[derive(Clone, Debug, PartialEq)]
pub struct NpyHeader {
    /// Kind (`f`, `i`, `u` or `b`), as NumPy abbreviates it.
    pub kind: u8,
    /// Bytes per number.
    pub size: usize,
    /// Whether the most significant byte comes first.
    pub big_endian: bool,
    /// Lengths of the axes.
    pub shape: Vec<u64>,
}

/// What was found and what was expected, for the caller to add the place.
pub type Mismatch = (String, &'static str);

fn wrong(found: impl Display, expected: &'static str) -> Mismatch {
    (found.to_string(), expected)
}

/// Longest header read, in bytes.
pub const MAX_HEADER: usize = 1 << 16;

impl NpyHeader {
    /// Length in bytes of magic, version and length field, and of the header text behind it, from the first 12
    /// bytes of the array.
    pub fn lengths(start: &[u8; 12]) -> Result<(usize, usize), Mismatch> {
        if &start[..6] != b"\x93NUMPY" {
            return Err(wrong("other bytes", "'\\x93NUMPY', the start of an array"));
        }
        let (before, text) = match start[6] {
            1 => (10, u16::from_le_bytes([start[8], start[9]]) as usize),
            2 | 3 => (12, u32::from_le_bytes([start[8], start[9], start[10], start[11]]) as usize),
            version => return Err(wrong(format_args!("array format version {version}"), "1, 2 or 3")),
        };
        if !(2..=MAX_HEADER).contains(&text) {
            return Err(wrong(format_args!("an array header of {text} bytes"), "2 to 65536 bytes"));
        }
        Ok((before, text))
    }

    /// Reads the header text, a Python dictionary.
    pub fn parse(text: &[u8]) -> Result<Self, Mismatch> {
        const EXPECTED: &str = "an array header with 'descr', 'fortran_order' and 'shape'";
        let text = std::str::from_utf8(text).map_err(|_| wrong("bytes that are not UTF-8", EXPECTED))?;
        let value = |key: &str| -> Result<&str, Mismatch> {
            let quoted = [format!("'{key}'"), format!("\"{key}\"")];
            let after =
                quoted.iter().find_map(|q| text.split_once(q.as_str())).map(|(_, after)| after.trim_start());
            after
                .and_then(|a| a.strip_prefix(':'))
                .map(str::trim_start)
                .ok_or_else(|| wrong(format_args!("the array header {}", text.trim_end()), EXPECTED))
        };
        let descr = value("descr")?;
        let quote = descr.chars().next().filter(|c| matches!(c, '\'' | '"'));
        let name = quote.and_then(|q| descr[1..].split(q).next()).unwrap_or(descr);
        let (order, kind, size) = match name.as_bytes() {
            &[order, kind, size] => (order, kind, size),
            _ => (0, 0, 0),
        };
        let known = b"<>|=".contains(&order)
            && match kind {
                b'f' => b"48".contains(&size),
                b'i' | b'u' => b"1248".contains(&size),
                _ => (kind, size) == (b'b', b'1'),
            };
        if !known {
            return Err(wrong(
                format_args!("numbers of type {name}"),
                "floats of 4 or 8 bytes, integers or booleans",
            ));
        }
        if !value("fortran_order")?.starts_with("False") {
            return Err(wrong("an array in Fortran order", "C order (np.ascontiguousarray gives it)"));
        }
        let shape = value("shape")?;
        let inside = shape.strip_prefix('(').and_then(|s| s.split_once(')')).map(|(inside, _)| inside);
        let axes = inside.map(|inside| {
            let axes = inside.split(',').map(str::trim).filter(|s| !s.is_empty());
            axes.map(|s| s.trim_end_matches('L').parse::<u64>().ok()).collect::<Option<Vec<_>>>()
        });
        let Some(Some(shape)) = axes else {
            return Err(wrong(format_args!("the shape {shape}"), "a tuple of lengths"));
        };
        Ok(Self { kind, size: (size - b'0') as usize, big_endian: order == b'>', shape })
    }

    /// Number of elements, or none if it overflows.
    pub fn count(&self) -> Option<u64> {
        self.shape.iter().try_fold(1u64, |n, &axis| n.checked_mul(axis))
    }

    /// The element that `bytes` start with, which must be at least [`NpyHeader::size`].
    pub fn number(&self, bytes: &[u8]) -> f64 {
        let raw = self.raw(bytes);
        match (self.kind, self.size) {
            (b'f', 4) => f32::from_bits(raw as u32) as f64,
            (b'f', _) => f64::from_bits(raw),
            _ => self.sign_extend(raw) as f64,
        }
    }

    /// The integer or boolean that `bytes` start with.
    pub fn integer(&self, bytes: &[u8]) -> i64 {
        self.sign_extend(self.raw(bytes))
    }

    fn raw(&self, bytes: &[u8]) -> u64 {
        let mut word = [0; 8];
        word[..self.size].copy_from_slice(&bytes[..self.size]);
        if self.big_endian {
            word[..self.size].reverse();
        }
        u64::from_le_bytes(word)
    }

    fn sign_extend(&self, raw: u64) -> i64 {
        let shift = 64 - 8 * self.size as u32;
        // Unsigned 64-bit numbers beyond i64 are out of every range here, and become the largest one.
        match (self.kind, self.size) {
            (b'i', _) => ((raw << shift) as i64) >> shift,
            _ => i64::try_from(raw).unwrap_or(i64::MAX),
        }
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

    #[test]
    fn headers_round_trip() {
        for shape in [&[][..], &[3], &[2, 0, 3]] {
            let bytes = header_bytes("<f4", shape);
            assert_eq!(bytes.len() % 64, 0);
            let (before, length) = NpyHeader::lengths(bytes[..12].try_into().unwrap()).unwrap();
            assert_eq!(before + length, bytes.len());
            let header = NpyHeader::parse(&bytes[before..]).unwrap();
            assert_eq!(header, NpyHeader { kind: b'f', size: 4, big_endian: false, shape: shape.to_vec() });
        }
    }

    #[test]
    fn numbers_of_all_kinds() {
        let number = |descr: &str, bytes: &[u8]| {
            let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ()}}");
            NpyHeader::parse(text.as_bytes()).unwrap().number(bytes)
        };
        assert_eq!(number("<f8", &1.5f64.to_le_bytes()), 1.5);
        assert_eq!(number(">f4", &1.5f32.to_be_bytes()), 1.5);
        assert_eq!(number("<i2", &(-2i16).to_le_bytes()), -2.0);
        assert_eq!(number(">u4", &7u32.to_be_bytes()), 7.0);
        assert_eq!(number("|b1", &[1]), 1.0);
        assert_eq!(number("|i1", &[255]), -1.0);
    }

    #[test]
    fn strange_headers() {
        for text in [
            "",
            "{}",
            "{'descr': '|O', ",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (1,)}",
            "{'descr': é",
        ] {
            assert!(NpyHeader::parse(text.as_bytes()).is_err());
        }
        let header =
            NpyHeader::parse(b"{'descr':'<f4','fortran_order':False,'shape':(4294967296,4294967296)}")
                .unwrap();
        assert_eq!(header.count(), None);
    }
}
