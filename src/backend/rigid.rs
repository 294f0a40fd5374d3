//! A frame in which everything moves as one: what was worked out before is turned along.

use crate::math::{Scalar, V3};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

const CHUNK: usize = 4096;
/// Frames in a row that are only turned along. Each adds its rounding to points, and may add its share of the
/// tolerance to shapes; the next one is worked out again.
pub const FRAMES: u32 = 16;

/// A rigid motion of world positions: p to turn p + shift.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    turn: DMat3,
    shift: DVec3,
}

impl Motion {
    /// The motion that takes `before` to `after` (`[vertex]`, world units), if one does to within `tolerance` along each
    /// axis.
    pub fn find(before: &[DVec3], after: &[DVec3], tolerance: f64) -> Option<Self> {
        // Three vertices far from each other tell the motion; all others confirm it.
        let every = before.len().div_ceil(256).max(1);
        let sample = || (0..before.len()).step_by(every);
        let a = 0;
        let far = |from: DVec3| {
            move |i: &usize, j: &usize| (before[*i] - from).length().total_cmp(&(before[*j] - from).length())
        };
        let b = sample().max_by(far(before[a]))?;
        let along = (before[b] - before[a]).normalize_or_zero();
        let off = |i: usize| (before[i] - before[a]).reject_from(along).length();
        let c = sample().max_by(|i, j| off(*i).total_cmp(&off(*j)))?;
        let frame = |p: &[DVec3]| -> Option<DMat3> {
            let x = (p[b] - p[a]).try_normalize()?;
            let z = x.cross(p[c] - p[a]).try_normalize()?;
            Some(DMat3::from_cols(x, z.cross(x), z))
        };
        let turn = frame(after)? * frame(before)?.transpose();
        let motion = Self { turn, shift: after[a] - turn * before[a] };
        let holds = |(p, q): (&DVec3, &DVec3)| {
            (motion.turn * *p + motion.shift - *q).abs().max_element() <= tolerance
        };
        let confirmed = sample().all(|i| holds((&before[i], &after[i])))
            && before
                .par_chunks(CHUNK)
                .zip(after.par_chunks(CHUNK))
                .all(|(before, after)| before.iter().zip(after).all(holds));
        confirmed.then_some(motion)
    }

    /// The motion as x, y, z and shift, p to x p.x + y p.y + z p.z + shift, of places in units of `gauge` relative to
    /// `origin`.
    pub fn columns<T: Scalar>(&self, origin: DVec3, gauge: f64) -> [V3<T>; 4] {
        let shift = (self.turn * origin + self.shift - origin) / gauge;
        [self.turn.x_axis, self.turn.y_axis, self.turn.z_axis, shift].map(V3::of)
    }

    /// Moves places that are given in units of `gauge` relative to `origin`.
    pub fn carry<T: Scalar>(&self, origin: DVec3, gauge: f64, places: &mut [V3<T>]) {
        let [x, y, z, shift] = self.columns::<T>(origin, gauge);
        places.par_chunks_mut(CHUNK).for_each(|places| {
            for p in places {
                *p = x * p.x + y * p.y + z * p.z + shift;
            }
        });
    }
}
