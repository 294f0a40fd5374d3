//! Where to go downhill, without second derivatives: L-BFGS (Nocedal 1980) upon the matrix of projective dynamics, factored once
//! (Liu et al. 2017).
//!
//! That matrix bounds the energy's second derivatives from above whatever the shape, so each place of the fabric gives way as far
//! as it safely can; a region of trust is as small for all as the one that buckles worst needs.

use super::Cloth;
use super::factor::{Entry, Factor};
use super::implicit::matrix;
use super::linear::dot;
use glam::DVec3;
use std::collections::VecDeque;

/// Steps that are remembered. 5, 12 and 20 take as many steps.
const MEMORY: usize = 8;

/// What the diagonal has beyond the matrix, of its largest entry: fabric that nothing holds would have no factor.
const SHIFT: f64 = 1e-6;

/// Entries of the factor at most: half a gigabyte while it is made. Larger cloth, and such as has no order that saves entries, does
/// without.
const MOST: u64 = 40_000_000;

/// A step, by how much forces fell, and one over the product of both.
struct Pair {
    step: Vec<DVec3>,
    fall: Vec<DVec3>,
    inverse: f64,
}

/// The factored matrix and the last steps.
pub(super) struct Descent {
    factor: Factor,
    pairs: VecDeque<Pair>,
    right: Vec<DVec3>,
}

impl Descent {
    /// Factors; nothing where that would take too much.
    pub fn new(cloth: &Cloth, held: &[u32]) -> Option<Self> {
        let (mut diagonal, entries): (_, Vec<Entry>) = matrix(cloth);
        let shift = SHIFT * diagonal.iter().copied().fold(0.0, f64::max);
        diagonal.iter_mut().for_each(|d| *d += shift);
        let pairs: Vec<[u32; 2]> = entries.iter().map(|(pair, _)| *pair).collect();
        let mut factor = Factor::within(&cloth.rest, &pairs, MOST)?;
        let mut fixed = vec![false; diagonal.len()];
        held.iter().for_each(|n| fixed[*n as usize] = true);
        factor.factor(&diagonal, &entries, |node| fixed[node]);
        let right = vec![DVec3::ZERO; diagonal.len()];
        Some(Self { factor, pairs: VecDeque::with_capacity(MEMORY), right })
    }

    /// Forgets all steps; whether there were any.
    pub fn forget(&mut self) -> bool {
        let any = !self.pairs.is_empty();
        self.pairs.clear();
        any
    }

    /// The step to try under those forces. `keep` leaves of a vector what may move.
    pub fn step(&mut self, forces: &[DVec3], step: &mut [DVec3], keep: impl Fn(&mut [DVec3])) {
        let right = &mut self.right;
        right.copy_from_slice(forces);
        let mut shares = [0.0; MEMORY];
        for (pair, share) in self.pairs.iter().zip(&mut shares).rev() {
            *share = pair.inverse * dot(&pair.step, right);
            right.iter_mut().zip(&pair.fall).for_each(|(r, y)| *r -= *y * *share);
        }
        // The factor is in f32: numbers of any size are brought to its range.
        let size = right.iter().map(|r| r.abs().max_element()).fold(0.0, f64::max);
        step.fill(DVec3::ZERO);
        if !(size > 0.0 && size.is_finite()) {
            return;
        }
        right.iter_mut().for_each(|r| *r /= size);
        self.factor.add_solution(right, step);
        step.iter_mut().for_each(|s| *s *= size);
        for (pair, share) in self.pairs.iter().zip(&shares) {
            let more = share - pair.inverse * dot(&pair.fall, step);
            step.iter_mut().zip(&pair.step).for_each(|(s, p)| *s += *p * more);
        }
        keep(step);
    }

    /// Remembers a step that was taken from forces `before` to forces `after`, unless the energy curves down along it.
    pub fn learn(&mut self, step: &[DVec3], before: &[DVec3], after: &[DVec3]) {
        let products = step.iter().zip(before).zip(after).map(|((s, b), a)| {
            let fall = *b - *a;
            (s.dot(fall), fall.length_squared())
        });
        let (product, square) = products.fold((0.0, 0.0), |sum, p| (sum.0 + p.0, sum.1 + p.1));
        // False also for what is no number.
        let upwards = product > 1e-10 * (dot(step, step) * square).sqrt();
        if !upwards {
            return;
        }
        let oldest = if self.pairs.len() == MEMORY { self.pairs.pop_front() } else { None };
        let Pair { step: mut s, mut fall, .. } = oldest.unwrap_or_else(|| Pair {
            step: vec![DVec3::ZERO; step.len()],
            fall: vec![DVec3::ZERO; step.len()],
            inverse: 0.0,
        });
        s.copy_from_slice(step);
        fall.iter_mut().zip(before).zip(after).for_each(|((y, b), a)| *y = *b - *a);
        self.pairs.push_back(Pair { step: s, fall, inverse: 1.0 / product });
    }
}
