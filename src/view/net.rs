//! The fabric as a net of places: what comes along when one of them is pulled.

use super::state::Pull;
use crate::mesh::StitchMesh;
use crate::mesh::corners::CornerGroups;
use glam::DVec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Which places of a fabric are side by side.
#[derive(Clone, Debug, Default)]
pub struct Net {
    node_of_vertex: Vec<u32>,
    /// `[node + 1]` prefix sums over `beside`, and over `vertices`.
    offsets: Vec<u32>,
    beside: Vec<u32>,
    firsts: Vec<u32>,
    vertices: Vec<u32>,
}

/// What comes along with a pulled vertex: vertices with the share of its way that they go.
pub type Along = Vec<(u32, f64)>;

impl Net {
    /// The net of a mesh: corners that are one place of it, and its edges.
    pub fn new(mesh: &StitchMesh) -> Self {
        let groups = CornerGroups::new(mesh);
        let mut edges: Vec<[u32; 2]> = (0..mesh.face_count())
            .flat_map(|face| {
                let corners = mesh.face(face.into());
                let ends = move |k: usize| [corners[k], corners[(k + 1) % corners.len()]];
                (0..corners.len()).map(move |k| ends(k).map(|v| v.index()))
            })
            .map(|[a, b]| [groups.of_vertex[a], groups.of_vertex[b]])
            .filter(|[a, b]| a != b)
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        let both = edges.iter().flat_map(|[a, b]| [(*a, *b), (*b, *a)]);
        let (offsets, beside) = grouped(groups.len(), both);
        let of_node = groups.of_vertex.iter().enumerate().map(|(v, n)| (*n, v as u32));
        let (firsts, vertices) = grouped(groups.len(), of_node);
        Self { node_of_vertex: groups.of_vertex, offsets, beside, firsts, vertices }
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.node_of_vertex.len()
    }

    /// What comes along: near vertices all of the way, those at `reach` (along the fabric) and beyond none of it.
    pub fn along(&self, positions: &[DVec3], pull: &Pull) -> Along {
        let Some(first) = self.node_of_vertex.get(pull.vertex as usize) else { return Vec::new() };
        let place = |node: u32| {
            let vertex = self.vertices.get(self.firsts[node as usize] as usize);
            vertex.map_or(DVec3::NAN, |v| positions[*v as usize])
        };
        let mut along = Vec::new();
        let mut done = std::collections::HashSet::new();
        // Distances are not negative, so their bits are in their order.
        let mut ahead = BinaryHeap::from([Reverse((0u64, *first))]);
        while let Some(Reverse((bits, node))) = ahead.pop() {
            if !done.insert(node) {
                continue;
            }
            let far = f64::from_bits(bits);
            let share = 1.0 - (far / pull.reach.max(f64::MIN_POSITIVE)).powi(2);
            let own = self.firsts[node as usize] as usize..self.firsts[node as usize + 1] as usize;
            along.extend(self.vertices[own].iter().map(|v| (*v, share * share)));
            let sides = self.offsets[node as usize] as usize..self.offsets[node as usize + 1] as usize;
            for next in &self.beside[sides] {
                let there = far + place(node).distance(place(*next));
                if there < pull.reach && !done.contains(next) {
                    ahead.push(Reverse((there.to_bits(), *next)));
                }
            }
        }
        along
    }
}

/// Pairs sorted by their first: prefix sums and seconds.
fn grouped(count: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> (Vec<u32>, Vec<u32>) {
    let mut offsets = vec![0; count + 1];
    pairs.clone().for_each(|(a, _)| offsets[a as usize + 1] += 1);
    for k in 0..count {
        offsets[k + 1] += offsets[k];
    }
    let mut next = offsets.clone();
    let mut items = vec![0; offsets[count] as usize];
    for (a, b) in pairs {
        items[next[a as usize] as usize] = b;
        next[a as usize] += 1;
    }
    (offsets, items)
}
