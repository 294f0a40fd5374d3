//! The CPU backend: rayon over chunks of each batch, lanes within a chunk.

use super::known::Known;
use super::scatter::Scatter;
use super::sight::Sight;
use super::skip::{Skip, Skipped};
use super::surface::Surface;
use super::work::{Bench, CHUNK, Chunk, Precision, Task};
use super::{Backend, FrameOutput, Tables, unsolved};
use crate::knot::{FaceResult, Kernel, KnotState, Settings, Start};
use crate::math::{V2, V3, Width};
use crate::scene::Scene;
use crate::{Error, Result};
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex};

/// Seams that one task works on.
const SEAMS: usize = 8192;
/// More threads than this are a slip of the keyboard.
const MOST_THREADS: usize = 1024;

/// How a backend goes about its work; see also [`Settings`], which say what it works out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Running {
    /// Threads; 0 takes one per core.
    pub threads: usize,
    /// Stitches side by side, in f32.
    pub width: Width,
    /// What is left undone where it can be.
    pub skip: Skip,
    /// Whether every face's energies are worked out. Without, they are NaN where the method needs none: always with
    /// modes that solve nothing, at the end with plain Gauss-Newton.
    pub energies: bool,
}

impl Default for Running {
    fn default() -> Self {
        Self { threads: 0, width: Width::default(), skip: Skip::default(), energies: true }
    }
}

/// Runs scenes on the CPU, in f64 (the reference) or f32 (its twin).
#[derive(Debug)]
pub struct CpuBackend<T: Precision> {
    scene: Arc<Scene>,
    /// `[batch]`, each of a stencil of its own
    kernels: Vec<Kernel<T>>,
    tables: Tables,
    start: Start,
    running: Running,
    pool: Arc<rayon::ThreadPool>,
    benches: Vec<Bench>,
    surface: Surface<T>,
    /// `[seam][side]` what the two faces say of a shared point.
    sides: Vec<V3<T>>,
    /// `[batch]` the templates' own shapes.
    rests: Vec<Option<Known<T>>>,
    /// `[batch]` the batches' first faces, where they are shared.
    firsts: Vec<Option<Known<T>>>,
    /// `[face][corner but the first]` in batch order, the shapes that knots were solved for.
    shapes: Vec<V2<T>>,
    remembered: Vec<bool>,
    sight: Sight,
    /// Frames in a row that were turned along as one.
    turned: u32,
    /// Names this backend, and its last frame.
    name: u64,
    stamp: u64,
}

impl<T: Precision> CpuBackend<T> {
    /// A backend for a scene.
    ///
    /// # Errors
    /// Settings out of range; threads that cannot be started.
    pub fn new(scene: Arc<Scene>, settings: &Settings, running: &Running) -> Result<Self> {
        Self::with_cache(scene, settings, running, None)
    }

