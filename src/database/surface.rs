//! What of a triangle mesh does not change: material coordinates of faces, and what lies across their edges.

use crate::mesh::MaterialMesh;
use glam::{DVec2, IVec2};
use std::collections::HashMap;

/// No face lies across.
pub const NONE: u32 = u32::MAX;
/// Seams whose sides differ in length by more than this share are borders.
const SEAM_STRETCH: f64 = 0.01;
/// Seams are translations, and by whole periods, to within this share of an edge, or of a period.
const SEAM_SLACK: f64 = 1e-3;

/// A mesh with its material coordinates face by face.
#[derive(Clone, Debug)]
pub struct Surface {
    /// `[face]` world vertices.
    pub faces: Vec<[u32; 3]>,
    /// `[face]` material vertices.
    pub face_uvs: Vec<[u32; 3]>,
    /// `[face]` material coordinates of its corners, metres.
    pub corners: Vec<[DVec2; 3]>,
    /// `[face]` rows of the inverse of the matrix of material edges 0-1 and 0-2; zero where they span nothing. Times a place
    /// relative to corner 0 it gives the barycentric coordinates of corners 1 and 2.
    pub inverses: Vec<[DVec2; 2]>,
    /// `[face][edge]` edge k runs from corner k to the next.
    pub across: Vec<[Across; 3]>,
    /// `[face]` the piece of the flattened fabric that it belongs to: faces of a piece hang together in u and v.
    pub charts: Vec<u32>,
}

/// What lies across an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Across {
    /// The face, or [`NONE`].
    pub face: u32,
    /// Which of its corners is this edge's first, its second, and neither.
    pub corners: [u8; 3],
    /// Barycentric coordinates, there and in that order, of the corner here that the edge does not touch.
    pub opposite: [f64; 3],
    /// Whether u and v go on as they are.
    pub continuous: bool,
    /// What is to be added to material coordinates here to have those there, where that is a translation.
    pub shift: Option<DVec2>,
}

const BORDER: Across =
    Across { face: NONE, corners: [0, 1, 2], opposite: [0.0; 3], continuous: false, shift: None };

impl Surface {
    /// Takes a mesh in; it must have been checked.
    pub fn new(mesh: &MaterialMesh) -> Self {
        let corners: Vec<[DVec2; 3]> =
            mesh.face_uvs.iter().map(|uvs| uvs.map(|uv| mesh.uvs[uv as usize])).collect();
        let inverses = corners.iter().map(inverse).collect();
        let mut surface = Self {
            faces: mesh.faces.clone(),
            face_uvs: mesh.face_uvs.clone(),
            across: vec![[BORDER; 3]; corners.len()],
            charts: Vec::new(),
            corners,
            inverses,
        };
        surface.join();
        surface.charts = surface.find_charts();
        surface
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Barycentric coordinates of a place in a face.
    pub fn barycentric(&self, face: usize, uv: DVec2) -> [f64; 3] {
        let [first, second] = self.inverses[face];
        let p = uv - self.corners[face][0];
        let (b, c) = (first.dot(p), second.dot(p));
        [1.0 - b - c, b, c]
    }

    /// Whether a face spans an area of the fabric.
    pub fn spans(&self, face: usize) -> bool {
        self.inverses[face] != [DVec2::ZERO; 2]
    }

    /// Whole periods by which a place moves as it crosses an edge, where the pattern goes on across.
    pub fn periods(across: &Across, size: DVec2) -> Option<IVec2> {
        let shift = across.shift.filter(|_| across.face != NONE)? / size;
        let whole = shift.round();
        ((shift - whole).abs().max_element() <= SEAM_SLACK && whole.abs().max_element() < 1e9)
            .then(|| whole.as_ivec2())
    }

    /// Finds what lies across each edge of exactly two faces.
    fn join(&mut self) {
        let mut sides: HashMap<[u32; 2], [u32; 3]> = HashMap::with_capacity(self.faces.len() * 3 / 2);
        for (face, corners) in self.faces.iter().enumerate().filter(|(f, _)| self.spans(*f)) {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                if a == b {
                    continue;
                }
                // How many faces there are, and the first two, as 3 face + edge.
                let side = sides.entry([a.min(b), a.max(b)]).or_default();
                if side[0] < 2 {
                    side[1 + side[0] as usize] = (3 * face + k) as u32;
                }
                side[0] += 1;
            }
        }
        let pairs: Vec<[u32; 2]> = sides.values().filter(|s| s[0] == 2).map(|s| [s[1], s[2]]).collect();
        for [one, other] in pairs {
            for (here, there) in [(one, other), (other, one)] {
                let (face, k) = (here as usize / 3, here as usize % 3);
                self.across[face][k] = self.look_across(face, k, there as usize / 3, there as usize % 3);
            }
        }
    }

