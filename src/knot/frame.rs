//! Stage 1: the face frame, and the template's points in it (model section 3).

use crate::math::{Real, V2, V3};
use crate::scene::Stencil;

/// The frame of a deformed face and its in-plane deformation F = `[[f11, f12], [0, f22]]`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame<T> {
    /// Course direction, unit.
    pub t1: V3<T>,
    /// Wale direction, unit: n x t1.
    pub t2: V3<T>,
    /// Face normal, unit.
    pub n: V3<T>,
    /// Course stretch.
    pub f11: T,
    /// Shear.
    pub f12: T,
    /// Stretch across the course.
    pub f22: T,
}

/// The frame of a face whose corners lie at `corners` relative to the first, in template units, and where
/// there is one. There is none if anything is not finite or |D e_u x D e_v| <= 1e-6 |D|^2.
#[inline(always)]
pub fn face_frame<T: Real>(gradients: &[V2<T::Scalar>], corners: &[V3<T>]) -> (Frame<T>, T::Mask) {
    let (a, b) = gradient(gradients, corners);
    let cross = a.cross(b);
    let area = cross.length();
    let size = a.dot(a) + b.dot(b);
    let course = a.length();
    let usable = T::and((T::of(1e-6) * size).lt(area), T::and(area.finite(), size.finite()));
    let area = T::select(usable, area, T::one());
    let course_or_one = T::select(usable, course, T::one());
    let t1 = a * (T::one() / course_or_one);
    let n = cross * (T::one() / area);
    let t2 = n.cross(t1);
    let frame = Frame { t1, t2, n, f11: course, f12: b.dot(t1), f22: b.dot(t2) };
    (frame, usable)
}

/// D(q) e_u and D(q) e_v: sum of corners times gradients of their weights.
#[inline(always)]
pub fn gradient<T: Real>(gradients: &[V2<T::Scalar>], corners: &[V3<T>]) -> (V3<T>, V3<T>) {
    let (mut a, mut b) = (V3::zero(), V3::zero());
    for (g, corner) in gradients.iter().zip(corners) {
        a = a + *corner * T::splat(g.u);
        b = b + *corner * T::splat(g.v);
    }
    (a, b)
}

/// Sum of weights times vectors.
#[inline(always)]
pub fn blend<T: Real>(weights: &[T::Scalar], vectors: &[V3<T>]) -> V3<T> {
    let mut sum = V3::zero();
    for (w, v) in weights.iter().zip(vectors) {
        // On an edge only its two corners count.
        if *w != T::Scalar::zero() {
            sum = sum + *v * T::splat(*w);
        }
    }
    sum
}

impl<T: Real> Frame<T> {
    /// In-plane coordinates of a mapped point.
    #[inline(always)]
    pub fn plane(&self, x: V3<T>) -> V2<T> {
        V2::new(x.dot(self.t1), x.dot(self.t2))
    }

    /// F v.
    #[inline(always)]
    pub fn apply(&self, v: V2<T>) -> V2<T> {
        V2::new(self.f11 * v.u + self.f12 * v.v, self.f22 * v.v)
    }
}

/// Draws the knot centres towards or away from their mean: at beta = 0 their spread is that of the
/// template, at beta = 1 that of the mapped centres (Huang et al. 2025, fig. 13).
#[inline(always)]
pub fn space_knots<T: Real>(stencil: &Stencil<T::Scalar>, beta: T, centers: &mut [V2<T>]) {
    if centers.len() < 2 {
        return;
    }
    let share = T::one() / T::of(centers.len() as f64);
    let mut mean = V2::zero();
    for c in centers.iter() {
        mean = mean + *c;
    }
    mean = mean * share;
    let mut spread = T::zero();
    for c in centers.iter() {
        let off = *c - mean;
        spread += off.dot(off);
    }
    let spread = (spread * share).sqrt();
    let apart = T::zero().lt(spread);
    let rest = T::splat(stencil.rest_spread);
    let scale = (rest + beta * (spread - rest)) / T::select(apart, spread, T::one());
    let scale = T::select(apart, scale, T::one());
    for c in centers.iter_mut() {
        *c = mean + (*c - mean) * scale;
    }
}
