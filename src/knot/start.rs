//! Stage 2: where the solve starts (model section 5).

use super::frame::Frame;
use crate::math::{Real, V2};
use crate::scene::Stencil;

/// The state of a knot: direction d (unit) and half-length l in the face frame, template units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KnotState<T> {
    /// d.
    pub direction: V2<T>,
    /// l.
    pub half_length: T,
}

impl<T: Real> KnotState<T> {
    /// The state in a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> KnotState<T::Scalar> {
        KnotState { direction: self.direction.lane(lane), half_length: self.half_length.lane(lane) }
    }
    /// Puts a state into a lane.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, state: KnotState<T::Scalar>) {
        self.direction.set_lane(lane, state.direction);
        self.half_length.set_lane(lane, state.half_length);
    }
    /// Selection lane by lane.
    #[inline(always)]
    pub fn select(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self {
            direction: V2::select(mask, yes.direction, no.direction),
            half_length: T::select(mask, yes.half_length, no.half_length),
        }
    }
}

/// The template's own knots, carried rigidly.
#[inline(always)]
pub fn rigid<T: Real>(stencil: &Stencil<T::Scalar>, state: &mut [KnotState<T>]) {
    for (k, state) in state.iter_mut().enumerate() {
        *state = KnotState {
            direction: V2::splat(stencil.knot_direction[k]),
            half_length: T::splat(stencil.knot_half_length[k]),
        };
    }
}

/// Affine start: v = l0 F d0, l = |v|, d = v / l.
#[inline(always)]
pub fn affine<T: Real>(stencil: &Stencil<T::Scalar>, frame: &Frame<T>, state: &mut [KnotState<T>]) {
    for (k, state) in state.iter_mut().enumerate() {
        let rest = V2::splat(stencil.knot_direction[k]);
        let v = frame.apply(rest * T::splat(stencil.knot_half_length[k]));
        let length = v.dot(v).sqrt();
        let usable = T::zero().lt(length);
        let direction = v * (T::one() / T::select(usable, length, T::one()));
        *state = KnotState { direction: V2::select(usable, direction, rest), half_length: length };
    }
}