    fn look_across(&self, face: usize, k: usize, there: usize, edge: usize) -> Across {
        // Neighbours of like orientation run through the edge in opposite directions.
        let opposed = self.faces[there][edge] == self.faces[face][(k + 1) % 3];
        let (first, second) = if opposed { ((edge + 1) % 3, edge) } else { (edge, (edge + 1) % 3) };
        let third = 3 - first - second;
        let (mine, theirs) = (&self.corners[face], &self.corners[there]);
        let (a, b, c) = (mine[k], mine[(k + 1) % 3], mine[(k + 2) % 3]);
        let (from, to) = (b - a, theirs[second] - theirs[first]);
        let ratio = to.length() / from.length();
        if !(1.0 / (1.0 + SEAM_STRETCH)..=1.0 + SEAM_STRETCH).contains(&ratio) {
            return BORDER;
        }
        // The similarity that lays this side of the seam onto the other, as a complex number.
        let turn = DVec2::new(to.dot(from), from.perp_dot(to)) / from.length_squared();
        let place = theirs[first] + turn.rotate(c - a);
        let all = self.barycentric(there, place);
        let opposite = [all[first], all[second], all[third]];
        // Beyond the edge it must lie, else the fabric is folded over or mirrored here.
        if opposite[2].is_nan() || opposite[2] >= -1e-9 {
            return BORDER;
        }
        let shift = theirs[first] - a;
        let slack = (theirs[second] - b - shift).length();
        let translation = slack <= SEAM_SLACK * from.length();
        let (mine, theirs) = (&self.face_uvs[face], &self.face_uvs[there]);
        Across {
            face: there as u32,
            corners: [first as u8, second as u8, third as u8],
            opposite,
            continuous: mine[k] == theirs[first] && mine[(k + 1) % 3] == theirs[second],
            shift: translation.then_some(shift),
        }
    }

    fn find_charts(&self) -> Vec<u32> {
        let mut charts = vec![NONE; self.faces.len()];
        let (mut count, mut waiting) = (0, Vec::new());
        for face in 0..self.faces.len() {
            if charts[face] != NONE {
                continue;
            }
            charts[face] = count;
            waiting.push(face);
            while let Some(face) = waiting.pop() {
                for across in self.across[face].iter().filter(|a| a.continuous) {
                    if charts[across.face as usize] == NONE {
                        charts[across.face as usize] = count;
                        waiting.push(across.face as usize);
                    }
                }
            }
            count += 1;
        }
        charts
    }
}

fn inverse(corners: &[DVec2; 3]) -> [DVec2; 2] {
    let (a, b) = (corners[1] - corners[0], corners[2] - corners[0]);
    let area = a.perp_dot(b);
    // Slivers have no frame: numbers would be noise.
    if area.is_nan() || area.abs() <= 1e-9 * a.length_squared().max(b.length_squared()) || area == 0.0 {
        return [DVec2::ZERO; 2];
    }
    [DVec2::new(b.y, -b.x) / area, DVec2::new(-a.y, a.x) / area]
}
