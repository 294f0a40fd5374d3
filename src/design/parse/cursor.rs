//! A place among tokens; numbers and expressions are read here.

use super::DEPTH;
use crate::design::expression::{Expression, Function};
use crate::design::token::{Kind, Place, Token};
use crate::{Error, Result};
use std::fmt::Display;
use std::path::Path;

/// Signs of a sum or product at most.
const MOST_SIGNS: usize = 200;

/// Reads tokens one after the other.
pub struct Cursor<'a> {
    path: &'a Path,
    tokens: &'a [Token],
    at: usize,
    depth: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(path: &'a Path, tokens: &'a [Token]) -> Self {
        Self { path, tokens, at: 0, depth: 0 }
    }

    pub fn peek(&self) -> Option<&'a Kind> {
        self.tokens.get(self.at).map(|t| &t.kind)
    }

    /// The token after the next one.
    pub fn peek_second(&self) -> Option<&'a Kind> {
        self.tokens.get(self.at + 1).map(|t| &t.kind)
    }

    pub fn skip(&mut self) {
        self.at += 1;
    }

    /// Of the next token; at the end, of the last.
    pub fn place(&self) -> Place {
        let token = self.tokens.get(self.at).or(self.tokens.last());
        token.map_or(Place { line: 1, column: 1 }, |t| t.place)
    }

    /// Takes a word, if there is one.
    pub fn word(&mut self) -> Option<String> {
        match self.peek() {
            Some(Kind::Word(word)) => {
                self.at += 1;
                Some(word.clone())
            }
            _ => None,
        }
    }

    pub fn is_word(&self, wanted: &str) -> bool {
        matches!(self.peek(), Some(Kind::Word(word)) if word == wanted)
    }

    /// Takes this word, if it is next.
    pub fn keyword(&mut self, wanted: &str) -> bool {
        let found = self.is_word(wanted);
        self.at += usize::from(found);
        found
    }

    /// Takes this sign, if it is next.
    pub fn sign(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(&Kind::Sign(wanted));
        self.at += usize::from(found);
        found
    }

    pub fn expect(&mut self, wanted: char) -> Result<()> {
        if self.sign(wanted) { Ok(()) } else { Err(self.error(format_args!("'{wanted}'"))) }
    }

    pub fn end_of_line(&mut self) -> bool {
        let found = self.peek() == Some(&Kind::End);
        self.at += usize::from(found);
        found
    }

    /// A statement ends: a full stop, the end of the line.
    pub fn line_ends(&mut self) -> Result<()> {
        while self.sign('.') || self.sign(';') {}
        if self.end_of_line() || self.peek().is_none() {
            Ok(())
        } else {
            Err(self.error("the end of the line"))
        }
    }

    pub fn text(&mut self) -> Option<String> {
        match self.peek() {
            Some(Kind::Text(text)) => {
                self.at += 1;
                Some(text.clone())
            }
            _ => None,
        }
    }

    pub fn colour(&mut self) -> Option<[u8; 3]> {
        match self.peek() {
            Some(Kind::Colour(rgb)) => {
                self.at += 1;
                Some(*rgb)
            }
            _ => None,
        }
    }

    pub fn name(&mut self, expected: &str) -> Result<String> {
        match self.peek() {
            Some(Kind::Word(word)) => {
                self.at += 1;
                Ok(word.clone())
            }
            _ => Err(self.error(expected)),
        }
    }

    /// `st`, `sts`, `stitches` may follow a number.
    pub fn stitches_word(&mut self) -> bool {
        self.keyword("st") || self.keyword("sts") || self.keyword("stitch") || self.keyword("stitches")
    }

    /// A plain number, or an expression in braces.
    pub fn count(&mut self) -> Result<Expression> {
        match self.peek() {
            Some(Kind::Number(x)) => {
                self.at += 1;
                Ok(Expression::Number(*x))
            }
            Some(Kind::Sign('{')) => {
                self.at += 1;
                let value = self.expression()?;
                self.expect('}')?;
                Ok(value)
            }
            _ => Err(self.error("a number, or an expression in braces")),
        }
    }

    /// Like [`count`](Self::count), for what is not a number of stitches.
    pub fn number(&mut self) -> Result<Expression> {
        self.count()
    }

    /// Sums and products of numbers, lengths, names and functions.
    pub fn expression(&mut self) -> Result<Expression> {
        if self.depth >= DEPTH {
            return Err(self.error(format_args!("an expression of at most {DEPTH} levels")));
        }
        self.depth += 1;
        let mut value = self.product()?;
        let mut terms = 0;
        while let Some(Kind::Sign(sign @ ('+' | '-'))) = self.peek() {
            terms += 1;
            let place = self.bounded(terms)?;
            value = Expression::Binary(*sign, Box::new(value), Box::new(self.product()?), place);
        }
        self.depth -= 1;
        Ok(value)
    }

    fn product(&mut self) -> Result<Expression> {
        let mut value = self.factor()?;
        let mut factors = 0;
        while let Some(Kind::Sign(sign @ ('*' | '/'))) = self.peek() {
            factors += 1;
            let place = self.bounded(factors)?;
            value = Expression::Binary(*sign, Box::new(value), Box::new(self.factor()?), place);
        }
        Ok(value)
    }

    /// Goes past the sign of a sum or product, which may not have too many.
    fn bounded(&mut self, signs: usize) -> Result<Place> {
        if signs > MOST_SIGNS {
            return Err(self.error(format_args!("a sum or product of at most {MOST_SIGNS} parts")));
        }
        let place = self.place();
        self.at += 1;
        Ok(place)
    }

    fn factor(&mut self) -> Result<Expression> {
        let place = self.place();
        let mut negative = false;
        while self.sign('-') {
            negative = !negative;
        }
        let value = match self.peek() {
            Some(Kind::Number(x)) => {
                self.at += 1;
                Expression::Number(x * self.unit())
            }
            Some(Kind::Sign('(')) => {
                self.at += 1;
                let value = self.expression()?;
                self.expect(')')?;
                value
            }
            Some(Kind::Word(name)) => {
                self.at += 1;
                if self.sign('(') { self.call(name, place)? } else { Expression::Name(name.clone(), place) }
            }
            _ => return Err(self.error("a number, a name or '('")),
        };
        Ok(if negative { Expression::Negative(Box::new(value)) } else { value })
    }

    /// The unit of a length, in metres.
    fn unit(&mut self) -> f64 {
        let unit = match self.peek() {
            Some(Kind::Word(word)) => match word.as_str() {
                "mm" => 0.001,
                "cm" => 0.01,
                "m" => 1.0,
                "in" | "inch" | "inches" => 0.0254,
                _ => return 1.0,
            },
            _ => return 1.0,
        };
        self.at += 1;
        unit
    }

    fn call(&mut self, name: &str, place: Place) -> Result<Expression> {
        let Some((function, takes)) = Function::named(name) else {
            return Err(self.error_at(
                place,
                format_args!("the unknown function '{name}'"),
                "stitches, rows, width, height, round, floor, ceil, multiple, min, max, rest, sin or cos",
            ));
        };
        let mut arguments = vec![self.expression()?];
        while self.sign(',') {
            arguments.push(self.expression()?);
        }
        self.expect(')')?;
        if !takes.contains(&arguments.len()) {
            let (least, most) = (takes.start(), takes.end());
            let wanted = if least == most { format!("{least}") } else { format!("{least} or {most}") };
            return Err(self.error_at(
                place,
                format_args!("'{name}' of {} numbers", arguments.len()),
                format_args!("{wanted} numbers"),
            ));
        }
        Ok(Expression::Call(function, arguments, place))
    }

    /// The next token is not what was expected.
    pub fn error(&self, expected: impl Display) -> Error {
        let found = self.peek().map_or("the end of the pattern".into(), ToString::to_string);
        self.error_at(self.place(), found, expected)
    }

    /// The token before is not what was expected.
    pub fn error_before(&self, expected: impl Display) -> Error {
        let before = self.at.saturating_sub(usize::from(self.at > 0));
        match self.tokens.get(before) {
            Some(token) => self.error_at(token.place, &token.kind, expected),
            None => self.error(expected),
        }
    }

    pub fn error_at(&self, place: Place, found: impl Display, expected: impl Display) -> Error {
        Error::input(self.path, place.line as usize, place.column as usize, found, expected)
    }
}
