//! Charts on disk: text (`.chart`), JSON (`.json`) and pictures (`.png`); and a chart alone as a flat swatch.
//!
//! All three give a [`Drawing`], in which "no stitch" squares are left out.

pub mod swatch;

mod json;
mod key;
mod picture;
mod text;

pub use json::FORMAT;

use super::text::{extension, read_bytes};
use crate::design::chart::{Cell, Chart};
use crate::design::stitch::Stitch;
use crate::design::token::Place;
use crate::{Error, Result};
use std::collections::HashMap;
use std::path::Path;

/// Squares of a chart at most: more is a mistake.
pub const MOST_SQUARES: usize = 4_000_000;

/// Colours of a chart at most.
pub const MOST_COLOURS: usize = 65_535;

/// A square as it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Square {
    /// The stitch as the front shows it.
    pub stitch: Stitch,
    /// Its colour, if it has one of its own.
    pub colour: Option<[u8; 3]>,
    /// Line and column of the file; of pictures, row and column of pixels, both from 1.
    pub place: Place,
}

/// A row as it is drawn, from left to right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DrawnRow {
    /// Where it begins.
    pub place: Place,
    /// Its squares; there is at least one.
    pub squares: Vec<Square>,
}

/// A chart as it is drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Drawing {
    /// Rows from the bottom; there is at least one.
    pub rows: Vec<DrawnRow>,
}

/// Reads a chart's file; its extension says which kind it is.
///
/// # Errors
/// Files that cannot be read; the first place that is not a chart.
pub fn read_file(path: &Path) -> Result<Drawing> {
    if !is_chart(path) {
        return Err(Error::invalid(format_args!(
            "{}: found another kind of file, expected a chart (.chart, .json or .png)",
            path.display()
        )));
    }
    read(path, &read_bytes(path)?)
}

/// Whether a file's extension is that of a chart.
pub fn is_chart(path: &Path) -> bool {
    matches!(extension(path).as_str(), "chart" | "json" | "png")
}

/// The same from what the file holds.
///
/// # Errors
/// The first place that is not a chart.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Drawing> {
    match extension(path).as_str() {
        "png" => picture::read(path, bytes),
        "json" => json::read(path, bytes),
        _ => text::read(path, bytes),
    }
}

impl Drawing {
    /// The chart as patterns use it; `colour` gives colours their numbers.
    ///
    /// # Errors
    /// More than [`MOST_COLOURS`] colours.
    pub fn chart(&self, path: &Path, colour: &mut dyn FnMut([u8; 3]) -> u16) -> Result<Chart> {
        let mut numbers: HashMap<[u8; 3], u16> = HashMap::new();
        let mut rows = Vec::with_capacity(self.rows.len());
        for row in &self.rows {
            let mut cells = Vec::with_capacity(row.squares.len());
            for &Square { stitch, colour: rgb, place } in &row.squares {
                if let Some(rgb) = rgb
                    && numbers.len() >= MOST_COLOURS
                    && !numbers.contains_key(&rgb)
                {
                    let [r, g, b] = rgb;
                    return Err(Error::input(
                        path,
                        place.line as usize,
                        place.column as usize,
                        format_args!("one more colour, #{r:02x}{g:02x}{b:02x}"),
                        format_args!("at most {MOST_COLOURS} colours"),
                    ));
                }
                let colour = rgb.map(|rgb| *numbers.entry(rgb).or_insert_with(|| colour(rgb)));
                cells.push(Cell { stitch, colour, place });
            }
            rows.push(cells);
        }
        Ok(Chart { rows, alone: false })
    }
}

/// A row of symbols before it is known what they mean.
struct SymbolRow<'a> {
    text: &'a str,
    /// Place of each byte of `text`.
    places: Box<dyn Fn(usize) -> Place + 'a>,
}

/// What rows of symbols mean, the top one first.
fn resolve(path: &Path, key: &key::Key, rows: &[SymbolRow]) -> Result<Vec<DrawnRow>> {
    let error = |place: Place, found: String, expected: String| {
        Error::input(path, place.line as usize, place.column as usize, found, expected)
    };
    let mut drawn = Vec::with_capacity(rows.len());
    let mut total = 0;
    for (number, row) in (1..=rows.len()).rev().zip(rows) {
        let mut words: Vec<(usize, &str)> = key::words(row.text);
        let first = words.first().map_or(Place { line: 1, column: 1 }, |w| (row.places)(w.0));
        // Row numbers stand beside the squares, on either side.
        let margin = |word: &str| word.bytes().all(|b| b.is_ascii_digit()) && !key.knows(word);
        for last in [true, false] {
            let at_edge = if last { words.last() } else { words.first() };
            if let Some(&(at, word)) = at_edge
                && words.len() > 1
                && margin(word)
            {
                if word.parse() != Ok(number) {
                    return Err(error(
                        (row.places)(at),
                        format!("row number {word}"),
                        format!("{number}: rows are counted from the bottom"),
                    ));
                }
                words.remove(if last { words.len() - 1 } else { 0 });
            }
        }
        let mut squares = Vec::new();
        let mut column = 0;
        for (at, word) in words {
            let whole = key.knows(word);
            for (k, c) in word.char_indices() {
                if whole && k > 0 {
                    break;
                }
                column += 1;
                let symbol = if whole { word } else { &word[k..k + c.len_utf8()] };
                let place = (row.places)(at + k);
                let Some(meaning) = key.meaning(symbol) else {
                    return Err(error(
                        place,
                        format!("'{symbol}' (row {number}, square {column} from the left)"),
                        format!("a symbol ({}) or a stitch's name", key.symbols()),
                    ));
                };
                if let Some((stitch, colour)) = meaning {
                    squares.push(Square { stitch, colour, place });
                }
            }
        }
        total += column;
        if total > MOST_SQUARES {
            return Err(error(first, format!("more than {MOST_SQUARES} squares"), "a smaller chart".into()));
        }
        if squares.is_empty() {
            return Err(error(first, format!("row {number} without stitches"), "one or more".into()));
        }
        drawn.push(DrawnRow { place: first, squares });
    }
    drawn.reverse();
    Ok(drawn)
}
