//! Line and word scanning of text formats, with the place of every word kept for messages.

use crate::{Error, Result};
use memchr::{memchr, memchr2};
use std::path::Path;

/// Reads a whole file.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|e| Error::io(path, e))
}

/// The extension of a path in lower case, empty where there is none.
pub fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Line and column of a byte, both counted from 1.
pub fn line_and_column(bytes: &[u8], at: usize) -> (usize, usize) {
    let before = &bytes[..at.min(bytes.len())];
    let line_at = before.iter().rposition(|&b| b == b'\n').map_or(0, |p| p + 1);
    (before.iter().filter(|&&b| b == b'\n').count() + 1, before.len() - line_at + 1)
}

/// The lines of a text file, with comments (from `#` to the end of the line) cut off when asked for.
/// A byte order mark at the start is skipped.
pub struct Lines<'a> {
    path: &'a Path,
    rest: &'a [u8],
    number: usize,
    comments: bool,
    continued: bool,
}

impl<'a> Lines<'a> {
    /// Starts at the first line. With `comments`, text after `#` is dropped.
    pub fn new(path: &'a Path, bytes: &'a [u8], comments: bool) -> Self {
        let rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self { path, rest, number: 0, comments, continued: false }
    }

    /// A backslash at the end of a line makes the next line part of it (OBJ); words end at the backslash.
    pub fn continued(mut self) -> Self {
        self.continued = true;
        self
    }

    /// Number of the line last returned, counted from 1 (at the end: the last line's). Of continued
    /// lines, the last one's.
    pub fn number(&self) -> usize {
        self.number
    }

    fn take(&mut self) -> &'a [u8] {
        let (text, taken) = split_line(self.rest, self.comments);
        self.rest = &self.rest[taken..];
        self.number += 1;
        text
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        if self.rest.is_empty() {
            return None;
        }
        let whole = self.rest;
        let text = self.take();
        let comment = &whole[text.len()..whole.len() - self.rest.len()];
        let (path, number, comments) = (self.path, self.number, self.comments);
        let mut line = Line { path, number, text, at: 0, more: &[], comments, comment };
        if self.continued
            && let Some(text) = before_backslash(text)
        {
            line.text = text;
            line.more = self.rest;
            while !self.rest.is_empty() && before_backslash(self.take()).is_some() {}
            line.more = &line.more[..line.more.len() - self.rest.len()];
        }
        Some(line)
    }
}

/// The first line without its end and comment, and how many bytes it takes up.
fn split_line(bytes: &[u8], comments: bool) -> (&[u8], usize) {
    let hit = if comments { memchr2(b'\n', b'#', bytes) } else { memchr(b'\n', bytes) };
    let cut = hit.unwrap_or(bytes.len());
    let end = match hit {
        Some(at) if bytes[at] == b'#' => memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |k| at + k),
        _ => cut,
    };
    let text = &bytes[..cut];
    (text.strip_suffix(b"\r").unwrap_or(text), (end + 1).min(bytes.len()))
}

fn before_backslash(text: &[u8]) -> Option<&[u8]> {
    text.trim_ascii_end().strip_suffix(b"\\")
}

/// One line, read word by word.
pub struct Line<'a> {
    path: &'a Path,
    /// Line number, counted from 1; follows the words over continued lines.
    pub number: usize,
    text: &'a [u8],
    at: usize,
    /// The lines that continue this one.
    more: &'a [u8],
    comments: bool,
    comment: &'a [u8],
}

/// A word and where it stands.
#[derive(Clone, Copy, Debug)]
pub struct Word<'a> {
    /// The word.
    pub text: &'a str,
    /// Column of its first byte, counted from 1.
    pub column: usize,
}

