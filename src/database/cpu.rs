//! The CPU backend of the precomputed method: lanes for the strains, threads for the rest.

use super::chunk::{CHUNK, Chunk, Row, Shared};
use super::director::{Shell, directors};
use super::fabric::Fabric;
use super::forms::{FaceFrame, Form, Forms};
use super::lookup::Lookup;
use super::shell::{FaceMap, Place, followed, shifted, strain};
use super::strain::Axes;
use super::{Compat, FabricRecipe, FoundWeaver, skip};
use crate::Result;
use crate::backend::{Scatter, middle};
use crate::math::{Scalar, V3, Width};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

pub use super::skip::{SkipYarn, SkippedYarn};

/// Numbers for backends and their frames, never the same twice.
pub(super) static STAMPS: AtomicU64 = AtomicU64::new(1);

/// A frame's yarn. Places are relative to `origin`, metres.
#[derive(Clone, Debug)]
pub struct YarnFrame<T> {
    /// World position that places are relative to; the same for all frames of a backend.
    pub origin: DVec3,
    /// `[point]` yarn after yarn.
    pub points: Vec<V3<T>>,
    /// `[point]` twist of the edge that leaves it, radians.
    pub twists: Vec<T>,
    /// Points whose strain lies outside the table's: they are displaced as at the nearest strain in it.
    pub outside: usize,
    /// What was left undone.
    pub skipped: SkippedYarn,
    pub(super) backend: u64,
    pub(super) stamp: u64,
}

impl<T> Default for YarnFrame<T> {
    fn default() -> Self {
        Self {
            origin: DVec3::ZERO,
            points: Vec::new(),
            twists: Vec::new(),
            outside: 0,
            skipped: SkippedYarn::default(),
            backend: 0,
            stamp: 0,
        }
    }
}

impl<T: Scalar> YarnFrame<T> {
    /// A point in the world.
    pub fn world(&self, point: usize) -> DVec3 {
        self.origin + self.points[point].to_f64()
    }
}

/// How a backend works; results do not depend on it but for what is skipped.
#[derive(Clone, Debug, Default)]
pub struct RunningYarn {
    /// Threads; 0 takes one per core.
    pub threads: usize,
    /// Numbers side by side in f32.
    pub width: Width,
    /// What is left undone.
    pub skip: SkipYarn,
}

/// A precision that fabrics can be worked out in. Kernels are compiled for it once, here, and not where they are used.
pub trait Woven: Scalar {
    /// Works on a chunk.
    #[doc(hidden)]
    fn weave(width: Width, chunk: Chunk<Self>);
    /// A weaver on a GPU, of hardware unless `software` will do.
    #[doc(hidden)]
    fn gpu(recipe: &FabricRecipe, software: bool) -> Result<FoundWeaver<Self>>;
}

macro_rules! woven {
    ($t:ty, $gpu:expr) => {
        impl Woven for $t {
            #[inline(never)]
            fn weave(width: Width, chunk: Chunk<Self>) {
                Self::widen(width, chunk);
            }
            fn gpu(recipe: &FabricRecipe, software: bool) -> Result<FoundWeaver<Self>> {
                $gpu(recipe, software)
            }
        }
    };
}
woven!(f32, super::device::gpu);
woven!(f64, |recipe: &FabricRecipe, software: bool| {
    if software || recipe.adapter.is_some() {
        return Err(crate::Error::invalid("GPUs work in f32: expected --precision f32"));
    }
    Ok(None)
});

/// Turns the mesh of a frame into yarn on the CPU.
pub struct Cpu<T: Woven> {
    pub(super) fabric: Arc<Fabric>,
    pub(super) forms: Forms<T>,
    axes: Axes<T>,
    lookup: Lookup<T>,
    rows: Vec<Row<T>>,
    maps: Vec<FaceMap<T>>,
    pub(super) frames: Vec<FaceFrame<T>>,
    /// `[face]` what changed of it.
    changes: Vec<u8>,
    visible: Option<Vec<bool>>,
    /// `[home]` where it lies on the mesh, displaced.
    pub(super) places: Vec<Place<T>>,
    /// `[home]` whether its strain lies outside the table.
    outside: Vec<bool>,
    pool: rayon::ThreadPool,
    running: RunningYarn,
    tolerance: skip::Tolerance<T>,
    origin: Option<DVec3>,
    backend: u64,
    stamp: u64,
}

