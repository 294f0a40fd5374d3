//! One pass over all springs and bends of a substep: extended position-based dynamics (Macklin et al. 2016) with one iteration a
//! small step (Macklin et al. 2019).

use super::{Bend, Cloth, Spring};
use glam::DVec3;
use rayon::prelude::*;

/// What all constraints of a substep share.
#[derive(Clone, Copy)]
pub(super) struct Step {
    /// `1 / dt^2`, 1/s2.
    pub inverse_dt2: f64,
    /// Damping time over dt: a constraint's force is its stiffness times the violation and `damping` times its rate.
    pub gamma: f64,
}

/// Corrects positions; `before` are those at the start of the substep.
pub(super) fn solve(cloth: &Cloth, step: Step, inverse_mass: &[f64], before: &[DVec3], x: &mut [DVec3]) {
    let size = cloth.blocks.size;
    x.par_chunks_mut(size).enumerate().for_each(|(block, x)| {
        let first = block * size;
        let (w, before) = (&inverse_mass[first..], &before[first..]);
        for s in &cloth.springs[cloth.blocks.springs_of(block)] {
            spring(s, first, step, w, before, x);
        }
        for b in &cloth.bends[cloth.blocks.bends_of(block)] {
            bend(b, first, step, w, before, x);
        }
    });
    for s in &cloth.springs[cloth.blocks.springs_across()..] {
        spring(s, 0, step, inverse_mass, before, x);
    }
    for b in &cloth.bends[cloth.blocks.bends_across()..] {
        bend(b, 0, step, inverse_mass, before, x);
    }
}

/// Macklin et al. 2016, eq. 18 and (with damping) 26, with multipliers that begin at 0.
#[inline(always)]
fn spring(s: &Spring, first: usize, step: Step, w: &[f64], before: &[DVec3], x: &mut [DVec3]) {
    let [a, b] = s.nodes.map(|n| n as usize - first);
    let (wa, wb) = (w[a], w[b]);
    let sum = wa + wb;
    let (direction, length) = s.stretched(x[a], x[b]);
    let moved = (x[a] - before[a]) - (x[b] - before[b]);
    let violation = length - s.length + step.gamma * direction.dot(moved);
    // Held nodes have no inverse mass: two of them are not moved.
    let push = -violation / ((1.0 + step.gamma) * sum + step.inverse_dt2 / s.stiffness);
    x[a] += direction * (push * wa);
    x[b] -= direction * (push * wb);
}

/// The same for the three components of a curvature, which is linear in positions.
#[inline(always)]
fn bend(b: &Bend, first: usize, step: Step, w: &[f64], before: &[DVec3], x: &mut [DVec3]) {
    let nodes = b.nodes.map(|n| n as usize - first);
    let (base, base_before) = (x[nodes[0]], before[nodes[0]]);
    let (mut curvature, mut moved) = (DVec3::ZERO, DVec3::ZERO);
    let mut sum = w[nodes[0]] * b.weights[0] * b.weights[0];
    for k in 1..4 {
        let d = x[nodes[k]] - base;
        curvature += d * b.weights[k];
        moved += (d - (before[nodes[k]] - base_before)) * b.weights[k];
        sum += w[nodes[k]] * b.weights[k] * b.weights[k];
    }
    let violation = curvature + moved * step.gamma;
    let push = violation * (-1.0 / ((1.0 + step.gamma) * sum + step.inverse_dt2 / b.stiffness));
    for k in 0..4 {
        x[nodes[k]] += push * (w[nodes[k]] * b.weights[k]);
    }
}
