//! The method: knots of a stitch solved for in the plane of its face (Huang et al. 2025), a stage a file.
//!
//! Generic over the scalar: f64 is the reference, f32 its twin in the same order of operations. All lengths
//! are in template units, all places relative to the face's first corner.

pub mod energy;
pub mod factor;
pub mod frame;
pub mod lift;
pub mod solve;
pub mod start;
pub mod table;
pub mod tabulate;

use crate::math::{Real, Scalar, V2, V3};
use crate::scene::{Mode, Role, Stencil};
pub use energy::Weights;
pub use solve::Solver;
pub use start::KnotState;
use std::sync::Arc;
use table::Table;

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
    /// A step lowered the energy by less than 1e-10 of it.
    Converged = 2,
    /// The start is at rest: no step was needed.
    AtRest = 3,
    /// No step lowered the energy.
    Stuck = 4,
    /// The face has no frame, or its solve no finite end: interpolated instead.
    FellBack = 5,
    /// Left out: the library has no such stitch.
    Skipped = 6,
}

impl Status {
    /// All of them, in the order of their numbers.
    pub const ALL: [Status; 7] = [
        Status::Interpolated,
        Status::Stepped,
        Status::Converged,
        Status::AtRest,
        Status::Stuck,
        Status::FellBack,
        Status::Skipped,
    ];
}

/// What is known of a face after its work is done.
#[derive(Clone, Copy, Debug)]
pub struct FaceResult<T> {
    /// E at the start; 0 where there is no frame.
    pub energy_start: T,
    /// E at the end.
    pub energy: T,
    /// How it ended.
    pub status: Status,
}

/// One stitch type ready to run: its stencil and settings, in one precision.
#[derive(Clone, Debug)]
pub struct Kernel<T> {
    /// The template, compiled.
    pub stencil: Stencil<T>,
    mode: Mode,
    solver: Solver,
    iterations: u32,
    beta: Option<T>,
    weights: Weights<T>,
    table: Option<Arc<Table<T>>>,
}

/// Scratch space for faces, sized for the kernel last run.
#[derive(Clone, Debug, Default)]
pub struct Workspace<T: Real> {
    /// `[corner]` places relative to the first corner, template units: set by the caller.
    pub corners: Vec<V3<T>>,
    /// `[corner]` unnormalised normals: set by the caller.
    pub normals: Vec<V3<T>>,
    seats: Vec<lift::Seat<T>>,
    solve: solve::Solve<T>,
}

impl<T: Scalar> Kernel<T> {
    /// Prepares a stitch type.
    pub fn new(stencil: &Stencil<f64>, mode: Mode, settings: &Settings) -> Self {
        Self {
            stencil: stencil.cast(),
            mode,
            solver: settings.solver,
            iterations: settings.iterations,
            // Plain interpolation leaves the centres' bits alone.
            beta: (settings.beta != 1.0).then(|| T::of(settings.beta)),
            weights: Weights {
                angle: T::of(settings.weight_angle.sqrt()),
                length: T::of(settings.weight_length.sqrt()),
            },
            table: None,
        }
    }

    /// Starts solves from a table, made for this stitch type and these settings.
    pub fn with_table(self, table: Option<Arc<Table<T>>>) -> Self {
        Self { table, ..self }
    }

    /// Makes room in a workspace.
    pub fn fit(&self, work: &mut Workspace<T>) {
        work.corners.resize(self.stencil.corner_count, V3::zero());
        work.normals.resize(self.stencil.corner_count, V3::zero());
        work.seats.resize(self.stencil.knot_count(), lift::Seat::default());
        work.solve.fit(&self.stencil);
    }

    /// Works out one face: its points relative to its first corner go to `points`, its knots' end state to
    /// `state`. With `warm`, the solve starts from `state` where that holds a half-length above 0.
    #[inline(always)]
    pub fn run(
        &self,
        work: &mut Workspace<T>,
        warm: bool,
        state: &mut [KnotState<T>],
        points: &mut [V3<T>],
    ) -> FaceResult<T> {
        let stencil = &self.stencil;
        let n = stencil.corner_count;
        let (frame, usable) = frame::face_frame(&stencil.frame_gradients, &work.corners);
        for (i, point) in points.iter_mut().enumerate() {
            let (weights, p) = (&stencil.weights[i * n..(i + 1) * n], &stencil.points[i]);
            let needed = !usable || matches!(p.role, Role::Boundary | Role::Free);
            if needed {
                *point = lift::interpolate(weights, &work.corners, &work.normals, p.z);
                work.solve.points.plane[i] = frame.plane(frame::blend(weights, &work.corners));
            }
        }
        let fell_back = FaceResult { energy_start: T::zero(), energy: T::zero(), status: Status::FellBack };
        if !usable {
            state.fill(KnotState::default());
            return fell_back;
        }

        for k in 0..stencil.knot_count() {
            work.seats[k] = lift::seat(stencil, &frame, &work.corners, &work.normals, k);
            work.solve.points.centers[k] = work.seats[k].center();
        }
        if let Some(beta) = self.beta {
            frame::space_knots(stencil, beta, &mut work.solve.points.centers);
        }
        let solving = self.mode == Mode::Relax && !state.is_empty();
        let mut damping = solve::DAMPING;
        if !solving {
            start::rigid(stencil, &mut work.solve.state);
        } else if warm && state.iter().all(|s| T::zero().lt(s.half_length)) {
            work.solve.state.copy_from_slice(state);
            damping = solve::DAMPING_PREVIOUS;
        } else {
            start::affine(stencil, &frame, &mut work.solve.state);
            if let Some(table) = &self.table {
                table.correct(&frame, &mut work.solve.state);
                damping = solve::DAMPING_TABLE;
            }
        }
        let (outcome, mut status) = if solving {
            let outcome =
                work.solve.run(stencil, &self.weights, self.solver, self.iterations, T::of(damping));
            (outcome, status_of(&outcome, self.iterations))
        } else {
            (work.solve.evaluate(stencil, &self.weights), Status::Interpolated)
        };

        state.copy_from_slice(&work.solve.state);
        let mut finite = outcome.end.finite();
        for (i, point) in points.iter_mut().enumerate() {
            let p = &stencil.points[i];
            if matches!(p.role, Role::Contact | Role::Control) {
                *point = work.seats[p.knot as usize].lift(&frame, work.solve.points.plane[i], p.z);
            }
            finite &= point.finite();
        }
        if !finite {
            for (i, point) in points.iter_mut().enumerate() {
                let weights = &stencil.weights[i * n..(i + 1) * n];
                *point = lift::interpolate(weights, &work.corners, &work.normals, stencil.points[i].z);
            }
            state.fill(KnotState::default());
            status = Status::FellBack;
            return FaceResult { status, ..fell_back };
        }
        FaceResult { energy_start: outcome.start, energy: outcome.end, status }
    }

    /// The in-plane places of the points and of the knot centres of the face last run, template units.
    pub fn plane_points<'a>(&self, work: &'a Workspace<T>) -> (&'a [V2<T>], &'a [V2<T>]) {
        (&work.solve.points.plane, &work.solve.points.centers)
    }
}

fn status_of<T: Scalar>(outcome: &solve::Outcome<T>, iterations: u32) -> Status {
    if outcome.at_rest {
        Status::AtRest
    } else if outcome.converged {
        Status::Converged
    } else if iterations > 0 && outcome.steps.to_f64() == 0.0 {
        Status::Stuck
    } else {
        Status::Stepped
    }
}
