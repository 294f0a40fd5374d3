//! Ribs fold: side by side, fronts come forward and backs go back, which is how a rib gets narrow.
//!
//! Cloth is flat there (its natural sizes are of ribs as they are seen), so yarn that follows it would be squeezed sideways. What is
//! squeezed is given height instead: [`Ribs::fold`] stands between cloth and yarn, frame by frame. A rib that is stretched to its
//! stitches' width is flat again.

use super::natural::Front;
use crate::mesh::StitchMesh;
use crate::mesh::corners::CornerGroups;
use crate::template::TemplateLibrary;
use glam::DVec3;

/// How much of the height that would keep a stitch's width. At 0.6, next to no yarn of a 2x2 rib at its natural size is nearer than r
/// to other yarn (one sample in 10,000; without height one in 15: `benches/ribs.rs`); at 1 it is crowded inside the fold, and the rib is
/// too thick.
const SHARE: f64 = 0.6;

/// The ribs of a mesh: where wales of knits lie beside wales of purls, two or more of them at a time. (Of single wales, each side is
/// a border: there is nothing between to rise.)
#[derive(Clone, Debug, Default)]
pub struct Ribs {
    share: f64,
    /// Places that rise or fall.
    crests: Vec<Crest>,
    /// Vertices at crests, one after the other.
    vertices: Vec<u32>,
    /// Edges that lead there, one after the other.
    edges: Vec<Edge>,
    /// Faces around crests, one after the other, as runs of `corners`.
    faces: Vec<[u32; 2]>,
    corners: Vec<u32>,
}

/// A place between two wales of a kind, one of which lies beside the other kind: ends of its runs.
#[derive(Clone, Copy, Debug)]
struct Crest {
    vertices: u32,
    edges: u32,
    faces: u32,
}

/// The course edge of a stitch between a border of kinds and a crest.
#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [u32; 2],
    /// World units, at rest.
    length: f64,
    /// 1 of knits, -1 of purls.
    side: f64,
}

impl Ribs {
    /// Finds the ribs of a mesh whose plain stitches are `width` wide (world units). Stitches that the library lacks take no part.
    pub fn new(mesh: &StitchMesh, library: &TemplateLibrary, width: f64) -> Self {
        let groups = CornerGroups::new(mesh);
        let kinds: Vec<Kind> = mesh.types.iter().map(|t| Kind::new(&t.name, &t.labels)).collect();
        let kind = |face: usize| &kinds[mesh.face_types[face].index()];
        let group = |face: usize, corner: usize| {
            let corners = mesh.face(face.into());
            groups.of_vertex[corners[corner % corners.len()].index()]
        };
        // Sides of wales, by their ends: who lies there.
        let mut sides: Vec<([u32; 2], Front)> = Vec::new();
        for face in (0..mesh.face_count()).filter(|f| kind(*f).front != Front::Neutral) {
            for edge in kind(face).edges('y') {
                let [a, b] = [edge, edge + 1].map(|k| group(face, k));
                sides.push(([a.min(b), a.max(b)], kind(face).front));
            }
        }
        sides.sort_unstable_by_key(|(ends, _)| *ends);
        let (mut border, mut between) = (vec![false; groups.len()], vec![false; groups.len()]);
        for beside in sides.chunk_by(|a, b| a.0 == b.0) {
            if beside.len() > 1 {
                let differ = beside.iter().any(|(_, front)| front.differs(beside[0].1));
                let of = if differ { &mut border } else { &mut between };
                beside[0].0.iter().for_each(|group| of[*group as usize] = true);
            }
        }
        let templates: Vec<_> = mesh.types.iter().map(|t| library.find(t)).collect();
        let mut edges: Vec<(u32, Edge)> = Vec::new();
        for face in (0..mesh.face_count()).filter(|f| kind(*f).front != Front::Neutral) {
            let Some((id, turn)) = templates[mesh.face_types[face].index()] else { continue };
            let outline = &library.get(id).corners;
            let n = outline.len();
            for edge in kind(face).edges('l') {
                let at = |k: usize| outline[(edge + k + n - turn) % n];
                let length = width * at(0).distance(at(1));
                let side = if kind(face).front == Front::Knit { 1.0 } else { -1.0 };
                let corners = mesh.face(face.into());
                let ends = [edge, edge + 1].map(|k| corners[k % corners.len()].0);
                for [low, high] in [[0, 1], [1, 0]] {
                    let [from, to] = [low, high].map(|k| group(face, edge + k));
                    if border[from as usize] && between[to as usize] && !border[to as usize] {
                        edges.push((to, Edge { ends, length, side }));
                    }
                }
            }
        }
        edges.sort_by_key(|(crest, _)| *crest);
        let mut at: Vec<Vec<u32>> = vec![Vec::new(); groups.len()];
        for (vertex, group) in groups.of_vertex.iter().enumerate() {
            at[*group as usize].push(vertex as u32);
        }
        let mut ribs = Self { share: SHARE, ..Self::default() };
        for edges in edges.chunk_by(|a, b| a.0 == b.0) {
            let crest = edges[0].0 as usize;
            ribs.edges.extend(edges.iter().map(|(_, edge)| *edge));
            ribs.vertices.extend(&at[crest]);
            for face in &groups.faces[groups.offsets[crest] as usize..groups.offsets[crest + 1] as usize] {
                let begin = ribs.corners.len() as u32;
                ribs.corners.extend(mesh.face((*face as usize).into()).iter().map(|v| v.0));
                ribs.faces.push([begin, ribs.corners.len() as u32]);
            }
            let [vertices, edges, faces] =
                [ribs.vertices.len(), ribs.edges.len(), ribs.faces.len()].map(|n| n as u32);
            ribs.crests.push(Crest { vertices, edges, faces });
        }
        ribs
    }

