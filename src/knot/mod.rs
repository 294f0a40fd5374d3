//! The method: knots of a stitch solved for in the plane of its face (Huang et al. 2025), a stage a file.
//!
//! Generic over the scalar: f64 is the reference, f32 its twin in the same order of operations. All lengths
//! are in template units, all places relative to the face's first corner.

pub mod curve;
pub mod energy;
pub mod factor;
pub mod frame;
pub mod lift;
pub mod solve;
pub mod start;
mod sums;
pub mod table;
pub mod tabulate;

use crate::math::{Real, Scalar, V2, V3};
use crate::scene::{Mode, Role, Stencil};
pub use energy::Weights;
pub use frame::Frame;
pub use solve::Solver;
pub use start::KnotState;
use std::sync::Arc;
use table::Table;

/// An earlier state is no start where a half-length is this many times longer or shorter than the deformed template's.
pub(crate) const LEAP: f64 = 8.0;

/// Where a solve starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// The template's knots under the face's deformation.
    #[default]
    Affine,
    /// The previous frame's result.
    Previous,
    /// The optimum of a face deformed alike, from the stitch type's [`table`].
    Table,
}

/// How stitches are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The iteration.
    pub solver: Solver,
    /// Where it starts.
    pub start: Start,
    /// How many steps at most.
    pub iterations: u32,
    /// Knot spacing: 1 is plain interpolation, 0 keeps every loop as wide as at rest.
    pub beta: f64,
    /// w_angle of eq. 3.
    pub weight_angle: f64,
    /// w_length of eq. 3.
    pub weight_length: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            solver: Solver::default(),
            start: Start::default(),
            iterations: 3,
            beta: 1.0,
            weight_angle: 1.0,
            weight_length: 100.0,
        }
    }
}

/// How the work on a face ended; the numbers stand in result files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Status {
    /// Nothing to solve: no knots, or a mode that does not.
    Interpolated = 0,
    /// All steps were made.
    Stepped = 1,
    /// A step lowered the energy by next to nothing: see [`Real::CONVERGED`].
    Converged = 2,
    /// The start is at rest: no step was needed.
    AtRest = 3,
    /// No step lowered the energy.
    Stuck = 4,
    /// The face has no frame, or its solve no finite end: interpolated instead.
    FellBack = 5,
    /// Left out: the library has no such stitch.
    Skipped = 6,
    /// Not worked on, because nobody sees it.
    Hidden = 7,
}

impl Status {
    /// All of them, in the order of their numbers.
    pub const ALL: [Status; 8] = [
        Status::Interpolated,
        Status::Stepped,
        Status::Converged,
        Status::AtRest,
        Status::Stuck,
        Status::FellBack,
        Status::Skipped,
        Status::Hidden,
    ];
}

/// What is known of a face after its work is done.
#[derive(Clone, Copy, Debug)]
pub struct FaceResult<T> {
    /// E at the start; 0 where there is no frame, NaN where nobody asked ([`Kernel::with_energies`]).
    pub energy_start: T,
    /// E at the end; likewise.
    pub energy: T,
    /// How it ended.
    pub status: Status,
}

/// One stitch type ready to run: its stencil and settings, in one precision.
#[derive(Clone, Debug)]
pub struct Kernel<S> {
    /// The template, compiled.
    pub stencil: Stencil<S>,
    mode: Mode,
    solver: Solver,
    iterations: u32,
    beta: Option<S>,
    weights: Weights<S>,
    table: Option<Arc<Table<S>>>,
    energies: bool,
}

/// Scratch space for the kernels of one thread: what a run is given, and what it leaves. A face a lane.
#[derive(Clone, Debug, Default)]
pub struct Workspace<T: Real> {
    /// `[corner]` places relative to the first corner, template units: set by the caller.
    pub corners: Vec<V3<T>>,
    /// `[corner]` unnormalised normals: set by the caller.
    pub normals: Vec<V3<T>>,
    /// `[corner]` places in the face frame: set by [`Kernel::frame`].
    pub shape: Vec<V2<T>>,
    /// `[knot]` an earlier state, set by the caller where [`Given`] asks for it; afterwards the end state.
    pub state: Vec<KnotState<T>>,
    /// `[point]` where the points ended, relative to the first corner, template units.
    pub points: Vec<V3<T>>,
    seats: Vec<lift::Seat<T>>,
    solve: solve::Solve<T>,
}

/// What is known of faces side by side before their solve: masks of what `Workspace::state` holds.
#[derive(Clone, Copy, Debug)]
pub struct Given<T: Real> {
    /// The solve's result already: nothing is left to solve.
    pub solved: T::Mask,
    /// A start for the solve, where its half-lengths are above 0.
    pub start: bool,
    /// Whether that start is one only where no half-length is far off the deformed template's: else the face has
    /// leapt since.
    pub near: bool,
}

