//! Where fabric lies that nothing holds: as it lay before.

use glam::{DMat3, DQuat, DVec3};

/// Turns and moves `x` as a whole so that it lies as near to `start` as it can; `masses` are its weights, and what has none stays.
///
/// The rotation is found as by Müller et al. 2016, "A robust method to extract the rotational part of deformations".
pub(super) fn align(x: &mut [DVec3], start: &[DVec3], masses: &[f64]) {
    let total: f64 = masses.iter().sum();
    let mean = |x: &[DVec3]| x.iter().zip(masses).map(|(p, m)| *p * *m).sum::<DVec3>() / total;
    let (from, to) = (mean(x), mean(start));
    let mut a = DMat3::ZERO;
    for ((p, q), m) in x.iter().zip(start).zip(masses) {
        let (p, q) = (*p - from, (*q - to) * *m);
        a += DMat3::from_cols(q * p.x, q * p.y, q * p.z);
    }
    let mut turn = DQuat::IDENTITY;
    for _ in 0..1000 {
        let r = DMat3::from_quat(turn);
        let cross = r.x_axis.cross(a.x_axis) + r.y_axis.cross(a.y_axis) + r.z_axis.cross(a.z_axis);
        let dot = r.x_axis.dot(a.x_axis) + r.y_axis.dot(a.y_axis) + r.z_axis.dot(a.z_axis);
        let by = cross / dot.abs();
        if !(by.is_finite() && by.length() > 1e-12) {
            break;
        }
        turn = (DQuat::from_scaled_axis(by) * turn).normalize();
    }
    if !(from.is_finite() && to.is_finite() && turn.is_finite()) {
        return;
    }
    for (p, _) in x.iter_mut().zip(masses).filter(|(_, m)| **m > 0.0) {
        *p = to + turn * (*p - from);
    }
}
