//! Stitch meshes: polygons whose faces are stitches, and how their edges are joined.

pub mod corners;
mod material;

pub use material::MaterialMesh;

use crate::ids::{FaceId, TypeId, VertexId};
use glam::DVec3;

/// A stitch type as a mesh names it: its name and one label per edge (at least three).
///
/// A label is `+` (out), `-` (in) or nothing (undirected), then the edge's type, e.g. `+yX`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StitchType {
    /// The stitch's name, e.g. `knit+`.
    pub name: String,
    /// One label per edge; edge k runs from corner k to corner k + 1.
    pub labels: Vec<String>,
}

impl StitchType {
    /// Name and labels joined by single spaces: what templates are found by.
    pub fn key(&self) -> String {
        let mut key = self.name.clone();
        for label in &self.labels {
            key.push(' ');
            key.push_str(label);
        }
        key
    }
}

/// One edge of one face; edge k runs from the face's corner k to corner k + 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FaceEdge {
    /// The face.
    pub face: FaceId,
    /// The edge within the face, counted from 0.
    pub edge: u32,
}

/// Two edges that the yarn crosses as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Join {
    /// One side.
    pub a: FaceEdge,
    /// The other side.
    pub b: FaceEdge,
    /// The normal case: a's start meets b's end. Otherwise the starts coincide.
    pub flipped: bool,
}

/// A rest length of yarn given by the mesh (`c` lines): after a crossing, so many units follow.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// The edge where the yarn crosses.
    pub at: FaceEdge,
    /// Rank of the crossing on that edge, by fraction along it, then by z; counted from 0.
    pub crossing: u32,
    /// Lengths and the (0-based) unit each is counted in.
    pub lengths: Vec<(f64, u32)>,
}

/// Where in its pattern a stitch comes from, beyond the line, and what it looks like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaceOrigin {
    /// Column of the pattern's line (in bytes, from 1), or column of the chart.
    pub column: u32,
    /// Colour of its yarn: red, green, blue.
    pub colour: Option<[u8; 3]>,
}

/// A unit of yarn length (`U` lines); the first is always `1 1.0`.
#[derive(Clone, Debug, PartialEq)]
pub struct YarnUnit {
    /// The unit's name.
    pub name: String,
    /// Its length in the mesh's units.
    pub length: f64,
}

/// A stitch mesh as read from a file. Faces are stored flat: the corners of face f are
/// `face_vertices[face_offsets[f] .. face_offsets[f + 1]]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StitchMesh {
    /// Vertex positions, world units.
    pub positions: Vec<DVec3>,
    /// `[face + 1]` prefix sums of corner counts.
    pub face_offsets: Vec<u32>,
    /// Corners of all faces, counter-clockwise seen from the front.
    pub face_vertices: Vec<VertexId>,
    /// `[face]` the stitch type.
    pub face_types: Vec<TypeId>,
    /// The stitch types that faces refer to.
    pub types: Vec<StitchType>,
    /// Which edges are joined.
    pub joins: Vec<Join>,
    /// `[face]` source line of the pattern (`N` lines), or empty.
    pub face_source: Vec<u32>,
    /// `[face]` where on that line it stands (comments of `N` lines, ours), or empty.
    pub face_origins: Vec<FaceOrigin>,
    /// Width and height of a plain stitch, world units, where it was made to a gauge (a `# gauge` comment, ours).
    pub gauge: Option<[f64; 2]>,
    /// Yarn length units (`U` lines), or empty.
    pub units: Vec<YarnUnit>,
    /// Rest lengths of yarn (`c` lines).
    pub checkpoints: Vec<Checkpoint>,
    /// Lines that are kept but not interpreted (knitting machine hints: `h o t l I xfer`), verbatim.
    pub hints: Vec<String>,
    /// Kinds of lines that were read over without keeping them (`ci vn vt usemtl mtllib`), with their counts.
    pub ignored: Vec<(String, usize)>,
}

impl StitchMesh {
    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.face_types.len()
    }

    /// The corners of a face.
    pub fn face(&self, face: FaceId) -> &[VertexId] {
        let [begin, end] = [0, 1].map(|k| self.face_offsets[face.index() + k] as usize);
        &self.face_vertices[begin..end]
    }

    /// The stitch type of a face.
    pub fn face_type(&self, face: FaceId) -> &StitchType {
        &self.types[self.face_types[face.index()].index()]
    }
}
