//! `.sf`: face libraries as text. `#` starts a comment; edges count from 0.
//!
//! | line | meaning |
//! |---|---|
//! | `face NAME` | begins a face |
//! | `edge (x,y) LABEL` | its next corner and the label of the edge that starts there |
//! | `yarn [edge:along,z] (x,y,z)... [edge:along,z]` | a yarn from edge to edge |
//! | `derive NAME [labels] [by operations] from KEY` | a face made from another, see [`crate::template::derive`] |
//!
//! A yarn whose first or last bracket is exactly at a corner (along 0 or 1) ends inside the face: that
//! point is dropped. A KEY is a face's name and all its labels; derived faces may stand before their
//! source and be sources themselves.

mod resolve;
mod scan;

use super::text::{Line, Lines, Word, read_bytes};
use crate::template::derive::Operation;
use crate::{Error, Result};
use glam::{DVec2, DVec3};
use resolve::{Derivation, Entry};
use scan::Scan;
use std::path::Path;

/// A face of a library, in the file's own units.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainTemplate {
    /// The stitch's name.
    pub name: String,
    /// One label per edge; edge k runs from corner k to corner k + 1.
    pub labels: Vec<String>,
    /// The polygon, counter-clockwise from the lower left, file units.
    pub corners: Vec<DVec2>,
    /// The yarns, each with at least one point. A strand whose first (last) point is no boundary point
    /// begins (ends) inside the face.
    pub strands: Vec<Vec<PlainPoint>>,
}

impl PlainTemplate {
    /// Name and labels joined by single spaces: what templates are found by.
    pub fn key(&self) -> String {
        std::iter::once(&self.name).chain(&self.labels).map(String::as_str).collect::<Vec<_>>().join(" ")
    }
}

/// A point of a yarn of a library face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlainPoint {
    /// Where the yarn crosses an edge.
    Boundary {
        /// The edge, counted from 0.
        edge: u32,
        /// Fraction along the edge, strictly between 0 and 1.
        along: f64,
        /// Height over the face plane, file units.
        z: f64,
    },
    /// A point (x, y, z) inside the face, file units.
    Interior(DVec3),
}

/// Reads a `.sf` file.
pub fn read_file(path: &Path) -> Result<Vec<PlainTemplate>> {
    read(path, &read_bytes(path)?)
}

/// Reads a `.sf` file from memory; `path` is only for messages. Faces come in the order of the file,
/// derived ones included.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Vec<PlainTemplate>> {
    let mut entries = Vec::new();
    let mut open: Option<OpenFace> = None;
    let mut lines = Lines::new(path, bytes, true);
    for mut line in lines.by_ref() {
        let Some(keyword) = line.word()? else { continue };
        match (keyword.text, &mut open) {
            ("face" | "derive", _) => {
                entries.extend(open.take().map(|face| face.close(path)).transpose()?);
                if keyword.text == "face" {
                    open = Some(OpenFace::new(&mut line)?);
                } else {
                    entries.push(derivation(&mut line)?);
                }
            }
            ("edge", Some(face)) => face.edge(&mut line)?,
            ("yarn", Some(face)) => face.yarn(&mut line)?,
            ("edge" | "yarn", None) => return Err(line.unexpected(keyword, "a 'face' line before this")),
            _ => return Err(line.unexpected(keyword, "'face', 'edge', 'yarn' or 'derive'")),
        }
    }
    entries.extend(open.take().map(|face| face.close(path)).transpose()?);
    if entries.is_empty() {
        let line = lines.number().max(1);
        return Err(Error::input(path, line, 1, "the end of the file", "at least one face"));
    }
    resolve::resolve(path, entries)
}

/// A face whose lines are being read.
struct OpenFace {
    place: (usize, usize),
    face: PlainTemplate,
    /// Line, column and edge of every bracket: edges may still follow, so they are checked at the end.
    brackets: Vec<(usize, usize, u32)>,
}

impl OpenFace {
    fn new(line: &mut Line) -> Result<Self> {
        let name = line.expect_word("the name of the face")?;
        line.end()?;
        let face =
            PlainTemplate { name: name.text.to_owned(), labels: vec![], corners: vec![], strands: vec![] };
        Ok(Self { place: (line.number, name.column), face, brackets: vec![] })
    }

