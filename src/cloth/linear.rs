//! The linear system of a Newton step: the energy's second derivatives made positive, times a vector, and conjugate gradients.

use super::Cloth;
use glam::{DMat3, DVec3};

/// Workspaces of conjugate gradients, and the matrix in pieces.
pub(super) struct System {
    /// `[spring]` direction and stiffness across it, N/m. A compressed spring's is negative; left out, the matrix is positive.
    springs: Vec<(DVec3, f64)>,
    /// `[node]` inverse of the matrix's diagonal block.
    inverse: Vec<DMat3>,
    shift: f64,
    residual: Vec<DVec3>,
    direction: Vec<DVec3>,
    product: Vec<DVec3>,
}

impl System {
    pub fn new(cloth: &Cloth) -> Self {
        let nodes = vec![DVec3::ZERO; cloth.node_count()];
        Self {
            springs: Vec::with_capacity(cloth.springs.len()),
            inverse: Vec::with_capacity(nodes.len()),
            shift: 0.0,
            residual: nodes.clone(),
            direction: nodes.clone(),
            product: nodes,
        }
    }

    /// The matrix at positions, plus `shift` (N/m) on its diagonal; `exact` with what is negative.
    pub fn set(&mut self, cloth: &Cloth, x: &[DVec3], shift: f64, exact: bool) {
        self.shift = shift;
        self.springs.clear();
        self.springs.extend(cloth.springs.iter().map(|s| {
            let [a, b] = s.nodes.map(|n| x[n as usize]);
            let (n, l) = s.stretched(a, b);
            // Below a tenth of its length a spring turns with any step: its exact derivative says little.
            let across = 1.0 - s.length / l.max(0.1 * s.length);
            (n, s.stiffness * if exact { across } else { across.max(0.0) })
        }));
        self.inverse.clear();
        self.inverse.resize(x.len(), DMat3::from_diagonal(DVec3::splat(shift)));
        for (s, (n, across)) in cloth.springs.iter().zip(&self.springs) {
            // The preconditioner stays positive.
            let across = across.max(0.0);
            let along = *n * (s.stiffness - across);
            let block = DMat3::from_cols(along * n.x, along * n.y, along * n.z)
                + DMat3::from_diagonal(DVec3::splat(across));
            s.nodes.iter().for_each(|k| self.inverse[*k as usize] += block);
        }
        for b in &cloth.bends {
            for (k, w) in b.nodes.iter().zip(&b.weights) {
                self.inverse[*k as usize] += DMat3::from_diagonal(DVec3::splat(b.stiffness * w * w));
            }
        }
        for m in &mut self.inverse {
            // A node that nothing holds has no entries and takes no step.
            let inverse = m.inverse();
            *m = if inverse.is_finite() { inverse } else { DMat3::ZERO };
        }
    }

    /// The matrix times `direction`, into `product`.
    fn multiply(&mut self, cloth: &Cloth) {
        let (p, springs, shift) = (&self.direction, &self.springs, self.shift);
        for (out, p) in self.product.iter_mut().zip(p) {
            *out = *p * shift;
        }
        cloth.scatter(
            &mut self.product,
            |i, s| {
                let d = p[s.nodes[0] as usize] - p[s.nodes[1] as usize];
                let (n, across) = springs[i];
                d * across + n * ((s.stiffness - across) * n.dot(d))
            },
            |b| b.curvature(p) * b.stiffness,
        );
    }

    /// Solves for `step` by preconditioned conjugate gradients until the residual has shrunk to a share `tolerance` of
    /// `forces`, for `most` rounds, or until a direction comes up along which the matrix is not positive, so that steps go
    /// downhill in any case; returns the rounds. `keep` leaves of a vector what may move.
    pub fn solve(
        &mut self,
        cloth: &Cloth,
        forces: &[DVec3],
        step: &mut [DVec3],
        tolerance: f64,
        most: usize,
        keep: &impl Fn(&mut [DVec3]),
    ) -> usize {
        step.fill(DVec3::ZERO);
        self.residual.copy_from_slice(forces);
        let target = tolerance * dot(forces, forces).sqrt();
        let mut before = 0.0;
        for round in 0..most {
            for ((z, m), r) in self.product.iter_mut().zip(&self.inverse).zip(&self.residual) {
                *z = *m * *r;
            }
            keep(&mut self.product);
            let rho = dot(&self.residual, &self.product);
            if rho.is_nan() || rho <= 0.0 {
                return round;
            }
            let beta = if round == 0 { 0.0 } else { rho / before };
            before = rho;
            for (p, z) in self.direction.iter_mut().zip(&self.product) {
                *p = *z + *p * beta;
            }
            if round == 0 {
                self.direction.copy_from_slice(&self.product);
            }
            self.multiply(cloth);
            keep(&mut self.product);
            let curvature = dot(&self.direction, &self.product);
            if curvature.is_nan() || curvature <= 0.0 {
                if round == 0 {
                    step.copy_from_slice(&self.direction);
                }
                return round + 1;
            }
            let alpha = rho / curvature;
            for (((x, r), p), q) in
                step.iter_mut().zip(&mut self.residual).zip(&self.direction).zip(&self.product)
            {
                *x += *p * alpha;
                *r -= *q * alpha;
            }
            if dot(&self.residual, &self.residual).sqrt() <= target {
                return round + 1;
            }
        }
        most
    }
}

/// Sums in order: the same on any number of threads.
pub(super) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
