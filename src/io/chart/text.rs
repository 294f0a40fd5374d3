//! Charts as text: lines `SYMBOL = STITCH [COLOUR]` and `color NAME #rrggbb`, and the rows as they are drawn, the top one
//! first, numbered at a margin or not. Docs: `docs/charts.md`.

use super::key::{Key, colour, words};
use super::{Drawing, SymbolRow, resolve};
use crate::design::token::Place;
use crate::io::text::line_and_column;
use crate::{Error, Result};
use std::path::Path;

/// Reads a chart.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Drawing> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let (line, column) = line_and_column(bytes, e.valid_up_to());
        Error::input(path, line, column, "bytes that are not UTF-8", "a text file")
    })?;
    let mut key = Key::default();
    let mut rows = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = before_comment(line);
        let words = words(line);
        let error =
            |at: usize, found: String, expected: String| Error::input(path, number, at + 1, found, expected);
        match words[..] {
            [] => {}
            [(at, symbol), (_, "="), ..] => {
                // What follows the sign.
                let from = words[1].0 + 1;
                key.define(symbol, &line[from..]).map_err(|(word, found, expected)| {
                    let place = if word == 0 { at } else { from + word };
                    error(place, found, expected)
                })?;
            }
            [(_, "color" | "colour"), (at, name), (_, rgb)] => {
                key.name_colour(name, rgb).map_err(|(found, expected)| error(at, found, expected))?;
            }
            [(at, "color" | "colour"), ..] => {
                return Err(error(at, "a colour that is not whole".into(), "color NAME #rrggbb".into()));
            }
            _ => {
                let places = Box::new(move |at: usize| Place { line: number as u32, column: at as u32 + 1 });
                rows.push(SymbolRow { text: line, places });
            }
        }
    }
    if rows.is_empty() {
        let (line, column) = line_and_column(bytes, bytes.len());
        return Err(Error::input(path, line, column, "the end of the file", "rows of symbols"));
    }
    Ok(Drawing { rows: resolve(path, &key, &rows)? })
}

/// A `#` begins a comment, but where it begins a colour.
fn before_comment(line: &str) -> &str {
    let mut words = words(line).into_iter().peekable();
    let names = words.peek().is_some_and(|(_, w)| matches!(*w, "color" | "colour"))
        || words.clone().nth(1).is_some_and(|(_, w)| w == "=");
    let mut seen = false;
    for (at, word) in words {
        let Some(k) = word.find('#') else { continue };
        if !(names && !seen && k == 0 && colour(word).is_some()) {
            return &line[..at + k];
        }
        seen = true;
    }
    line
}
