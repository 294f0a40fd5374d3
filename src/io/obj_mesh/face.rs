//! Faces of an OBJ file and which of their edges meet.

use super::ObjMesh;
use crate::ids::FaceId;
use crate::io::text::{Line, Word};
use crate::mesh::{FaceEdge, Join};
use crate::{Error, Result};
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// The faces so far, flat.
pub(super) struct Faces {
    pub(super) offsets: Vec<u32>,
    pub(super) vertices: Vec<u32>,
    pub(super) uvs: Vec<u32>,
    pub(super) names: Vec<u32>,
    pub(super) lines: Vec<u32>,
    pub(super) joins: Vec<Join>,
    /// By lower and higher vertex: the first face there, its start vertex, and whether a second came.
    edges: HashMap<(u32, u32), (FaceEdge, u32, bool)>,
    /// Line and column of each corner of the face being read.
    places: Vec<(usize, usize)>,
}

impl Default for Faces {
    fn default() -> Self {
        Self {
            offsets: vec![0],
            vertices: Vec::new(),
            uvs: Vec::new(),
            names: Vec::new(),
            lines: Vec::new(),
            joins: Vec::new(),
            edges: HashMap::new(),
            places: Vec::new(),
        }
    }
}

impl Faces {
    /// Reads the rest of an `f` line.
    pub(super) fn add(&mut self, line: &mut Line, vertices: usize, uvs: usize, name: u32) -> Result<()> {
        let first_line = line.number;
        let begin = self.vertices.len();
        self.places.clear();
        while let Some(word) = line.word()? {
            let (vertex, uv) = corner(line, word, vertices, uvs)?;
            if self.vertices.len() > begin && (self.uvs[begin] == ObjMesh::NO_UV) != (uv == ObjMesh::NO_UV) {
                let expected = "texture coordinates at all corners of a face or at none";
                return Err(line.unexpected(word, expected));
            }
            self.places.push((line.number, word.column));
            self.vertices.push(vertex);
            self.uvs.push(uv);
        }
        if self.vertices.len() < begin + 3 {
            line.expect_word("a face with at least three vertices")?;
        }
        let Ok(end) = u32::try_from(self.vertices.len()) else {
            return Err(line.error(1, "one face too many", "fewer than 2^32 corners"));
        };
        self.join(line, begin)?;
        self.offsets.push(end);
        self.names.push(name);
        self.lines.push(u32::try_from(first_line).unwrap_or(u32::MAX));
        Ok(())
    }

    /// Joins the edges of the last face to those of earlier faces (or its own: one stitch may close a ring).
    fn join(&mut self, line: &Line, begin: usize) -> Result<()> {
        let count = self.vertices.len() - begin;
        for edge in 0..count {
            let start = self.vertices[begin + edge];
            let end = self.vertices[begin + (edge + 1) % count];
            if start == end {
                continue;
            }
            let b = FaceEdge { face: FaceId::from(self.names.len()), edge: edge as u32 };
            match self.edges.entry((start.min(end), start.max(end))) {
                Entry::Vacant(place) => {
                    place.insert((b, start, false));
                }
                Entry::Occupied(mut place) => {
                    let (a, a_start, joined) = place.get_mut();
                    if std::mem::replace(joined, true) {
                        let found = format_args!(
                            "a third face on the edge of vertices {} and {}",
                            start + 1,
                            end + 1
                        );
                        let (number, column) = self.places[edge];
                        return Err(Error::input(
                            line.path(),
                            number,
                            column,
                            found,
                            "at most two faces on an edge",
                        ));
                    }
                    self.joins.push(Join { a: *a, b, flipped: *a_start != start });
                }
            }
        }
        Ok(())
    }
}

/// `i`, `i/t`, `i//n` or `i/t/n`: the vertex and the texture coordinate.
fn corner(line: &Line, word: Word, vertices: usize, uvs: usize) -> Result<(u32, u32)> {
    let mut parts = word.text.split('/');
    let vertex = index(line, word, parts.next().unwrap_or(""), vertices, "vertex")?;
    let uv = match parts.next() {
        None => return Ok((vertex, ObjMesh::NO_UV)),
        Some(text) => text,
    };
    let normal = parts.next();
    let normal_is_number = normal.is_none_or(|n| n.parse::<i64>().is_ok());
    if parts.next().is_some() || !normal_is_number || (uv.is_empty() && normal.is_none()) {
        return Err(line.unexpected(word, "a corner as i, i/t, i//n or i/t/n"));
    }
    let uv = if uv.is_empty() { ObjMesh::NO_UV } else { index(line, word, uv, uvs, "texture coordinate")? };
    Ok((vertex, uv))
}

/// A number counted from 1, or from the end if negative, as one counted from 0.
fn index(line: &Line, word: Word, text: &str, count: usize, what: &str) -> Result<u32> {
    let n = text
        .parse::<i64>()
        .ok()
        .and_then(|n| if n < 0 { n.checked_add(count as i64) } else { n.checked_sub(1) });
    match n.map(u32::try_from) {
        Some(Ok(n)) if (n as usize) < count => Ok(n),
        _ if count == 0 => {
            Err(line.unexpected(word, &format!("a {what}, but none is defined before this line")))
        }
        _ => {
            let expected =
                format!("a {what} from 1 to {count}, or from -1 to -{count}, defined before this line");
            Err(line.unexpected(word, &expected))
        }
    }
}
