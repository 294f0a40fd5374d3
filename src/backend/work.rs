//! A chunk of faces of one stitch type, worked on side by side.

use super::known::Known;
use super::scatter::Scatter;
use super::skip::{Skip, Skipped, same};
use super::surface::{Surface, stand_in};
use super::{FoundGpu, Recipe, unsolved};
use crate::knot::{Ended, FaceResult, Given, Kernel, KnotState, Start, Status, Workspace};
use crate::math::{Real, Scalar, V2, V3, Wide, Width};
use crate::scene::{Batch, Scene, StrandEnd, StrandPlace};
use crate::{Error, Result};
use std::any::Any;
use std::sync::Mutex;

/// Faces that one task works on.
pub(super) const CHUNK: usize = 256;

/// No processor has more numbers side by side.
const MOST_LANES: usize = 16;

/// A thread's workspace, of whichever lanes were last used.
pub(super) type Bench = Mutex<Option<Box<dyn Any + Send>>>;

/// What all chunks of a batch share.
pub struct Task<'a, T: Precision> {
    pub scene: &'a Scene,
    pub batch: &'a Batch,
    pub kernel: &'a Kernel<T>,
    pub surface: &'a Surface<T>,
    pub start: Start,
    pub skip: Skip,
    /// Skip's tolerance, template units.
    pub tolerance: T,
    /// Whether the output holds a frame of this backend: its knots are a start, its points those of hidden faces.
    pub own: bool,
    /// Whether the output holds this backend's last frame.
    pub continued: bool,
    /// The template's own shape and the first face's, where they are of use.
    pub rest: Option<&'a Known<T>>,
    pub first: Option<&'a Known<T>>,
    /// `[face of the mesh]`
    pub visible: Option<&'a [bool]>,
    pub benches: &'a [Bench],
    pub points: &'a Scatter<'a, V3<T>>,
    pub sides: &'a Scatter<'a, V3<T>>,
}

/// A chunk's own part of the output and of what is remembered.
pub struct Chunk<'a, 'b, T: Precision> {
    pub task: &'b Task<'a, T>,
    /// Index of its first face within the batch.
    pub begin: usize,
    /// `[face]`
    pub results: &'b mut [FaceResult<T>],
    /// `[face][knot]`
    pub knots: &'b mut [KnotState<T>],
    /// `[face][corner but the first]` shapes that the knots were solved for; empty where nothing is remembered.
    pub shapes: &'b mut [V2<T>],
    /// `[face]` whether they were.
    pub remembered: &'b mut [bool],
}

/// Where a face's knots are known from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum From {
    /// Its own last solve.
    Own,
    /// The template's own shape.
    Rest,
    /// The batch's first face.
    First,
    /// The template, for want of a solve: nobody sees the face.
    Template,
}

/// A precision that frames can be solved in. Kernels are compiled for it once, here, and not where they are used.
pub trait Precision: Scalar {
    /// Works on a chunk.
    #[doc(hidden)]
    fn chunk(width: Width, chunk: Chunk<Self>) -> Skipped;
    /// A backend on a GPU, of hardware unless `software` will do.
    #[doc(hidden)]
    fn gpu(recipe: &Recipe, software: bool) -> Result<FoundGpu<Self>>;
    /// Works on one face.
    #[doc(hidden)]
    fn face(kernel: &Kernel<Self>, work: &mut Workspace<Self>, given: Given<Self>) -> Ended<Self>;
}

macro_rules! precision {
    ($t:ty, $gpu:expr) => {
        impl Precision for $t {
            fn gpu(recipe: &Recipe, software: bool) -> Result<FoundGpu<Self>> {
                $gpu(recipe, software)
            }
            #[inline(never)]
            fn chunk(width: Width, chunk: Chunk<Self>) -> Skipped {
                Self::widen(width, chunk)
            }
            #[inline(never)]
            fn face(kernel: &Kernel<Self>, work: &mut Workspace<Self>, given: Given<Self>) -> Ended<Self> {
                kernel.run(work, given)
            }
        }
    };
}
precision!(f32, super::device::gpu);
precision!(f64, |recipe: &Recipe, software: bool| {
    if software || recipe.adapter.is_some() {
        return Err(Error::invalid("GPUs solve in f32: expected --precision f32"));
    }
    Ok(None)
});

