//! Extended position-based dynamics (Macklin et al. 2016, eq. 18) with one iteration a small step (Macklin et al. 2019):
//! Gauss-Seidel over springs and bends, in blocks of consecutive nodes side by side, what reaches across blocks last.

use glam::DVec3;
use knotmesh::cloth::{Cloth, Spring};
use rayon::prelude::*;

type Bend = ([u32; 4], [f64; 4], f64);

/// Cloth in motion.
pub struct Xpbd {
    /// `[node]` m
    pub x: Vec<DVec3>,
    v: Vec<DVec3>,
    before: Vec<DVec3>,
    /// 1/kg
    weights: Vec<f64>,
    size: usize,
    /// `[block]`; the last are those across.
    springs: Vec<Vec<Spring>>,
    bends: Vec<Vec<Bend>>,
}

impl Xpbd {
    /// Cloth at rest.
    pub fn new(cloth: &Cloth, start: &[DVec3], held: &[u32]) -> Self {
        let n = start.len();
        let size = n.div_ceil(8);
        let mut weights: Vec<f64> = cloth.masses().iter().map(|m| 1.0 / m).collect();
        held.iter().for_each(|node| weights[*node as usize] = 0.0);
        let block = |nodes: &[u32]| {
            let first = nodes[0] as usize / size;
            if nodes.iter().all(|node| *node as usize / size == first) { first } else { 8 }
        };
        // They come sorted by colour, which lets a processor work on several at once.
        let mut springs = vec![Vec::new(); 9];
        cloth.springs().iter().for_each(|s| springs[block(&s.nodes)].push(*s));
        let mut bends = vec![Vec::new(); 9];
        cloth.bending().for_each(|b| bends[block(&b.0)].push(b));
        Self {
            x: start.to_vec(),
            v: vec![DVec3::ZERO; n],
            before: start.to_vec(),
            weights,
            size,
            springs,
            bends,
        }
    }

    /// One step of `h` seconds.
    pub fn step(&mut self, gravity: DVec3, h: f64) {
        self.before.copy_from_slice(&self.x);
        for ((x, v), w) in self.x.iter_mut().zip(&self.v).zip(&self.weights) {
            if *w > 0.0 {
                *x += (*v + gravity * h) * h;
            }
        }
        let stiff = 1.0 / (h * h);
        let size = self.size;
        self.x.par_chunks_mut(size).enumerate().for_each(|(block, x)| {
            let first = block * size;
            let w = &self.weights[first..];
            self.springs[block].iter().for_each(|s| spring(s, first, stiff, w, x));
            self.bends[block].iter().for_each(|b| bend(b, first, stiff, w, x));
        });
        self.springs[8].iter().for_each(|s| spring(s, 0, stiff, &self.weights, &mut self.x));
        self.bends[8].iter().for_each(|b| bend(b, 0, stiff, &self.weights, &mut self.x));
        for ((v, x), before) in self.v.iter_mut().zip(&self.x).zip(&self.before) {
            *v = (*x - *before) / h;
        }
    }
}

#[inline(always)]
fn spring(s: &Spring, first: usize, stiff: f64, w: &[f64], x: &mut [DVec3]) {
    let [a, b] = s.nodes.map(|n| n as usize - first);
    let d = x[a] - x[b];
    let length = d.length();
    let push = (s.length - length) / (length * (w[a] + w[b] + stiff / s.stiffness));
    x[a] += d * (push * w[a]);
    x[b] -= d * (push * w[b]);
}

/// The three components of a curvature, which is linear in positions.
#[inline(always)]
fn bend((nodes, weights, stiffness): &Bend, first: usize, stiff: f64, w: &[f64], x: &mut [DVec3]) {
    let nodes = nodes.map(|n| n as usize - first);
    let base = x[nodes[0]];
    let curvature: DVec3 = (1..4).map(|k| (x[nodes[k]] - base) * weights[k]).sum();
    let sum: f64 = (0..4).map(|k| w[nodes[k]] * weights[k] * weights[k]).sum();
    let push = curvature * (-1.0 / (sum + stiff / stiffness));
    for k in 0..4 {
        x[nodes[k]] += push * (w[nodes[k]] * weights[k]);
    }
}
