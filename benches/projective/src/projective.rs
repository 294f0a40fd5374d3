//! Projective dynamics (Bouaziz et al. 2014): implicit Euler, whose global step has one matrix for all times, factored once.

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};
use glam::DVec3;
use knotmesh::cloth::Cloth;
use rayon::prelude::*;

/// Weight that keeps held nodes in place, of the greatest on the diagonal.
const HOLD: f64 = 1e6;

/// Cloth in motion.
pub struct Projective {
    /// `[node]` m
    pub x: Vec<DVec3>,
    v: Vec<DVec3>,
    h: f64,
    inertia: Vec<f64>,
    springs: Vec<([u32; 2], f64, f64)>,
    /// `[node + 1]`, and the springs around each with their sign.
    offsets: Vec<u32>,
    around: Vec<(u32, f64)>,
    factor: Llt<usize, f64>,
    right: Mat<f64>,
}

impl Projective {
    /// Factors the matrix of steps of `h` seconds.
    pub fn new(cloth: &Cloth, start: &[DVec3], held: &[u32], h: f64) -> Self {
        let n = start.len();
        let mut inertia: Vec<f64> = cloth.masses().iter().map(|m| m / (h * h)).collect();
        let springs: Vec<_> = cloth.springs().iter().map(|s| (s.nodes, s.length, s.stiffness)).collect();
        let mut entries = Vec::new();
        let mut add = |a: u32, b: u32, k: f64| entries.push(Triplet::new(a as usize, b as usize, k));
        let mut greatest: f64 = 0.0;
        for (nodes, _, k) in &springs {
            let [a, b] = *nodes;
            greatest = greatest.max(*k);
            add(a, a, *k);
            add(b, b, *k);
            add(a.max(b), a.min(b), -k);
        }
        for (nodes, weights, k) in cloth.bending() {
            for (a, wa) in nodes.iter().zip(&weights) {
                for (b, wb) in nodes.iter().zip(&weights) {
                    if a >= b {
                        add(*a, *b, k * wa * wb);
                    }
                }
            }
        }
        held.iter().for_each(|node| inertia[*node as usize] = HOLD * greatest);
        inertia.iter().enumerate().for_each(|(node, k)| add(node as u32, node as u32, *k));
        let matrix =
            SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &entries).expect("entries in range");
        let symbolic = SymbolicLlt::try_new(matrix.symbolic(), Side::Lower).expect("a matrix that fits");
        let factor =
            Llt::try_new_with_symbolic(symbolic, matrix.as_ref(), Side::Lower).expect("a positive matrix");
        let mut offsets = vec![0_u32; n + 1];
        springs.iter().flat_map(|s| s.0).for_each(|node| offsets[node as usize + 1] += 1);
        (0..n).for_each(|k| offsets[k + 1] += offsets[k]);
        let mut next = offsets.clone();
        let mut around = vec![(0, 0.0); springs.len() * 2];
        for (i, (nodes, ..)) in springs.iter().enumerate() {
            for (node, sign) in nodes.iter().zip([1.0, -1.0]) {
                around[next[*node as usize] as usize] = (i as u32, sign);
                next[*node as usize] += 1;
            }
        }
        let right = Mat::zeros(n, 3);
        Self {
            x: start.to_vec(),
            v: vec![DVec3::ZERO; n],
            h,
            inertia,
            springs,
            offsets,
            around,
            factor,
            right,
        }
    }

    /// One step.
    pub fn step(&mut self, gravity: DVec3, iterations: usize) {
        let before = self.x.clone();
        let held = self.inertia.iter().copied().fold(0.0, f64::max);
        let goal: Vec<DVec3> = before
            .iter()
            .zip(&self.v)
            .zip(&self.inertia)
            .map(|((x, v), k)| if *k == held { *x } else { *x + (*v + gravity * self.h) * self.h })
            .collect();
        self.x.copy_from_slice(&goal);
        for _ in 0..iterations {
            let x = &self.x;
            let ends: Vec<DVec3> = self
                .springs
                .par_iter()
                .map(|([a, b], length, k)| {
                    (x[*a as usize] - x[*b as usize]).normalize_or_zero() * (length * k)
                })
                .collect();
            let right: Vec<DVec3> = (0..x.len())
                .into_par_iter()
                .map(|node| {
                    let around = self.offsets[node] as usize..self.offsets[node + 1] as usize;
                    let pulls: DVec3 =
                        self.around[around].iter().map(|(i, sign)| ends[*i as usize] * *sign).sum();
                    goal[node] * self.inertia[node] + pulls
                })
                .collect();
            for (node, r) in right.iter().enumerate() {
                (0..3).for_each(|k| self.right[(node, k)] = r[k]);
            }
            self.factor.solve_in_place(self.right.as_mut());
            for (node, x) in self.x.iter_mut().enumerate() {
                *x = DVec3::new(self.right[(node, 0)], self.right[(node, 1)], self.right[(node, 2)]);
            }
        }
        for ((v, x), before) in self.v.iter_mut().zip(&self.x).zip(&before) {
            *v = (*x - *before) / self.h;
        }
    }
}
