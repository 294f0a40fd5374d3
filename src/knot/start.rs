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

/// The template's own knots, carried rigidly.
#[inline(always)]
pub fn rigid<T: Real>(stencil: &Stencil<T>, state: &mut [KnotState<T>]) {
    for (k, state) in state.iter_mut().enumerate() {
        *state = KnotState { direction: stencil.knot_direction[k], half_length: stencil.knot_half_length[k] };
    }
}

/// Affine start: v = l0 F d0, l = |v|, d = v / l.
#[inline(always)]
pub fn affine<T: Real>(stencil: &Stencil<T>, frame: &Frame<T>, state: &mut [KnotState<T>]) {
    for (k, state) in state.iter_mut().enumerate() {
        let rest = stencil.knot_direction[k];
        let v = frame.apply(rest * stencil.knot_half_length[k]);
        let length = v.dot(v).sqrt();
        let usable = T::zero().lt(length);
        let direction = v * (T::one() / T::select(usable, length, T::one()));
        *state = KnotState { direction: V2::select(usable, direction, rest), half_length: length };
    }
}
