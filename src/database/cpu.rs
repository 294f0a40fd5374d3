//! The CPU backend of the precomputed method: lanes for the strains, threads for the rest.

use super::director::{Shell, directors};
use super::fabric::{Fabric, Homes};
use super::forms::{FaceFrame, Form, Forms};
use super::lookup::Lookup;
use super::shell::{FaceMap, Place, followed, lifted, shifted, strain};
use super::strain::Axes;
use super::{Compat, FabricRecipe, FoundWeaver, skip};
use crate::Result;
use crate::backend::{Scatter, middle};
use crate::math::{Real, Scalar, V3, Wide, Width};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

pub use super::skip::{SkipYarn, SkippedYarn};

/// Points worked on as one, and room for lanes beyond them.
const BLOCK: usize = 128;
const ROOM: usize = BLOCK + MOST_LANES;
/// No processor has more numbers side by side.
const MOST_LANES: usize = 16;
/// Points that one task works on.
const CHUNK: usize = 32 * BLOCK;

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

/// What all chunks share.
struct Shared<'a, T> {
    homes: &'a Homes,
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
pub struct Chunk<'a, 'b, T> {
    shared: &'b Shared<'a, T>,
    begin: usize,
    places: &'b mut [Place<T>],
    outside: &'b mut [bool],
}

/// A few points on their way, number beside number.
struct Block<T> {
    /// Faces, and which points of the block lie in them.
    pieces: [(u32, u8, u8); BLOCK],
    piece_count: usize,
    len: usize,
    /// First home.
    begin: usize,
    barycentric: [[T; ROOM]; 2],
    height: [T; ROOM],
    /// Strains, then fractions of cells.
    strain: [[T; ROOM]; 3],
    node: [T; ROOM],
    /// Along u, v, height and twist.
    displacement: [[T; 4]; ROOM],
}

impl<T: Scalar> Wide<T> for Chunk<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real<Scalar = T>>(mut self) {
        let shared = self.shared;
        let mut counts = [0usize; 4];
        let zero = [T::zero(); ROOM];
        let mut block = Block {
            pieces: [(0, 0, 0); BLOCK],
            piece_count: 0,
            len: 0,
            begin: 0,
            barycentric: [zero; 2],
            height: zero,
            strain: [zero; 3],
            node: zero,
            displacement: [[T::zero(); 4]; ROOM],
        };
        let range = self.begin..self.begin + self.places.len();
        for (face, homes) in shared.homes.runs(range) {
            if let Some(changes) = shared.changes {
                let change = changes[face as usize];
                if change & skip::HIDDEN != 0 {
                    counts[2] += homes.len();
                    continue;
                }
                if change & skip::STRAIN == 0 {
                    self.carry(homes, change, changes, &mut counts);
                    continue;
                }
            }
            let mut left = homes;
            while !left.is_empty() {
                // Homes of a block follow each other.
                if block.len == BLOCK || block.begin + block.len != left.start {
                    self.displace::<R>(&mut block);
                    (block.begin, block.len, block.piece_count) = (left.start, 0, 0);
                }
                let count = left.len().min(BLOCK - block.len);
                block.pieces[block.piece_count] = (face, block.len as u8, count as u8);
                block.piece_count += 1;
                block.len += count;
                left.start += count;
            }
        }
        self.displace::<R>(&mut block);
        counts[3] = self.outside.iter().filter(|o| **o).count();
        for (count, all) in counts.iter().zip(shared.counts) {
            all.fetch_add(*count, Ordering::Relaxed);
        }
    }
}

impl<T: Scalar> Chunk<'_, '_, T> {
    /// Lifts points again whose strain is known, where their surface moved.
    #[inline(always)]
    fn carry(&self, homes: std::ops::Range<usize>, change: u8, changes: &[u8], counts: &mut [usize; 4]) {
        let shared = self.shared;
        for home in homes {
            let place = &self.places[home - self.begin];
            if (change | changes[place.face as usize]) & skip::FRAME == 0 {
                counts[0] += 1;
                continue;
            }
            counts[1] += 1;
            let [b, c] = place.barycentric;
            shared.put(home, lifted(&shared.frames[place.face as usize], b, c, place.height), None);
        }
    }

