//! Backends: a scene once, positions each frame, control points out.

mod cpu;
mod known;
mod rigid;
mod scatter;
mod skip;
mod surface;
pub mod table_cache;
mod tables;
mod work;

pub use cpu::{CpuBackend, Running};
pub use skip::{Skip, Skipped};
pub use tables::{TableReport, TableSource, Tables};
pub use work::Precision;

use crate::Result;
use crate::ids::FaceId;
use crate::knot::{FaceResult, KnotState, Status};
use crate::math::{Scalar, V3};
use crate::scene::Scene;
use glam::DVec3;

/// Turns the positions of a frame into control points.
pub trait Backend<T: Scalar> {
    /// Solves one frame.
    ///
    /// `positions` are world coordinates, one per vertex of the scene's mesh. The result replaces what is in
    /// `output`, whose memory is reused; faces that did not move are left as they are there, if it holds this
    /// backend's last frame. Faces with a corner that is not finite fall back, that corner at the mean of the
    /// others, and take no part in their neighbours' normals; all points are finite.
    ///
    /// # Errors
    /// Another number of positions than the scene has vertices.
    fn frame(&mut self, positions: &[DVec3], output: &mut FrameOutput<T>) -> Result<()>;
}

/// The result of a frame. Places are in template units relative to `origin`: world = origin + gauge * place.
#[derive(Clone, Debug)]
pub struct FrameOutput<T> {
    /// World position that places are relative to; the same for all frames of a backend.
    pub origin: DVec3,
    /// World units per template unit.
    pub gauge: f64,
    /// `[point]` control points in the order of [`crate::scene::Yarns`].
    pub points: Vec<V3<T>>,
    /// `[knot]` end states, in batch order.
    pub knots: Vec<KnotState<T>>,
    /// `[face]` in batch order.
    pub faces: Vec<FaceResult<T>>,
    /// What was left undone.
    pub skipped: Skipped,
    /// Tell a backend whether a frame of its own is in here, and whether it is the last one.
    backend: u64,
    stamp: u64,
}

/// In place of a backend's name: the knots are starts that somebody gave.
const GIVEN: u64 = u64::MAX;

impl<T> Default for FrameOutput<T> {
    fn default() -> Self {
        Self {
            origin: DVec3::ZERO,
            gauge: 1.0,
            points: Vec::new(),
            knots: Vec::new(),
            faces: Vec::new(),
            skipped: Skipped::default(),
            backend: 0,
            stamp: 0,
        }
    }
}

impl<T: Scalar> FrameOutput<T> {
    /// An output whose knots (in batch order) a backend with [`crate::knot::Start::Previous`] that has run before
    /// starts from, whatever they are.
    pub fn starting_from(knots: Vec<crate::knot::KnotState<T>>) -> Self {
        Self { knots, backend: GIVEN, ..Self::default() }
    }

    /// A control point in world coordinates.
    #[inline]
    pub fn world(&self, point: usize) -> DVec3 {
        self.origin + self.points[point].to_f64() * self.gauge
    }

    /// What is known of a face.
    pub fn face(&self, scene: &Scene, face: FaceId) -> FaceResult<T> {
        let place = scene.face_places[face.index()];
        if place.skipped() {
            return FaceResult { energy_start: T::zero(), energy: T::zero(), status: Status::Skipped };
        }
        let batch = &scene.batches[place.batch as usize];
        self.faces[batch.first_face + place.index as usize]
    }

    /// The knots of a face.
    pub fn face_knots<'a>(&'a self, scene: &Scene, face: FaceId) -> &'a [KnotState<T>] {
        let place = scene.face_places[face.index()];
        if place.skipped() {
            return &[];
        }
        let batch = &scene.batches[place.batch as usize];
        let count = scene.stencils[batch.stencil].knot_count();
        let first = batch.first_knot + place.index as usize * count;
        &self.knots[first..first + count]
    }
}

/// What is reported of a face with nothing to solve.
fn unsolved<T: Scalar>() -> FaceResult<T> {
    FaceResult { energy_start: T::zero(), energy: T::zero(), status: Status::Interpolated }
}
