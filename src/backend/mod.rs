//! Backends: a scene once, positions each frame, control points out.

mod cpu;
mod device;
#[cfg(feature = "gpu")]
pub mod gpu;
mod known;
mod rigid;
mod scatter;
mod sight;
mod skip;
mod surface;
pub mod table_cache;
mod tables;
mod work;

pub use cpu::{CpuBackend, Running};
pub use device::{DeviceBackend, DeviceKind, FoundGpu, OnGpu, Recipe};
pub(crate) use scatter::Scatter;
pub use skip::{Skip, Skipped};
pub use surface::middle;
pub use tables::{TableReport, TableSource, Tables};
pub use work::Precision;

use crate::ids::FaceId;
use crate::knot::table::Table;
use crate::knot::{FaceResult, Kernel, KnotState, Settings, Start, Status};
use crate::math::{Scalar, V3};
use crate::scene::{Batch, Scene};
use crate::{Error, Result};
use glam::DVec3;
use known::Known;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// Numbers for backends and their frames, never the same twice.
static STAMPS: AtomicU64 = AtomicU64::new(1);

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

    /// Tells the positions of the next frame ahead, where they are known: a device may work on it while this thread does
    /// something else. The next [`Backend::frame`] must then be given the same positions and the output of the last
    /// frame; else it begins anew. The next frame's visibility is set before.
    ///
    /// # Errors
    /// Those of [`Backend::frame`].
    fn ahead(&mut self, _positions: &[DVec3]) -> Result<()> {
        Ok(())
    }

    /// Names the faces of the mesh that need to be right from the next frame on; `None` for all. Faces that share a
    /// yarn point with one of them are worked on too; others have the status `Hidden` and keep the points that
    /// they had. In an output that is new to this backend they had none: there they are interpolated once, their
    /// knots as in the template.
    ///
    /// A face that is shown again is right in that same frame; with the start at the previous frame's result it
    /// starts as it would in a first frame.
    ///
    /// # Errors
    /// Another number of faces than the mesh has.
    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()>;

    /// Says what is wanted of the next frames, so that a device need not bring back all there is. Knots come back all the
    /// same where another backend may have to go on from them. To be said before a frame is told ahead: one that is under
    /// way when something else is wanted is dropped, and solved again when it is asked for.
    ///
    /// # Errors
    /// A device without room for it.
    fn set_wanted(&mut self, _wanted: Wanted) -> Result<()> {
        Ok(())
    }

    /// Seconds that the device itself says the passes of the last frame took, by name; none where nothing was to be done,
    /// nobody asked for times or the device takes none.
    fn device_times(&self) -> &[(&'static str, f64)] {
        &[]
    }

    /// Says what places are relative to ([`FrameOutput::origin`]), before the first frame; without, that is the [`middle`]
    /// of the first frame. After a frame it changes nothing.
    fn set_origin(&mut self, origin: DVec3);

    /// What became of the stitch types' tables; the tables themselves are with the kernels.
    fn tables(&self) -> &Tables;

    /// The control points of the last frame where they lie on a device, all in one buffer; `None` where they do not.
    #[cfg(feature = "gpu")]
    fn device_points(&self) -> Option<gpu::DevicePoints<'_>> {
        None
    }

    /// Gives its device up, as if it had failed: every frame from now on is an error. For tests; a CPU cannot fail.
    #[doc(hidden)]
    fn lose(&mut self) {}
}

/// The result of a frame. Places are in template units relative to `origin`: world = origin + gauge * place.
#[derive(Clone, Debug)]
pub struct FrameOutput<T> {
    /// World position that places are relative to; the same for all frames of a backend.
    pub origin: DVec3,
    /// World units per template unit.
    pub gauge: f64,
    /// `[point]` control points in the order of [`crate::scene::Yarns`]; none where nobody asked for them and the backend can keep
    /// them to itself.
    pub points: Vec<V3<T>>,
    /// Samples of the curves through them, where they were asked for and the backend makes them.
    pub curves: SampledCurves<T>,
    /// `[knot]` end states, in batch order; none where nobody asked for them and the backend can keep them to itself.
    pub knots: Vec<KnotState<T>>,
    /// `[face]` in batch order.
    pub faces: Vec<FaceResult<T>>,
    /// What was left undone.
    pub skipped: Skipped,
    /// Tell a backend whether a frame of its own is in here, and whether it is the last one.
    backend: u64,
    stamp: u64,
}

