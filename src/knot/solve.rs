//! Stage 4: the per-stitch solve (Huang et al. 2025, section 5.2; model section 5).

use super::energy::{Points, Weights};
use super::factor;
use super::start::KnotState;
use crate::math::{Real, V2};
use crate::scene::Stencil;

/// How the energy is minimised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solver {
    /// Damped Newton steps (Gauss-Newton where the Hessian is not positive definite) that never raise the
    /// energy, half-lengths kept at r / 2 or more.
    #[default]
    Safeguarded,
    /// The paper's plain Gauss-Newton iteration: undamped, unbounded.
    GaussNewton,
}

/// 'Converged' means that a step lowered E by less than this share of it.
const CONVERGED: f64 = 1e-10;
/// Or that it was not lower by no more than rounding leaves of E: this share of sqrt(E E0), E0 what counts as at
/// rest. In f32 a step from a table is often too small for E to tell.
const NOISE: f64 = 0.2;
/// Damping of the first step from the affine start.
/// Measured: less overshoots where residuals are large, and an undone step costs as much as a good one.
pub const DAMPING: f64 = 0.1;
/// Damping of the first step from a table's start: it would only throttle the step.
pub const DAMPING_TABLE: f64 = 0.0;
/// Damping of the first step from the previous frame's result. Measured with strains that change by 0.003 to 0.1
/// a frame: 0.1 leaves a tenth of each error, 0 gains little more and overshoots in stacked stitches.
pub const DAMPING_PREVIOUS: f64 = 0.01;
/// Change of the damping after a step that lowered E and one that did not, and what it counts as at least in
/// the latter case.
const LEAST_DAMPING: f64 = 0.01;
const DAMPING_AFTER_SUCCESS: f64 = 0.1;
const DAMPING_AFTER_FAILURE: f64 = 10.0;

/// Scratch space of a solve, and its result in `state`.
#[derive(Clone, Debug, Default)]
pub struct Solve<T: Real> {
    /// Points and their energy.
    pub points: Points<T>,
    /// `[knot]` the state: set to the start, left at the result.
    pub state: Vec<KnotState<T>>,
    trial: Vec<KnotState<T>>,
    a: Vec<T>,
    c: Vec<T>,
    b: Vec<T>,
    trial_a: Vec<T>,
    trial_c: Vec<T>,
    trial_b: Vec<T>,
    factor: Vec<T>,
    step: Vec<T>,
    frozen: Vec<T::Mask>,
}

/// What a solve reports of a stitch.
#[derive(Clone, Copy, Debug)]
pub struct Outcome<T: Real> {
    /// E at the start.
    pub start: T,
    /// E at the end.
    pub end: T,
    /// Whether it stood at rest already.
    pub at_rest: T::Mask,
    /// Whether the last step lowered E by less than 1e-10 of it.
    pub converged: T::Mask,
    /// Steps that changed the state.
    pub steps: T,
}

impl<T: Real> Solve<T> {
    /// Makes room for a stencil.
    pub fn fit(&mut self, stencil: &Stencil<T>) {
        let (k, n) = (stencil.knot_count(), 2 * stencil.knot_count());
        self.points.fit(stencil);
        self.state.resize(k, KnotState::default());
        self.trial.resize(k, KnotState::default());
        for matrix in [&mut self.a, &mut self.c, &mut self.trial_a, &mut self.trial_c, &mut self.factor] {
            matrix.resize(n * n, T::zero());
        }
        for vector in [&mut self.b, &mut self.trial_b, &mut self.step] {
            vector.resize(n, T::zero());
        }
        self.frozen.resize(n, T::mask(false));
    }

    /// Runs up to `iterations` steps from `state`; `damping` is that of the first one.
    #[inline(always)]
    pub fn run(
        &mut self,
        stencil: &Stencil<T>,
        weights: &Weights<T>,
        solver: Solver,
        iterations: u32,
        damping: T,
    ) -> Outcome<T> {
        match solver {
            Solver::Safeguarded => self.safeguarded(stencil, weights, iterations, damping),
            Solver::GaussNewton => self.gauss_newton(stencil, weights, iterations),
        }
    }

    /// The energy of the state as it is.
    #[inline(always)]
    pub fn evaluate(&mut self, stencil: &Stencil<T>, weights: &Weights<T>) -> Outcome<T> {
        self.points.place(stencil, &self.state);
        let energy = self.points.energy(stencil, weights);
        Outcome {
            start: energy,
            end: energy,
            at_rest: T::mask(false),
            converged: T::mask(false),
            steps: T::zero(),
        }
    }

