//! What can only be checked when the whole file is read: references and counts.
//!
//! No place is stored while reading. When something is wrong, its line is found by reading the file
//! once more: the n-th element of a kind comes from the n-th line of its keyword.

use crate::ids::FaceId;
use crate::io::text::Lines;
use crate::mesh::StitchMesh;
use crate::{Error, Result};
use std::path::Path;

pub(super) fn check(mesh: &StitchMesh, path: &Path, bytes: &[u8]) -> Result<()> {
    let source = Source { path, bytes };
    let faces = mesh.face_offsets.len() - 1;
    if faces == 0 {
        let line = Lines::new(path, bytes, true).count().max(1);
        return Err(Error::input(path, line, 1, "the end of the file", "at least one face (f line)"));
    }
    counts(mesh, faces, &source)?;
    face_references(mesh, &source)?;
    joins(mesh, faces, &source)?;
    for (n, checkpoint) in mesh.checkpoints.iter().enumerate() {
        edge_exists(mesh, faces, checkpoint.at.face.index(), checkpoint.at.edge)
            .map_err(|expected| source.error("c", n, 1, expected))?;
        if let Some(k) = checkpoint.lengths.iter().position(|(_, unit)| *unit as usize >= mesh.units.len()) {
            return Err(source.error("c", n, 3 + 2 * k, among("a yarn unit", mesh.units.len(), "U lines")));
        }
    }
    Ok(())
}

fn counts(mesh: &StitchMesh, faces: usize, source: &Source) -> Result<()> {
    let wanted = |n, what: &str| source.found("f", n, 0, "a face without one", what);
    let without = |key, n, what: &str| source.found(key, n, 0, "one more than there are faces", what);
    let types = "a stitch type (T line) for each face";
    match mesh.face_types.len() {
        n if n < faces => return Err(wanted(n, types)),
        n if n > faces => return Err(without("T", faces, types)),
        _ => {}
    }
    let lines = "a pattern line (N line) for each face or for none";
    match mesh.face_source.len() {
        n if n > 0 && n < faces => Err(wanted(n, lines)),
        n if n > faces => Err(without("N", faces, lines)),
        _ => Ok(()),
    }
}

fn face_references(mesh: &StitchMesh, source: &Source) -> Result<()> {
    let vertices = mesh.positions.len();
    if let Some(at) = mesh.face_vertices.iter().position(|v| v.index() >= vertices) {
        let face = mesh.face_offsets.partition_point(|&begin| begin as usize <= at) - 1;
        let word = 1 + at - mesh.face_offsets[face] as usize;
        return Err(source.error("f", face, word, among("a vertex", vertices, "v lines")));
    }
    for (face, stitch) in mesh.face_types.iter().enumerate() {
        let Some(stitch) = mesh.types.get(stitch.index()) else {
            return Err(source.error("T", face, 1, among("a stitch type", mesh.types.len(), "L lines")));
        };
        let corners = mesh.face(FaceId::from(face)).len();
        if stitch.labels.len() != corners {
            let found = format!("'{}' with {} edges", stitch.key(), stitch.labels.len());
            let expected = format!("a stitch type with {corners} edges, as face {} has", face + 1);
            return Err(source.found("T", face, 1, &found, &expected));
        }
    }
    Ok(())
}

fn joins(mesh: &StitchMesh, faces: usize, source: &Source) -> Result<()> {
    let mut used = vec![false; mesh.face_vertices.len()];
    for (n, join) in mesh.joins.iter().enumerate() {
        for (word, side) in [(1, join.a), (2, join.b)] {
            edge_exists(mesh, faces, side.face.index(), side.edge)
                .map_err(|expected| source.error("e", n, word, expected))?;
            let flat = mesh.face_offsets[side.face.index()] as usize + side.edge as usize;
            if std::mem::replace(&mut used[flat], true) {
                let found = format!("edge {} of face {} again", side.edge + 1, side.face.0 + 1);
                return Err(source.found("e", n, word, &found, "each edge in one e line at most"));
            }
        }
    }
    Ok(())
}

fn edge_exists(mesh: &StitchMesh, faces: usize, face: usize, edge: u32) -> Result<(), String> {
    if face >= faces {
        return Err(among("a face", faces, "f lines"));
    }
    let corners = mesh.face_offsets[face + 1] - mesh.face_offsets[face];
    if edge >= corners { Err(format!("an edge from 1 to {corners} of face {}", face + 1)) } else { Ok(()) }
}

fn among(what: &str, count: usize, lines: &str) -> String {
    match count {
        0 => format!("{what}, but the file has no {lines}"),
        _ => format!("{what} from 1 to {count} ({lines})"),
    }
}

struct Source<'a> {
    path: &'a Path,
    bytes: &'a [u8],
}

impl Source<'_> {
    /// The error that a word (0 = the keyword) of the n-th line of a keyword is not what was expected.
    fn error(&self, keyword: &str, n: usize, word: usize, expected: String) -> Error {
        self.place(keyword, n, word, |found, line, column| {
            Error::input(self.path, line, column, format_args!("'{found}'"), expected)
        })
    }

    /// The same, with its own words for what was found.
    fn found(&self, keyword: &str, n: usize, word: usize, found: &str, expected: &str) -> Error {
        self.place(keyword, n, word, |_, line, column| Error::input(self.path, line, column, found, expected))
    }

    fn place(
        &self,
        keyword: &str,
        n: usize,
        word: usize,
        make: impl FnOnce(&str, usize, usize) -> Error,
    ) -> Error {
        let mut seen = 0;
        for mut line in Lines::new(self.path, self.bytes, true) {
            let mut at = line.word();
            if !matches!(at, Ok(Some(first)) if first.text == keyword) {
                continue;
            }
            if seen == n {
                for _ in 0..word {
                    at = line.word();
                }
                // Every line has been read once, so the word is there.
                let (text, column) = at.ok().flatten().map_or(("", 1), |w| (w.text, w.column));
                return make(text, line.number, column);
            }
            seen += 1;
        }
        make("", 1, 1)
    }
}
