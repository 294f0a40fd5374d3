//! Periodic yarn patterns as text (`pyp`): blocks of rows, each begun by a line `*name`; `#` starts a comment.
//!
//! | block | a row |
//! |---|---|
//! | `*pattern` | `px py r n`: period along u and v, yarn radius (metres), number of vertices; one row |
//! | `*Q` | `x y z theta`: place (metres) and twist (radians) of a vertex |
//! | `*E` | `v0 v1 dx dy`: an edge from v0 to v1, so many periods on; in any order |
//! | `*RL` | rest length (metres) of the edge that leaves the vertex |
//! | `*RefD1` | `x y z`: reference director of the edge that leaves the vertex |
//!
//! Rows are one a vertex, vertices counted from 0. Blocks of other names are passed over, blank lines mean nothing.

use super::text::{Line, Lines, Word, read_bytes};
use crate::pattern::{Pattern, PatternEdge};
use crate::{Error, Result};
use glam::{DVec2, DVec3, IVec2};
use std::fmt::Write;
use std::path::Path;

/// What a column holds.
enum Column {
    Number(&'static str),
    Whole(&'static str),
}

use Column::{Number, Whole};

/// The blocks that are read.
const BLOCKS: [(&str, &[Column]); 5] = [
    (
        "*pattern",
        &[
            Number("px, the period along u, a number"),
            Number("py, the period along v, a number"),
            Number("r, the yarn radius, a number"),
            Whole("n, the number of vertices, a whole number"),
        ],
    ),
    (
        "*Q",
        &[
            Number("x, a number"),
            Number("y, a number"),
            Number("z, a number"),
            Number("theta, the twist, a number"),
        ],
    ),
    (
        "*E",
        &[
            Whole("v0, a vertex number"),
            Whole("v1, a vertex number"),
            Whole("dx, a number of periods"),
            Whole("dy, a number of periods"),
        ],
    ),
    ("*RL", &[Number("a rest length, a number")]),
    (
        "*RefD1",
        &[
            Number("x of a director, a number"),
            Number("y of a director, a number"),
            Number("z of a director, a number"),
        ],
    ),
];

/// Most vertices of a pattern.
const MOST_VERTICES: usize = 1 << 16;

/// The rows of a block, and where each number stands.
struct Block {
    name: &'static str,
    columns: &'static [Column],
    /// The line of its name.
    line: usize,
    /// `[row * column]`; whole ones up to 2^53 are exact.
    numbers: Vec<f64>,
    /// `[row * column]` line and column.
    places: Vec<(usize, usize)>,
}

impl Block {
    /// Reads a row, whose first word is read already.
    fn add(&mut self, line: &mut Line, first: Word) -> Result<()> {
        let mut first = Some(first);
        for column in self.columns {
            let (Number(expected) | Whole(expected)) = *column;
            let word = match first.take() {
                Some(word) => word,
                None => line.expect_word(expected)?,
            };
            self.numbers.push(match column {
                Number(_) => line.parse_f64(word, expected)?,
                Whole(_) => word.text.parse::<i64>().map_err(|_| line.unexpected(word, expected))? as f64,
            });
            self.places.push((line.number, word.column));
        }
        line.end()
    }

    fn row(&self, row: usize) -> &[f64] {
        let width = self.columns.len();
        &self.numbers[row * width..(row + 1) * width]
    }

    fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.numbers.chunks_exact(self.columns.len())
    }

    /// The error that a number is not what was expected.
    fn error(&self, path: &Path, row: usize, column: usize, expected: impl std::fmt::Display) -> Error {
        let at = row * self.columns.len() + column;
        let (line, place) = self.places[at];
        Error::input(path, line, place, self.numbers[at], expected)
    }

    /// That there are as many rows as expected; `why` says by whom.
    fn check_rows(&self, path: &Path, expected: usize, why: &str) -> Result<()> {
        let found = self.rows().len();
        if found == expected {
            return Ok(());
        }
        // Rows too many have a place, missing ones only their block's.
        let (line, column) =
            self.places.get(expected * self.columns.len()).copied().unwrap_or((self.line, 1));
        let name = self.name;
        Err(Error::input(
            path,
            line,
            column,
            format_args!("{found} rows in '{name}'"),
            format_args!("{expected}{why}"),
        ))
    }

    fn check_positive(&self, path: &Path, columns: usize) -> Result<()> {
        for (row, numbers) in self.rows().enumerate() {
            if let Some(bad) = numbers[..columns].iter().position(|x| *x <= 0.0) {
                return Err(self.error(path, row, bad, "a positive number"));
            }
        }
        Ok(())
    }
}

/// Reads a pattern.
///
/// # Errors
/// A file that cannot be read, and what [`read`] refuses.
pub fn read_file(path: &Path) -> Result<Pattern> {
    read(path, &read_bytes(path)?)
}

/// Reads a pattern from memory; `path` is only for messages.
///
/// # Errors
/// By line and column: blocks that are missing or come twice, rows too many or too few, words that are no numbers, lengths
/// that are not positive, vertices out of range, and vertices that not just one edge leaves and one reaches.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Pattern> {
    let blocks = read_blocks(path, bytes)?;
    let [pattern, places, edges, lengths, directors] = &blocks;
    pattern.check_rows(path, 1, "")?;
    let n = pattern.row(0)[3];
    if !(1.0..=MOST_VERTICES as f64).contains(&n) {
        return Err(pattern.error(path, 0, 3, format_args!("1 to {MOST_VERTICES} vertices")));
    }
    let n = n as usize;
    for block in [places, edges, lengths, directors] {
        block.check_rows(path, n, " as '*pattern' says: one a vertex")?;
    }
    pattern.check_positive(path, 3)?;
    lengths.check_positive(path, 1)?;
    let vector = |row: &[f64]| DVec3::new(row[0], row[1], row[2]);
    let result = Pattern {
        size: DVec2::new(pattern.row(0)[0], pattern.row(0)[1]),
        radius: pattern.row(0)[2],
        places: places.rows().map(vector).collect(),
        twists: places.rows().map(|row| row[3]).collect(),
        edges: read_edges(path, edges, n)?,
        rest_lengths: lengths.numbers.clone(),
        directors: directors.rows().map(vector).collect(),
    };
    result.links().map_err(|e| Error::invalid(format_args!("{}: {e}", path.display())))?;
    Ok(result)
}

