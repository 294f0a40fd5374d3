//! Backends: a scene once, positions each frame, control points out.

mod cpu;
pub mod table_cache;
mod tables;

pub use cpu::CpuBackend;
pub use tables::{TableReport, TableSource, Tables};

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
    /// `output`, whose memory is reused.
    ///
    /// # Errors
    /// Another number of positions than the scene has vertices; a position that is not finite.
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
}

impl<T> Default for FrameOutput<T> {
    fn default() -> Self {
        Self { origin: DVec3::ZERO, gauge: 1.0, points: Vec::new(), knots: Vec::new(), faces: Vec::new() }
    }
}

impl<T: Scalar> FrameOutput<T> {
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
