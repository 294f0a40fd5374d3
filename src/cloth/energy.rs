//! Elastic energy and its gradient.

use super::{Bend, Cloth, Spring};
use glam::DVec3;
use rayon::prelude::*;

/// Constraints that one partial sum takes; sums do not depend on the number of threads.
const PART: usize = 4096;

/// Below this share of its natural length a spring has no direction of its own.
const POINT: f64 = 1e-9;

impl Spring {
    /// Direction from the second node to the first, and length, m. Nodes that coincide are taken as apart along a direction
    /// that depends on their numbers, so that fabric crumpled into a point unfolds.
    #[inline]
    pub(super) fn stretched(&self, a: DVec3, b: DVec3) -> (DVec3, f64) {
        let d = a - b;
        let l = d.length();
        if l > POINT * self.length { (d / l, l) } else { (somewhere(self.nodes), l) }
    }

    #[inline]
    fn energy(&self, x: &[DVec3]) -> f64 {
        let [a, b] = self.nodes.map(|n| x[n as usize]);
        let stretch = a.distance(b) - self.length;
        0.5 * self.stiffness * stretch * stretch
    }
}

/// Some direction.
#[cold]
fn somewhere(nodes: [u32; 2]) -> DVec3 {
    let mut state = (u64::from(nodes[0]) << 32 | u64::from(nodes[1])) ^ 0x9e37_79b9_7f4a_7c15;
    let mut next = || {
        state ^= state >> 30;
        state = state.wrapping_mul(0xbf58_476d_1ce4_e5b9);
        state ^= state >> 27;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    DVec3::new(next(), next(), next()).normalize_or(DVec3::X)
}

impl Bend {
    /// Curvature, 1/m.
    #[inline]
    pub(super) fn curvature(&self, x: &[DVec3]) -> DVec3 {
        // In differences to the first node: a place far from the origin costs no digits.
        let base = x[self.nodes[0] as usize];
        (1..4).map(|k| (x[self.nodes[k] as usize] - base) * self.weights[k]).sum()
    }
}

impl Cloth {
    /// Room that [`Cloth::energy_in`] takes.
    pub(super) fn part_count(&self) -> usize {
        self.springs.len().div_ceil(PART) + self.bends.len().div_ceil(PART)
    }

    /// Elastic energy, with room for its partial sums.
    pub(super) fn energy_in(&self, x: &[DVec3], parts: &mut [f64]) -> f64 {
        assert_eq!(x.len(), self.node_count(), "a position for each node");
        let (springs, bends) = parts.split_at_mut(self.springs.len().div_ceil(PART));
        springs
            .par_iter_mut()
            .zip(self.springs.par_chunks(PART))
            .for_each(|(part, springs)| *part = springs.iter().map(|s| s.energy(x)).sum());
        bends.par_iter_mut().zip(self.bends.par_chunks(PART)).for_each(|(part, bends)| {
            *part = bends.iter().map(|b| 0.5 * b.stiffness * b.curvature(x).length_squared()).sum();
        });
        parts.iter().sum()
    }

    /// Adds to `out` what springs and bends give, each to its nodes: blocks side by side, then what reaches across.
    pub(super) fn scatter(
        &self,
        out: &mut [DVec3],
        spring: impl Fn(usize, &Spring) -> DVec3 + Sync,
        bend: impl Fn(&Bend) -> DVec3 + Sync,
    ) {
        let of_spring = |i: usize, first: usize, out: &mut [DVec3]| {
            let s = &self.springs[i];
            let f = spring(i, s);
            out[s.nodes[0] as usize - first] += f;
            out[s.nodes[1] as usize - first] -= f;
        };
        let of_bend = |i: usize, first: usize, out: &mut [DVec3]| {
            let b = &self.bends[i];
            let f = bend(b);
            for (n, w) in b.nodes.iter().zip(&b.weights) {
                out[*n as usize - first] += f * *w;
            }
        };
        let size = self.blocks.size;
        out.par_chunks_mut(size).enumerate().for_each(|(block, out)| {
            self.blocks.springs_of(block).for_each(|i| of_spring(i, block * size, out));
            self.blocks.bends_of(block).for_each(|i| of_bend(i, block * size, out));
        });
        (self.blocks.springs_across()..self.springs.len()).for_each(|i| of_spring(i, 0, out));
        (self.blocks.bends_across()..self.bends.len()).for_each(|i| of_bend(i, 0, out));
    }
}

/// Minus the gradient of the energy.
pub(super) fn forces(cloth: &Cloth, x: &[DVec3], out: &mut [DVec3]) {
    assert!([x.len(), out.len()] == [cloth.node_count(); 2], "a position and a force for each node");
    out.fill(DVec3::ZERO);
    add_forces(cloth, x, out);
}

/// Adds elastic forces.
pub(super) fn add_forces(cloth: &Cloth, x: &[DVec3], out: &mut [DVec3]) {
    cloth.scatter(
        out,
        |_, s| {
            let [a, b] = s.nodes.map(|n| x[n as usize]);
            let (direction, length) = s.stretched(a, b);
            direction * (s.stiffness * (s.length - length))
        },
        |b| b.curvature(x) * -b.stiffness,
    );
}

/// Adds elastic forces and those of dampers beside springs and bends, which see how far each has moved since `before`: a
/// share `gamma` of what a violation as large would give.
pub(super) fn add_damped_forces(cloth: &Cloth, x: &[DVec3], before: &[DVec3], gamma: f64, out: &mut [DVec3]) {
    cloth.scatter(
        out,
        |_, s| {
            let [a, b] = s.nodes.map(|n| n as usize);
            let (direction, length) = s.stretched(x[a], x[b]);
            let moved = direction.dot((x[a] - before[a]) - (x[b] - before[b]));
            direction * (s.stiffness * (s.length - length - gamma * moved))
        },
        |b| (b.curvature(x) * (1.0 + gamma) - b.curvature(before) * gamma) * -b.stiffness,
    );
}
