//! What a frame leaves undone because its result is known.

use crate::knot::Kernel;
use crate::math::{Real, Scalar, V2};
use crate::scene::Scene;

/// Work to skip where that does not change the result by more than its bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skip {
    /// Faces whose corners and normals are, to the bit, where they were: nothing is done. Changes nothing.
    pub unmoved: bool,
    /// Faces of the shape they were last solved for, wherever they moved to: only lifted.
    pub rigid: bool,
    /// Faces of their template's own shape: only lifted.
    pub rest: bool,
    /// Faces of the shape of the first face of their type: they take its knots over.
    pub shared: bool,
    /// Shapes are the same where no corner is off by more than this in the face frame, along either axis; yarn radii.
    pub tolerance: f64,
}

impl Skip {
    /// Skips nothing.
    pub const NOTHING: Self =
        Self { unmoved: false, rigid: false, rest: false, shared: false, tolerance: 0.0 };
}

impl Default for Skip {
    fn default() -> Self {
        Self { unmoved: true, rigid: true, rest: true, shared: true, tolerance: 1e-3 }
    }
}

/// How many faces of a frame were not solved, and why; the rest was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Skipped {
    /// Not visible: nothing was done.
    pub hidden: usize,
    /// Nothing around them moved: nothing was done.
    pub unmoved: usize,
    /// Without knots, or a mode that does not solve: interpolated.
    pub without_knots: usize,
    /// Of the shape they were last solved for: lifted.
    pub rigid: usize,
    /// Of their template's own shape: lifted.
    pub rest: usize,
    /// Of the shape of the first face of their type: lifted.
    pub shared: usize,
}

impl Skipped {
    /// Of a frame that was only turned along.
    pub(super) fn turned<T: Scalar>(scene: &Scene, kernels: &[Kernel<T>]) -> Self {
        let solved = scene.batches.iter().zip(kernels).filter(|(_, k)| k.solves());
        let rigid = solved.map(|(b, _)| b.faces.len()).sum();
        Self { rigid, without_knots: scene.face_count - rigid, ..Self::default() }
    }
}

impl std::ops::Add for Skipped {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            hidden: self.hidden + other.hidden,
            unmoved: self.unmoved + other.unmoved,
            without_knots: self.without_knots + other.without_knots,
            rigid: self.rigid + other.rigid,
            rest: self.rest + other.rest,
            shared: self.shared + other.shared,
        }
    }
}

/// Whether no corner of the shape in a lane is apart from another shape's by more than `tolerance` along either axis.
/// A plain loop: adaptors that carry lanes become calls.
#[inline(always)]
pub(super) fn same<R: Real>(a: &[V2<R>], lane: usize, b: &[V2<R::Scalar>], tolerance: R::Scalar) -> bool {
    let mut off = false;
    for (a, b) in a.iter().zip(b) {
        let (u, v) = (a.u.lane(lane) - b.u, a.v.lane(lane) - b.v);
        off |= !(u.abs() <= tolerance && v.abs() <= tolerance);
    }
    !off
}