    #[inline(always)]
    fn displace<R: Real<Scalar = T>>(&mut self, block: &mut Block<T>) {
        let (shared, n, begin) = (self.shared, block.len, block.begin);
        let homes = shared.homes;
        for i in 0..n {
            block.height[i] = shared.rows[homes.rows[begin + i] as usize].height;
        }
        for (all, given) in block.barycentric.iter_mut().zip(&homes.barycentric) {
            for (b, given) in all.iter_mut().zip(&given[begin..begin + n]) {
                *b = T::of((*given).into());
            }
        }
        for &(face, first, count) in &block.pieces[..block.piece_count] {
            let frame = &shared.frames[face as usize];
            let (first, count) = (usize::from(first), usize::from(count));
            for at in (first..first + count).step_by(R::LANES) {
                let [b, c] = block.barycentric.each_ref().map(|b| R::load(&b[at..]));
                let strain = strain(frame, b, c, R::load(&block.height[at..]));
                for (strain, all) in strain.iter().zip(&mut block.strain) {
                    strain.store(&mut all[at..]);
                }
            }
        }
        for at in (0..n).step_by(R::LANES) {
            let strain = block.strain.each_ref().map(|s| R::load(&s[at..]));
            let (cell, out) = shared.axes.find(shared.axes.strains(shared.axes.clamp(strain)));
            cell.node.store(&mut block.node[at..]);
            for k in 0..3 {
                cell.fraction[k].store(&mut block.strain[k][at..]);
            }
            let outside = &mut self.outside[begin - self.begin + at..];
            let mut flags = [T::zero(); MOST_LANES];
            R::select(out, R::one(), R::zero()).store(&mut flags);
            for (flag, outside) in flags[..R::LANES.min(n - at)].iter().zip(outside) {
                *outside = *flag != T::zero();
            }
        }
        for i in 0..n {
            let row = &shared.rows[homes.rows[begin + i] as usize];
            let fraction = [0, 1, 2].map(|k| block.strain[k][i]);
            let by = shared.lookup.at(row.vertex as usize, block.node[i].to_f64() as usize, fraction);
            block.displacement[i] = by;
            block.displacement[i][3] += row.twist;
        }
        for piece in 0..block.piece_count {
            self.place::<R>(block, piece);
        }
    }

    /// Puts the points of a face where they are displaced to.
    #[inline(always)]
    fn place<R: Real<Scalar = T>>(&mut self, block: &Block<T>, piece: usize) {
        let shared = self.shared;
        let (face, first, count) = block.pieces[piece];
        let (first, end) = (usize::from(first), usize::from(first) + usize::from(count));
        let (map, frame) = (&shared.maps[face as usize], &shared.frames[face as usize]);
        for at in (first..end).step_by(R::LANES) {
            let [b, c] = block.barycentric.each_ref().map(|b| R::load(&b[at..]));
            let mut by = [R::zero(); 3];
            for (lane, given) in block.displacement[at..at + R::LANES].iter().enumerate() {
                for k in 0..3 {
                    by[k].set_lane(lane, given[k]);
                }
            }
            let [u, v, h] = by;
            let all = shifted(&map.inverse, b, c, u, v);
            let height = R::load(&block.height[at..]) + h;
            let point = lifted(frame, all[1], all[2], height);
            let zero = R::zero();
            let left = R::or(R::or(all[0].lt(zero), all[1].lt(zero)), all[2].lt(zero));
            let mut out = [[T::zero(); MOST_LANES]; 7];
            let left = R::select(left, R::one(), zero);
            for (out, value) in out.iter_mut().zip([point.x, point.y, point.z, all[1], all[2], height, left])
            {
                value.store(out);
            }
            for lane in 0..R::LANES.min(end - at) {
                let home = block.begin + at + lane;
                let [x, y, z, b, c, height, left] = out.each_ref().map(|values| values[lane]);
                let mut point = V3::new(x, y, z);
                let mut place = Place { face, barycentric: [b, c], height };
                if left != T::zero() {
                    let (there, all) = followed(shared.maps, face, [T::one() - b - c, b, c]);
                    if there != face {
                        (place.face, place.barycentric) = (there, [all[1], all[2]]);
                        point = lifted(&shared.frames[there as usize], all[1], all[2], height);
                    }
                }
                self.places[home - self.begin] = place;
                shared.put(home, point, Some(block.displacement[at + lane][3]));
            }
        }
    }
}

impl<T: Scalar> Shared<'_, T> {
    /// Puts a point where its yarn has it.
    #[inline(always)]
    #[allow(unsafe_code)]
    fn put(&self, home: usize, point: V3<T>, twist: Option<T>) {
        let at = self.homes.points[home] as usize;
        // SAFETY: each point has one home, and each home one chunk.
        unsafe {
            self.points.write(at, point);
            if let Some(twist) = twist {
                self.twists.write(at, twist);
            }
        }
    }
}
