//! What CPU and shaders share of fabrics: structs (`shaders/fabric_*.wgsl`) and constants. `tests/database_layout.rs` holds
//! them against the shaders, without a GPU.

use super::super::{shell, skip, strain, surface};
use bytemuck::{Pod, Zeroable};

/// What the kernels are told; see `shaders/fabric_settings.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FabricSettings {
    /// Number of the mesh's vertices.
    pub vertices: u32,
    /// Number of its faces.
    pub faces: u32,
    /// Number of nodes.
    pub nodes: u32,
    /// Number of yarn vertices.
    pub homes: u32,
    /// Faces around a node at most.
    pub most_shares: u32,
    /// Vertices of a fit at most.
    pub most_fits: u32,
    /// Whether bending is taken account of.
    pub bends: u32,
    /// Share of Phong deformation.
    pub phong: f32,
    /// Lower bound of eigenvalues.
    pub least: f32,
    /// Nodes along sx.
    pub axis_sx: u32,
    /// Nodes along sa.
    pub axis_sa: u32,
    /// Nodes along sy.
    pub axis_sy: u32,
    /// Where among the words of the pattern, in fours, its rows begin.
    pub first_row: u32,
    /// Where its displacements begin.
    pub first_value: u32,
    /// Displacements of a pattern's vertex.
    pub table_nodes: u32,
    /// From a node to the next along sa, 0 where there is but one.
    pub table_sa: u32,
    /// From a node to the next along sy, 0 where there is but one.
    pub table_sy: u32,
    /// Whether the output holds the frame before.
    pub continued: u32,
    /// Whether what did not move is left alone.
    pub unmoved: u32,
    /// Whether what has the strain of its last look-up is only lifted.
    pub rigid: u32,
    /// How far components of first fundamental forms of one strain are apart.
    pub within_first: f32,
    /// How far those of twice the second are.
    pub within_second: f32,
    /// Whether some faces are hidden.
    pub hides: u32,
}

/// What of a face does not change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FabricFace {
    /// Its vertices.
    pub vertices: [u32; 3],
    /// Nodes of its corners.
    pub nodes: [u32; 3],
    /// Rows of the inverse of the material edges.
    pub inverse: [f32; 4],
    /// Material edges 0-1, 1-2 and 2-0.
    pub edges: [f32; 6],
}

/// A node's vertex, and where begins what it takes of others; each ends where the next node's begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Node {
    /// The vertex.
    pub vertex: u32,
    /// Among shares: faces of its normal.
    pub normal: u32,
    /// Among shares: faces of its strain.
    pub strain: u32,
    /// Among fits: vertices of its second fundamental form.
    pub fit: u32,
}

/// What a node takes of a face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Share {
    /// The face.
    pub face: u32,
    /// How much.
    pub weight: f32,
}

/// What a node's second fundamental form takes of a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Fit {
    /// The vertex.
    pub vertex: u32,
    /// For uu.
    pub uu: f32,
    /// For uv.
    pub uv: f32,
    /// For vv.
    pub vv: f32,
}

/// Normal, gradient and first fundamental form of a face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FaceForm {
    /// Unit normal, or zero.
    pub normal: [f32; 3],
    /// What becomes of u.
    pub u: [f32; 3],
    /// What becomes of v.
    pub v: [f32; 3],
    /// uu, uv, vv.
    pub first: [f32; 3],
}

/// The same of a node, with the second fundamental form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct NodeForm {
    /// Unit normal, or zero.
    pub normal: [f32; 3],
    /// What becomes of u.
    pub u: [f32; 3],
    /// What becomes of v.
    pub v: [f32; 3],
    /// uu, uv, vv.
    pub first: [f32; 3],
    /// uu, uv, vv.
    pub second: [f32; 3],
}

/// What yarn needs to know of a face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FaceFrame {
    /// Places.
    pub place: [[f32; 4]; 3],
    /// What Phong deformation adds.
    pub phong: [[f32; 4]; 3],
    /// Normals.
    pub normal: [[f32; 4]; 3],
    /// First fundamental forms.
    pub first: [[f32; 4]; 3],
    /// Twice the second.
    pub second: [[f32; 4]; 3],
}

/// What lies across an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Step {
    /// The face, or `NONE`.
    pub face: u32,
    /// Its corners, two bits each.
    pub corners: u32,
    /// Barycentric coordinates there of the corner that the edge does not touch.
    pub opposite: [f32; 3],
}

/// What of a face displacements need to know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FaceMap {
    /// Rows of the inverse of the material edges.
    pub inverse: [f32; 4],
    /// What lies across its edges.
    pub steps: [Step; 3],
}

/// A yarn vertex at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Home {
    /// The face that it lies in.
    pub face: u32,
    /// Row of the pattern.
    pub row: u32,
    /// Its number among the yarns' points.
    pub point: u32,
    /// Barycentric coordinate of the face's corner 1.
    pub b: f32,
    /// Of corner 2.
    pub c: f32,
}

/// Where it lies on the mesh, displaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Place {
    /// The face; the highest bit says that the strain lies outside the table.
    pub face: u32,
    /// Barycentric coordinate of the face's corner 1.
    pub b: f32,
    /// Of corner 2.
    pub c: f32,
    /// Height over it, metres.
    pub height: f32,
}

/// A point of a yarn, relative to the origin, metres, and its twist, radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct YarnPoint {
    /// Place.
    pub x: f32,
    /// Place.
    pub y: f32,
    /// Place.
    pub z: f32,
    /// Twist of the edge that leaves it.
    pub twist: f32,
}

/// Bytes of the device for each yarn vertex.
pub const BYTES_OF_A_YARN_VERTEX: usize = size_of::<Home>() + size_of::<Place>() + size_of::<YarnPoint>();

const _: () = assert!(BYTES_OF_A_YARN_VERTEX <= 64);

/// The constants that both sides use.
pub fn constants() -> String {
    // Shortest digits that read back as the same f32.
    let mut text = format!("const MOST: f32 = {:e}f;\n", strain::MOST as f32);
    for (name, value) in [
        ("STRAIN", u32::from(skip::STRAIN)),
        ("FRAME", u32::from(skip::FRAME)),
        ("HIDDEN", u32::from(skip::HIDDEN)),
        ("NONE", surface::NONE),
        ("MOST_CROSSED", shell::MOST_CROSSED as u32),
    ] {
        text += &format!("const {name}: u32 = {value}u;\n");
    }
    text
}