impl<T: Real> Given<T> {
    /// Nothing is known.
    #[inline(always)]
    pub fn nothing() -> Self {
        Self { solved: T::mask(false), start: false, near: false }
    }
}

/// What a run reports of the faces side by side.
#[derive(Clone, Copy, Debug)]
pub struct Ended<T: Real> {
    outcome: solve::Outcome<T>,
    /// Which faces have a frame and a finite end.
    pub sound: T::Mask,
    solved: bool,
    iterations: u32,
}

impl<T: Real> Ended<T> {
    /// What is known of the face in a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> FaceResult<T::Scalar> {
        let zero = T::Scalar::zero();
        if !T::mask_lane(self.sound, lane) {
            return FaceResult { energy_start: zero, energy: zero, status: Status::FellBack };
        }
        let outcome = &self.outcome;
        let status = if !self.solved {
            Status::Interpolated
        } else if T::mask_lane(outcome.at_rest, lane) {
            Status::AtRest
        } else if T::mask_lane(outcome.converged, lane) {
            Status::Converged
        } else if self.iterations > 0 && outcome.steps.lane(lane) == zero {
            Status::Stuck
        } else {
            Status::Stepped
        };
        FaceResult { energy_start: outcome.start.lane(lane), energy: outcome.end.lane(lane), status }
    }
}

impl<S: Scalar> Kernel<S> {
    /// Prepares a stitch type.
    pub fn new(stencil: &Stencil<f64>, mode: Mode, settings: &Settings) -> Self {
        Self {
            stencil: stencil.cast(),
            mode,
            solver: settings.solver,
            iterations: settings.iterations,
            // Plain interpolation leaves the centres' bits alone.
            beta: (settings.beta != 1.0).then(|| S::of(settings.beta)),
            weights: Weights {
                angle: S::of(settings.weight_angle.sqrt()),
                length: S::of(settings.weight_length.sqrt()),
            },
            table: None,
            energies: true,
        }
    }

    /// Starts solves from a table, made for this stitch type and these settings.
    pub fn with_table(self, table: Option<Arc<Table<S>>>) -> Self {
        Self { table, ..self }
    }

    /// Whether energies are worked out that the method does not need; else they are NaN. They are unless told.
    pub fn with_energies(self, energies: bool) -> Self {
        Self { energies, ..self }
    }

    /// The iteration.
    pub fn solver(&self) -> Solver {
        self.solver
    }

    /// Steps at most.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }

    /// Knot spacing, where it is not plain interpolation.
    pub fn beta(&self) -> Option<S> {
        self.beta
    }

    /// Square roots of the weights.
    pub fn weights(&self) -> Weights<S> {
        self.weights
    }

    /// The table that solves start from.
    pub fn table(&self) -> Option<&Table<S>> {
        self.table.as_deref()
    }

    /// Makes room in a workspace.
    pub fn fit<T: Real<Scalar = S>>(&self, work: &mut Workspace<T>) {
        work.corners.resize(self.stencil.corner_count, V3::zero());
        work.normals.resize(self.stencil.corner_count, V3::zero());
        work.shape.resize(self.stencil.corner_count, V2::zero());
        work.state.resize(self.stencil.knot_count(), KnotState::default());
        work.points.resize(self.stencil.points.len(), V3::zero());
        work.seats.resize(self.stencil.knot_count(), lift::Seat::default());
        work.solve.fit(&self.stencil);
    }

    /// Works out faces side by side, from `corners` and `normals` of the workspace to its `points` and `state`.
    #[inline(always)]
    pub fn run<T: Real<Scalar = S>>(&self, work: &mut Workspace<T>, given: Given<T>) -> Ended<T> {
        let framed = self.frame(work);
        self.finish(work, framed, given)
    }

    /// The first part of [`Kernel::run`]: the faces' frames and their shapes in them. All that the solve depends
    /// on is the shape.
    #[inline(always)]
    pub fn frame<T: Real<Scalar = S>>(&self, work: &mut Workspace<T>) -> (Frame<T>, T::Mask) {
        let (frame, usable) = frame::face_frame(&self.stencil.frame_gradients, &work.corners);
        for (shape, corner) in work.shape.iter_mut().zip(&work.corners) {
            *shape = frame.plane(*corner);
        }
        (frame, usable)
    }

