//! `.smobj`: stitch meshes as text. One keyword a line, `#` starts a comment, numbers count from 1.
//!
//! | line | meaning |
//! |---|---|
//! | `L name label label label ...` | a stitch type |
//! | `v x y z` | a vertex |
//! | `f i j k ...` | a face; negative numbers count back from the last vertex so far |
//! | `T n`, `N line` | type and pattern line of the n-th face, for the n-th such line |
//! | `N line # column c color rrggbb` | ours: the place on that line and the stitch's colour, in a comment that others pass over |
//! | `e face/edge face/edge` | two joined edges; flipped if exactly one edge number is negative |
//! | `# gauge width height` | ours: size of a plain stitch, in units of the mesh |
//! | `U name length`, `c face/edge/crossing (length unit)...` | yarn length units and rest lengths |
//! | `h o t l I xfer` | knitting machine hints, kept verbatim |
//! | `ci vn vt usemtl mtllib` | counted, otherwise passed over |
//!
//! Lines may refer to lines further down; references are checked at the end.

mod check;
mod write;

pub use write::write;

use super::text::{Line, Lines, Word, read_bytes};
use crate::Result;
use crate::ids::{FaceId, TypeId, VertexId};
use crate::mesh::{Checkpoint, FaceEdge, FaceOrigin, Join, StitchMesh, StitchType, YarnUnit};
use glam::DVec3;
use std::collections::HashSet;
use std::path::Path;

/// Reads a `.smobj` file.
pub fn read_file(path: &Path) -> Result<StitchMesh> {
    read(path, &read_bytes(path)?)
}

/// Reads a `.smobj` file from memory; `path` is only for messages.
pub fn read(path: &Path, bytes: &[u8]) -> Result<StitchMesh> {
    let mut reader = Reader {
        mesh: StitchMesh { face_offsets: vec![0], ..StitchMesh::default() },
        signatures: HashSet::new(),
    };
    for mut line in Lines::new(path, bytes, true) {
        if let Some(keyword) = line.word()? {
            reader.line(keyword, &mut line)?;
        } else if reader.mesh.gauge.is_none() {
            reader.mesh.gauge = gauge(line.comment());
        }
    }
    let mut mesh = reader.mesh;
    check::check(&mesh, path, bytes)?;
    if !mesh.face_origins.is_empty() {
        mesh.face_origins.resize(mesh.face_count(), FaceOrigin::default());
    }
    mesh.positions.shrink_to_fit();
    mesh.face_offsets.shrink_to_fit();
    mesh.face_vertices.shrink_to_fit();
    mesh.face_types.shrink_to_fit();
    mesh.face_source.shrink_to_fit();
    mesh.joins.shrink_to_fit();
    Ok(mesh)
}

/// Column and colour from the comment of an `N` line; any other comment is none of ours.
fn origin(comment: &str) -> Option<FaceOrigin> {
    let mut words = comment.strip_prefix('#')?.split_ascii_whitespace();
    let column = (words.next()? == "column").then(|| words.next())??.parse().ok()?;
    let colour = match (words.next(), words.next(), words.next()) {
        (None, ..) => None,
        (Some("color"), Some(rgb), None) if rgb.len() == 6 => {
            let [_, r, g, b] = u32::from_str_radix(rgb, 16).ok()?.to_be_bytes();
            Some([r, g, b])
        }
        _ => return None,
    };
    Some(FaceOrigin { column, colour })
}

/// Width and height of a plain stitch from a comment of its own; any other comment is none of ours.
fn gauge(comment: &str) -> Option<[f64; 2]> {
    let mut words = comment.strip_prefix('#')?.split_ascii_whitespace();
    let named = words.next()? == "gauge";
    let size = |word: Option<&str>| word?.parse().ok().filter(|x| (1e-9..=1e9).contains(x));
    let both = [size(words.next())?, size(words.next())?];
    (named && words.next().is_none()).then_some(both)
}

struct Reader {
    mesh: StitchMesh,
    signatures: HashSet<StitchType>,
}