impl<T: Precision> Wide<T> for Chunk<'_, '_, T> {
    type Output = Skipped;

    #[inline(always)]
    fn run<R: Real<Scalar = T>>(mut self) -> Skipped {
        let task = self.task;
        let mut skipped = Skipped::default();
        let mut active = [0u32; CHUNK];
        let count = self.active(&mut active, &mut skipped);
        if count == 0 {
            return skipped;
        }
        let thread = rayon::current_thread_index().unwrap_or(0);
        let mut bench = task.benches[thread].lock().expect("no other thread uses it");
        if !bench.as_ref().is_some_and(|b| b.is::<Workspace<R>>()) {
            *bench = Some(Box::new(Workspace::<R>::default()));
        }
        let work = bench.as_mut().and_then(|b| b.downcast_mut::<Workspace<R>>()).expect("just made");
        task.kernel.fit(work);
        for lanes in active[..count].chunks(R::LANES) {
            self.group(work, lanes, &mut skipped);
        }
        skipped
    }
}

impl<T: Precision> Chunk<'_, '_, T> {
    /// Lists the faces (counted from the chunk's first) that need work.
    #[inline(always)]
    fn active(&mut self, active: &mut [u32; CHUNK], skipped: &mut Skipped) -> usize {
        let task = self.task;
        let n = task.kernel.stencil.corner_count;
        let mut count = 0;
        for i in 0..self.results.len() {
            let index = self.begin + i;
            if self.hidden(index) {
                skipped.hidden += 1;
                if task.own {
                    self.results[i].status = Status::Hidden;
                    continue;
                }
            } else if task.continued && task.skip.unmoved && self.settled(i) {
                let corners = &task.batch.corners[index * n..(index + 1) * n];
                if !self.changed(corners, index) {
                    skipped.unmoved += 1;
                    continue;
                }
            }
            active[count] = i as u32;
            count += 1;
        }
        count
    }

    /// Whether nobody sees a face of the batch.
    #[inline(always)]
    fn hidden(&self, index: usize) -> bool {
        self.task.visible.is_some_and(|v| !v[self.task.batch.faces[index].index()])
    }

    /// Whether a face's last result would come out again, were nothing to move.
    #[inline(always)]
    fn settled(&self, i: usize) -> bool {
        let status = self.results[i].status;
        status != Status::Hidden && (self.task.start != Start::Previous || status != Status::Stepped)
    }

    /// Whether a corner moved or its normal turned.
    #[inline(always)]
    fn changed(&self, corners: &[u32], index: usize) -> bool {
        let surface = self.task.surface;
        if !surface.any {
            return false;
        }
        corners.iter().any(|v| surface.moved[*v as usize])
            || match &self.task.scene.corner_groups {
                Some(groups) => {
                    corners.iter().any(|v| surface.turned[groups.of_vertex[*v as usize] as usize])
                }
                None => surface.bent[self.task.batch.faces[index].index()],
            }
    }

