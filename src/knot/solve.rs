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

/// Damping at the start, and its change after a step that lowered E and one that did not.
/// Measured: less at the start overshoots where residuals are large, and an undone step costs as much as a good
/// one.
const DAMPING: f64 = 0.1;
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

impl<T: Real> Outcome<T> {
    /// Of no solve at all.
    #[inline(always)]
    pub fn none() -> Self {
        let (zero, no) = (T::zero(), T::mask(false));
        Self { start: zero, end: zero, at_rest: no, converged: no, steps: zero }
    }
}

impl<T: Real> Solve<T> {
    /// Makes room for a stencil.
    pub fn fit(&mut self, stencil: &Stencil<T::Scalar>) {
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

    /// Runs up to `iterations` steps from `state`.
    #[inline(always)]
    pub fn run(
        &mut self,
        stencil: &Stencil<T::Scalar>,
        weights: &Weights<T>,
        solver: Solver,
        iterations: u32,
    ) -> Outcome<T> {
        let safe = solver == Solver::Safeguarded;
        let shortest = T::splat(stencil.yarn_radius) * T::of(0.5);
        self.trial.copy_from_slice(&self.state);
        if safe {
            for trial in &mut self.trial {
                trial.half_length = trial.half_length.max(shortest);
            }
        }
        self.frozen.fill(T::mask(false));
        let mut outcome = Outcome::none();
        let mut done = T::mask(false);
        let mut mu = if safe { T::of(DAMPING) } else { T::zero() };
        // The first trial is the start itself, and the last needs no more than its energy.
        for i in 0..=iterations {
            self.points.place(stencil, &self.trial);
            let tried = if i < iterations {
                let (a, c, b) = (&mut self.trial_a, &mut self.trial_c, &mut self.trial_b);
                let c = if safe { Some(&mut c[..]) } else { None };
                self.points.assemble(stencil, weights, &self.trial, (a, c, b))
            } else {
                self.points.energy(stencil, weights, &self.trial)
            };
            let better = if i == 0 {
                outcome.start = tried;
                outcome.end = tried;
                if safe {
                    outcome.at_rest = tried.le(T::of(T::REST_ENERGY));
                    done = outcome.at_rest;
                }
                T::mask(true)
            } else if safe {
                let better = T::and(tried.lt(outcome.end), T::not(done));
                let small = (outcome.end - tried).lt(T::of(T::CONVERGED) * outcome.end);
                outcome.converged = T::or(outcome.converged, T::and(better, small));
                let success = T::of(DAMPING_AFTER_SUCCESS);
                mu = mu * T::select(better, success, T::of(DAMPING_AFTER_FAILURE));
                done = T::or(done, outcome.converged);
                better
            } else {
                T::mask(true)
            };
            if i > 0 {
                outcome.steps += T::select(better, T::one(), T::zero());
            }
            outcome.end = T::select(better, tried, outcome.end);
            self.take(better, i < iterations, safe);
            if i == iterations || !T::any(T::not(done)) {
                break;
            }
            if safe {
                self.freeze(shortest);
            }
            self.step(mu, safe);
            if safe {
                for trial in &mut self.trial {
                    trial.half_length = trial.half_length.max(shortest);
                }
            }
        }
        self.place(stencil);
        outcome
    }

    /// Puts the points where the state says.
    #[inline(always)]
    pub fn place(&mut self, stencil: &Stencil<T::Scalar>) {
        self.points.place(stencil, &self.state);
    }

    /// The energy of the state as it is.
    #[inline(always)]
    pub fn evaluate(&mut self, stencil: &Stencil<T::Scalar>, weights: &Weights<T>) -> Outcome<T> {
        self.place(stencil);
        let energy = self.points.energy(stencil, weights, &self.state);
        Outcome { start: energy, end: energy, ..Outcome::none() }
    }

    /// Takes the trial over where it is better; its matrices too, where there are any.
    #[inline(always)]
    fn take(&mut self, better: T::Mask, assembled: bool, curved: bool) {
        for (state, trial) in self.state.iter_mut().zip(&self.trial) {
            *state = KnotState::select(better, *trial, *state);
        }
        if !assembled {
            return;
        }
        for (old, new) in self.a.iter_mut().zip(&self.trial_a) {
            *old = T::select(better, *new, *old);
        }
        for (old, new) in self.b.iter_mut().zip(&self.trial_b) {
            *old = T::select(better, *new, *old);
        }
        if curved {
            for (old, new) in self.c.iter_mut().zip(&self.trial_c) {
                *old = T::select(better, *new, *old);
            }
        }
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
