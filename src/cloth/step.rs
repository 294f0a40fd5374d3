//! Motion: small implicit steps by projective dynamics, watched and cut where they go wrong.
//!
//! `docs/cloth.md` has what this was chosen over, and by what figures.

use super::implicit::Implicit;
use super::watch::{Slack, State};
use super::{Cloth, assemble};
use crate::Result;
use glam::DVec3;
use rayon::prelude::*;

/// Longest steps, s, in which contacts bear cloth within the solve. In longer ones they lift it off (`docs/scenes.md`), and it is
/// only pushed out afterwards.
pub const LONGEST_BORNE: f64 = 2.5e-3;

/// What a scene does to nodes; called by the stepper. All methods do nothing unless written.
///
/// A frame that goes wrong is done again in smaller steps, so `time` may go back to the frame's start: what a scene does
/// should depend on its arguments alone.
pub trait Surroundings: Send {
    /// Adds accelerations over `dt` (gravity, wind) to `velocities`, m/s, at the start of a substep.
    fn accelerate(&mut self, time: f64, dt: f64, positions: &[DVec3], velocities: &mut [DVec3]) {
        let _ = (time, dt, positions, velocities);
    }

    /// Sets the positions, m, of nodes that the scene moves, at `time` (the substep's end). Only those of [`Self::held`] count.
    fn place(&mut self, time: f64, positions: &mut [DVec3]) {
        let _ = (time, positions);
    }

    /// Adds the forces of contacts, N, to `forces`, which act on nodes at `positions` while these go on from `previous`, inertia
    /// included; how many there are.
    fn support(&mut self, step: &Support, forces: &mut [DVec3]) -> usize {
        let _ = (step, forces);
        0
    }

    /// Pushes nodes out of colliders with friction, for [`Self::support`] and what follows on it; how many were touched.
    fn confine(&mut self, time: f64, dt: f64, previous: &[DVec3], positions: &mut [DVec3]) -> usize {
        let _ = (time, dt, previous, positions);
        0
    }

    /// Pushes nodes out of colliders and of each other and applies friction, after a substep's elastic constraints. `previous`
    /// are positions at its start, `time` is its end. Held nodes are put back afterwards.
    fn collide(&mut self, time: f64, dt: f64, previous: &[DVec3], positions: &mut [DVec3]) {
        let _ = (time, dt, previous, positions);
    }

    /// Nodes that the elastic constraints do not move. Asked at the start of each frame; numbers beyond the last node are
    /// passed over.
    fn held(&self) -> &[u32] {
        &[]
    }
}

/// A substep of which contact forces are asked.
#[derive(Clone, Copy, Debug)]
pub struct Support<'a> {
    /// Its end, s.
    pub time: f64,
    /// Its length, s.
    pub dt: f64,
    /// `[node]` m, at its start.
    pub previous: &'a [DVec3],
    /// `[node]` m, out of colliders.
    pub positions: &'a [DVec3],
    /// `[node]` force that an own displacement meets, N/m, inertia included.
    pub stiffness: &'a [f64],
}

/// Nothing around.
impl Surroundings for () {}

/// How to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOptions {
    /// Substeps of a frame.
    pub substeps: usize,
    /// Iterations of a substep. More substeps gain more than more iterations.
    pub iterations: usize,
    /// After contact, how often nodes are moved one by one to where their forces balance, and out of colliders again.
    pub sweeps: usize,
    /// Rate at which velocities fade, 1/s: air.
    pub damping: f64,
    /// Damping time of springs and bends, s: their force is stiffness times (violation + this times its rate).
    pub elastic_damping: f64,
    /// Speed that no node may pass, m/s; a frame in which one does is cut.
    pub speed_limit: f64,
    /// How often a bad frame is done again with twice the substeps.
    pub retries: u32,
}

