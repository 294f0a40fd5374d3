//! The CPU backend: rayon over chunks of each batch.

use super::{Backend, FrameOutput, Tables};
use crate::knot::table::Table;
use crate::knot::{FaceResult, Kernel, KnotState, Settings, Start, Status, Workspace};
use crate::math::{Scalar, V3};
use crate::scene::{NO_SECOND_SLOT, Scene};
use crate::{Error, Result};
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Faces (or points) that one task works on.
const CHUNK: usize = 256;
const POINT_CHUNK: usize = 8192;
/// More threads than this are a slip of the keyboard.
const MOST_THREADS: usize = 1024;

/// Runs scenes on the CPU, in f64 (the reference) or f32 (its twin).
#[derive(Debug)]
pub struct CpuBackend<T: Scalar> {
    scene: Arc<Scene>,
    kernels: Vec<Kernel<T>>,
    tables: Tables,
    start: Start,
    pool: Arc<rayon::ThreadPool>,
    workspaces: Vec<Mutex<Workspace<T>>>,
    origin: Option<DVec3>,
    local: Vec<V3<T>>,
    areas: Vec<V3<T>>,
    normals: Vec<V3<T>>,
    slots: Vec<V3<T>>,
    solved_before: bool,
}

impl<T: Scalar> CpuBackend<T> {
    /// A backend for a scene; `threads` 0 takes one per core.
    ///
    /// # Errors
    /// Settings out of range; threads that cannot be started.
    pub fn new(scene: Arc<Scene>, settings: &Settings, threads: usize) -> Result<Self> {
        Self::with_cache(scene, settings, threads, None)
    }