impl Reader {
    fn line(&mut self, keyword: Word, line: &mut Line) -> Result<()> {
        let mesh = &mut self.mesh;
        match keyword.text {
            "v" => {
                let [x, y, z] = ["the vertex's x", "the vertex's y", "the vertex's z"].map(|e| line.f64(e));
                mesh.positions.push(DVec3::new(x?, y?, z?));
            }
            "f" => return self.face(line),
            "T" => {
                let word = line.expect_word("the number of a stitch type")?;
                mesh.face_types
                    .push(TypeId(number(line, word, word.text, "the number of a stitch type")? - 1));
            }
            "N" => {
                let word = line.expect_word("the number of a pattern line")?;
                let source =
                    word.text.parse().map_err(|_| line.unexpected(word, "the number of a pattern line"))?;
                mesh.face_source.push(source);
                if let Some(origin) = origin(line.comment()) {
                    mesh.face_origins.resize(mesh.face_source.len() - 1, FaceOrigin::default());
                    mesh.face_origins.push(origin);
                }
            }
            "e" => {
                let (a, a_reversed) = joined_edge(line)?;
                let (b, b_reversed) = joined_edge(line)?;
                mesh.joins.push(Join { a, b, flipped: a_reversed != b_reversed });
            }
            "L" => return self.signature(line),
            "U" => {
                let name = line.expect_word("the name of a yarn unit")?;
                let length_column = line.expect_word("the length of the unit")?;
                let length = line.parse_f64(length_column, "the length of the unit")?;
                if mesh.units.is_empty() && (name.text != "1" || length != 1.0) {
                    let found = format_args!("'{} {length}'", name.text);
                    return Err(line.error(name.column, found, "'1 1.0' as the first yarn unit"));
                }
                mesh.units.push(YarnUnit { name: name.text.to_owned(), length });
            }
            "c" => return self.checkpoint(line),
            "h" | "o" | "t" | "l" | "I" | "xfer" => {
                check_hint(keyword.text, line)?;
                mesh.hints.push(line.whole()?.text.to_owned());
                return Ok(());
            }
            "ci" | "vn" | "vt" | "usemtl" | "mtllib" => {
                match mesh.ignored.iter_mut().find(|(kind, _)| kind == keyword.text) {
                    Some((_, count)) => *count += 1,
                    None => mesh.ignored.push((keyword.text.to_owned(), 1)),
                }
                return Ok(());
            }
            _ => {
                let expected = "one of L v f T N e U c h o t l I xfer ci vn vt usemtl mtllib";
                return Err(line.unexpected(keyword, expected));
            }
        }
        line.end()
    }

    fn face(&mut self, line: &mut Line) -> Result<()> {
        const EXPECTED: &str = "a vertex number (from 1, or negative from the last vertex so far)";
        let mesh = &mut self.mesh;
        let begin = mesh.face_vertices.len();
        while let Some(word) = line.word()? {
            let index = match word.text.split_once('/') {
                None => word.text,
                // Texture and normal numbers may stand behind slashes; they say nothing about the stitch.
                Some((index, rest))
                    if rest.bytes().all(|b| b.is_ascii_digit() || b == b'/' || b == b'-')
                        && rest.bytes().any(|b| b.is_ascii_digit()) =>
                {
                    index
                }
                Some(_) => return Err(line.unexpected(word, EXPECTED)),
            };
            let count = mesh.positions.len() as i64;
            let vertex = match index.parse::<i64>() {
                Ok(n) if n > 0 && n <= i64::from(u32::MAX) => n - 1,
                Ok(n) if n < 0 && n >= -count => count + n,
                _ => return Err(line.unexpected(word, EXPECTED)),
            };
            mesh.face_vertices.push(VertexId(vertex as u32));
        }
        if mesh.face_vertices.len() < begin + 3 {
            line.expect_word("a face with at least three vertices")?;
        }
        match u32::try_from(mesh.face_vertices.len()) {
            Ok(end) => mesh.face_offsets.push(end),
            Err(_) => return Err(line.error(1, "one face too many", "fewer than 2^32 corners")),
        }
        Ok(())
    }

