//! Shapes whose solve is known: a template's own, and that of the first face of a batch.

use super::surface::{Surface, stand_in};
use super::work::Precision;
use crate::knot::{FaceResult, Given, Kernel, KnotState, Start, Status, Workspace};
use crate::math::{V2, V3};
use crate::scene::Scene;

/// A shape and what its solve gave.
#[derive(Debug)]
pub struct Known<T: Precision> {
    /// `[corner]` in the face frame.
    pub shape: Vec<V2<T>>,
    /// `[knot]`
    pub state: Vec<KnotState<T>>,
    pub result: FaceResult<T>,
    /// Whether this holds a solve that came to an end.
    pub sound: bool,
    work: Workspace<T>,
}

impl<T: Precision> Known<T> {
    /// Room for a stitch type's.
    pub fn nothing(kernel: &Kernel<T>) -> Self {
        let mut work = Workspace::default();
        kernel.fit(&mut work);
        // The solve does not see how the surface is bent.
        work.normals.fill(V3::new(T::zero(), T::zero(), T::one()));
        Self {
            shape: work.shape.clone(),
            state: work.state.clone(),
            result: super::unsolved(),
            sound: false,
            work,
        }
    }

    fn solve(&mut self, kernel: &Kernel<T>) {
        let ended = T::face(kernel, &mut self.work, Given::nothing());
        self.sound = ended.sound;
        self.result = ended.lane(0);
        self.shape.copy_from_slice(&self.work.shape);
        self.state.copy_from_slice(&self.work.state);
    }

    /// The template's own shape. With the start at the previous frame's result, only if its solve would not go on.
    pub fn at_rest(scene: &Scene, stencil: usize, kernel: &Kernel<T>, start: Start) -> Option<Self> {
        if !kernel.solves() {
            return None;
        }
        let mut known = Self::nothing(kernel);
        let corners = &scene.templates[stencil].corners;
        for (at, corner) in known.work.corners.iter_mut().zip(corners) {
            *at = V3::of((*corner - corners[0]).extend(0.0));
        }
        known.solve(kernel);
        let ended = start != Start::Previous || known.result.status != Status::Stepped;
        (known.sound && ended).then_some(known)
    }

    /// Takes in the first face of a batch, unless it stands where it stood.
    pub fn update(&mut self, corners: &[u32], kernel: &Kernel<T>, surface: &Surface<T>) {
        if self.sound && !corners.iter().any(|v| surface.moved[*v as usize]) {
            return;
        }
        self.sound = false;
        if surface.not_finite && stand_in(corners, &surface.local).is_some() {
            return;
        }
        let first = surface.local[corners[0] as usize];
        for (at, vertex) in self.work.corners.iter_mut().zip(corners) {
            *at = surface.local[*vertex as usize] - first;
        }
        self.solve(kernel);
    }
}
