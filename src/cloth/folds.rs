//! Faces that fold upon themselves or their neighbours.

use super::Cloth;
use glam::DVec3;

impl Cloth {
    /// Faces whose front turns by more than a right angle across one of their edges or diagonals, in rising order: folded ones, ones
    /// turned over, and those beside them. Of faces without area nothing is said.
    ///
    /// # Panics
    /// If there are not as many positions as nodes.
    pub fn folded_faces(&self, nodes: &[DVec3]) -> Vec<u32> {
        assert_eq!(nodes.len(), self.node_count(), "a position for each node");
        let normals: Vec<DVec3> = self
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|n| nodes[n as usize]);
                (b - a).cross(c - a).normalize_or_zero()
            })
            .collect();
        // Sides by their ends, with the triangle and whether it runs from the lower end to the higher.
        let mut sides: Vec<([u32; 2], u32, bool)> = Vec::with_capacity(3 * normals.len());
        for (i, t) in self.triangles.iter().enumerate() {
            for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
                sides.push(([a.min(b), a.max(b)], i as u32, a < b));
            }
        }
        sides.sort_unstable();
        let mut folded = Vec::new();
        for beside in sides.chunk_by(|a, b| a.0 == b.0) {
            for (k, (_, one, up)) in beside.iter().enumerate() {
                for (_, other, other_up) in &beside[k + 1..] {
                    let turn = normals[*one as usize].dot(normals[*other as usize]);
                    // Neighbours run along their common side in opposite senses, or one shows its back.
                    let turn = if up == other_up { -turn } else { turn };
                    if turn < -1e-6 {
                        folded.extend([one, other].map(|t| self.triangle_faces[*t as usize]));
                    }
                }
            }
        }
        folded.sort_unstable();
        folded.dedup();
        folded
    }
}