    /// Works on up to as many faces as there are lanes.
    #[inline(always)]
    fn group<R: Real<Scalar = T>>(&mut self, work: &mut Workspace<R>, faces: &[u32], skipped: &mut Skipped) {
        let task = self.task;
        let (first, bad) = self.load(work, faces);
        let mut framed = task.kernel.frame(work);
        framed.1 = R::and(framed.1, R::not(bad));
        let mut given = Given::<R>::nothing();
        let (mut solved, mut results) = (R::default(), [None; MOST_LANES]);
        if task.kernel.solves() {
            for (lane, i) in faces.iter().enumerate() {
                if !R::mask_lane(framed.1, lane) {
                    continue;
                }
                results[lane] = self.known(work, lane, *i as usize, skipped);
                if results[lane].is_some() {
                    solved.set_lane(lane, T::one());
                }
            }
            // Lanes that repeat the last face have nothing to solve of their own.
            for lane in faces.len()..R::LANES {
                solved.set_lane(lane, T::one());
            }
            given.solved = R::zero().lt(solved);
            given.start = task.start == Start::Previous && task.own;
        } else {
            for i in faces {
                skipped.without_knots += usize::from(!self.hidden(self.begin + *i as usize));
            }
        }
        given.near = task.continued;
        if given.start {
            let k = task.kernel.stencil.knot_count();
            for (lane, i) in faces.iter().enumerate().filter(|(lane, _)| results[*lane].is_none()) {
                // Of a face that nobody saw it is from no one knows when.
                let stale = self.results[*i as usize].status == Status::Hidden;
                for (state, knot) in work.state.iter_mut().zip(&self.knots[*i as usize * k..]) {
                    state.set_lane(lane, if stale { KnotState::default() } else { *knot });
                }
            }
        }
        let ended = task.kernel.finish(work, framed, given);
        for (lane, i) in faces.iter().enumerate() {
            let sound = R::mask_lane(ended.sound, lane);
            let result = match results[lane] {
                Some((result, _)) if sound => result,
                _ => ended.lane(lane),
            };
            let hidden = self.hidden(self.begin + *i as usize);
            self.results[*i as usize] =
                if hidden { FaceResult { status: Status::Hidden, ..unsolved() } } else { result };
            self.remember(work, lane, *i as usize, sound, results[lane].map(|(_, from)| from));
        }
        self.store(work, faces, first);
    }

    /// Fills the lanes' corners and normals; lanes left over repeat the last face. Gives the first corners, and
    /// which faces have a corner that is not finite.
    #[inline(always)]
    fn load<R: Real<Scalar = T>>(&self, work: &mut Workspace<R>, faces: &[u32]) -> (V3<R>, R::Mask) {
        let task = self.task;
        let n = task.kernel.stencil.corner_count;
        let mut bad = R::default();
        for lane in 0..R::LANES {
            let index = self.begin + faces[lane.min(faces.len() - 1)] as usize;
            let corners = &task.batch.corners[index * n..(index + 1) * n];
            for ((vertex, corner), normal) in corners.iter().zip(&mut work.corners).zip(&mut work.normals) {
                let vertex = *vertex as usize;
                corner.set_lane(lane, task.surface.local[vertex]);
                normal.set_lane(
                    lane,
                    match &task.scene.corner_groups {
                        Some(groups) => task.surface.normals[groups.of_vertex[vertex] as usize],
                        None => task.surface.areas[task.batch.faces[index].index()],
                    },
                );
            }
            if task.surface.not_finite
                && let Some(middle) = stand_in(corners, &task.surface.local)
            {
                bad.set_lane(lane, T::one());
                for (vertex, corner) in corners.iter().zip(&mut work.corners) {
                    if !task.surface.local[*vertex as usize].finite() {
                        corner.set_lane(lane, middle);
                    }
                }
            }
        }
        let first = work.corners[0];
        for corner in &mut work.corners {
            *corner = *corner - first;
        }
        (first, R::zero().lt(bad))
    }

    /// The result of a face whose shape is known, if it is; its knots are put into the lane's state.
    #[inline(always)]
    fn known<R: Real<Scalar = T>>(
        &self,
        work: &mut Workspace<R>,
        lane: usize,
        i: usize,
        skipped: &mut Skipped,
    ) -> Option<(FaceResult<T>, From)> {
        let task = self.task;
        if self.hidden(self.begin + i) {
            let stencil = &task.kernel.stencil;
            for (k, state) in work.state.iter_mut().enumerate() {
                let (direction, half_length) = (stencil.knot_direction[k], stencil.knot_half_length[k]);
                state.set_lane(lane, KnotState { direction, half_length });
            }
            return Some((unsolved(), From::Template));
        }
        let n = task.kernel.stencil.corner_count - 1;
        let k = task.kernel.stencil.knot_count();
        let shape = &work.shape[1..];
        let mut found = None;
        if task.skip.rigid
            && task.continued
            && self.remembered[i]
            && self.settled(i)
            && same(shape, lane, &self.shapes[i * n..(i + 1) * n], task.tolerance)
        {
            skipped.rigid += 1;
            found = Some((&self.knots[i * k..(i + 1) * k], self.results[i], From::Own));
        }
        if let (None, Some(rest)) = (found, task.rest)
            && same(shape, lane, &rest.shape[1..], task.tolerance)
        {
            skipped.rest += 1;
            found = Some((&rest.state[..], rest.result, From::Rest));
        }
        if let (None, Some(first)) = (found, task.first)
            && same(shape, lane, &first.shape[1..], task.tolerance)
        {
            skipped.shared += 1;
            found = Some((&first.state[..], first.result, From::First));
        }
        let (knots, result, from) = found?;
        for (state, knot) in work.state.iter_mut().zip(knots) {
            state.set_lane(lane, *knot);
        }
        Some((result, from))
    }