    /// Another share of the height that would keep a stitch's width; 0.6 unless given.
    pub fn with_share(self, share: f64) -> Self {
        Self { share, ..self }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.crests.is_empty()
    }

    /// Gives height to what is squeezed, in place; `positions` are those of the mesh's vertices, lying flat.
    ///
    /// # Panics
    /// If there are fewer positions than vertices.
    pub fn fold(&self, positions: &mut [DVec3]) {
        let at = |vertex: u32| positions[vertex as usize];
        let normal = |corners: &[u32]| -> DVec3 {
            let first = at(corners[0]);
            corners[1..].windows(2).map(|w| (at(w[0]) - first).cross(at(w[1]) - first)).sum()
        };
        let mut moves: Vec<DVec3> = Vec::with_capacity(self.crests.len());
        let (mut edge, mut face) = (0, 0);
        for crest in &self.crests {
            let edges = &self.edges[edge..crest.edges as usize];
            let faces = &self.faces[face..crest.faces as usize];
            (edge, face) = (crest.edges as usize, crest.faces as usize);
            let rise = |e: &Edge| {
                let [a, b] = e.ends.map(at);
                e.side * (e.length.powi(2) - a.distance_squared(b)).max(0.0).sqrt()
            };
            let height = self.share * edges.iter().map(rise).sum::<f64>() / edges.len() as f64;
            let up: DVec3 = faces.iter().map(|[a, b]| normal(&self.corners[*a as usize..*b as usize])).sum();
            moves.push(up.normalize_or_zero() * height);
        }
        let mut begin = 0;
        for (crest, by) in self.crests.iter().zip(moves) {
            for vertex in &self.vertices[begin..crest.vertices as usize] {
                positions[*vertex as usize] += by;
            }
            begin = crest.vertices as usize;
        }
    }
}

/// What of a stitch type matters here.
struct Kind {
    front: Front,
    /// `[edge]` `l` of courses, `y` of wales.
    along: Vec<char>,
}

impl Kind {
    fn new(name: &str, labels: &[String]) -> Self {
        let letter = |label: &String| label.trim_start_matches(['+', '-']).chars().next().unwrap_or(' ');
        Self { front: Front::of_name(name), along: labels.iter().map(letter).collect() }
    }

    fn edges(&self, along: char) -> impl Iterator<Item = usize> + '_ {
        (0..self.along.len()).filter(move |k| self.along[*k] == along)
    }
}
