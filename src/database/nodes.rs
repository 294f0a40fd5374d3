//! Nodes: what corners of faces share, material vertices with the copies that lie across seams, and how much of its faces
//! each takes.

use super::surface::{NONE, Surface};
use super::{Compat, FaceWeights};
use glam::{DMat2, DVec2};
use std::collections::HashMap;

/// Nodes and the weights of the faces around them.
#[derive(Clone, Debug, Default)]
pub struct Nodes {
    /// `[face]` nodes of its corners.
    pub of_faces: Vec<[u32; 3]>,
    /// `[node]` its world vertex.
    pub vertices: Vec<u32>,
    /// Faces of each node and their shares, which add up to 1. Strains and gradients are averaged so.
    pub strain: Shares,
    /// The same for normals, where all faces around a world vertex count.
    pub normal: Shares,
}

/// `[node]` faces and weights: those of node i stand at `offsets[i] .. offsets[i + 1]`.
#[derive(Clone, Debug, Default)]
pub struct Shares {
    /// `[node + 1]`
    pub offsets: Vec<u32>,
    /// Faces.
    pub faces: Vec<u32>,
    /// Their weights.
    pub weights: Vec<f64>,
}

impl Shares {
    /// Faces and weights of a node.
    pub fn of(&self, node: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.offsets[node] as usize..self.offsets[node + 1] as usize;
        self.faces[range.clone()].iter().map(|f| *f as usize).zip(self.weights[range].iter().copied())
    }
}

impl Nodes {
    /// Nodes of a surface. To be `compat`, a node is a material vertex; else those on both sides of a seam that only shifts
    /// material coordinates are one.
    pub fn new(surface: &Surface, weights: FaceWeights, compat: Compat) -> Self {
        let of_faces = match compat {
            Compat::Madypg => by_number(surface.face_uvs.iter().map(|uvs| uvs.map(|uv| [uv, 0]))),
            Compat::None => across_seams(surface),
        };
        let count = of_faces.iter().flatten().max().map_or(0, |n| *n as usize + 1);
        let mut vertices = vec![0; count];
        for (nodes, corners) in of_faces.iter().zip(&surface.faces) {
            for (node, vertex) in nodes.iter().zip(corners) {
                vertices[*node as usize] = *vertex;
            }
        }
        let strain = shares(surface, &of_faces, count, weights);
        let normal = match compat {
            Compat::Madypg => strain.clone(),
            Compat::None => around_vertices(&strain, &vertices),
        };
        Self { of_faces, vertices, strain, normal }
    }

    /// Number of nodes.
    pub fn count(&self) -> usize {
        self.vertices.len()
    }
}

/// Numbers corners by a key, in order of first appearance.
fn by_number(keys: impl Iterator<Item = [[u32; 2]; 3]>) -> Vec<[u32; 3]> {
    let mut numbers = HashMap::new();
    keys.map(|corners| {
        corners.map(|key| {
            let next = numbers.len() as u32;
            *numbers.entry(key).or_insert(next)
        })
    })
    .collect()
}

fn across_seams(surface: &Surface) -> Vec<[u32; 3]> {
    // Corners of one world and one material vertex are one node; seams join more.
    let own =
        by_number(surface.faces.iter().zip(&surface.face_uvs).map(|(x, u)| [0, 1, 2].map(|k| [x[k], u[k]])));
    let count = own.iter().flatten().max().map_or(0, |n| *n as usize + 1);
    let mut roots: Vec<u32> = (0..count as u32).collect();
    for (face, across) in surface.across.iter().enumerate() {
        for (k, across) in across.iter().enumerate() {
            if across.face == NONE || across.continuous || across.shift.is_none() {
                continue;
            }
            let there = own[across.face as usize];
            for (mine, theirs) in [(k, across.corners[0]), ((k + 1) % 3, across.corners[1])] {
                let (a, b) = (root(&mut roots, own[face][mine]), root(&mut roots, there[theirs as usize]));
                roots[a.max(b) as usize] = a.min(b);
            }
        }
    }
    by_number(own.iter().map(|nodes| nodes.map(|n| [root(&mut roots, n), 0])).collect::<Vec<_>>().into_iter())
}