    /// The same, with a folder in which tables are kept ([`super::table_cache`]).
    ///
    /// # Errors
    /// Those of [`CpuBackend::new`]; none for the folder.
    pub fn with_cache(
        scene: Arc<Scene>,
        settings: &Settings,
        threads: usize,
        cache: Option<&Path>,
    ) -> Result<Self> {
        for (name, value) in [
            ("beta", settings.beta),
            ("weight-angle", settings.weight_angle),
            ("weight-length", settings.weight_length),
        ] {
            if !(0.0..=1e12).contains(&value) {
                return Err(Error::invalid(format_args!(
                    "--{name} {value:e}: expected a number from 0 to 1e12"
                )));
            }
        }
        if threads > MOST_THREADS {
            return Err(Error::invalid(format_args!("--threads {threads}: expected 0 to {MOST_THREADS}")));
        }
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::invalid(format_args!("cannot start {threads} threads: {e}")))?;
        let mut tables = pool.install(|| Tables::new(&scene, settings, cache));
        let kernel = |(s, table): (_, Option<Table<f32>>)| {
            Kernel::new(s, scene.mode, settings).with_table(table.map(|t| Arc::new(t.cast())))
        };
        let of_stencil = std::mem::take(&mut tables.tables);
        let kernels = scene.stencils.iter().zip(of_stencil).map(kernel).collect();
        Ok(Self {
            kernels,
            tables,
            start: settings.start,
            workspaces: (0..pool.current_num_threads()).map(|_| Mutex::default()).collect(),
            pool: Arc::new(pool),
            origin: None,
            local: Vec::new(),
            areas: Vec::new(),
            normals: Vec::new(),
            slots: vec![V3::zero(); scene.slot_count],
            solved_before: false,
            scene,
        })
    }

    /// What became of the stitch types' tables; the tables themselves are with the kernels.
    pub fn tables(&self) -> &Tables {
        &self.tables
    }

    /// The face-local points of the last frame by slot, before shared boundary points are averaged; same
    /// units as [`FrameOutput::points`].
    pub fn slots(&self) -> &[V3<T>] {
        &self.slots
    }

    /// World positions to template units around the origin.
    fn localise(&mut self, positions: &[DVec3]) -> Result<()> {
        if positions.len() != self.scene.vertex_count {
            return Err(Error::invalid(format_args!(
                "a frame of {} positions, expected {} as the mesh has vertices",
                positions.len(),
                self.scene.vertex_count
            )));
        }
        if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
            return Err(Error::invalid(format_args!(
                "vertex {vertex} (counted from 0) at {}, expected finite coordinates",
                positions[vertex]
            )));
        }
        let origin = *self.origin.get_or_insert_with(|| middle(positions));
        let gauge = self.scene.gauge;
        // Beyond this, face-local differences could overflow; such faces fall back anyway.
        let limit = if std::mem::size_of::<T>() == 4 { 1e37 } else { 1e300 };
        self.local.resize(positions.len(), V3::zero());
        self.local.par_chunks_mut(POINT_CHUNK).zip(positions.par_chunks(POINT_CHUNK)).for_each(
            |(local, positions)| {
                for (l, p) in local.iter_mut().zip(positions) {
                    let scaled = (*p - origin) / gauge;
                    *l = V3::of(scaled.clamp(DVec3::splat(-limit), DVec3::splat(limit)));
                }
            },
        );
        Ok(())
    }

    /// Vector areas of all faces, and their sums around corners (model section 3).
    fn normals(&mut self) {
        let scene = &*self.scene;
        let local = &self.local;
        self.areas.resize(scene.face_places.len(), V3::zero());
        self.areas.par_chunks_mut(POINT_CHUNK).enumerate().for_each(|(chunk, areas)| {
            for (i, area) in areas.iter_mut().enumerate() {
                let face = chunk * POINT_CHUNK + i;
                let range = scene.face_offsets[face] as usize..scene.face_offsets[face + 1] as usize;
                *area = vector_area(&scene.face_vertices[range], local);
            }
        });
        let Some(groups) = &scene.corner_groups else { return };
        let areas = &self.areas;
        self.normals.resize(groups.len(), V3::zero());
        self.normals.par_chunks_mut(POINT_CHUNK).enumerate().for_each(|(chunk, normals)| {
            for (i, normal) in normals.iter_mut().enumerate() {
                let group = chunk * POINT_CHUNK + i;
                let [begin, end] = [0, 1].map(|k| groups.offsets[group + k] as usize);
                *normal = V3::zero();
                for face in &groups.faces[begin..end] {
                    *normal = *normal + areas[*face as usize];
                }
            }
        });
    }

    fn solve(&mut self, output: &mut FrameOutput<T>) {
        let scene = &*self.scene;
        let warm = self.start == Start::Previous && self.solved_before;
        let (local, areas, normals) = (&self.local, &self.areas, &self.normals);
        let workspaces = &self.workspaces;
        for batch in &scene.batches {
            let kernel = &self.kernels[batch.stencil];
            let (count, n) = (batch.faces.len(), kernel.stencil.corner_count);
            let (p, k) = (kernel.stencil.points.len(), kernel.stencil.knot_count());
            let results = &mut output.faces[batch.first_face..batch.first_face + count];
            if p == 0 {
                // A stitch without yarn: nothing to do.
                results.fill(unsolved());
                continue;
            }
            let work_chunk = |chunk: usize,
                              results: &mut [FaceResult<T>],
                              slots: &mut [V3<T>],
                              knots: &mut [KnotState<T>]| {
                let thread = rayon::current_thread_index().unwrap_or(0);
                let mut work = workspaces[thread].lock().expect("no other thread uses it");
                kernel.fit(&mut work);
                for (i, result) in results.iter_mut().enumerate() {
                    let index = chunk * CHUNK + i;
                    let corners = &batch.corners[index * n..(index + 1) * n];
                    let first = local[corners[0] as usize];
                    for (c, vertex) in corners.iter().enumerate() {
                        work.corners[c] = local[*vertex as usize] - first;
                        work.normals[c] = match &scene.corner_groups {
                            Some(groups) => normals[groups.of_vertex[*vertex as usize] as usize],
                            None => areas[batch.faces[index].index()],
                        };
                    }
                    let points = &mut slots[i * p..(i + 1) * p];
                    *result = kernel.run(&mut work, warm, &mut knots[i * k..(i + 1) * k], points);
                    for point in points {
                        *point = *point + first;
                    }
                }
            };
            let slots = &mut self.slots[batch.first_slot..batch.first_slot + count * p];
            let knots = &mut output.knots[batch.first_knot..batch.first_knot + count * k];
            let chunks = results.par_chunks_mut(CHUNK).zip(slots.par_chunks_mut(CHUNK * p)).enumerate();
            if k == 0 {
                chunks.for_each(|(chunk, (results, slots))| work_chunk(chunk, results, slots, &mut []));
            } else {
                chunks.zip(knots.par_chunks_mut(CHUNK * k)).for_each(|((chunk, (results, slots)), knots)| {
                    work_chunk(chunk, results, slots, knots);
                });
            }
        }
    }

    fn gather(&self, output: &mut FrameOutput<T>) {
        let half = T::of(0.5);
        let slots = &self.slots;
        output
            .points
            .par_chunks_mut(POINT_CHUNK)
            .zip(self.scene.yarns.slots.par_chunks(POINT_CHUNK))
            .for_each(|(points, sources)| {
                for (point, [a, b]) in points.iter_mut().zip(sources) {
                    *point = slots[*a as usize];
                    if *b != NO_SECOND_SLOT {
                        *point = (*point + slots[*b as usize]) * half;
                    }
                }
            });
    }
}

