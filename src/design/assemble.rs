//! A fabric becomes a stitch mesh: corners that are one place are one vertex.

use super::fabric::Fabric;
use super::syntax::Edge;
use crate::ids::{FaceId, TypeId, VertexId};
use crate::mesh::{FaceOrigin, Join, StitchMesh};
use glam::DVec3;

/// Corners of faces and the vertices they are.
pub struct Corners {
    /// `[face + 1]` first corner of each face.
    pub offsets: Vec<u32>,
    /// `[corner]` its vertex.
    pub vertices: Vec<u32>,
    /// Number of vertices.
    pub count: usize,
    /// `[corner]` the edge that begins there is joined to the one that begins at this corner; `u32::MAX` of none.
    pub across: Vec<u32>,
}

impl Corners {
    /// Joined edges share both vertices.
    pub fn new(fabric: &Fabric) -> Self {
        let mut offsets = Vec::with_capacity(fabric.faces.len() + 1);
        let mut total = 0u32;
        offsets.push(0);
        for face in &fabric.faces {
            total += face.corners() as u32;
            offsets.push(total);
        }
        let mut parent: Vec<u32> = (0..total).collect();
        let mut across = vec![u32::MAX; total as usize];
        let corner = |face: u32, k: u32| {
            let n = fabric.faces[face as usize].corners() as u32;
            offsets[face as usize] + k % n
        };
        for [a, b] in &fabric.joins {
            let [a0, b0] = [a, b].map(|e| corner(e.face.0, e.edge));
            let [a1, b1] = [a, b].map(|e| corner(e.face.0, e.edge + 1));
            unite(&mut parent, a0, b1);
            unite(&mut parent, a1, b0);
            across[a0 as usize] = b0;
            across[b0 as usize] = a0;
        }
        // Borders one above the other touch where the rows between them do.
        for side in [Edge::Right, Edge::Left] {
            let turns: Vec<u32> = fabric.turns.iter().filter(|t| t.2 == side).map(|t| t.0).collect();
            let ([inner_top, outer_top], [inner_bottom, outer_bottom]) = match side {
                Edge::Right => ([3, 2], [0, 1]),
                Edge::Left => ([3, 4], [1, 0]),
            };
            for pair in turns.windows(2) {
                let (below, above) = (corner(pair[0], inner_top), corner(pair[1], inner_bottom));
                if find(&mut parent, below) == find(&mut parent, above) {
                    unite(&mut parent, corner(pair[0], outer_top), corner(pair[1], outer_bottom));
                }
            }
        }
        let mut vertices = vec![u32::MAX; total as usize];
        let mut count = 0;
        for corner in 0..total {
            let root = find(&mut parent, corner) as usize;
            if vertices[root] == u32::MAX {
                vertices[root] = count;
                count += 1;
            }
            vertices[corner as usize] = vertices[root];
        }
        Self { offsets, vertices, count: count as usize, across }
    }

    /// Vertices of a face.
    pub fn face(&self, face: usize) -> &[u32] {
        &self.vertices[self.offsets[face] as usize..self.offsets[face + 1] as usize]
    }

    /// The face that a corner belongs to.
    pub fn face_of(&self, corner: u32) -> usize {
        self.offsets.partition_point(|&first| first <= corner) - 1
    }
}

fn find(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

fn unite(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parent, a), find(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

/// The mesh of a fabric whose vertices lie at `positions`.
pub fn stitch_mesh(fabric: &Fabric, corners: &Corners, positions: Vec<DVec3>) -> StitchMesh {
    let join = |[a, b]: &[crate::mesh::FaceEdge; 2]| Join { a: *a, b: *b, flipped: true };
    let plain = fabric.faces.iter().all(|f| f.colour == 0);
    let origin = |face: &super::fabric::Face| FaceOrigin {
        column: face.place.column,
        colour: (!plain).then(|| fabric.colours[usize::from(face.colour)]),
    };
    StitchMesh {
        positions,
        face_offsets: corners.offsets.clone(),
        face_vertices: corners.vertices.iter().map(|&v| VertexId(v)).collect(),
        face_types: fabric.faces.iter().map(|f| TypeId(f.stitch)).collect(),
        types: fabric.types.clone(),
        joins: fabric.joins.iter().map(join).collect(),
        face_source: fabric.faces.iter().map(|f| f.place.line).collect(),
        face_origins: fabric.faces.iter().map(origin).collect(),
        ..StitchMesh::default()
    }
}

/// Loop edges that are joined to nothing, though a loop crosses them: none, if every stitch is held.
pub fn loose_loops(fabric: &Fabric, corners: &Corners) -> Vec<(FaceId, u32)> {
    let mut loose = Vec::new();
    for (number, face) in fabric.faces.iter().enumerate() {
        let stitch = &fabric.types[face.stitch as usize];
        let first = corners.offsets[number] as usize;
        for (k, label) in stitch.labels.iter().enumerate() {
            // Cast-on loops begin in their own row.
            let begins = stitch.name.starts_with("tuck-twist") && k == 0;
            if label.len() > 1
                && label[1..].starts_with('l')
                && !begins
                && corners.across[first + k] == u32::MAX
            {
                loose.push((FaceId::from(number), k as u32));
            }
        }
    }
    loose
}
