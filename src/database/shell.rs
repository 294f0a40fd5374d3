//! Where a displaced vertex of the pattern lies on the mesh, and from there in space (section 4.5, eq. 9).

use super::forms::FaceFrame;
use super::surface::{NONE, Surface};
use crate::math::{Scalar, V3};

/// Faces that a displacement crosses at most; beyond, the last one is extrapolated.
const MOST_CROSSED: usize = 8;

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

/// Moves a place by (u, v, height), across edges where it leaves its face.
#[inline(always)]
pub fn displaced<T: Scalar>(maps: &[FaceMap<T>], mut place: Place<T>, by: [T; 3]) -> Place<T> {
    let mut map = &maps[place.face as usize];
    let b = place.barycentric[0] + (map.inverse[0] * by[0] + map.inverse[1] * by[1]);
    let c = place.barycentric[1] + (map.inverse[2] * by[0] + map.inverse[3] * by[1]);
    let mut all = [T::one() - b - c, b, c];
    for _ in 0..MOST_CROSSED {
        // The corner whose edge it is farthest beyond, of those with a face across.
        let (mut opposite, mut least) = (3, T::zero());
        for k in 0..3 {
            if all[k] < least && map.steps[(k + 1) % 3].face != NONE {
                (opposite, least) = (k, all[k]);
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
        all = there;
        place.face = step.face;
        map = &maps[place.face as usize];
    }
    Place { barycentric: [all[1], all[2]], height: place.height + by[2], ..place }
}

/// A place in space, relative to the origin: on the face, bent by Phong deformation (James 2020), and lifted along the
/// normal.
#[inline(always)]
pub fn lifted<T: Scalar>(frame: &FaceFrame<T>, place: &Place<T>) -> V3<T> {
    let [b, c] = place.barycentric;
    let a = T::one() - b - c;
    let pairs = [a * b, b * c, c * a];
    let (mut point, mut normal) = ([T::zero(); 4], [T::zero(); 4]);
    for i in 0..4 {
        normal[i] = frame.normal[0][i] + frame.normal[1][i] * b + frame.normal[2][i] * c;
        point[i] = (frame.place[0][i] + frame.place[1][i] * b + frame.place[2][i] * c)
            + (frame.phong[0][i] * pairs[0] + frame.phong[1][i] * pairs[1] + frame.phong[2][i] * pairs[2]);
    }
    let squared = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
    let usable = T::zero() < squared && squared.finite();
    let scale = place.height / T::select(usable, squared, T::one()).sqrt();
    V3::new(point[0] + normal[0] * scale, point[1] + normal[1] * scale, point[2] + normal[2] * scale)
}

/// `C = I - 2 h II` at barycentric coordinates and a height (eq. 7): uu, uv, vv.
#[inline(always)]
pub fn strain<T: Scalar>(frame: &FaceFrame<T>, [b, c]: [T; 2], height: T) -> [T; 4] {
    let mut strain = [T::zero(); 4];
    for i in 0..4 {
        let first = frame.first[0][i] + frame.first[1][i] * b + frame.first[2][i] * c;
        let second = frame.second[0][i] + frame.second[1][i] * b + frame.second[2][i] * c;
        strain[i] = first - second * height;
    }
    strain
}