/// What becomes of a point, stage by stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace<T> {
    /// The face it lies in at rest.
    pub face: u32,
    /// Barycentric coordinates of the face's corners 1 and 2, and the height.
    pub home: ([f32; 2], T),
    /// `C = I - 2 h II`: uu, uv, vv.
    pub strain: [T; 3],
    /// Its eigenvalues clamped.
    pub clamped: [T; 3],
    /// sx, sa, sy.
    pub strains: [T; 3],
    /// Along u, v, height and twist.
    pub displacement: [T; 4],
    /// Where it lies, displaced.
    pub place: Place<T>,
}

impl<T: Woven> Cpu<T> {
    /// A backend for a fabric.
    ///
    /// # Errors
    /// Threads that cannot be started.
    pub fn new(fabric: Arc<Fabric>, running: RunningYarn) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(running.threads)
            .build()
            .map_err(|e| crate::Error::invalid(format_args!("threads: {e}")))?;
        let settings = &fabric.settings;
        let table = &fabric.model.table;
        let stay = settings.compat == Compat::Madypg;
        let row = |(vertex, height, twist): &(u32, f64, f64)| Row {
            vertex: *vertex,
            height: T::of(*height),
            twist: T::of(*twist),
        };
        Ok(Self {
            forms: Forms::new(&fabric.surface, fabric.nodes.clone(), fabric.vertex_count, settings),
            axes: Axes::new(table, settings.min_eigenvalue, settings.compat),
            lookup: Lookup::new(table, settings.displacement),
            rows: fabric.rows.iter().map(row).collect(),
            maps: FaceMap::all(&fabric.surface, stay),
            frames: vec![FaceFrame::default(); fabric.face_count()],
            changes: vec![skip::ALL; fabric.face_count()],
            visible: None,
            places: vec![Place::default(); fabric.point_count()],
            outside: vec![false; fabric.point_count()],
            tolerance: skip::Tolerance::new(&fabric, &running.skip),
            pool,
            running,
            origin: None,
            backend: STAMPS.fetch_add(1, Ordering::Relaxed),
            stamp: 0,
            fabric,
        })
    }

    /// The fabric.
    pub fn fabric(&self) -> &Arc<Fabric> {
        &self.fabric
    }

    /// `[face]` normals, gradients and fundamental forms of the last frame.
    pub fn face_forms(&self) -> &[Form<T>] {
        &self.forms.face_forms
    }

    /// `[node]` the same at nodes ([`Fabric::face_nodes`]). Their first form is the mean of the faces', not that of their
    /// gradient.
    pub fn node_forms(&self) -> &[Form<T>] {
        &self.forms.node_forms
    }

    /// Says what places are relative to, before the first frame; without, that is the middle of the first frame.
    pub fn set_origin(&mut self, origin: DVec3) {
        if self.stamp == 0 {
            self.origin = Some(origin);
        }
    }

    /// Names the faces whose yarn needs to be right from the next frame on; `None` for all. Other points stay where they
    /// were, and in an output that is new to this backend are worked out once.
    ///
    /// # Errors
    /// Another number of faces than the mesh has.
    pub fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        self.fabric.check_visible(visible)?;
        self.visible = visible.map(<[bool]>::to_vec);
        Ok(())
    }

    /// Works a frame out. `positions`: `[vertex]` of the mesh, in the world. The result replaces what is in `output`, whose
    /// memory is reused. All numbers are finite if the positions are.
    ///
    /// # Errors
    /// Another number of positions than the mesh has vertices.
    pub fn frame(&mut self, positions: &[DVec3], output: &mut YarnFrame<T>) -> Result<()> {
        self.fabric.check_positions(positions)?;
        let origin = *self.origin.get_or_insert_with(|| middle(positions));
        let continued =
            self.stamp != 0 && output.stamp == self.stamp && output.points.len() == self.places.len();
        let zero = V3::zero();
        output.points.resize(self.places.len(), zero);
        output.twists.resize(self.places.len(), T::zero());
        let Self { forms, frames, changes, tolerance, pool, running, .. } = self;
        pool.install(|| {
            forms.update(positions, origin);
            let forms = &*forms;
            frames.par_iter_mut().zip(&mut *changes).enumerate().with_min_len(256).for_each(
                |(face, (frame, change))| {
                    let seen = *change & skip::HIDDEN == 0;
                    *change =
                        tolerance.update(frame, forms.face_frame(face), continued && seen, &running.skip);
                },
            );
        });
        if let Some(visible) = self.visible.as_ref().filter(|_| continued) {
            for (change, visible) in self.changes.iter_mut().zip(visible) {
                // Shown again, all of it is worked on.
                *change = if *visible { *change } else { skip::HIDDEN };
            }
        }
        let counts = [const { AtomicUsize::new(0) }; 4];
        let (points, twists) = (Scatter::new(&mut output.points), Scatter::new(&mut output.twists));
        let shared = Shared {
            homes: &self.fabric.homes,
            axes: &self.axes,
            lookup: &self.lookup,
            rows: &self.rows,
            maps: &self.maps,
            frames: &self.frames,
            changes: self.changes.iter().any(|c| *c != skip::ALL).then_some(&self.changes[..]),
            points: &points,
            twists: &twists,
            counts: &counts,
        };
        let width = self.running.width;
        let (places, outside) = (&mut self.places, &mut self.outside);
        self.pool.install(|| {
            places.par_chunks_mut(CHUNK).zip(outside.par_chunks_mut(CHUNK)).enumerate().for_each(
                |(chunk, (places, outside))| {
                    T::weave(width, Chunk { shared: &shared, begin: chunk * CHUNK, places, outside });
                },
            );
        });
        let [unmoved, rigid, hidden, out] = counts.map(AtomicUsize::into_inner);
        output.skipped = SkippedYarn { unmoved, rigid, hidden };
        output.outside = out;
        output.origin = origin;
        self.stamp = STAMPS.fetch_add(1, Ordering::Relaxed);
        (output.backend, output.stamp) = (self.backend, self.stamp);
        Ok(())
    }

    /// `[point]` directors of the last frame: which way across the edge that leaves each point its material points.
    /// Orthogonal to the edge and of unit length, unless settings are to be compatible.
    pub fn directors(&self, frame: &YarnFrame<T>) -> Vec<V3<T>> {
        let shell = Shell { forms: &self.forms.face_forms, frames: &self.frames, places: &self.places };
        directors(&self.fabric, &shell, frame)
    }

    /// What became of points in the last frame, stage by stage, in the order in which they are worked on; each with the
    /// number of its point.
    pub fn trace(&self) -> Vec<(u32, Trace<T>)> {
        let homes = &self.fabric.homes;
        let trace = |face: u32, home: usize| {
            let row = &self.rows[homes.rows[home] as usize];
            let frame = &self.frames[face as usize];
            let rounded = [homes.barycentric[0][home], homes.barycentric[1][home]];
            let [b, c] = rounded.map(|b| T::of(b.into()));
            let strain = strain(frame, b, c, row.height);
            let clamped = self.axes.clamp(strain);
            let strains = self.axes.strains(clamped);
            let (cell, _) = self.axes.find(strains);
            let displacement =
                self.lookup.at(row.vertex as usize, cell.node.to_f64() as usize, cell.fraction);
            let [u, v, h, _] = displacement;
            let all = shifted(&self.maps[face as usize].inverse, b, c, u, v);
            let (at, all) = followed(&self.maps, face, all);
            let place = Place { face: at, barycentric: [all[1], all[2]], height: row.height + h };
            let home = (rounded, row.height);
            Trace { face, home, strain, clamped, strains, displacement, place }
        };
        let all = homes.runs(0..homes.points.len());
        all.flat_map(|(face, range)| range.map(move |home| (homes.points[home], trace(face, home)))).collect()
    }
}
