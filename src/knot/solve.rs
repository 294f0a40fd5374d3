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

/// 'Converged' means that a step lowered E by less than [`Real::CONVERGED`] says, or that it was not lower by no
/// more than rounding leaves of E: this share of sqrt(E E0), E0 what counts as at rest. In f32 a step from a table
/// is often too small for E to tell.
pub(crate) const NOISE: f64 = 0.2;
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
pub(crate) const LEAST_DAMPING: f64 = 0.01;
pub(crate) const DAMPING_AFTER_SUCCESS: f64 = 0.1;
pub(crate) const DAMPING_AFTER_FAILURE: f64 = 10.0;

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
    /// Whether the last step lowered E by next to nothing: see [`Real::CONVERGED`].
    pub converged: T::Mask,
    /// Steps that changed the state.
    pub steps: T,
    /// Whether the end is finite: its energy, or what stands in for it.
    pub finite: T::Mask,
}

impl<T: Real> Outcome<T> {
    /// Of no solve at all.
    #[inline(always)]
    pub fn none() -> Self {
        let (zero, no) = (T::zero(), T::mask(false));
        Self { start: zero, end: zero, at_rest: no, converged: no, steps: zero, finite: no }
    }
}

impl<T: Real> Solve<T> {
    /// Makes room for a stencil.
    pub fn fit(&mut self, stencil: &Stencil<T::Scalar>) {
        let (k, n) = (stencil.knot_count(), 2 * stencil.knot_count());
        self.points.fit(stencil);
        self.state.resize(k, KnotState::default());
        self.trial.resize(k, KnotState::default());
        for matrix in [&mut self.a, &mut self.c, &mut self.factor] {
            matrix.resize(n * n, T::zero());
        }
        for vector in [&mut self.b, &mut self.step] {
            vector.resize(n, T::zero());
        }
        self.frozen.resize(n, T::mask(false));
    }

    /// Runs up to `iterations` steps from `state`; `damping` is that of the first one. Without `energies` those that
    /// the iteration itself does not need are NaN.
    #[inline(always)]
    pub fn run(
        &mut self,
        stencil: &Stencil<T::Scalar>,
        weights: &Weights<T>,
        solver: Solver,
        iterations: u32,
        damping: T,
        energies: bool,
    ) -> Outcome<T> {
        let safe = solver == Solver::Safeguarded;
        let shortest = T::splat(stencil.yarn_radius) * T::of(0.5);
        if safe {
            for state in &mut self.state {
                state.half_length = state.half_length.max(shortest);
            }
        }
        self.frozen.fill(T::mask(false));
        let mut outcome = Outcome::none();
        let mut done = T::mask(false);
        let mut mu = if safe { damping } else { T::zero() };
        for i in 0..iterations {
            self.place(stencil);
            let energy = self.assemble(stencil, weights, safe);
            if i == 0 {
                outcome.start = energy;
                outcome.end = energy;
                if safe {
                    outcome.at_rest = energy.le(T::of(T::REST_ENERGY));
                    done = outcome.at_rest;
                }
            }
            if !T::any(T::not(done)) {
                break;
            }
            if safe {
                self.freeze(shortest);
            }
            self.step(mu, safe);
            if !safe {
                self.state.copy_from_slice(&self.trial);
                outcome.steps += T::one();
                continue;
            }
            for trial in &mut self.trial {
                trial.half_length = trial.half_length.max(shortest);
            }
            self.points.place(stencil, &self.trial);
            let tried = self.points.energy(stencil, weights, &self.trial);
            let better = T::and(tried.lt(outcome.end), T::not(done));
            let little = T::of(T::CONVERGED) * outcome.end + T::of(T::CONVERGED_BELOW);
            let small = T::and(better, (outcome.end - tried).lt(little));
            // Not lower, but by no more than rounding: nothing is left to gain.
            let noise = (outcome.end * T::of(T::REST_ENERGY)).sqrt() * T::of(NOISE);
            let level = T::and(T::not(better), (tried - outcome.end).le(noise));
            let level = T::and(level, T::not(done));
            outcome.converged = T::or(outcome.converged, T::or(small, level));
            let more = mu.max(T::of(LEAST_DAMPING)) * T::of(DAMPING_AFTER_FAILURE);
            mu = T::select(better, mu * T::of(DAMPING_AFTER_SUCCESS), more);
            done = T::or(done, outcome.converged);
            outcome.steps += T::select(better, T::one(), T::zero());
            outcome.end = T::select(better, tried, outcome.end);
            for (state, trial) in self.state.iter_mut().zip(&self.trial) {
                *state = KnotState::select(better, *trial, *state);
            }
        }
        self.place(stencil);
        if !energies && (!safe || iterations == 0) {
            // The state's squares overflow where the energy's would, or nearly.
            let mut size = T::zero();
            for state in &self.state {
                let l = state.half_length;
                size += weights.length * weights.length * (l * l) + state.direction.dot(state.direction);
            }
            outcome.finite = size.finite();
            outcome.end = T::of(f64::NAN);
            outcome.start = if iterations == 0 { outcome.end } else { outcome.start };
            return outcome;
        }
        if !safe || iterations == 0 {
            outcome.end = self.points.energy(stencil, weights, &self.state);
            outcome.start = if iterations == 0 { outcome.end } else { outcome.start };
        }
        outcome.finite = outcome.end.finite();
        outcome
    }

    /// The normal equations at the state.
    #[inline(always)]
    fn assemble(&mut self, stencil: &Stencil<T::Scalar>, weights: &Weights<T>, curved: bool) -> T {
        let c = if curved { Some(&mut self.c[..]) } else { None };
        self.points.assemble(stencil, weights, &self.state, (&mut self.a, c, &mut self.b))
    }

    /// Puts the points where the state says.
    #[inline(always)]
    pub fn place(&mut self, stencil: &Stencil<T::Scalar>) {
        self.points.place(stencil, &self.state);
    }

    /// A half-length at its bound stays there while E falls towards shorter ones.
    #[inline(always)]
    fn freeze(&mut self, shortest: T) {
        for (k, state) in self.state.iter().enumerate() {
            self.frozen[2 * k + 1] = T::and(state.half_length.le(shortest), T::zero().lt(self.b[2 * k + 1]));
        }
    }

    /// The next trial: a step from the state.
    #[inline(always)]
    fn step(&mut self, mu: T, curved: bool) {
        // Newton's matrix where it is positive definite, else that of Gauss-Newton.
        let mut newton = T::mask(curved);
        loop {
            let positive = factor::factorise(&self.a, &self.c, newton, mu, &self.frozen, &mut self.factor);
            if !T::any(T::and(newton, T::not(positive))) {
                break;
            }
            newton = T::and(newton, positive);
        }
        factor::solve(&self.factor, &self.b, &mut self.step);
        for (k, trial) in self.trial.iter_mut().enumerate() {
            *trial = stepped(self.state[k], self.step[2 * k], self.step[2 * k + 1]);
        }
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
