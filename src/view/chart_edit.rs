//! Squares of charts, changed in the file's own text or pixels.

use super::state::Content;
use crate::io::chart::{Drawing, Square};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What a square may become.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Brush {
    /// A symbol, as the file writes it.
    Symbol(String),
    /// A colour, in pictures.
    Colour([u8; 3]),
}

/// Symbols that mean something in every chart.
const STANDARD: [&str; 8] = [".", "-", "o", "/", "\\", "^", "Q", "M"];

/// Where a square's symbol stands: bytes of the text.
fn span(text: &str, drawing: &Drawing, square: &Square) -> Option<std::ops::Range<usize>> {
    let line_begins: usize =
        text.split_inclusive('\n').take(square.place.line as usize - 1).map(str::len).sum();
    let line = text.get(line_begins..)?.lines().next()?;
    let at = square.place.column as usize - 1;
    let rest = line.get(at..)?;
    let first = rest.chars().next()?;
    // In JSON some signs are escaped.
    let one = if first == '\\' && text.trim_start().starts_with('{') { 2 } else { first.len_utf8() };
    let begins = line[..at].chars().next_back().is_none_or(|c| c.is_whitespace() || c == '"');
    let word = rest.find(|c: char| c.is_whitespace() || c == '"').unwrap_or(rest.len());
    let others = drawing.rows.iter().flat_map(|r| &r.squares).any(|s| {
        let column = s.place.column as usize - 1;
        s.place.line == square.place.line && column > at && column < at + word
    });
    // A word that is one square is a stitch's name.
    let length = if begins && !others && word > one { word } else { one };
    Some(line_begins + at..line_begins + at + length)
}

/// What squares may become: what the chart has already, and what all charts know.
pub fn brushes(content: &Content, drawing: &Drawing) -> Vec<Brush> {
    let mut found: BTreeMap<Brush, usize> = BTreeMap::new();
    for square in drawing.rows.iter().flat_map(|r| &r.squares) {
        *found.entry(brush(content, drawing, square)).or_default() += 1;
    }
    let mut brushes: Vec<Brush> = found.into_keys().collect();
    if matches!(content, Content::Text(_)) {
        for symbol in STANDARD {
            let symbol = Brush::Symbol(symbol.into());
            if !brushes.contains(&symbol) {
                brushes.push(symbol);
            }
        }
    }
    brushes.truncate(64);
    brushes
}

/// What a square is painted with.
pub fn brush(content: &Content, drawing: &Drawing, square: &Square) -> Brush {
    match content {
        Content::Text(text) => {
            let symbol = span(text, drawing, square).and_then(|s| text.get(s)).unwrap_or(".");
            Brush::Symbol(if symbol == "\\\\" { "\\".into() } else { symbol.into() })
        }
        _ => Brush::Colour(square.colour.unwrap_or([255; 3])),
    }
}

/// The content with a square changed; none where it cannot be.
pub fn paint(content: &Content, drawing: &Drawing, square: &Square, brush: &Brush) -> Option<Content> {
    match (content, brush) {
        (Content::Text(text), Brush::Symbol(symbol)) => {
            let span = span(text, drawing, square)?;
            let json = text.trim_start().starts_with('{');
            let symbol = if json { symbol.replace('\\', "\\\\") } else { symbol.clone() };
            let mut changed = text.to_string();
            // Names of stitches are kept apart from what is beside them.
            let name = symbol.chars().count() > 1 && !symbol.starts_with('\\');
            let apart = |c: Option<char>| name && c.is_some_and(|c| !c.is_whitespace() && c != '"');
            let before = if apart(text[..span.start].chars().next_back()) { " " } else { "" };
            let after = if apart(text[span.end..].chars().next()) { " " } else { "" };
            changed.replace_range(span, &format!("{before}{symbol}{after}"));
            Some(Content::Text(changed.into()))
        }
        (Content::Picture(_), Brush::Colour(colour)) => picture(drawing, square, *colour),
        _ => None,
    }
}

/// A picture's pixels with one changed; transparent ones stay so.
fn picture(drawing: &Drawing, square: &Square, colour: [u8; 3]) -> Option<Content> {
    let width = drawing.rows.iter().map(|r| r.squares.len()).max()?;
    let mut pixels = Vec::with_capacity(4 * width * drawing.rows.len());
    for row in drawing.rows.iter().rev() {
        for s in &row.squares {
            let own = if s.place == square.place { Some(colour) } else { s.colour };
            pixels.extend(own.map_or([0; 4], |[r, g, b]| [r, g, b, 255]));
        }
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, drawing.rows.len() as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().ok()?.write_image_data(&pixels).ok()?;
    Some(Content::Picture(Arc::from(bytes)))
}