/// The yarns' curves, sampled.
#[derive(Clone, Debug)]
pub struct SampledCurves<T> {
    /// Extra points a segment; 0 where there are no samples.
    pub subdivide: usize,
    /// `[sample]` yarn after yarn ([`crate::scene::Yarns::first_sample`]), as places are given.
    pub points: Vec<V3<T>>,
}

impl<T> Default for SampledCurves<T> {
    fn default() -> Self {
        Self { subdivide: 0, points: Vec::new() }
    }
}

/// What of a frame is wanted, beyond control points and how each face ended. What is not may be left out of the output,
/// or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Control points.
    pub points: bool,
    /// Knots.
    pub knots: bool,
    /// Samples of curves, with so many extra points a segment; 0 for none. Where a backend makes none,
    /// [`crate::curve::FrameCurves`] does.
    pub curves: usize,
}

impl Default for Wanted {
    fn default() -> Self {
        Self { points: true, knots: true, curves: 0 }
    }
}

/// In place of a backend's name: the knots are starts that somebody gave.
const GIVEN: u64 = u64::MAX;

impl<T> Default for FrameOutput<T> {
    fn default() -> Self {
        Self {
            origin: DVec3::ZERO,
            gauge: 1.0,
            points: Vec::new(),
            curves: SampledCurves::default(),
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

/// Whether settings are in range.
fn check(settings: &Settings, running: &Running) -> Result<()> {
    for (name, value) in [
        ("beta", settings.beta),
        ("weight-angle", settings.weight_angle),
        ("weight-length", settings.weight_length),
        ("skip-tolerance", running.skip.tolerance),
    ] {
        if !(0.0..=1e12).contains(&value) {
            return Err(Error::invalid(format_args!("--{name} {value:e}: expected a number from 0 to 1e12")));
        }
    }
    Ok(())
}

/// `[batch]` the kernels of a scene, with their tables, and what became of those.
fn kernels<T: Scalar>(
    scene: &Scene,
    settings: &Settings,
    running: &Running,
    cache: Option<&Path>,
) -> (Vec<Kernel<T>>, Tables) {
    let mut tables = Tables::new(scene, settings, cache);
    let kernel = |(stencil, table): (_, Option<Table<f32>>)| {
        let kernel = Kernel::new(stencil, scene.mode, settings).with_energies(running.energies);
        kernel.with_table(table.map(|t| Arc::new(t.cast())))
    };
    let of_stencil = std::mem::take(&mut tables.tables);
    (scene.stencils.iter().zip(of_stencil).map(kernel).collect(), tables)
}

/// `[batch]` the templates' own shapes, and room for the first faces', where they may be skipped.
#[expect(clippy::type_complexity)]
fn known_shapes<T: Precision>(
    scene: &Scene,
    kernels: &[Kernel<T>],
    skip: &Skip,
    start: Start,
) -> (Vec<Option<Known<T>>>, Vec<Option<Known<T>>>) {
    let batches = || scene.batches.iter().zip(kernels);
    let rest = |(b, k): (&Batch, _)| skip.rest.then(|| Known::at_rest(scene, b.stencil, k, start)).flatten();
    // With the start at the previous frame's result, faces of one shape need not end alike.
    let shares = skip.shared && start != Start::Previous;
    let first =
        |(b, k): (&Batch, &Kernel<T>)| (shares && k.solves() && b.faces.len() > 1).then(|| Known::nothing(k));
    (batches().map(rest).collect(), batches().map(first).collect())
}

/// What is reported of a face with nothing to solve.
fn unsolved<T: Scalar>() -> FaceResult<T> {
    FaceResult { energy_start: T::zero(), energy: T::zero(), status: Status::Interpolated }
}