    fn edge(&mut self, line: &mut Line) -> Result<()> {
        let rest = line.rest()?;
        let mut scan = Scan::new(line, rest);
        let [x, y] = scan.numbers('(', ["a number (x)", "a number (y)"])?;
        let label = scan.rest();
        if label.text.is_empty() {
            return Err(line.error(label.column, "the end of the line", "the label of the edge"));
        }
        if let Some(at) = label.text.find(|c: char| c.is_ascii_whitespace()) {
            let text = label.text[at..].trim_start();
            let column = label.column + label.text.len() - text.len();
            return Err(line.unexpected(Word { text, column }, "one label for the edge"));
        }
        self.face.corners.push(DVec2::new(x, y));
        self.face.labels.push(label.text.to_owned());
        Ok(())
    }

    fn yarn(&mut self, line: &mut Line) -> Result<()> {
        let rest = line.rest()?;
        let mut scan = Scan::new(line, rest);
        let mut strand = Vec::new();
        strand.extend(self.bracket(&mut scan)?);
        while scan.next_is('(') {
            let names = ["a number (x)", "a number (y)", "a number (z)"];
            strand.push(PlainPoint::Interior(scan.numbers('(', names)?.into()));
        }
        strand.extend(self.bracket(&mut scan)?);
        let left = scan.rest();
        if !left.text.is_empty() {
            return Err(line.unexpected(left, "the end of the line after the yarn's second bracket"));
        }
        if strand.is_empty() {
            return Err(line.error(rest.column, "a yarn without points", "a point between two yarn ends"));
        }
        self.face.strands.push(strand);
        Ok(())
    }

    /// `[edge:along,z]`, or nothing if the yarn ends there.
    fn bracket(&mut self, scan: &mut Scan) -> Result<Option<PlainPoint>> {
        const ALONG: &str = "a fraction along the edge from 0 to 1";
        scan.take('[')?;
        let (word, edge) = scan.edge()?;
        self.brackets.push((scan.line.number, word.column, edge));
        scan.take(':')?;
        let (word, along) = scan.number(ALONG)?;
        if !(0.0..=1.0).contains(&along) {
            return Err(scan.line.unexpected(word, ALONG));
        }
        scan.take(',')?;
        let (_, z) = scan.number("a number (z)")?;
        scan.take(']')?;
        let ends = along == 0.0 || along == 1.0;
        Ok((!ends).then_some(PlainPoint::Boundary { edge, along, z }))
    }

    fn close(self, path: &Path) -> Result<Entry> {
        let count = self.face.labels.len();
        if count < 3 {
            let found = format_args!("'{}' with {count} edges", self.face.name);
            return Err(Error::input(path, self.place.0, self.place.1, found, "at least three edge lines"));
        }
        match self.brackets.iter().find(|&&(_, _, edge)| edge as usize >= count) {
            None => Ok(Entry { place: self.place, derivation: None, face: Some(self.face) }),
            Some(&(line, column, edge)) => {
                let expected = format!("an edge from 0 to {}", count - 1);
                Err(Error::input(path, line, column, format_args!("'{edge}'"), expected))
            }
        }
    }
}

/// `derive NAME [labels] [by operations] from KEY`
fn derivation(line: &mut Line) -> Result<Entry> {
    let name = line.expect_word("the name of the derived face")?;
    let mut labels = Vec::new();
    let mut labels_column = 0;
    let mut operations: Vec<Operation> = Vec::new();
    let mut by = false;
    loop {
        let word = line.expect_word(if by { "an operation or 'from'" } else { "'by' or 'from'" })?;
        match word.text {
            "from" => break,
            "by" if !by => by = true,
            _ if by => {
                let expected = || format!("{} or 'from'", Operation::NAMES);
                let operation =
                    Operation::from_name(word.text).ok_or_else(|| line.unexpected(word, &expected()))?;
                if operations.contains(&operation) {
                    let found = format_args!("'{}' for the second time", word.text);
                    return Err(line.error(word.column, found, "each operation once"));
                }
                operations.push(operation);
            }
            _ => {
                if labels.is_empty() {
                    labels_column = word.column;
                }
                labels.push(word.text.to_owned());
            }
        }
    }
    let first = line.expect_word("the name and labels of the source face")?;
    let mut source = first.text.to_owned();
    while let Some(word) = line.word()? {
        source.push(' ');
        source.push_str(word.text);
    }
    let derivation = Derivation {
        name: name.text.to_owned(),
        labels,
        labels_column,
        operations,
        source,
        source_column: first.column,
    };
    Ok(Entry { place: (line.number, name.column), derivation: Some(derivation), face: None })
}
