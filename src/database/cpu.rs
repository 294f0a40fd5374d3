//! The CPU backend of the precomputed method: lanes for the strains, threads for the rest.

use super::fabric::{Fabric, Home};
use super::forms::{FaceFrame, Forms};
use super::lookup::Lookup;
use super::shell::{FaceMap, Place, displaced, lifted, strain};
use super::strain::{Axes, Cell};
use super::{Compat, skip};
use crate::Result;
use crate::backend::{Scatter, middle};
use crate::math::{Real, Scalar, V3, Wide, Width};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

pub use super::skip::{SkipYarn, SkippedYarn};

/// Points worked on as one.
const BLOCK: usize = 64;
/// Points that one task works on.
const CHUNK: usize = 64 * BLOCK;

/// Numbers for backends and their frames, never the same twice.
static STAMPS: AtomicU64 = AtomicU64::new(1);

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

/// Turns the mesh of a frame into yarn on the CPU.
pub struct Cpu<T: Scalar> {
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
    /// A bit for each home: its strain lies outside the table.
    outside: Vec<u64>,
    pool: rayon::ThreadPool,
    running: RunningYarn,
    tolerance: skip::Tolerance<T>,
    origin: Option<DVec3>,
    backend: u64,
    stamp: u64,
}

/// A vertex of the pattern.
#[derive(Clone, Copy, Debug)]
struct Row<T> {
    vertex: u32,
    height: T,
    twist: T,
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

impl<T: Scalar> Cpu<T> {
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
            outside: vec![0; fabric.point_count().div_ceil(BLOCK)],
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
        if let Some(visible) = visible.filter(|v| v.len() != self.fabric.face_count()) {
            return Err(crate::Error::invalid(format_args!(
                "found {} visible or hidden faces, expected {} as the mesh has",
                visible.len(),
                self.fabric.face_count()
            )));
        }
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
            places.par_chunks_mut(CHUNK).zip(outside.par_chunks_mut(CHUNK / BLOCK)).enumerate().for_each(
                |(chunk, (places, outside))| {
                    T::widen(width, Chunk { shared: &shared, begin: chunk * CHUNK, places, outside });
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

    /// What became of points in the last frame, stage by stage; `[home]`, in the order in which they are worked on.
    pub fn trace(&self) -> Vec<(u32, Trace<T>)> {
        let shared = |home: &Home| {
            let row = &self.rows[home.row as usize];
            let frame = &self.frames[home.face as usize];
            let barycentric = home.barycentric.map(|b| T::of(b.into()));
            let [uu, uv, vv, _] = strain(frame, barycentric, row.height);
            let clamped = self.axes.clamp([uu, uv, vv]);
            let strains = self.axes.strains(clamped);
            let (cell, _) = self.axes.find(strains);
            let displacement =
                self.lookup.at(row.vertex as usize, cell.node.to_f64() as usize, cell.fraction);
            let at = Place { face: home.face, barycentric, height: row.height };
            let [u, v, h, _] = displacement;
            let place = displaced(&self.maps, at, [u, v, h]);
            let home_at = (home.barycentric, row.height);
            Trace {
                face: home.face,
                home: home_at,
                strain: [uu, uv, vv],
                clamped,
                strains,
                displacement,
                place,
            }
        };
        self.fabric.homes.iter().map(|home| (home.point, shared(home))).collect()
    }
}

/// What all chunks share.
struct Shared<'a, T> {
    homes: &'a [Home],
    axes: &'a Axes<T>,
    lookup: &'a Lookup<T>,
    rows: &'a [Row<T>],
    maps: &'a [FaceMap<T>],
    frames: &'a [FaceFrame<T>],
    /// None where all faces changed.
    changes: Option<&'a [u8]>,
    points: &'a Scatter<'a, V3<T>>,
    twists: &'a Scatter<'a, T>,
    /// Points left alone, carried, hidden; points outside the table.
    counts: &'a [AtomicUsize; 4],
}

/// Some points, and what is kept of them.
struct Chunk<'a, 'b, T> {
    shared: &'b Shared<'a, T>,
    begin: usize,
    places: &'b mut [Place<T>],
    outside: &'b mut [u64],
}

impl<T: Scalar> Wide<T> for Chunk<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real<Scalar = T>>(self) {
        let Self { shared, begin, places, outside } = self;
        let mut counts = [0usize; 4];
        for (block, (places, outside)) in places.chunks_mut(BLOCK).zip(outside).enumerate() {
            let homes = &shared.homes[begin + block * BLOCK..][..places.len()];
            shared.block::<R>(homes, places, outside, &mut counts);
            counts[3] += outside.count_ones() as usize;
        }
        for (count, all) in counts.iter().zip(shared.counts) {
            all.fetch_add(*count, Ordering::Relaxed);
        }
    }
}

impl<T: Scalar> Shared<'_, T> {
    /// Puts a point where its yarn has it.
    #[inline(always)]
    #[allow(unsafe_code)]
    fn put(&self, home: &Home, point: V3<T>, twist: Option<T>) {
        // SAFETY: each point has one home, and each home one chunk.
        unsafe {
            self.points.write(home.point as usize, point);
            if let Some(twist) = twist {
                self.twists.write(home.point as usize, twist);
            }
        }
    }