    #[inline(always)]
    fn gauss_newton(&mut self, stencil: &Stencil<T>, weights: &Weights<T>, iterations: u32) -> Outcome<T> {
        let mut outcome = self.evaluate(stencil, weights);
        self.frozen.fill(T::mask(false));
        for _ in 0..iterations {
            self.points.place(stencil, &self.state);
            self.points.assemble(stencil, weights, &self.state, &mut self.a, &mut self.b);
            factor::factorise(&self.a, None, T::zero(), &self.frozen, &mut self.factor);
            factor::solve(&self.factor, &self.b, &mut self.step);
            for (k, state) in self.state.iter_mut().enumerate() {
                *state = stepped(*state, self.step[2 * k], self.step[2 * k + 1]);
            }
            outcome.steps += T::one();
        }
        outcome.end = self.evaluate(stencil, weights).end;
        outcome
    }

    #[inline(always)]
    fn safeguarded(
        &mut self,
        stencil: &Stencil<T>,
        weights: &Weights<T>,
        iterations: u32,
        damping: T,
    ) -> Outcome<T> {
        let shortest = stencil.yarn_radius * T::of(0.5);
        for state in &mut self.state {
            state.half_length = state.half_length.max(shortest);
        }
        self.points.place(stencil, &self.state);
        let (a, c, b) = (&mut self.a, &mut self.c, &mut self.b);
        let start = self.points.assemble_curved(stencil, weights, &self.state, a, c, b);
        let mut energy = start;
        let at_rest = start.le(T::of(T::REST_ENERGY));
        let mut done = at_rest;
        let mut converged = T::mask(false);
        let mut steps = T::zero();
        let mut mu = damping;
        for i in 0..iterations {
            if !T::any(T::not(done)) {
                break;
            }
            for (k, state) in self.state.iter().enumerate() {
                // A half-length at its bound stays there while E falls towards shorter ones.
                self.frozen[2 * k] = T::mask(false);
                self.frozen[2 * k + 1] =
                    T::and(state.half_length.le(shortest), T::zero().lt(self.b[2 * k + 1]));
            }
            // Newton's matrix where it is positive definite, else that of Gauss-Newton.
            let curved = Some((&self.c[..], T::mask(true)));
            let positive = factor::factorise(&self.a, curved, mu, &self.frozen, &mut self.factor);
            if T::any(T::not(positive)) {
                let curved = Some((&self.c[..], positive));
                factor::factorise(&self.a, curved, mu, &self.frozen, &mut self.factor);
            }
            factor::solve(&self.factor, &self.b, &mut self.step);
            for (k, trial) in self.trial.iter_mut().enumerate() {
                *trial = stepped(self.state[k], self.step[2 * k], self.step[2 * k + 1]);
                trial.half_length = trial.half_length.max(shortest);
            }
            self.points.place(stencil, &self.trial);
            let tried = if i + 1 < iterations {
                let (a, c, b) = (&mut self.trial_a, &mut self.trial_c, &mut self.trial_b);
                self.points.assemble_curved(stencil, weights, &self.trial, a, c, b)
            } else {
                self.points.energy(stencil, weights)
            };
            let better = T::and(tried.lt(energy), T::not(done));
            let small = T::and(better, (energy - tried).lt(T::of(CONVERGED) * energy));
            // Not lower, but by no more than rounding: nothing is left to gain.
            let noise = (energy * T::of(T::REST_ENERGY)).sqrt() * T::of(NOISE);
            let level = T::and(T::not(better), (tried - energy).le(noise));
            converged = T::or(converged, T::or(small, T::and(level, T::not(done))));
            steps += T::select(better, T::one(), T::zero());
            energy = T::select(better, tried, energy);
            let more = mu.max(T::of(LEAST_DAMPING)) * T::of(DAMPING_AFTER_FAILURE);
            mu = T::select(better, mu * T::of(DAMPING_AFTER_SUCCESS), more);
            done = T::or(done, converged);
            for (state, trial) in self.state.iter_mut().zip(&self.trial) {
                state.direction = V2::select(better, trial.direction, state.direction);
                state.half_length = T::select(better, trial.half_length, state.half_length);
            }
            for (old, new) in
                [(&mut self.a, &self.trial_a), (&mut self.c, &self.trial_c), (&mut self.b, &self.trial_b)]
            {
                for (old, new) in old.iter_mut().zip(new) {
                    *old = T::select(better, *new, *old);
                }
            }
        }
        self.points.place(stencil, &self.state);
        Outcome { start, end: energy, at_rest, converged, steps }
    }
}

/// The step of the unknowns: the state after turning d by 2 atan(angle / 2) (Cayley) and lengthening l.
#[inline(always)]
pub fn stepped<T: Real>(state: KnotState<T>, angle: T, lengthening: T) -> KnotState<T> {
    let h = angle * T::of(0.5);
    let scale = T::one() / (T::one() + h * h);
    let (cos, sin) = ((T::one() - h * h) * scale, (h + h) * scale);
    let d = state.direction;
    KnotState {
        direction: V2::new(cos * d.u - sin * d.v, sin * d.u + cos * d.v),
        half_length: state.half_length + lengthening,
    }
}
