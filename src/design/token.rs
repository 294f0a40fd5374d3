//! Words, numbers and signs of a pattern, each with its place.

use crate::{Error, Result};
use std::path::Path;

/// A place in the pattern: line and column (in bytes), counted from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// Line of the file.
    pub line: u32,
    /// Byte of the line.
    pub column: u32,
}

/// What a token is.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A word in lower case: letters, digits, `_`, `&`; it begins with a letter.
    Word(String),
    /// A number that is not negative.
    Number(f64),
    /// Text in double quotes.
    Text(String),
    /// A colour, red, green and blue.
    Colour([u8; 3]),
    /// One of `,;:*()[]{}-+/=.`
    Sign(char),
    /// The end of a line, where the statement may end.
    End,
}

/// A token and its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Token {
    /// What it is.
    pub kind: Kind,
    /// Where it begins.
    pub place: Place,
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Kind::Word(word) => write!(f, "'{word}'"),
            Kind::Number(x) => write!(f, "{x}"),
            Kind::Text(text) => write!(f, "\"{text}\""),
            Kind::Colour([r, g, b]) => write!(f, "#{r:02x}{g:02x}{b:02x}"),
            Kind::Sign(c) => write!(f, "'{c}'"),
            Kind::End => write!(f, "the end of the line"),
        }
    }
}

/// Cuts a pattern into tokens. A line that ends with a comma, a semicolon or a colon goes on in the next one; `#` begins a
/// comment, but a colour after the word `color`.
pub fn tokens(path: &Path, text: &str) -> Result<Vec<Token>> {
    let mut found: Vec<Token> = Vec::new();
    let mut last_line = 0;
    for (number, line) in text.lines().enumerate() {
        last_line = number as u32 + 1;
        let line = if number == 0 { line.strip_prefix('\u{feff}').unwrap_or(line) } else { line };
        let first = found.len();
        Line { path, text: line, number: last_line, at: 0 }.cut(&mut found, first)?;
        let open = matches!(found.last(), Some(Token { kind: Kind::Sign(',' | ';' | ':'), .. }));
        if found.len() > first && !open {
            let place = Place { line: last_line, column: line.len() as u32 + 1 };
            found.push(Token { kind: Kind::End, place });
        }
    }
    if !matches!(found.last(), None | Some(Token { kind: Kind::End, .. })) {
        let column = text.lines().last().map_or(0, str::len) as u32 + 1;
        found.push(Token { kind: Kind::End, place: Place { line: last_line, column } });
    }
    Ok(found)
}

struct Line<'a> {
    path: &'a Path,
    text: &'a str,
    number: u32,
    at: usize,
}

impl Line<'_> {
    fn cut(mut self, found: &mut Vec<Token>, first: usize) -> Result<()> {
        while let Some(c) = self.text[self.at..].chars().next() {
            let place = Place { line: self.number, column: self.at as u32 + 1 };
            let kind = match c {
                _ if c.is_whitespace() => {
                    self.at += c.len_utf8();
                    continue;
                }
                '#' => {
                    let names_colour = found.get(first).is_some_and(
                        |t| matches!(&t.kind, Kind::Word(word) if word == "color" || word == "colour"),
                    );
                    if !names_colour || found[first..].iter().any(|t| matches!(t.kind, Kind::Colour(_))) {
                        return Ok(());
                    }
                    self.colour()?
                }
                '"' => self.quoted()?,
                '0'..='9' | '.'
                    if self.text[self.at..]
                        .trim_start_matches('.')
                        .starts_with(|d: char| d.is_ascii_digit()) =>
                {
                    self.number()?
                }
                'a'..='z' | 'A'..='Z' | '_' => {
                    let word = self.take(|c| c.is_ascii_alphanumeric() || c == '_' || c == '&');
                    let word = word.to_ascii_lowercase();
                    // "22x36" is a number, an x and a number.
                    if let Some(digits) = word.strip_prefix('x').filter(|d| !d.is_empty())
                        && let Ok(times) = digits.parse::<u32>()
                    {
                        found.push(Token { kind: Kind::Word("x".into()), place });
                        let place = Place { column: place.column + 1, ..place };
                        found.push(Token { kind: Kind::Number(f64::from(times)), place });
                        continue;
                    }
                    Kind::Word(word)
                }
                '\u{d7}' => {
                    self.at += c.len_utf8();
                    Kind::Word("x".into())
                }
                '\u{2013}' | '\u{2212}' => {
                    self.at += c.len_utf8();
                    Kind::Sign('-')
                }
                ',' | ';' | ':' | '*' | '(' | ')' | '[' | ']' | '{' | '}' | '-' | '+' | '/' | '=' | '.' => {
                    self.at += 1;
                    Kind::Sign(c)
                }
                _ => {
                    return Err(self.error(
                        place.column as usize,
                        format_args!("'{c}'"),
                        "a word, a number or a sign",
                    ));
                }
            };
            found.push(Token { kind, place });
        }
        Ok(())
    }

    fn take(&mut self, of: impl Fn(char) -> bool) -> &str {
        let rest = &self.text[self.at..];
        let end = rest.find(|c| !of(c)).unwrap_or(rest.len());
        self.at += end;
        &rest[..end]
    }

    fn number(&mut self) -> Result<Kind> {
        let column = self.at + 1;
        let digits = self.take(|c| c.is_ascii_digit() || c == '.').to_string();
        // A full stop may end a sentence.
        let (digits, stop) = match digits.strip_suffix('.') {
            Some(short) => (short.to_string(), true),
            None => (digits, false),
        };
        self.at -= usize::from(stop);
        match digits.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(Kind::Number(x)),
            _ => Err(self.error(column, digits, "a number")),
        }
    }

    fn quoted(&mut self) -> Result<Kind> {
        let column = self.at + 1;
        self.at += 1;
        let text = self.take(|c| c != '"').to_string();
        if self.at == self.text.len() {
            return Err(self.error(column, "text without an end", "a closing '\"' on the same line"));
        }
        self.at += 1;
        Ok(Kind::Text(text))
    }

    fn colour(&mut self) -> Result<Kind> {
        let column = self.at + 1;
        self.at += 1;
        let digits = self.take(|c| c.is_ascii_alphanumeric()).to_string();
        match u32::from_str_radix(&digits, 16) {
            Ok(rgb) if digits.len() == 6 => {
                let [_, r, g, b] = rgb.to_be_bytes();
                Ok(Kind::Colour([r, g, b]))
            }
            _ => Err(self.error(
                column,
                format_args!("#{digits}"),
                "a colour of six hexadecimal digits, such as #c0392b",
            )),
        }
    }

    fn error(&self, column: usize, found: impl std::fmt::Display, expected: &str) -> Error {
        Error::input(self.path, self.number as usize, column, found, expected)
    }
}
