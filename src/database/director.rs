//! Directors: which way across the yarn its material points, edge by edge (supplementary section S2.1 of the paper).

use super::forms::{FaceFrame, Form};
use super::shell::Place;
use super::{Compat, Fabric, YarnFrame};
use crate::math::{Scalar, V3};
use glam::{DVec2, DVec3};

/// A frame's mesh and where its points lie on it.
pub(super) struct Shell<'a, T> {
    /// `[face]`
    pub forms: &'a [Form<T>],
    /// `[face]`
    pub frames: &'a [FaceFrame<T>],
    /// `[home]`
    pub places: &'a [Place<T>],
}

/// `[point]` the director of the edge that leaves each point: the pattern's reference director, carried along as normals are
/// (by the inverse transpose of the shell's gradient), made orthogonal to the edge and of unit length, and turned about it by
/// the twist. The last point of an open yarn has that of the edge that reaches it.
///
/// With [`Compat::Madypg`] neither orthogonal nor of unit length nor turned, and on edges that cross periods off by that
/// program's tangent.
pub(super) fn directors<T: Scalar>(fabric: &Fabric, shell: &Shell<T>, frame: &YarnFrame<T>) -> Vec<V3<T>> {
    let compat = fabric.settings.compat == Compat::Madypg;
    let rest = if compat { as_madypg(fabric) } else { fabric.model.pattern.directors.clone() };
    let mut carried = vec![DVec3::ZERO; fabric.point_count()];
    for (home, point) in fabric.homes.points.iter().enumerate() {
        let vertex = fabric.rows[fabric.homes.rows[home] as usize].0;
        carried[*point as usize] = carry(shell, &shell.places[home], rest[vertex as usize], compat);
    }
    if !compat {
        for yarn in 0..fabric.yarn_count() {
            let range = fabric.yarn(yarn);
            finish(frame, range, fabric.yarn_closed[yarn], &mut carried);
        }
    }
    carried.into_iter().map(V3::of).collect()
}

/// `Q^-T d` of the shell's gradient Q: the face's columns and the normal. Without `divided`, by the cofactors of Q: the same
/// direction without a division.
fn carry<T: Scalar>(shell: &Shell<T>, place: &Place<T>, director: DVec3, divided: bool) -> DVec3 {
    let [u, v] = shell.forms[place.face as usize].gradient.map(|g| g.to_f64());
    let rows = &shell.frames[place.face as usize].normal;
    let row = |k: usize| DVec3::new(rows[k][0].to_f64(), rows[k][1].to_f64(), rows[k][2].to_f64());
    let [b, c] = place.barycentric.map(|b| b.to_f64());
    let normal = (row(0) + row(1) * b + row(2) * c).normalize_or_zero();
    let cofactors = v.cross(normal) * director.x + normal.cross(u) * director.y + u.cross(v) * director.z;
    let volume = u.cross(v).dot(normal);
    if divided { cofactors / volume } else { cofactors * if volume < 0.0 { -1.0 } else { 1.0 } }
}

/// Makes directors of a yarn orthogonal to its edges and turns them by the twist.
fn finish<T: Scalar>(
    frame: &YarnFrame<T>,
    range: std::ops::Range<usize>,
    closed: bool,
    directors: &mut [DVec3],
) {
    let last = range.end - 1;
    let at = |point: usize| frame.points[point].to_f64();
    for point in range.clone() {
        let way = match (point == last, closed) {
            (false, _) => at(point + 1) - at(point),
            (true, true) => at(range.start) - at(point),
            (true, false) => at(point) - at(point - 1),
        };
        let tangent = way.try_normalize().unwrap_or(DVec3::X);
        let across = directors[point].reject_from_normalized(tangent);
        let across = across.try_normalize().unwrap_or_else(|| tangent.any_orthonormal_vector());
        let (sine, cosine) = frame.twists[point].to_f64().sin_cos();
        // Once more, for what rounding left along the tangent.
        let turned = across * cosine + tangent.cross(across) * sine;
        directors[point] = turned.reject_from_normalized(tangent).normalize_or(across);
    }
}

/// MADYPG takes the way to the next period for the tangent of edges that cross periods, and none elsewhere.
fn as_madypg(fabric: &Fabric) -> Vec<DVec3> {
    let pattern = &fabric.model.pattern;
    let mut directors = pattern.directors.clone();
    for edge in &pattern.edges {
        let jump: DVec2 = edge.tile.as_dvec2() * pattern.size;
        if let Some(tangent) = jump.extend(0.0).try_normalize() {
            let director = &mut directors[edge.from as usize];
            *director = director.reject_from_normalized(tangent).normalize_or(*director);
        }
    }
    directors
}