    fn signature(&mut self, line: &mut Line) -> Result<()> {
        let name = line.expect_word("the name of a stitch type")?;
        let mut labels = Vec::new();
        while let Some(word) = line.word()? {
            labels.push(word.text.to_owned());
        }
        if labels.len() < 3 {
            line.expect_word("at least three edge labels")?;
        }
        let signature = StitchType { name: name.text.to_owned(), labels };
        if !self.signatures.insert(signature.clone()) {
            let found = format_args!("'{}' for the second time", signature.key());
            return Err(line.error(name.column, found, "each name with its labels once"));
        }
        self.mesh.types.push(signature);
        Ok(())
    }

    fn checkpoint(&mut self, line: &mut Line) -> Result<()> {
        const EXPECTED: &str = "face/edge/crossing, counted from 1";
        let word = line.expect_word(EXPECTED)?;
        let mut parts = word.text.split('/');
        let [face, edge, crossing] =
            [(); 3].map(|()| number(line, word, parts.next().unwrap_or(""), EXPECTED));
        let at = FaceEdge { face: FaceId(face? - 1), edge: edge? - 1 };
        let crossing = crossing? - 1;
        if parts.next().is_some() {
            return Err(line.unexpected(word, EXPECTED));
        }
        let mut lengths = Vec::new();
        while let Some(word) = line.word()? {
            let length = line.parse_f64(word, "a yarn length")?;
            let unit = line.expect_word("the number of a yarn unit after each length")?;
            lengths.push((length, number(line, unit, unit.text, "the number of a yarn unit")? - 1));
        }
        self.mesh.checkpoints.push(Checkpoint { at, crossing, lengths });
        Ok(())
    }
}

/// A number counted from 1 (`text` is all or part of `word`).
fn number(line: &Line, word: Word, text: &str, expected: &str) -> Result<u32> {
    match text.parse() {
        Ok(n) if n > 0 => Ok(n),
        _ => Err(line.unexpected(word, expected)),
    }
}

/// `face/edge` of an `e` line, and whether the edge number was negative.
fn joined_edge(line: &mut Line) -> Result<(FaceEdge, bool)> {
    const EXPECTED: &str = "face/edge, counted from 1 (a negative edge is run through backwards)";
    let word = line.expect_word(EXPECTED)?;
    let (face, edge) = word.text.split_once('/').ok_or_else(|| line.unexpected(word, EXPECTED))?;
    let face = number(line, word, face, EXPECTED)?;
    match edge.parse::<i64>() {
        Ok(n) if n != 0 && n.unsigned_abs() <= u64::from(u32::MAX) => {
            let edge = (n.unsigned_abs() - 1) as u32;
            Ok((FaceEdge { face: FaceId(face - 1), edge }, n < 0))
        }
        _ => Err(line.unexpected(word, EXPECTED)),
    }
}

/// Hints are not interpreted, but a line that cannot be one (such as OBJ's `o name`) is named.
fn check_hint(keyword: &str, line: &mut Line) -> Result<()> {
    let (pairs, expected) = match keyword {
        "h" => (1, "face/edge of a needle hint"),
        "o" => (2, "face/instruction of an order hint (object names do not belong in .smobj)"),
        "I" => (1, "face/instruction"),
        "t" => (0, "the number of a face"),
        "l" => (0, "the number of a face"),
        _ => {
            line.expect_word("a needle")?;
            return Ok(());
        }
    };
    let is_number = |text: &str| text.parse::<i64>().is_ok();
    if pairs == 0 {
        let word = line.expect_word(expected)?;
        return if is_number(word.text) { Ok(()) } else { Err(line.unexpected(word, expected)) };
    }
    for _ in 0..pairs {
        let word = line.expect_word(expected)?;
        if !word.text.split_once('/').is_some_and(|(a, b)| is_number(a) && is_number(b)) {
            return Err(line.unexpected(word, expected));
        }
    }
    Ok(())
}