    /// The second part of [`Kernel::run`].
    #[inline(always)]
    pub fn finish<T: Real<Scalar = S>>(
        &self,
        work: &mut Workspace<T>,
        (frame, usable): (Frame<T>, T::Mask),
        given: Given<T>,
    ) -> Ended<T> {
        let stencil = &self.stencil;
        let n = stencil.corner_count;
        for (i, p) in stencil.points.iter().enumerate() {
            if matches!(p.role, Role::Boundary | Role::Free) {
                let weights = &stencil.weights[i * n..(i + 1) * n];
                let at = frame::blend(weights, &work.corners);
                work.points[i] = lift::interpolate(weights, at, &work.normals, p.z);
                work.solve.points.plane[i] = frame.plane(at);
            }
        }
        for k in 0..stencil.knot_count() {
            work.seats[k] = lift::seat(stencil, &frame, &work.corners, &work.normals, k);
            work.solve.points.centers[k] = work.seats[k].center;
        }
        if let Some(beta) = self.beta {
            frame::space_knots(stencil, T::splat(beta), &mut work.solve.points.centers);
        }
        let solves = self.solves();
        let left = solves && T::any(T::not(given.solved));
        let weights = Weights { angle: T::splat(self.weights.angle), length: T::splat(self.weights.length) };
        let mut damping = T::zero();
        if left {
            damping = self.start(work, &frame, given);
        } else if !solves {
            start::rigid(stencil, &mut work.solve.state);
        }
        let outcome = if left {
            work.solve.run(stencil, &weights, self.solver, self.iterations, damping, self.energies)
        } else if solves {
            solve::Outcome::none()
        } else {
            work.solve.run(stencil, &weights, Solver::GaussNewton, 0, T::zero(), self.energies)
        };
        if solves && T::any(given.solved) {
            for (state, earlier) in work.solve.state.iter_mut().zip(&work.state) {
                *state = KnotState::select(given.solved, *earlier, *state);
            }
            work.solve.place(stencil);
        }

        let mut sound = T::and(usable, T::or(given.solved, outcome.finite));
        for (i, p) in stencil.points.iter().enumerate() {
            if matches!(p.role, Role::Contact | Role::Control) {
                let (seat, at) = (&work.seats[p.knot as usize], work.solve.points.plane[i]);
                work.points[i] = seat.lift(&frame, at, T::splat(p.z));
            }
            sound = T::and(sound, work.points[i].finite());
        }
        work.state.copy_from_slice(&work.solve.state);
        if T::any(T::not(sound)) {
            self.fall_back(work, sound);
        }
        Ended { outcome, sound, solved: solves, iterations: self.iterations }
    }

    /// Whether there is anything to solve.
    #[inline(always)]
    pub fn solves(&self) -> bool {
        self.mode == Mode::Relax && self.stencil.knot_count() > 0
    }

    /// Puts the solve's start in place; gives the damping of its first step.
    #[inline(always)]
    fn start<T: Real<Scalar = S>>(&self, work: &mut Workspace<T>, frame: &Frame<T>, given: Given<T>) -> T {
        start::affine(&self.stencil, frame, &mut work.solve.state);
        let mut damping = T::of(solve::DAMPING);
        if let Some(table) = &self.table {
            table.correct(frame, &mut work.solve.state);
            damping = T::of(solve::DAMPING_TABLE);
        }
        if given.start {
            let mut known = T::mask(true);
            let leap = T::of(LEAP);
            for (state, earlier) in work.solve.state.iter().zip(&work.state) {
                let (l, before) = (state.half_length, earlier.half_length);
                known = T::and(known, T::zero().lt(before));
                if given.near {
                    known = T::and(known, T::and(l.lt(before * leap), before.lt(l * leap)));
                }
            }
            for (state, earlier) in work.solve.state.iter_mut().zip(&work.state) {
                *state = KnotState::select(known, *earlier, *state);
            }
            damping = T::select(known, T::of(solve::DAMPING_PREVIOUS), damping);
        }
        damping
    }

    /// Interpolates the faces that are not sound.
    #[inline(always)]
    fn fall_back<T: Real<Scalar = S>>(&self, work: &mut Workspace<T>, sound: T::Mask) {
        let stencil = &self.stencil;
        let n = stencil.corner_count;
        for (i, p) in stencil.points.iter().enumerate() {
            let weights = &stencil.weights[i * n..(i + 1) * n];
            let at = frame::blend(weights, &work.corners);
            let point = lift::interpolate(weights, at, &work.normals, p.z);
            work.points[i] = V3::select(sound, work.points[i], point);
        }
        for state in &mut work.state {
            *state = KnotState::select(sound, *state, KnotState::default());
        }
    }

    /// The in-plane places of the points and of the knot centres of the faces last run, template units.
    pub fn plane_points<'a, T: Real>(&self, work: &'a Workspace<T>) -> (&'a [V2<T>], &'a [V2<T>]) {
        (&work.solve.points.plane, &work.solve.points.centers)
    }
}