    /// The same, with a folder in which tables are kept ([`super::table_cache`]).
    ///
    /// # Errors
    /// Those of [`CpuBackend::new`]; none for the folder.
    pub fn with_cache(
        scene: Arc<Scene>,
        settings: &Settings,
        running: &Running,
        cache: Option<&Path>,
    ) -> Result<Self> {
        super::check(settings, running)?;
        let threads = running.threads;
        if threads > MOST_THREADS {
            return Err(Error::invalid(format_args!("--threads {threads}: expected 0 to {MOST_THREADS}")));
        }
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::invalid(format_args!("cannot start {threads} threads: {e}")))?;
        let (kernels, tables) = pool.install(|| super::kernels::<T>(&scene, settings, running, cache));
        let (rests, firsts) = super::known_shapes(&scene, &kernels, &running.skip, settings.start);
        Ok(Self {
            rests,
            firsts,
            kernels,
            tables,
            start: settings.start,
            running: *running,
            benches: (0..pool.current_num_threads()).map(|_| Mutex::default()).collect(),
            pool: Arc::new(pool),
            surface: Surface::default(),
            sides: vec![V3::zero(); 2 * scene.yarns.seams.len()],
            shapes: Vec::new(),
            remembered: Vec::new(),
            sight: Sight::default(),
            turned: 0,
            name: super::STAMPS.fetch_add(1, Relaxed),
            stamp: 0,
            scene,
        })
    }

    /// Goes on where another backend of the same scene and settings left off: its last frame counts as this one's.
    pub(super) fn take_over(&mut self, output: &FrameOutput<T>) {
        if output.stamp == 0 {
            return;
        }
        (self.name, self.stamp) = (output.backend, output.stamp);
        self.surface.set_origin(output.origin);
        // What hidden faces say of shared points is not known: as much as both together did.
        for (sides, point) in self.sides.chunks_exact_mut(2).zip(&self.scene.yarns.seams) {
            sides.fill(output.points[*point as usize]);
        }
    }

    /// `[seam][side]` what the two faces say of a shared point.
    #[cfg(feature = "gpu")]
    pub(super) fn sides(&self) -> &[V3<T>] {
        &self.sides
    }

    /// The places of vertices, the areas of faces and the normals of corner groups of the last frame, as the GPU backend
    /// keeps them.
    pub fn surface(&self) -> Vec<V3<T>> {
        let surface = &self.surface;
        [&surface.local, &surface.areas, &surface.normals].into_iter().flatten().copied().collect()
    }

    /// The face-local points of the last frame by slot, before shared boundary points are averaged; same
    /// units as [`FrameOutput::points`], which `output` of that frame holds.
    pub fn slots(&self, output: &FrameOutput<T>) -> Vec<V3<T>> {
        let mut slots = vec![V3::zero(); self.scene.slot_count];
        let sources = self.scene.point_slots();
        for (slot, point) in sources.iter().zip(&output.points) {
            slots[slot[0] as usize] = *point;
        }
        for (point, sides) in self.scene.yarns.seams.iter().zip(self.sides.chunks_exact(2)) {
            for (slot, side) in sources[*point as usize].iter().zip(sides) {
                slots[*slot as usize] = *side;
            }
        }
        slots
    }

    fn solve(&mut self, output: &mut FrameOutput<T>, continued: bool) -> Skipped {
        let scene = &*self.scene;
        let (kernels, surface) = (&self.kernels, &self.surface);
        self.firsts.par_iter_mut().zip(&scene.batches).zip(kernels).for_each(|((first, batch), kernel)| {
            if let Some(first) = first {
                first.update(&batch.corners[..kernel.stencil.corner_count], kernel, surface);
            }
        });
        if self.running.skip.rigid {
            let batches = scene.batches.iter().zip(&self.kernels);
            let count = batches.map(|(b, k)| b.faces.len() * (k.stencil.corner_count - 1)).sum();
            self.shapes.resize(count, V2::zero());
            self.remembered.resize(scene.face_count, false);
        }
        let frame = Frame {
            scene,
            kernels,
            surface,
            rests: &self.rests,
            firsts: &self.firsts,
            start: self.start,
            running: self.running,
            own: output.backend == self.name || output.backend == super::GIVEN,
            continued,
            visible: self.sight.faces.as_deref(),
            benches: &self.benches,
            points: Scatter::new(&mut output.points),
            sides: Scatter::new(&mut self.sides),
        };
        let part = Part {
            results: &mut output.faces,
            knots: &mut output.knots,
            shapes: &mut self.shapes,
            remembered: &mut self.remembered,
        };
        frame.batches(0..scene.batches.len(), part)
    }

    /// Shared points are the mean of what both faces say.
    fn join(&self, output: &mut FrameOutput<T>) {
        let half = T::of(0.5);
        let points = Scatter::new(&mut output.points);
        let seams = self.scene.yarns.seams.par_chunks(SEAMS).zip(self.sides.par_chunks(2 * SEAMS));
        seams.for_each(|(seams, sides)| {
            for (point, sides) in seams.iter().zip(sides.chunks_exact(2)) {
                #[allow(unsafe_code)]
                // SAFETY: each seam has a control point of its own.
                unsafe {
                    points.write(*point as usize, (sides[0] + sides[1]) * half);
                }
            }
        });
    }
}

impl<T: Precision> Backend<T> for CpuBackend<T> {
    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        self.sight.set(&self.scene, visible)
    }

    fn set_origin(&mut self, origin: DVec3) {
        self.surface.set_origin(origin);
    }

    fn tables(&self) -> &Tables {
        &self.tables
    }

    fn frame(&mut self, positions: &[DVec3], output: &mut FrameOutput<T>) -> Result<()> {
        // Curves are sampled as they are written: that takes no memory.
        output.curves.subdivide = 0;
        let continued = self.stamp != 0 && output.stamp == self.stamp;
        // With the previous frame's start, a face that stands still goes on towards its optimum.
        let known = continued && !self.sight.anew && self.start != Start::Previous;
        let may_stay = known && self.running.skip.unmoved;
        let hidden = output.skipped.hidden;
        let stays =
            Skipped { hidden, unmoved: self.scene.face_count.saturating_sub(hidden), ..Skipped::default() };
        if may_stay && self.surface.rests(positions) {
            output.skipped = stays;
            return Ok(());
        }
        // Tasks run in the pool's own threads, so that each finds its workspace.
        let pool = self.pool.clone();
        pool.install(|| {
            let motion = if known && self.sight.faces.is_none() {
                self.surface.motion(&self.scene, &self.running.skip, positions, self.turned)
            } else {
                None
            };
            if !self.surface.update(&self.scene, positions)? && may_stay {
                output.skipped = stays;
                return Ok(());
            }
            self.turned = if motion.is_some() { self.turned + 1 } else { 0 };
            if let Some(motion) = motion {
                let (origin, gauge) = (output.origin, output.gauge);
                motion.carry(origin, gauge, &mut output.points);
                motion.carry(origin, gauge, &mut self.sides);
                output.skipped = Skipped::turned(&self.scene, &self.kernels);
                return Ok(());
            }
            output.origin = self.surface.origin();
            output.gauge = self.scene.gauge;
            output.points.resize(self.scene.yarns.point_count(), V3::zero());
            output.knots.resize(self.scene.knot_count, KnotState::default());
            output.faces.resize(self.scene.face_count, unsolved());
            output.skipped = self.solve(output, continued);
            self.join(output);
            self.sight.anew = false;
            self.stamp = super::STAMPS.fetch_add(1, Relaxed);
            (output.stamp, output.backend) = (self.stamp, self.name);
            Ok(())
        })
    }
}