    #[inline(always)]
    fn block<R: Real<Scalar = T>>(
        &self,
        homes: &[Home],
        places: &mut [Place<T>],
        outside: &mut u64,
        counts: &mut [usize; 4],
    ) {
        // Points to displace, and points that only follow their face.
        let (mut moved, mut carried) = ([0u8; BLOCK], [0u8; BLOCK]);
        let (mut moves, mut carries) = (0, 0);
        match self.changes {
            None => {
                for (i, slot) in moved.iter_mut().enumerate() {
                    *slot = i as u8;
                }
                moves = homes.len();
            }
            Some(changes) => {
                for (i, home) in homes.iter().enumerate() {
                    let (there, here) = (changes[home.face as usize], changes[places[i].face as usize]);
                    if there & skip::HIDDEN != 0 {
                        counts[2] += 1;
                    } else if there & skip::STRAIN != 0 {
                        moved[moves] = i as u8;
                        moves += 1;
                    } else if (there | here) & skip::FRAME != 0 {
                        carried[carries] = i as u8;
                        carries += 1;
                        counts[1] += 1;
                    } else {
                        counts[0] += 1;
                    }
                }
            }
        }
        self.displace::<R>(homes, places, &moved[..moves], outside);
        for i in &carried[..carries] {
            let (home, place) = (&homes[*i as usize], &places[*i as usize]);
            let point = lifted(&self.frames[place.face as usize], place);
            self.put(home, point, None);
        }
    }

    #[inline(always)]
    fn displace<R: Real<Scalar = T>>(
        &self,
        homes: &[Home],
        places: &mut [Place<T>],
        moved: &[u8],
        outside: &mut u64,
    ) {
        let mut strains = [[R::default(); BLOCK]; 3];
        for (at, i) in moved.iter().enumerate() {
            let home = &homes[*i as usize];
            let height = self.rows[home.row as usize].height;
            let barycentric = home.barycentric.map(|b| T::of(b.into()));
            let c = strain(&self.frames[home.face as usize], barycentric, height);
            for k in 0..3 {
                strains[k][at / R::LANES].set_lane(at % R::LANES, c[k]);
            }
        }
        let mut cells = [Cell::<R>::default(); BLOCK];
        for group in 0..moved.len().div_ceil(R::LANES) {
            let clamped = self.axes.clamp([strains[0][group], strains[1][group], strains[2][group]]);
            let (cell, out) = self.axes.find(self.axes.strains(clamped));
            cells[group] = cell;
            for lane in 0..R::LANES.min(moved.len() - group * R::LANES) {
                let bit = 1 << moved[group * R::LANES + lane];
                *outside = if R::mask_lane(out, lane) { *outside | bit } else { *outside & !bit };
            }
        }
        for (at, i) in moved.iter().enumerate() {
            let home = &homes[*i as usize];
            let row = &self.rows[home.row as usize];
            let (cell, lane) = (&cells[at / R::LANES], at % R::LANES);
            let fraction = [0, 1, 2].map(|k| cell.fraction[k].lane(lane));
            let node = cell.node.lane(lane).to_f64() as usize;
            let [u, v, h, twist] = self.lookup.at(row.vertex as usize, node, fraction);
            let barycentric = home.barycentric.map(|b| T::of(b.into()));
            let at = Place { face: home.face, barycentric, height: row.height };
            let place = displaced(self.maps, at, [u, v, h]);
            places[*i as usize] = place;
            let point = lifted(&self.frames[place.face as usize], &place);
            self.put(home, point, Some(row.twist + twist));
        }
    }
}