impl<'a> Line<'a> {
    /// The file, for messages.
    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// The comment that was cut off, from its `#`; empty if there is none, or it is not UTF-8.
    pub fn comment(&self) -> &'a str {
        std::str::from_utf8(self.comment.trim_ascii()).unwrap_or_default()
    }

    /// The next word (separated by blanks), if any. Bytes that are not UTF-8 end in an error.
    pub fn word(&mut self) -> Result<Option<Word<'a>>> {
        self.skip_blanks();
        while self.at == self.text.len() && !self.more.is_empty() {
            let (text, taken) = split_line(self.more, self.comments);
            self.more = &self.more[taken..];
            self.text = before_backslash(text).unwrap_or(text);
            self.at = 0;
            self.number += 1;
            self.skip_blanks();
        }
        let begin = self.at;
        while self.at < self.text.len() && !self.text[self.at].is_ascii_whitespace() {
            self.at += 1;
        }
        if begin == self.at {
            return Ok(None);
        }
        let column = begin + 1;
        match std::str::from_utf8(&self.text[begin..self.at]) {
            Ok(text) => Ok(Some(Word { text, column })),
            Err(e) => Err(self.error(column + e.valid_up_to(), "bytes that are not UTF-8", "a text file")),
        }
    }

    /// The next word; its absence is an error naming `expected`.
    pub fn expect_word(&mut self, expected: &str) -> Result<Word<'a>> {
        match self.word()? {
            Some(word) => Ok(word),
            None => {
                let column = self.text.trim_ascii_end().len() + 1;
                Err(self.error(column, "the end of the line", expected))
            }
        }
    }

    /// The next word as a finite number.
    pub fn f64(&mut self, expected: &str) -> Result<f64> {
        let word = self.expect_word(expected)?;
        self.parse_f64(word, expected)
    }

    /// A word as a finite number.
    pub fn parse_f64(&self, word: Word, expected: &str) -> Result<f64> {
        if let Some(x) = short_decimal(word.text.as_bytes()) {
            return Ok(x);
        }
        match word.text.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(self.error(word.column, format_args!("'{}'", word.text), expected)),
        }
    }

    /// The next word as an integer.
    pub fn i64(&mut self, expected: &str) -> Result<i64> {
        let word = self.expect_word(expected)?;
        word.text.parse().map_err(|_| self.error(word.column, format_args!("'{}'", word.text), expected))
    }

    /// The whole line, trimmed, wherever reading has got to.
    pub fn whole(&mut self) -> Result<Word<'a>> {
        self.at = 0;
        self.rest()
    }

    /// What is left of the line, trimmed, with its column.
    pub fn rest(&mut self) -> Result<Word<'a>> {
        self.skip_blanks();
        let column = self.at + 1;
        let bytes = self.text[self.at..].trim_ascii_end();
        self.at = self.text.len();
        let text = std::str::from_utf8(bytes)
            .map_err(|e| self.error(column + e.valid_up_to(), "bytes that are not UTF-8", "a text file"))?;
        Ok(Word { text, column })
    }

    /// Errors if anything is left on the line.
    pub fn end(&mut self) -> Result<()> {
        match self.word()? {
            None => Ok(()),
            Some(word) => Err(self.unexpected(word, "the end of the line")),
        }
    }

    fn skip_blanks(&mut self) {
        while self.at < self.text.len() && self.text[self.at].is_ascii_whitespace() {
            self.at += 1;
        }
    }

    /// The error that `word` is not what was expected.
    pub fn unexpected(&self, word: Word, expected: &str) -> Error {
        self.error(word.column, format_args!("'{}'", word.text), expected)
    }

    /// An error at a column of this line.
    pub fn error(
        &self,
        column: usize,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
    ) -> Error {
        Error::input(self.path, self.number, column, found, expected)
    }
}

/// Plain decimals such as `-1.25` with at most 15 digits, exactly as the standard library parses them:
/// both the digits and the power of ten are exact in f64, so the one division rounds once.
fn short_decimal(text: &[u8]) -> Option<f64> {
    const POWERS: [f64; 16] =
        [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let (negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest),
        rest => (false, rest),
    };
    // 16 bytes hold 15 digits and a point.
    if digits.is_empty() || digits.len() > 16 {
        return None;
    }
    let (mut mantissa, mut point) = (0_u64, None);
    for (at, &byte) in digits.iter().enumerate() {
        match byte {
            b'0'..=b'9' => mantissa = mantissa * 10 + u64::from(byte - b'0'),
            b'.' if point.is_none() => point = Some(at),
            _ => return None,
        }
    }
    let count = digits.len() - usize::from(point.is_some());
    if count == 0 || count > 15 {
        return None;
    }
    let x = mantissa as f64 / POWERS[point.map_or(0, |at| count - at)];
    Some(if negative { -x } else { x })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_decimals_equal_the_standard_parser() {
        let mut state = 1_u64;
        let mut fast = 0;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let digits = (state >> 33) % 10_u64.pow(1 + (state >> 60) as u32 % 9);
            let places = (state >> 20) as usize % 12;
            let text = format!("{}{}.{digits:0places$}", if state & 1 == 0 { "-" } else { "" }, state >> 55);
            if let Some(x) = short_decimal(text.as_bytes()) {
                assert_eq!(x.to_bits(), text.parse::<f64>().unwrap().to_bits(), "{text}");
                fast += 1;
            }
        }
        assert!(fast > 100_000, "the fast path is hardly taken: {fast}");
        for text in ["", "-", ".", "-.", "1e5", "1.2.3", "+1", "0x10", "1234567890123456", "nan"] {
            assert_eq!(short_decimal(text.as_bytes()), None, "{text}");
        }
        assert_eq!(short_decimal(b"5."), Some(5.0));
        assert_eq!(short_decimal(b".5"), Some(0.5));
        assert!(short_decimal(b"-0").unwrap().is_sign_negative());
    }

    #[test]
    fn continued_lines_keep_their_places() {
        let text = b"\xef\xbb\xbfa b\\\n c \\ \r\n d # x\\\ne\\";
        let mut lines = Lines::new(Path::new("p"), text, true).continued();
        let mut line = lines.next().unwrap();
        let mut words = Vec::new();
        while let Some(word) = line.word().unwrap() {
            words.push((word.text, line.number, word.column));
        }
        assert_eq!(words, [("a", 1, 1), ("b", 1, 3), ("c", 2, 2), ("d", 3, 2)]);
        let mut line = lines.next().unwrap();
        assert_eq!(line.number, 4);
        assert_eq!(line.word().unwrap().unwrap().text, "e");
        assert!(line.word().unwrap().is_none() && lines.next().is_none());
        assert_eq!(lines.number(), 4);
    }
}
