//! Stage 5: from the face plane back onto the surface (model section 6).

use super::frame::{Frame, blend, gradient};
use crate::math::{Real, V2, V3};
use crate::scene::Stencil;

/// A knot's place on the surface: what its points are lifted from.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seat<T> {
    /// In-plane coordinates of the unmoved mapped centre.
    pub center: V2<T>,
    /// Its height over the face plane.
    pub height: T,
    /// Slope of the surface there, per in-plane unit.
    pub slope: V2<T>,
    /// Unit normal there, or zero.
    pub normal: V3<T>,
}

/// The seat of knot `k`.
#[inline(always)]
pub fn seat<T: Real>(
    stencil: &Stencil<T::Scalar>,
    frame: &Frame<T>,
    corners: &[V3<T>],
    normals: &[V3<T>],
    k: usize,
) -> Seat<T> {
    let range = k * stencil.corner_count..(k + 1) * stencil.corner_count;
    let weights = &stencil.knot_weights[range.clone()];
    let x = blend(weights, corners);
    let (a, b) = gradient(&stencil.knot_gradients[range], corners);
    let (a_plane, b_plane) = (frame.plane(a), frame.plane(b));
    let (a_up, b_up) = (a.dot(frame.n), b.dot(frame.n));
    let det = a_plane.u * b_plane.v - b_plane.u * a_plane.v;
    let size = a.dot(a) + b.dot(b);
    let steep = T::not((T::of(1e-6) * size).lt(det.abs()));
    let inverse = T::one() / T::select(steep, T::one(), det);
    let slope = V2::new(
        (a_up * b_plane.v - b_up * a_plane.v) * inverse,
        (b_up * a_plane.u - a_up * b_plane.u) * inverse,
    );
    Seat {
        center: frame.plane(x),
        height: x.dot(frame.n),
        slope: V2::select(steep, V2::zero(), slope),
        normal: blend(weights, normals).normalized_or_zero(),
    }
}

impl<T: Real> Seat<T> {
    /// The place of an in-plane point of the knot, relative to the face's first corner: on the tangent
    /// plane of the surface, then offset along its normal.
    #[inline(always)]
    pub fn lift(&self, frame: &Frame<T>, p: V2<T>, z: T) -> V3<T> {
        let height = self.height + self.slope.dot(p - self.center);
        frame.t1 * p.u + frame.t2 * p.v + frame.n * height + self.normal * z
    }
}

/// The place of an interpolated point that lies at `at` on the surface, relative to the face's first corner.
#[inline(always)]
pub fn interpolate<T: Real>(weights: &[T::Scalar], at: V3<T>, normals: &[V3<T>], z: T::Scalar) -> V3<T> {
    // Most points on edges lie on the surface: they need no normal.
    if z == T::Scalar::zero() {
        return at;
    }
    at + blend(weights, normals).normalized_or_zero() * T::splat(z)
}
