//! How far f32 may be from f64.
//!
//! Both see the same corners: they are representable in f32. What remains are the roundings of the operations.
//! With e = 2^-23, X = 1 + the greatest distance of a corner from the first + the greatest half-length, and s the
//! slant of the face frame, |D|^2 / |D e_u x D e_v| (at least 2, that of a square; a face has a frame up to 1e6):
//!
//! - **Interpolated points** are sums of corners, and a shift along a normal: off by a few e (X + their distance
//!   from the origin), and by z times the error of the normal, e times the face's own slant. Bound:
//!   [`INTERPOLATED`] of that.
//! - **Energies.** sqrt(E) is the length of the vector of residuals, so by the triangle inequality the sqrt(E) of
//!   one and the same state differ by no more than the rounding of the residuals: weights (10 for lengths, 1 for
//!   cosines, of segments that are r or more) times e X, times s for what the frame's own error moves; and summing
//!   some thirty squares rounds sqrt(E) itself by a few e. Bound:
//!   |sqrt(E32) - sqrt(E64)| <= [`ENERGY`] e (s X max(sqrt(weights)) + sqrt(E)), for the f32 end state as f32 reports
//!   it and as f64 works it out. As f32 never ends above its own start, its end lies below its start in f64 too, by that
//!   bound. No bound holds for the places of points in general: with several minima, a start on the ridge
//!   between two goes down on either side.
//! - **Mild faces** (stretches of 0.8 to 1.25) from the affine start: all points are within [`MILD_POINTS`] r, for
//!   all but one face in [`MILD_FACES`]. A step is undone where f32 cannot see that it lowers E, so places are off by
//!   some sqrt(e E / weight), not by e; and where a step passes by a saddle the two go down on either side of it
//!   (seen once in 33,630 mild faces, in a purl over two loops: f32 ended at E = 2.10, f64 at 2.25).
//!
//! Compared are faces whose area has a square among the normal numbers of f32, [`AREAS`], and whose corners are
//! within [`REACH`]: beyond, both precisions do not see the same face.

use crate::knot::frame::gradient;
use crate::math::V3;
use crate::scene::Stencil;
use glam::DVec3;

/// Of e (X + distance), see above.
pub const INTERPOLATED: f64 = 32.0;
/// Of e (s X sqrt(weight) + sqrt(E)), see above.
pub const ENERGY: f64 = 16.0;
/// In r, see above.
pub const MILD_POINTS: f64 = 0.01;
/// One face of so many may be further off, see above.
pub const MILD_FACES: u64 = 1000;
/// Areas of faces that are compared, template units.
pub const AREAS: std::ops::Range<f64> = 1e-15..1e18;
/// Distances of corners from the origin that are compared, template units.
pub const REACH: f64 = 1e18;
/// Energies this near, as a share of 1 + E, are one to f32: sums of some thirty squares.
pub const ONE_ENERGY: f64 = 1e-6;
/// Distances of points, f32 from f64, whose shares are printed, in r.
pub const LEVELS: [f64; 6] = [1e-4, 1e-3, 1e-2, 0.1, 1.0, f64::INFINITY];

/// What is known of a face's shape, for the bounds.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Greatest distance of a corner from the first, template units.
    pub size: f64,
    /// Greatest distance of a corner from the origin, template units.
    pub away: f64,
    /// |D e_u x D e_v| of the face frame.
    pub area: f64,
    /// |D|^2 / |D e_u x D e_v| of the face frame.
    pub slant: f64,
    /// Sum of squared sides and diagonals over the vector area.
    pub area_slant: f64,
}

impl Shape {
    /// Of a face; nothing where a corner is not finite. `corners` in world units, `gauge` world units a template
    /// unit.
    pub fn of(stencil: &Stencil<f64>, corners: &[DVec3], gauge: f64) -> Option<Self> {
        if corners.iter().any(|p| !p.is_finite()) {
            return None;
        }
        let local: Vec<DVec3> = corners.iter().map(|p| *p / gauge).collect();
        let size = local.iter().map(|p| p.distance(local[0])).fold(0.0, f64::max);
        let away = local.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let off: Vec<V3<f64>> = local.iter().map(|p| V3::of(*p - local[0])).collect();
        let (a, b) = gradient(&stencil.frame_gradients, &off);
        let area = a.cross(b).length();
        let (mut sum, mut sides) = (V3::zero(), 0.0);
        for pair in off[1..].windows(2) {
            sum = sum + pair[0].cross(pair[1]) * 0.5;
            sides += pair[0].dot(pair[0]) + pair[1].dot(pair[1]);
        }
        let finite = |x: f64| if x.is_finite() { x } else { f64::INFINITY };
        let slant = finite((a.dot(a) + b.dot(b)) / area);
        Some(Self { size, away, area, slant, area_slant: finite(sides / sum.length()) })
    }

    /// Whether f32 and f64 are compared.
    pub fn comparable(&self) -> bool {
        AREAS.contains(&self.area) && self.away < REACH
    }
}

const E: f64 = f32::EPSILON as f64;

/// Allowed distance of an interpolated point at height z, template units.
pub fn interpolated(shape: &Shape, z: f64) -> f64 {
    let normal = (INTERPOLATED * E * shape.area_slant).min(2.0);
    // Near the limit of 1e6 the normal may be zero in one precision only.
    let normal = if shape.area_slant < 1e5 { normal } else { 2.0 };
    INTERPOLATED * E * (1.0 + shape.size + shape.away) + z.abs() * normal
}

/// Allowed difference of the square roots of energies: `root` is that of f64's, `half_length` the greatest of the
/// knots', `weight` the greater of the two weights.
pub fn energy(shape: &Shape, half_length: f64, weight: f64, root: f64) -> f64 {
    ENERGY * E * (shape.slant * (1.0 + shape.size + half_length) * weight.sqrt() + root)
}
