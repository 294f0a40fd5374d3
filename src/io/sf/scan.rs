//! Points in brackets, where blanks may stand anywhere between the parts.

use crate::io::text::{Line, Word};
use crate::{Error, Result};

/// The rest of a line, read part by part.
pub(super) struct Scan<'l, 'a> {
    pub(super) line: &'l Line<'a>,
    text: &'a str,
    column: usize,
}

impl<'l, 'a> Scan<'l, 'a> {
    pub(super) fn new(line: &'l Line<'a>, rest: Word<'a>) -> Self {
        Self { line, text: rest.text, column: rest.column }
    }

    fn skip(&mut self, bytes: usize) {
        self.text = &self.text[bytes..];
        self.column += bytes;
    }

    fn skip_blanks(&mut self) {
        let blanks = self.text.len() - self.text.trim_ascii_start().len();
        self.skip(blanks);
    }

    /// Whether the next part is `sign`.
    pub(super) fn next_is(&mut self, sign: char) -> bool {
        self.skip_blanks();
        self.text.starts_with(sign)
    }

    /// Reads over `sign` (ASCII).
    pub(super) fn take(&mut self, sign: char) -> Result<()> {
        if self.next_is(sign) {
            self.skip(1);
            return Ok(());
        }
        Err(self.error(&format!("'{sign}'")))
    }

    /// The error that the next character is not what was expected.
    fn error(&self, expected: &str) -> Error {
        match self.text.chars().next() {
            Some(found) => self.line.error(self.column, format_args!("'{found}'"), expected),
            None => self.line.error(self.column, "the end of the line", expected),
        }
    }

    /// Everything up to the next blank or sign, at least one character.
    fn token(&mut self, expected: &str) -> Result<Word<'a>> {
        self.skip_blanks();
        let end = self.text.find(|c: char| c.is_ascii_whitespace() || "()[]:,".contains(c));
        let word = Word { text: &self.text[..end.unwrap_or(self.text.len())], column: self.column };
        if word.text.is_empty() {
            return Err(self.error(expected));
        }
        self.skip(word.text.len());
        Ok(word)
    }

    /// A finite number and its word.
    pub(super) fn number(&mut self, expected: &str) -> Result<(Word<'a>, f64)> {
        let word = self.token(expected)?;
        Ok((word, self.line.parse_f64(word, expected)?))
    }

    /// The number of an edge.
    pub(super) fn edge(&mut self) -> Result<(Word<'a>, u32)> {
        const EXPECTED: &str = "the number of an edge, counted from 0";
        let word = self.token(EXPECTED)?;
        word.text.parse().map(|edge| (word, edge)).map_err(|_| self.line.unexpected(word, EXPECTED))
    }

    /// Numbers in round brackets, separated by commas.
    pub(super) fn numbers<const N: usize>(&mut self, open: char, names: [&str; N]) -> Result<[f64; N]> {
        self.take(open)?;
        let mut numbers = [0.0; N];
        for (k, name) in names.into_iter().enumerate() {
            if k > 0 {
                self.take(',')?;
            }
            numbers[k] = self.number(name)?.1;
        }
        self.take(')')?;
        Ok(numbers)
    }

    /// What is left, without leading blanks.
    pub(super) fn rest(&mut self) -> Word<'a> {
        self.skip_blanks();
        Word { text: self.text, column: self.column }
    }
}