impl Default for StepOptions {
    fn default() -> Self {
        Self {
            substeps: 4,
            iterations: 1,
            sweeps: 1,
            damping: 0.2,
            elastic_damping: 0.0,
            speed_limit: 100.0,
            retries: 4,
        }
    }
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameReport {
    /// Time at its end, s.
    pub time: f64,
    /// Substeps that the result took.
    pub substeps: usize,
    /// How often it was bad and done again with twice the substeps.
    pub cut: u32,
    /// Whether it stayed bad, so that cloth was left as it was, at rest.
    pub damped: bool,
    /// Kinetic energy at its end, J.
    pub kinetic: f64,
    /// Elastic energy at its end, J.
    pub elastic: f64,
    /// Greatest distance of a node from node 0, m.
    pub extent: f64,
}

/// Cloth in motion. Owns positions, velocities and workspaces; a frame allocates nothing.
pub struct Stepper {
    cloth: Cloth,
    options: StepOptions,
    time: f64,
    now: Motion,
    /// As at the start of the frame.
    good: Motion,
    /// Positions at the start of the substep.
    previous: Vec<DVec3>,
    /// Where free ones would be at its end without elastic forces.
    goal: Vec<DVec3>,
    implicit: Implicit,
    /// 1/kg; 0 where held.
    inverse_mass: Vec<f64>,
    /// Held nodes, and where they were put.
    held: Vec<u32>,
    held_at: Vec<DVec3>,
    parts: Vec<f64>,
    state: State,
    cuts: u64,
    damped_frames: u64,
}

#[derive(Clone)]
struct Motion {
    x: Vec<DVec3>,
    v: Vec<DVec3>,
}

impl Motion {
    fn set(&mut self, other: &Self) {
        self.x.copy_from_slice(&other.x);
        self.v.copy_from_slice(&other.v);
    }
}

impl Stepper {
    /// Cloth at rest at node positions, m.
    ///
    /// # Errors
    /// Another number of positions than nodes, positions that are not finite, options out of range.
    pub fn new(
        cloth: Cloth,
        start: &[DVec3],
        options: StepOptions,
        surroundings: &dyn Surroundings,
    ) -> Result<Self> {
        check(&cloth, start, &options)?;
        let n = cloth.node_count();
        let zero = vec![DVec3::ZERO; n];
        let now = Motion { x: start.to_vec(), v: zero };
        let mut stepper = Self {
            parts: vec![0.0; cloth.part_count()],
            options,
            time: 0.0,
            good: now.clone(),
            previous: start.to_vec(),
            goal: start.to_vec(),
            implicit: Implicit::new(&cloth),
            inverse_mass: vec![0.0; n],
            held: Vec::with_capacity(n),
            held_at: Vec::with_capacity(n),
            now,
            cloth,
            state: State::default(),
            cuts: 0,
            damped_frames: 0,
        };
        stepper.hold(surroundings);
        stepper.state = State::of(&stepper.cloth, start, &stepper.now.v, &mut stepper.parts);
        Ok(stepper)
    }

    /// The cloth.
    pub fn cloth(&self) -> &Cloth {
        &self.cloth
    }

    /// `[node]` m
    pub fn positions(&self) -> &[DVec3] {
        &self.now.x
    }

    /// `[node]` m/s
    pub fn velocities(&self) -> &[DVec3] {
        &self.now.v
    }

    /// Velocities, to be set: a thrown cloth.
    pub fn velocities_mut(&mut self) -> &mut [DVec3] {
        &mut self.now.v
    }

    /// Entries of the factored matrix, which a solve reads twice: 8 bytes each.
    pub fn factor_entries(&self) -> usize {
        self.implicit.entries()
    }

    /// Seconds since the start.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Of all frames so far: how often one was cut, and how many were given up and damped.
    pub fn faults(&self) -> (u64, u64) {
        (self.cuts, self.damped_frames)
    }

    /// Goes on by `dt` seconds.
    pub fn frame(&mut self, dt: f64, surroundings: &mut dyn Surroundings) -> FrameReport {
        self.hold(surroundings);
        let began = self.time;
        self.good.set(&self.now);
        let before = State::of(&self.cloth, &self.good.x, &self.good.v, &mut self.parts);
        let mut report = FrameReport { substeps: self.options.substeps, ..FrameReport::default() };
        loop {
            if self.attempt(began, dt, report.substeps, &before, surroundings) {
                break;
            }
            self.now.set(&self.good);
            if report.cut == self.options.retries {
                // The last good state, at rest: whatever drove it has to begin anew.
                report.damped = true;
                self.damped_frames += 1;
                self.now.v.fill(DVec3::ZERO);
                self.state = State::of(&self.cloth, &self.now.x, &self.now.v, &mut self.parts);
                break;
            }
            report.cut += 1;
            report.substeps *= 2;
            self.cuts += 1;
        }
        self.time = began + dt;
        FrameReport {
            time: self.time,
            kinetic: self.state.kinetic,
            elastic: self.state.elastic,
            extent: self.state.extent,
            ..report
        }
    }

    /// Whether so many substeps led to a good state.
    fn attempt(
        &mut self,
        began: f64,
        dt: f64,
        substeps: usize,
        before: &State,
        surroundings: &mut dyn Surroundings,
    ) -> bool {
        let h = dt / substeps as f64;
        let mut work = 0.0;
        for k in 0..substeps {
            match self.substep(began, dt, (k, substeps), surroundings) {
                Some(more) => work += more,
                None => return false,
            }
        }
        self.state = State::of(&self.cloth, &self.now.x, &self.now.v, &mut self.parts);
        let options = &self.options;
        // Collisions and held nodes may add what moves all of the cloth at 3 m/s, and a strain of a fifth.
        let mass: f64 = self.cloth.masses.iter().sum();
        let stretched: f64 =
            self.cloth.springs.iter().map(|s| 0.5 * s.stiffness * (0.2 * s.length).powi(2)).sum();
        let slack = Slack {
            growth: 4.0,
            floor: 4.5 * mass + stretched,
            reach: 2.0 * options.speed_limit * h * substeps as f64,
        };
        self.state.may_follow(before, work, slack)
    }