impl<T: Scalar> Backend<T> for CpuBackend<T> {
    fn frame(&mut self, positions: &[DVec3], output: &mut FrameOutput<T>) -> Result<()> {
        self.localise(positions)?;
        output.origin = self.origin.expect("set with the first frame");
        output.gauge = self.scene.gauge;
        output.points.resize(self.scene.yarns.slots.len(), V3::zero());
        output.knots.resize(self.scene.knot_count, KnotState::default());
        output.faces.resize(self.scene.face_count, unsolved());
        // Tasks run in the pool's own threads, so that each finds its workspace.
        let pool = self.pool.clone();
        pool.install(|| {
            self.normals();
            self.solve(output);
            self.gather(output);
        });
        self.solved_before = true;
        Ok(())
    }
}

/// The vector area of a polygon; zero for one so thin that it has no frame either (see
/// [`crate::knot::frame::face_frame`]) or not finite, so that a bad face spoils no neighbour's normal.
fn vector_area<T: Scalar>(vertices: &[u32], local: &[V3<T>]) -> V3<T> {
    let first = local[vertices[0] as usize];
    let (mut sum, mut size) = (V3::zero(), T::zero());
    for pair in vertices[1..].windows(2) {
        let (a, b) = (local[pair[0] as usize] - first, local[pair[1] as usize] - first);
        sum = sum + a.cross(b);
        size += a.dot(a) + b.dot(b);
    }
    let area = sum * T::of(0.5);
    let wide = T::and((T::of(1e-6) * size).lt(area.length()), size.finite());
    V3::select(T::and(wide, area.finite()), area, V3::zero())
}

/// What is reported of a face with nothing to solve.
fn unsolved<T: Scalar>() -> FaceResult<T> {
    FaceResult { energy_start: T::zero(), energy: T::zero(), status: Status::Interpolated }
}

/// The median position, coordinate by coordinate, of a regular sample: in the midst of the mesh even when some
/// vertices are far off.
fn middle(positions: &[DVec3]) -> DVec3 {
    const SAMPLE: usize = 1024;
    let every = positions.len().div_ceil(SAMPLE).max(1);
    let median = |axis: usize| {
        let mut values: Vec<f64> = positions.iter().step_by(every).map(|p| p[axis]).collect();
        let half = values.len() / 2;
        values.sort_by(f64::total_cmp);
        values.get(half).copied().unwrap_or(0.0)
    };
    DVec3::new(median(0), median(1), median(2))
}
