//! Line and word scanning of text formats, with the place of every word kept for messages.

use crate::{Error, Result};
use std::path::Path;

/// Reads a whole file.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|e| Error::io(path, e))
}

/// The lines of a text file, with comments (from `#` to the end of the line) cut off when asked for.
pub struct Lines<'a> {
    path: &'a Path,
    rest: &'a [u8],
    number: usize,
    comments: bool,
}

impl<'a> Lines<'a> {
    /// Starts at the first line. With `comments`, text after `#` is dropped.
    pub fn new(path: &'a Path, bytes: &'a [u8], comments: bool) -> Self {
        Self { path, rest: bytes, number: 0, comments }
    }

    /// Number of the line last returned, counted from 1 (at the end: the last line's).
    pub fn number(&self) -> usize {
        self.number
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&b| b == b'\n');
        let line = &self.rest[..end.unwrap_or(self.rest.len())];
        self.rest = end.map_or(&[], |e| &self.rest[e + 1..]);
        self.number += 1;
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        let cut = if self.comments { line.iter().position(|&b| b == b'#') } else { None };
        Some(Line { path: self.path, number: self.number, text: &line[..cut.unwrap_or(line.len())], at: 0 })
    }
}

/// One line, read word by word.
pub struct Line<'a> {
    path: &'a Path,
    /// Line number, counted from 1.
    pub number: usize,
    text: &'a [u8],
    at: usize,
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
    /// The next word (separated by blanks), if any. Bytes that are not UTF-8 end in an error.
    pub fn word(&mut self) -> Result<Option<Word<'a>>> {
        while self.at < self.text.len() && self.text[self.at].is_ascii_whitespace() {
            self.at += 1;
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
        let column = self.text.trim_ascii_end().len() + 1;
        self.word()?.ok_or_else(|| self.error(column, "the end of the line", expected))
    }

    /// The next word as a finite number.
    pub fn f64(&mut self, expected: &str) -> Result<f64> {
        let word = self.expect_word(expected)?;
        self.parse_f64(word, expected)
    }

    /// A word as a finite number.
    pub fn parse_f64(&self, word: Word, expected: &str) -> Result<f64> {
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

    /// What is left of the line, trimmed, with its column.
    pub fn rest(&mut self) -> Result<Word<'a>> {
        while self.at < self.text.len() && self.text[self.at].is_ascii_whitespace() {
            self.at += 1;
        }
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
