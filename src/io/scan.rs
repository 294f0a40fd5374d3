//! Tokens of bracketed text formats (USD, PBRT): words, strings and punctuation, with the place of each.

use super::text::line_and_column;
use crate::{Error, Result};
use std::path::Path;

/// Walks through a text.
pub struct Scanner<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
}

/// A token and the byte offset where it starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Token<'a> {
    /// What it is.
    pub kind: Kind<'a>,
    /// Byte offset of its start.
    pub at: usize,
}

/// The kinds of tokens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind<'a> {
    /// One of `[](){}=,;`.
    Mark(u8),
    /// The inside of a quoted string (`"…"`, `'…'`, tripled quotes) or of `@…@` or `<…>`.
    Quoted(&'a str),
    /// A name, a number, a keyword.
    Word(&'a str),
    /// The end of the file.
    End,
}

impl std::fmt::Display for Kind<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Kind::Mark(mark) => write!(f, "'{}'", *mark as char),
            Kind::Quoted(text) => write!(f, "\"{text}\""),
            Kind::Word(text) => write!(f, "'{text}'"),
            Kind::End => f.write_str("the end of the file"),
        }
    }
}

const MARKS: &[u8] = b"[](){}=,;";

impl<'a> Scanner<'a> {
    /// Starts at the beginning.
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Self {
        Self { path, bytes, at: 0 }
    }

    /// An error at a byte offset.
    pub fn error(&self, at: usize, found: impl std::fmt::Display, expected: impl std::fmt::Display) -> Error {
        let (line, column) = line_and_column(self.bytes, at);
        Error::input(self.path, line, column, found, expected)
    }

    /// The error that `token` is not what was expected.
    pub fn unexpected(&self, token: Token, expected: &str) -> Error {
        self.error(token.at, token.kind, expected)
    }

    fn skip_blanks(&mut self) {
        while let Some(&b) = self.bytes.get(self.at) {
            if b == b'#' {
                let rest = &self.bytes[self.at..];
                self.at += rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
            } else if b.is_ascii_whitespace() {
                self.at += 1;
            } else {
                break;
            }
        }
    }

    fn utf8(&self, begin: usize, end: usize) -> Result<&'a str> {
        std::str::from_utf8(&self.bytes[begin..end])
            .map_err(|e| self.error(begin + e.valid_up_to(), "bytes that are not UTF-8", "a text file"))
    }

    /// The next token without taking it.
    pub fn peek(&mut self) -> Result<Token<'a>> {
        let token = self.next()?;
        self.at = token.at;
        Ok(token)
    }

    /// Takes the next token.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> Result<Token<'a>> {
        self.skip_blanks();
        let at = self.at;
        let kind = match self.bytes.get(at) {
            None => Kind::End,
            Some(mark) if MARKS.contains(mark) => {
                self.at += 1;
                Kind::Mark(*mark)
            }
            Some(&quote @ (b'"' | b'\'' | b'@' | b'<')) => self.quoted(quote)?,
            Some(_) => {
                let end = self.bytes[at..]
                    .iter()
                    .position(|b| b.is_ascii_whitespace() || MARKS.contains(b) || b"\"'@<#".contains(b))
                    .map_or(self.bytes.len(), |n| at + n);
                self.at = end;
                Kind::Word(self.utf8(at, end)?)
            }
        };
        Ok(Token { kind, at })
    }

    fn quoted(&mut self, quote: u8) -> Result<Kind<'a>> {
        let at = self.at;
        let rest = &self.bytes[at..];
        let triple = [quote; 3];
        let closing: &[u8] = match quote {
            b'<' => b">",
            _ if rest.starts_with(&triple) => &triple,
            b'"' => b"\"",
            b'\'' => b"'",
            _ => b"@",
        };
        let begin = at + closing.len();
        let mut end = begin;
        loop {
            let Some(&b) = self.bytes.get(end) else {
                return Err(self.error(at, "a string without an end", "a closing quote"));
            };
            if b == b'\\' {
                end += 2;
            } else if self.bytes[end..].starts_with(closing) {
                break;
            } else if b == b'\n' && closing.len() == 1 {
                return Err(self.error(at, "a string without an end", "a closing quote on the same line"));
            } else {
                end += 1;
            }
        }
        self.at = end + closing.len();
        Ok(Kind::Quoted(self.utf8(begin, end)?))
    }

    /// Takes the next token if it is `mark`.
    pub fn take(&mut self, mark: u8) -> Result<bool> {
        let token = self.next()?;
        let taken = token.kind == Kind::Mark(mark);
        if !taken {
            self.at = token.at;
        }
        Ok(taken)
    }

    /// Takes `mark`; anything else is an error.
    pub fn expect(&mut self, mark: u8) -> Result<()> {
        let token = self.next()?;
        if token.kind == Kind::Mark(mark) {
            return Ok(());
        }
        Err(self.unexpected(token, &format!("'{}'", mark as char)))
    }

    /// Takes a word.
    pub fn word(&mut self, expected: &str) -> Result<&'a str> {
        let token = self.next()?;
        match token.kind {
            Kind::Word(word) => Ok(word),
            _ => Err(self.unexpected(token, expected)),
        }
    }

    /// Takes a quoted string.
    pub fn string(&mut self, expected: &str) -> Result<&'a str> {
        let token = self.next()?;
        match token.kind {
            Kind::Quoted(text) => Ok(text),
            _ => Err(self.unexpected(token, expected)),
        }
    }

    /// Takes a finite number.
    pub fn number(&mut self, expected: &str) -> Result<f64> {
        let token = self.next()?;
        if let Kind::Word(word) = token.kind
            && let Ok(x) = word.parse::<f64>()
            && x.is_finite()
        {
            return Ok(x);
        }
        Err(self.unexpected(token, expected))
    }

    /// Skips a value: a word, a string, or everything up to the bracket that closes it.
    pub fn skip_value(&mut self) -> Result<()> {
        let first = self.next()?;
        let mut open = Vec::new();
        let mut token = first;
        loop {
            match token.kind {
                Kind::Mark(mark @ (b'[' | b'(' | b'{')) => open.push(mark),
                Kind::Mark(mark @ (b']' | b')' | b'}')) => {
                    let opening = match mark {
                        b']' => b'[',
                        b')' => b'(',
                        _ => b'{',
                    };
                    if open.pop() != Some(opening) {
                        return Err(self.unexpected(token, "a value with matching brackets"));
                    }
                }
                Kind::End => return Err(self.unexpected(token, "a value")),
                Kind::Mark(_) if open.is_empty() => return Err(self.unexpected(token, "a value")),
                _ => {}
            }
            if open.is_empty() {
                // `@file@</path>` is one value.
                if let Kind::Quoted(_) = first.kind
                    && self.bytes.get(first.at) == Some(&b'@')
                    && self.bytes.get(self.at) == Some(&b'<')
                {
                    self.next()?;
                }
                return Ok(());
            }
            token = self.next()?;
        }
    }
}