fn root(roots: &mut [u32], mut i: u32) -> u32 {
    while roots[i as usize] != i {
        roots[i as usize] = roots[roots[i as usize] as usize];
        i = roots[i as usize];
    }
    i
}

/// Weights of the faces around each node: `(1 + lambda . r) / |r|` of the vectors r to their centroids, with
/// `lambda = -(1 + sum r r^T)^-1 sum r` over their directions (James 2020, modified Shepard weights).
fn shares(surface: &Surface, of_faces: &[[u32; 3]], count: usize, weights: FaceWeights) -> Shares {
    let mut offsets = vec![0u32; count + 1];
    for node in of_faces.iter().flatten() {
        offsets[*node as usize + 1] += 1;
    }
    for i in 0..count {
        offsets[i + 1] += offsets[i];
    }
    let mut next = offsets.clone();
    let mut faces = vec![0; *offsets.last().unwrap_or(&0) as usize];
    let mut vectors = vec![DVec2::ZERO; faces.len()];
    for (face, nodes) in of_faces.iter().enumerate() {
        let corners = &surface.corners[face];
        let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
        for (node, corner) in nodes.iter().zip(corners) {
            let at = next[*node as usize] as usize;
            faces[at] = face as u32;
            vectors[at] = centroid - *corner;
            next[*node as usize] += 1;
        }
    }
    let mut all = vec![0.0; faces.len()];
    for node in 0..count {
        let range = offsets[node] as usize..offsets[node + 1] as usize;
        let (vectors, all) = (&vectors[range.clone()], &mut all[range.clone()]);
        let spans = |i: usize| surface.spans(faces[range.start + i] as usize);
        let (mut matrix, mut sum) = (DMat2::IDENTITY, DVec2::ZERO);
        for (i, r) in vectors.iter().enumerate().filter(|(i, _)| spans(*i)) {
            let _ = i;
            let r = r.normalize_or_zero();
            matrix += DMat2::from_cols(r * r.x, r * r.y);
            sum += r;
        }
        let lambda = -(matrix.inverse() * sum);
        for (i, r) in vectors.iter().enumerate() {
            // Faces that span nothing have no gradient and no say.
            all[i] = match weights {
                _ if !spans(i) => 0.0,
                FaceWeights::Equal => 1.0,
                FaceWeights::Shepard => (1.0 + lambda.dot(r.normalize_or_zero())) / r.length(),
            };
        }
        let total: f64 = all.iter().sum();
        let usable = total.is_finite() && total > 0.0;
        all.iter_mut().for_each(|w| *w = if usable { *w / total } else { 0.0 });
    }
    Shares { offsets, faces, weights: all }
}

/// Normals do not know of material coordinates: a node takes all faces around its world vertex, the nodes there in
/// proportion to their faces.
fn around_vertices(strain: &Shares, vertices: &[u32]) -> Shares {
    let mut by_vertex: HashMap<u32, Vec<usize>> = HashMap::with_capacity(vertices.len());
    for (node, vertex) in vertices.iter().enumerate() {
        by_vertex.entry(*vertex).or_default().push(node);
    }
    let mut shares = Shares { offsets: vec![0], ..Shares::default() };
    for vertex in vertices {
        let nodes = &by_vertex[vertex];
        let count = |node: &usize| (strain.offsets[*node + 1] - strain.offsets[*node]) as f64;
        let all: f64 = nodes.iter().map(count).sum();
        for node in nodes {
            for (face, weight) in strain.of(*node) {
                shares.faces.push(face as u32);
                shares.weights.push(weight * count(node) / all);
            }
        }
        shares.offsets.push(shares.faces.len() as u32);
    }
    shares
}