    /// One substep; the work that accelerations and held nodes did, J, or nothing if a node is nowhere or too fast.
    fn substep(
        &mut self,
        began: f64,
        dt: f64,
        (k, substeps): (usize, usize),
        surroundings: &mut dyn Surroundings,
    ) -> Option<f64> {
        let h = dt / substeps as f64;
        let [start, end] = [k, k + 1].map(|k| began + dt * (k as f64 / substeps as f64));
        let Motion { x, v } = &mut self.now;
        self.previous.copy_from_slice(x);
        // Iterations begin where the last velocities lead, without what accelerates now: so cloth at rest under a load is where
        // its forces balance, and stays there, however few iterations.
        let inverse_mass = &self.inverse_mass;
        x.par_iter_mut().zip(&*v).zip(inverse_mass).with_min_len(2048).for_each(|((x, v), w)| {
            if *w > 0.0 {
                *x += *v * h;
            }
        });
        let kinetic = super::watch::kinetic(&self.cloth, v);
        surroundings.accelerate(start, h, &self.previous, v);
        let mut work = (super::watch::kinetic(&self.cloth, v) - kinetic).max(0.0);
        surroundings.place(end, x);
        self.goal.par_iter_mut().zip(&self.previous).zip(&*v).with_min_len(2048).for_each(
            |((goal, x), v)| {
                *goal = *x + *v * h;
            },
        );
        self.held_at.clear();
        for node in &self.held {
            let n = *node as usize;
            let speed = x[n].distance(self.previous[n]) / h;
            work += self.cloth.masses[n] * speed * speed;
            self.held_at.push(x[n]);
        }
        let gamma = self.options.elastic_damping / h;
        self.implicit.prepare(&self.cloth, h, gamma, &self.held, inverse_mass);
        let ends = (&self.previous[..], &self.goal[..]);
        let bears = h <= LONGEST_BORNE;
        let mut touched = if bears { surroundings.confine(end, h, &self.previous, x) } else { 0 };
        for _ in 0..self.options.iterations {
            self.implicit.residual(&self.cloth, (h, gamma), inverse_mass, ends, x);
            if bears {
                let (stiffness, forces) = self.implicit.contact();
                let step = Support { time: end, dt: h, previous: &self.previous, positions: x, stiffness };
                touched += surroundings.support(&step, forces);
            }
            self.implicit.solve(x);
        }
        if touched > 0 {
            self.implicit.let_go(x);
            surroundings.confine(end, h, &self.previous, x);
            for _ in 0..self.options.sweeps {
                self.implicit.residual(&self.cloth, (h, gamma), inverse_mass, ends, x);
                self.implicit.smooth(x);
                surroundings.confine(end, h, &self.previous, x);
            }
        }
        surroundings.collide(end, h, &self.previous, x);
        for (node, place) in self.held.iter().zip(&self.held_at) {
            x[*node as usize] = *place;
        }
        let fade = f64::exp(-self.options.damping * h);
        let limit = self.options.speed_limit;
        let fine =
            v.par_iter_mut().zip(&*x).zip(&self.previous).with_min_len(2048).map(|((v, x), before)| {
                let velocity = (*x - *before) / h;
                *v = velocity * fade;
                // Not finite compares as false.
                velocity.length_squared() <= limit * limit
            });
        fine.reduce(|| true, |a, b| a & b).then_some(work)
    }

    fn hold(&mut self, surroundings: &dyn Surroundings) {
        for (w, m) in self.inverse_mass.iter_mut().zip(&self.cloth.masses) {
            *w = if *m > 0.0 { 1.0 / m } else { 0.0 };
        }
        self.held.clear();
        for node in surroundings.held() {
            if let Some(w) = self.inverse_mass.get_mut(*node as usize) {
                *w = 0.0;
                self.held.push(*node);
            }
        }
        // In order and each once: the factor belongs to a set.
        self.held.sort_unstable();
        self.held.dedup();
    }
}

fn check(cloth: &Cloth, start: &[DVec3], options: &StepOptions) -> Result<()> {
    if start.len() != cloth.node_count() {
        return Err(crate::Error::invalid(format_args!(
            "{} positions, expected {}, one for each node",
            start.len(),
            cloth.node_count()
        )));
    }
    assemble::check_finite(start)?;
    let rates = [options.damping, options.elastic_damping];
    let fine = (1..=100_000).contains(&options.substeps)
        && (1..=1000).contains(&options.iterations)
        && options.sweeps <= 1000
        && rates.iter().all(|r| r.is_finite() && *r >= 0.0)
        && options.speed_limit > 0.0
        && options.retries <= 10;
    if fine {
        Ok(())
    } else {
        Err(crate::Error::invalid(format_args!(
            "{options:?}: expected 1 to 100000 substeps, 1 to 1000 iterations, up to 1000 sweeps, damping of 0 or more, a positive speed limit, up to 10 retries"
        )))
    }
}
