//! Where a displaced vertex of the pattern lies on the mesh, and from there in space (section 4.5, eq. 9).

use super::forms::FaceFrame;
use super::surface::{NONE, Surface};
use crate::math::{Real, Scalar, V3};

/// Faces that a displacement crosses at most; beyond, the last one is extrapolated.
pub const MOST_CROSSED: usize = 8;

/// A place on the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Place<T> {
    /// The face.
    pub face: u32,
    /// Barycentric coordinates of its corners 1 and 2.
    pub barycentric: [T; 2],
    /// Height over it, metres.
    pub height: T,
}

/// What of a face does not change and displacements need to know.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct FaceMap<T> {
    /// Rows of the inverse of the material edges.
    pub inverse: [T; 4],
    /// `[edge]` what lies across.
    pub steps: [Step<T>; 3],
}

/// What lies across an edge.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Step<T> {
    /// The face, or [`NONE`].
    pub face: u32,
    /// Which of its corners are this edge's first and second, and the third: two bits each from the lowest on.
    pub corners: u32,
    /// Barycentric coordinates there, in that order, of the corner here that the edge does not touch.
    pub opposite: [T; 3],
}

impl<T: Scalar> FaceMap<T> {
    /// One for each face. Where vertices are to stay in their face, nothing lies across any edge.
    pub fn all(surface: &Surface, stay: bool) -> Vec<Self> {
        let step = |across: &super::surface::Across| Step {
            face: if stay { NONE } else { across.face },
            corners: across.corners.iter().enumerate().map(|(i, c)| u32::from(*c) << (2 * i)).sum(),
            opposite: across.opposite.map(T::of),
        };
        surface
            .inverses
            .iter()
            .zip(&surface.across)
            .map(|([a, b], across)| Self {
                inverse: [a.x, a.y, b.x, b.y].map(T::of),
                steps: across.each_ref().map(step),
            })
            .collect()
    }
}

/// Barycentric coordinates of a face's three corners, after a place in it was moved along u and v.
#[inline(always)]
pub fn shifted<R: Real>(inverse: &[R::Scalar; 4], b: R, c: R, u: R, v: R) -> [R; 3] {
    let row = |i: usize| R::splat(inverse[i]) * u + R::splat(inverse[i + 1]) * v;
    let (b, c) = (b + row(0), c + row(2));
    [R::one() - b - c, b, c]
}

/// Follows barycentric coordinates that leave their face to the face they lie in.
#[inline(always)]
pub fn followed<T: Scalar>(maps: &[FaceMap<T>], mut face: u32, mut all: [T; 3]) -> (u32, [T; 3]) {
    for _ in 0..MOST_CROSSED {
        let map = &maps[face as usize];
        // The corner whose edge it is farthest beyond, of those with a face across.
        let (mut opposite, mut least) = (3, T::zero());
        for (k, b) in all.into_iter().enumerate() {
            if b < least && map.steps[(k + 1) % 3].face != NONE {
                (opposite, least) = (k, b);
            }
        }
        if opposite == 3 {
            break;
        }
        let step = &map.steps[(opposite + 1) % 3];
        let own = [all[(opposite + 1) % 3], all[(opposite + 2) % 3], T::zero()];
        let mut there = [T::zero(); 3];
        for k in 0..3 {
            there[(step.corners >> (2 * k) & 3) as usize] = own[k] + least * step.opposite[k];
        }
        (face, all) = (step.face, there);
    }
    (face, all)
}

/// A place in space, relative to the origin: on the face, bent by Phong deformation (James 2020), and lifted along the
/// normal.
#[inline(always)]
pub fn lifted<R: Real>(frame: &FaceFrame<R::Scalar>, b: R, c: R, height: R) -> V3<R> {
    let a = R::one() - b - c;
    let pairs = [a * b, b * c, c * a];
    let (mut point, mut normal) = ([R::zero(); 3], [R::zero(); 3]);
    for i in 0..3 {
        let at = |rows: &[[R::Scalar; 4]; 3], k: usize| R::splat(rows[k][i]);
        normal[i] = at(&frame.normal, 0) + at(&frame.normal, 1) * b + at(&frame.normal, 2) * c;
        point[i] = (at(&frame.place, 0) + at(&frame.place, 1) * b + at(&frame.place, 2) * c)
            + (at(&frame.phong, 0) * pairs[0]
                + at(&frame.phong, 1) * pairs[1]
                + at(&frame.phong, 2) * pairs[2]);
    }
    let squared = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
    let usable = R::and(R::zero().lt(squared), squared.finite());
    let scale = height / R::select(usable, squared, R::one()).sqrt();
    V3::new(point[0] + normal[0] * scale, point[1] + normal[1] * scale, point[2] + normal[2] * scale)
}

/// `C = I - 2 h II` at barycentric coordinates and a height (eq. 7): uu, uv, vv.
#[inline(always)]
pub fn strain<R: Real>(frame: &FaceFrame<R::Scalar>, b: R, c: R, height: R) -> [R; 3] {
    let mut strain = [R::zero(); 3];
    for i in 0..3 {
        let at = |rows: &[[R::Scalar; 4]; 3], k: usize| R::splat(rows[k][i]);
        let first = at(&frame.first, 0) + at(&frame.first, 1) * b + at(&frame.first, 2) * c;
        let second = at(&frame.second, 0) + at(&frame.second, 1) * b + at(&frame.second, 2) * c;
        strain[i] = first - second * height;
    }
    strain
}