/// What all batches of a frame share.
struct Frame<'a, T: Precision> {
    scene: &'a Scene,
    kernels: &'a [Kernel<T>],
    surface: &'a Surface<T>,
    rests: &'a [Option<Known<T>>],
    firsts: &'a [Option<Known<T>>],
    start: Start,
    running: Running,
    own: bool,
    continued: bool,
    visible: Option<&'a [bool]>,
    benches: &'a [Bench],
    points: Scatter<'a, V3<T>>,
    sides: Scatter<'a, V3<T>>,
}

/// What some faces, consecutive in batch order, have of the output and of what is remembered.
struct Part<'a, T: Precision> {
    results: &'a mut [FaceResult<T>],
    knots: &'a mut [KnotState<T>],
    shapes: &'a mut [V2<T>],
    remembered: &'a mut [bool],
}

impl<'a, T: Precision> Part<'a, T> {
    fn split(self, faces: usize, knots: usize, shapes: usize) -> [Self; 2] {
        let remembers = !self.remembered.is_empty();
        let (results, more_results) = self.results.split_at_mut(faces);
        let (a, more_knots) = self.knots.split_at_mut(knots);
        let (shapes, more_shapes) = self.shapes.split_at_mut(if remembers { shapes } else { 0 });
        let (own, more_own) = self.remembered.split_at_mut(if remembers { faces } else { 0 });
        [
            Part { results, knots: a, shapes, remembered: own },
            Part { results: more_results, knots: more_knots, shapes: more_shapes, remembered: more_own },
        ]
    }
}

impl<T: Precision> Frame<'_, T> {
    /// Works on some batches.
    fn batches(&self, range: std::ops::Range<usize>, part: Part<T>) -> Skipped {
        if range.len() <= 1 {
            return range.clone().next().map_or(Skipped::default(), |b| self.batch(b, part));
        }
        let middle = range.start + range.len() / 2;
        let (mut faces, mut knots, mut shapes) = (0, 0, 0);
        for b in range.start..middle {
            let (count, stencil) = (self.scene.batches[b].faces.len(), &self.kernels[b].stencil);
            faces += count;
            knots += count * stencil.knot_count();
            shapes += count * (stencil.corner_count - 1);
        }
        let [a, b] = part.split(faces, knots, shapes);
        let (x, y) =
            rayon::join(|| self.batches(range.start..middle, a), || self.batches(middle..range.end, b));
        x + y
    }

    fn batch(&self, b: usize, part: Part<T>) -> Skipped {
        let (batch, kernel) = (&self.scene.batches[b], &self.kernels[b]);
        let count = batch.faces.len();
        if kernel.stencil.points.is_empty() {
            // A stitch without yarn: nothing to do.
            part.results.fill(unsolved());
            return Skipped { without_knots: count, ..Skipped::default() };
        }
        let skip = self.running.skip;
        let task = Task {
            scene: self.scene,
            batch,
            kernel,
            surface: self.surface,
            start: self.start,
            skip,
            tolerance: T::of(skip.tolerance * self.scene.yarn_radius),
            own: self.own,
            continued: self.continued,
            rest: self.rests[b].as_ref(),
            first: self.firsts[b].as_ref().filter(|f| f.sound),
            visible: self.visible,
            benches: self.benches,
            points: &self.points,
            sides: &self.sides,
        };
        self.chunks(&task, 0, part)
    }

    fn chunks(&self, task: &Task<T>, begin: usize, part: Part<T>) -> Skipped {
        let count = part.results.len();
        if count <= CHUNK {
            let Part { results, knots, shapes, remembered } = part;
            return T::chunk(self.running.width, Chunk { task, begin, results, knots, shapes, remembered });
        }
        let stencil = &task.kernel.stencil;
        let half = (count / 2).next_multiple_of(CHUNK);
        let [a, b] = part.split(half, half * stencil.knot_count(), half * (stencil.corner_count - 1));
        let (x, y) = rayon::join(|| self.chunks(task, begin, a), || self.chunks(task, begin + half, b));
        x + y
    }
}
