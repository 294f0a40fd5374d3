//! The elastic part of a small step: implicit Euler by projective dynamics.
//!
//! A step minimises `|x - goal|^2 M / (2 h^2) + E(x)`. An iteration solves with a matrix that never changes,
//! `A = M / h^2 + sum k S^T S` over springs and bends, which is what the local and global steps of Bouaziz et al. 2014 come to
//! (Liu et al. 2013): `x += A^-1 (forces(x) - M (x - goal) / h^2)`. `A` bounds the second derivatives from above whatever
//! the shape, so an iteration never raises what is minimised, at any stiffness and any step.

use super::Cloth;
use super::factor::{Entry, Factor};
use glam::DVec3;
use rayon::prelude::*;

/// The matrix of steps of one length with some nodes held, factored.
pub(super) struct Implicit {
    factor: Factor,
    diagonal: Vec<f64>,
    entries: Vec<Entry>,
    /// Length of the steps it was factored for, s, with the share of damping and the nodes held; none yet.
    made_for: Option<(f64, f64)>,
    held: Vec<u32>,
    right: Vec<DVec3>,
    /// Forces without those of contacts.
    bare: Vec<DVec3>,
    /// The matrix's diagonal, masses included.
    full: Vec<f64>,
}

/// Diagonal and other entries, each once, of `sum k S^T S` over springs and bends.
pub(super) fn matrix(cloth: &Cloth) -> (Vec<f64>, Vec<Entry>) {
    let mut diagonal = vec![0.0; cloth.node_count()];
    let mut entries: Vec<Entry> = Vec::new();
    for s in &cloth.springs {
        s.nodes.iter().for_each(|n| diagonal[*n as usize] += s.stiffness);
        entries.push((s.nodes, -s.stiffness));
    }
    for b in &cloth.bends {
        for i in 0..4 {
            let (a, wa) = (b.nodes[i], b.weights[i]);
            diagonal[a as usize] += b.stiffness * wa * wa;
            let others = (i + 1..4).filter(|k| b.weights[*k] != 0.0 && wa != 0.0);
            entries.extend(others.map(|k| ([a, b.nodes[k]], b.stiffness * wa * b.weights[k])));
        }
    }
    entries.sort_by_key(|([a, b], _)| [*a.min(b), *a.max(b)]);
    let mut merged: Vec<Entry> = Vec::new();
    for ([a, b], value) in entries {
        let pair = [a.min(b), a.max(b)];
        match merged.last_mut() {
            Some((last, sum)) if *last == pair => *sum += value,
            _ => merged.push((pair, value)),
        }
    }
    (diagonal, merged)
}

impl Implicit {
    /// Finds the order; the matrix is factored when first used.
    pub fn new(cloth: &Cloth) -> Self {
        let (diagonal, entries) = matrix(cloth);
        let pairs: Vec<[u32; 2]> = entries.iter().map(|(pair, _)| *pair).collect();
        Self {
            factor: Factor::new(&cloth.rest, &pairs),
            right: vec![DVec3::ZERO; diagonal.len()],
            bare: vec![DVec3::ZERO; diagonal.len()],
            full: diagonal.clone(),
            diagonal,
            entries,
            made_for: None,
            held: Vec::new(),
        }
    }

    /// Entries of the factor.
    pub fn entries(&self) -> usize {
        self.factor.entries()
    }

    /// Factors for steps of `h` seconds, unless that is done. `gamma` is the damping time over `h`; nodes without inverse mass are
    /// those `held` and those of no face.
    pub fn prepare(&mut self, cloth: &Cloth, h: f64, gamma: f64, held: &[u32], inverse_mass: &[f64]) {
        if self.made_for == Some((h, gamma)) && self.held == held {
            return;
        }
        // Masses are brought in by a scale, so that damping scales the rest: A / (1 + gamma).
        let share = 1.0 / (h * h * (1.0 + gamma));
        let diagonal: Vec<f64> =
            self.diagonal.iter().zip(&cloth.masses).map(|(k, m)| k + m * share).collect();
        self.full.copy_from_slice(&diagonal);
        self.factor.factor(&diagonal, &self.entries, |node| inverse_mass[node] == 0.0);
        self.made_for = Some((h, gamma));
        self.held.clear();
        self.held.extend_from_slice(held);
    }

    /// The forces on nodes at `x`, inertia included, N; scaled as the matrix is. `before` are positions at the start of the step.
    pub fn residual(
        &mut self,
        cloth: &Cloth,
        (h, gamma): (f64, f64),
        inverse_mass: &[f64],
        (before, goal): (&[DVec3], &[DVec3]),
        x: &[DVec3],
    ) {
        let (inertia, scale) = (1.0 / (h * h), 1.0 / (1.0 + gamma));
        self.right.par_iter_mut().enumerate().with_min_len(4096).for_each(|(n, r)| {
            *r = (goal[n] - x[n]) * (cloth.masses[n] * inertia);
        });
        if gamma > 0.0 {
            super::energy::add_damped_forces(cloth, x, before, gamma, &mut self.right);
        } else {
            super::energy::add_forces(cloth, x, &mut self.right);
        }
        self.right.par_iter_mut().zip(inverse_mass).with_min_len(4096).for_each(|(r, w)| {
            *r = if *w > 0.0 { *r * scale } else { DVec3::ZERO };
        });
    }

    /// The matrix's diagonal, and the forces of [`Self::residual`], for contacts to be added.
    pub fn contact(&mut self) -> (&[f64], &mut [DVec3]) {
        self.bare.copy_from_slice(&self.right);
        (&self.full, &mut self.right)
    }

    /// Moves nodes to where the matrix has the forces vanish.
    pub fn solve(&mut self, x: &mut [DVec3]) {
        self.factor.add_solution(&self.right, x);
    }

    /// Takes what [`Self::contact`] added away from each node by itself, for contacts to be found anew: so nodes that were lifted
    /// come back while a contact still bears them.
    pub fn let_go(&self, x: &mut [DVec3]) {
        let forces = self.bare.par_iter().zip(&self.right);
        x.par_iter_mut().zip(forces).zip(&self.full).with_min_len(4096).for_each(|((x, (bare, r)), a)| {
            if bare != r {
                *x += (*bare - *r) / *a;
            }
        });
    }

    /// Moves each node as if the others stayed.
    pub fn smooth(&self, x: &mut [DVec3]) {
        x.par_iter_mut().zip(&self.right).zip(&self.full).with_min_len(4096).for_each(|((x, r), a)| {
            if *a > 0.0 {
                *x += *r / *a;
            }
        });
    }
}