fn read_blocks(path: &Path, bytes: &[u8]) -> Result<[Block; 5]> {
    let mut blocks: [Option<Block>; 5] = Default::default();
    // Within which block: none before the first, then its number, or none of the known ones.
    let mut inside: Option<Option<usize>> = None;
    let mut lines = Lines::new(path, bytes, true);
    for mut line in lines.by_ref() {
        let Some(word) = line.word()? else { continue };
        if word.text.starts_with('*') {
            let known = BLOCKS.iter().position(|(name, _)| *name == word.text);
            inside = Some(known);
            let Some(known) = known else { continue };
            line.end()?;
            if blocks[known].is_some() {
                return Err(line.unexpected(word, "each block once"));
            }
            let (name, columns) = BLOCKS[known];
            let (numbers, places) = (Vec::new(), Vec::new());
            blocks[known] = Some(Block { name, columns, line: line.number, numbers, places });
            continue;
        }
        match inside {
            None => return Err(line.unexpected(word, "a block, such as '*pattern', before any row")),
            Some(None) => {}
            Some(Some(known)) => {
                if let Some(block) = &mut blocks[known] {
                    block.add(&mut line, word)?;
                }
            }
        }
    }
    let missing = blocks.iter().position(Option::is_none).unwrap_or(0);
    let [Some(pattern), Some(places), Some(edges), Some(lengths), Some(directors)] = blocks else {
        let expected = format!("a block '{}'", BLOCKS[missing].0);
        return Err(Error::input(path, lines.number().max(1), 1, "the end of the file", expected));
    };
    Ok([pattern, places, edges, lengths, directors])
}

fn read_edges(path: &Path, block: &Block, n: usize) -> Result<Vec<PatternEdge>> {
    let mut edges = Vec::with_capacity(n);
    // By end: which vertices have an edge there already.
    let mut taken = [vec![false; n], vec![false; n]];
    for (row, numbers) in block.rows().enumerate() {
        for (column, taken) in taken.iter_mut().enumerate() {
            let x = numbers[column];
            if !(0.0..n as f64).contains(&x) {
                return Err(block.error(path, row, column, format_args!("a vertex from 0 to {}", n - 1)));
            }
            if std::mem::replace(&mut taken[x as usize], true) {
                let verb = ["leaves", "reaches"][column];
                return Err(block.error(
                    path,
                    row,
                    column,
                    format_args!("a vertex that no other edge {verb}"),
                ));
            }
        }
        for (column, tile) in numbers.iter().enumerate().skip(2) {
            if !(i32::MIN as f64..=i32::MAX as f64).contains(tile) {
                return Err(block.error(path, row, column, "a number of periods within 32 bits"));
            }
        }
        edges.push(PatternEdge {
            from: numbers[0] as u32,
            to: numbers[1] as u32,
            tile: IVec2::new(numbers[2] as i32, numbers[3] as i32),
        });
    }
    Ok(edges)
}

/// Writes a pattern as text that reads back to the bit.
pub fn write(pattern: &Pattern) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail. `{:?}` is the shortest number that reads back, with an exponent where that is short.
    let mut put = |line: std::fmt::Arguments| {
        let _ = text.write_fmt(line);
        text.push('\n');
    };
    put(format_args!("*pattern # period along u and v, yarn radius, vertices"));
    let (size, radius) = (pattern.size, pattern.radius);
    put(format_args!("{:?} {:?} {radius:?} {}", size.x, size.y, pattern.vertex_count()));
    put(format_args!("\n*Q # x y z theta"));
    for (p, twist) in pattern.places.iter().zip(&pattern.twists) {
        put(format_args!("{:?} {:?} {:?} {twist:?}", p.x, p.y, p.z));
    }
    put(format_args!("\n*E # edges: from, to, periods along u and v"));
    for edge in &pattern.edges {
        put(format_args!("{} {} {} {}", edge.from, edge.to, edge.tile.x, edge.tile.y));
    }
    put(format_args!("\n*RL # rest lengths of the edges that leave each vertex"));
    for length in &pattern.rest_lengths {
        put(format_args!("{length:?}"));
    }
    put(format_args!("\n*RefD1 # directors of the edges that leave each vertex"));
    for d in &pattern.directors {
        put(format_args!("{:?} {:?} {:?}", d.x, d.y, d.z));
    }
    text
}
