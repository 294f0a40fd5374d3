//! OBJ polygons from a modelling tool, to be turned into a stitch mesh by naming a stitch per material.
//!
//! Read are `v`, `vt`, `f`, `usemtl`, `g` and `o`; other standard keywords are passed over. Faces that
//! share an edge are joined: flipped where they run through it in opposite directions, as neighbours
//! with like orientation do.

mod face;
mod material;
mod stitch;
mod write;

pub use stitch::Resolve;
pub use write::write;

use super::text::{Line, Lines, Word, read_bytes};
use crate::mesh::Join;
use crate::{Error, Result};
use face::Faces;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Polygons of an OBJ file, with what is needed to make stitches of them.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjMesh {
    /// The file, for messages.
    pub path: PathBuf,
    /// Vertex positions, world units.
    pub positions: Vec<DVec3>,
    /// Texture coordinates (u, v).
    pub uvs: Vec<DVec2>,
    /// `[face + 1]` prefix sums of corner counts.
    pub face_offsets: Vec<u32>,
    /// `[corner]` vertex numbers, counted from 0.
    pub face_vertices: Vec<u32>,
    /// `[corner]` numbers into `uvs`, or [`ObjMesh::NO_UV`]; within a face either all or none.
    pub corner_uvs: Vec<u32>,
    /// Names that faces carry. The first is empty: no name.
    pub names: Vec<String>,
    /// `[face]` number into `names`: the material (`usemtl`), else the group (`g`), else the object (`o`).
    pub face_names: Vec<u32>,
    /// `[face]` its line in the file, counted from 1.
    pub face_lines: Vec<u32>,
    /// Which edges are joined.
    pub joins: Vec<Join>,
}

impl ObjMesh {
    /// The corner has no texture coordinate.
    pub const NO_UV: u32 = u32::MAX;

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.face_names.len()
    }

    /// The vertex numbers of a face's corners.
    pub fn face(&self, face: usize) -> &[u32] {
        &self.face_vertices[self.corners(face)]
    }

    /// The name of a face; empty if it has none.
    pub fn face_name(&self, face: usize) -> &str {
        &self.names[self.face_names[face] as usize]
    }

    /// The texture coordinates of a face's corners, if it has any.
    pub fn face_uvs(&self, face: usize) -> Option<Vec<DVec2>> {
        self.corner_uvs[self.corners(face)].iter().map(|&uv| self.uvs.get(uv as usize).copied()).collect()
    }

    fn corners(&self, face: usize) -> std::ops::Range<usize> {
        self.face_offsets[face] as usize..self.face_offsets[face + 1] as usize
    }
}

/// Reads the polygons of an OBJ file.
pub fn read_file(path: &Path) -> Result<ObjMesh> {
    read(path, &read_bytes(path)?)
}

/// Reads the polygons of an OBJ file from memory; `path` is only for messages.
pub fn read(path: &Path, bytes: &[u8]) -> Result<ObjMesh> {
    let mut positions = Vec::new();
    let mut uvs = Vec::new();
    let mut faces = Faces::default();
    let mut names = Names::default();
    let mut lines = Lines::new(path, bytes, true).continued();
    for mut line in lines.by_ref() {
        let Some(keyword) = line.word()? else { continue };
        match keyword.text {
            "v" => positions.push(position(&mut line)?),
            "vt" => {
                let u = line.f64("the texture coordinate u")?;
                let mut rest = [0.0; 2];
                optional_numbers(&mut line, &mut rest, "a number")?;
                uvs.push(DVec2::new(u, rest[0]));
            }
            "f" => faces.add(&mut line, positions.len(), uvs.len(), names.current())?,
            "usemtl" | "g" | "o" => names.set(keyword.text, line.rest()?.text),
            _ => check_keyword(keyword, &line)?,
        }
    }
    if faces.lines.is_empty() {
        let line = lines.number().max(1);
        return Err(Error::input(path, line, 1, "the end of the file", "at least one face (f line)"));
    }
    Ok(ObjMesh {
        path: path.into(),
        positions,
        uvs,
        face_offsets: faces.offsets,
        face_vertices: faces.vertices,
        corner_uvs: faces.uvs,
        names: names.all,
        face_names: faces.names,
        face_lines: faces.lines,
        joins: faces.joins,
    })
}

/// Reads only the vertices of an OBJ file, into `positions` (cleared first).
pub fn read_positions(path: &Path, bytes: &[u8], positions: &mut Vec<DVec3>) -> Result<()> {
    positions.clear();
    for mut line in Lines::new(path, bytes, true).continued() {
        match line.word()? {
            Some(word) if word.text == "v" => positions.push(position(&mut line)?),
            Some(word) if !matches!(word.text, "vt" | "f" | "usemtl" | "g" | "o") => {
                check_keyword(word, &line)?
            }
            _ => {}
        }
    }
    Ok(())
}

/// `x y z`, then perhaps a weight or a colour or both, which are of no use here.
fn position(line: &mut Line) -> Result<DVec3> {
    let x = line.f64("the vertex's x")?;
    let y = line.f64("the vertex's y")?;
    let z = line.f64("the vertex's z")?;
    optional_numbers(line, &mut [0.0; 4], "a weight or colour of the vertex")?;
    Ok(DVec3::new(x, y, z))
}

fn optional_numbers(line: &mut Line, numbers: &mut [f64], expected: &str) -> Result<()> {
    for number in numbers {
        match line.word()? {
            Some(word) => *number = line.parse_f64(word, expected)?,
            None => return Ok(()),
        }
    }
    line.end()
}

/// Keywords of the format that say nothing about polygons or polylines.
pub(super) const OTHER_KEYWORDS: [&str; 35] = [
    "vn",
    "vp",
    "s",
    "mtllib",
    "mg",
    "cstype",
    "deg",
    "bmat",
    "step",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "maplib",
    "usemap",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "call",
    "csh",
    "bsp",
    "bzp",
    "cdc",
    "cdp",
];

fn check_keyword(keyword: Word, line: &Line) -> Result<()> {
    if OTHER_KEYWORDS.contains(&keyword.text) || ["l", "p"].contains(&keyword.text) {
        Ok(())
    } else {
        Err(line.unexpected(keyword, "a keyword of the OBJ format such as v, vt, f, usemtl, g or o"))
    }
}

/// The material, group and object in force.
struct Names {
    all: Vec<String>,
    numbers: HashMap<String, u32>,
    /// Of `usemtl`, `g` and `o`; 0 = none.
    in_force: [u32; 3],
}

impl Default for Names {
    fn default() -> Self {
        Self { all: vec![String::new()], numbers: HashMap::from([(String::new(), 0)]), in_force: [0; 3] }
    }
}

impl Names {
    fn set(&mut self, keyword: &str, name: &str) {
        let number = *self.numbers.entry(name.to_owned()).or_insert_with(|| {
            self.all.push(name.to_owned());
            (self.all.len() - 1) as u32
        });
        let kind = ["usemtl", "g", "o"].iter().position(|k| *k == keyword).unwrap_or(0);
        self.in_force[kind] = number;
    }

    fn current(&self) -> u32 {
        self.in_force.into_iter().find(|&n| n != 0).unwrap_or(0)
    }
}