    /// Keeps a face's knots, and the shape that they were solved for. That is not always its own: were it taken for
    /// the face's own, errors within the tolerance would add up.
    #[inline(always)]
    fn remember<R: Real<Scalar = T>>(
        &mut self,
        work: &Workspace<R>,
        lane: usize,
        i: usize,
        sound: bool,
        from: Option<From>,
    ) {
        if sound && from == Some(From::Own) {
            return;
        }
        let task = self.task;
        let seen = from != Some(From::Template);
        let k = task.kernel.stencil.knot_count();
        for (knot, state) in self.knots[i * k..(i + 1) * k].iter_mut().zip(&work.state) {
            *knot = if seen { state.lane(lane) } else { KnotState::default() };
        }
        if self.shapes.is_empty() {
            return;
        }
        self.remembered[i] = sound && seen;
        let n = task.kernel.stencil.corner_count - 1;
        let kept = &mut self.shapes[i * n..(i + 1) * n];
        let other = match from {
            Some(From::Rest) => task.rest,
            Some(From::First) => task.first,
            _ => None,
        };
        match other {
            Some(other) => kept.copy_from_slice(&other.shape[1..]),
            None => {
                for (kept, corner) in kept.iter_mut().zip(&work.shape[1..]) {
                    *kept = corner.lane(lane);
                }
            }
        }
    }

    /// Puts the lanes' points where they belong.
    #[inline(always)]
    fn store<R: Real<Scalar = T>>(&self, work: &mut Workspace<R>, faces: &[u32], first: V3<R>) {
        let task = self.task;
        let offsets = &task.kernel.stencil.strand_offsets;
        let strands = offsets.len() - 1;
        for point in &mut work.points {
            *point = *point + first;
        }
        for (lane, i) in faces.iter().enumerate() {
            let at = task.batch.first_strand + (self.begin + *i as usize) * strands;
            for (place, range) in task.scene.yarns.strands[at..at + strands].iter().zip(offsets.windows(2)) {
                let points = &work.points[range[0]..range[1]];
                let [begin, inside @ .., end] = points else { continue };
                self.put(place.end(0), begin.lane(lane));
                self.put_inside(*place, inside, lane);
                self.put(place.end(1), end.lane(lane));
            }
        }
    }

    /// Puts a lane's points between the ends of a strand.
    #[inline(always)]
    #[allow(unsafe_code)]
    fn put_inside<R: Real<Scalar = T>>(&self, place: StrandPlace, points: &[V3<R>], lane: usize) {
        let (lowest, with) = place.inside(points.len() as u32);
        let target = self.task.points.begin(lowest as usize, points.len());
        for (i, point) in points.iter().enumerate() {
            let at = if with { i } else { points.len() - 1 - i };
            // SAFETY: fewer than the points that `begin` has seen; else as in `put`.
            unsafe { target.add(at).write(point.lane(lane)) };
        }
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn put(&self, end: StrandEnd, point: V3<T>) {
        // SAFETY: a control point, and a side of a seam, belongs to one point of one strand of one face, and each
        // face to one chunk.
        match end {
            StrandEnd::Point(at) => unsafe { self.task.points.write(at as usize, point) },
            StrandEnd::Seam(side) => unsafe { self.task.sides.write(side as usize, point) },
        }
    }
}
