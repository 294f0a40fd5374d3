//! Faces that fold upon themselves or their neighbours.

use super::Cloth;
use glam::DVec3;

impl Cloth {
    /// Faces whose front turns by more than a right angle across one of their edges, or of quads the diagonal from their first
    /// corner, in rising order: folded ones, ones turned over, and those beside them. Of faces without area nothing is said.
    ///
    /// # Panics
    /// If there are not as many positions as nodes.
    pub fn folded_faces(&self, nodes: &[DVec3]) -> Vec<u32> {
        assert_eq!(nodes.len(), self.node_count(), "a position for each node");
        let cross = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|n| nodes[n as usize]);
            (b - a).cross(c - a)
        };
        let normals: Vec<DVec3> = self.triangles.iter().map(|t| cross(t).normalize_or_zero()).collect();
        // Of whole faces: sums over their triangles, which run one after the other. Triangles of a face of many corners may
        // well overlap, where it bulges inwards.
        let mut wholes = normals.clone();
        let mut begin = 0;
        for face in self.triangle_faces.chunk_by(|a, b| a == b) {
            let triangles = begin..begin + face.len();
            begin = triangles.end;
            let whole =
                self.triangles[triangles.clone()].iter().map(cross).sum::<DVec3>().normalize_or_zero();
            wholes[triangles].fill(whole);
        }
        let face_of = |triangle: usize| self.triangle_faces.get(triangle);
        let quad = |first: usize| {
            let before = first.checked_sub(1).and_then(face_of);
            face_of(first + 2) != face_of(first) && before != face_of(first)
        };
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
                    let faces = [one, other].map(|t| self.triangle_faces[*t as usize]);
                    let of = if faces[0] == faces[1] {
                        if !quad(*one.min(other) as usize) {
                            continue;
                        }
                        &normals
                    } else {
                        &wholes
                    };
                    let turn = of[*one as usize].dot(of[*other as usize]);
                    // Neighbours run along their common side in opposite senses, or one shows its back.
                    let turn = if up == other_up { -turn } else { turn };
                    if turn < -1e-6 {
                        folded.extend(faces);
                    }
                }
            }
        }
        folded.sort_unstable();
        folded.dedup();
        folded
    }
}
