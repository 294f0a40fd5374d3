//! Quasi-static relaxation: the shape of least energy that is downhill from a start.
//!
//! First the start is scaled to the best size, which has a closed form. What is not flat then goes downhill by L-BFGS
//! (`descend`), which passes buckles everywhere at once, until forces are within ten times their bound. Newton's method in
//! a region of trust (Steihaug 1983) does the rest: steps are as long as the quadratic model has proved right, and go that far along
//! directions in which the energy curves down. Should it take long, the two take turns. A step that does not lower the energy
//! is not taken, however rough the start. All of it turns with the start: a turned start gives the turned result but for rounding. What nothing
//! holds lies at the end as it lay at the start.

use super::align::align;
use super::descend::Descent;
use super::inflate::Inflation;
use super::linear::{System, dot};
use super::{Cloth, assemble};
use crate::{Error, Result};
use glam::DVec3;

/// How to relax.
#[derive(Clone, Debug, PartialEq)]
pub struct RelaxOptions {
    /// The largest force on a node, relative to [`Cloth::force_unit`], at which it ends.
    pub residual: f64,
    /// Steps at most, of both kinds.
    pub iterations: usize,
    /// Rounds of conjugate gradients at most, of all steps together.
    pub rounds: usize,
    /// Nodes that stay where they are.
    pub held: Vec<u32>,
    /// Acceleration of every node, m/s2: gravity.
    pub acceleration: DVec3,
    /// How many times as stiff against bending cloth is at first, where it is not flat: what is rough is smooth then before anything
    /// buckles, and cloth folds over and passes through itself less. 1: as it is from the start.
    pub stiffer: f64,
    /// Pressure from within what encloses room, as a form in it would give: that which widens a round tube of as much room and area by this
    /// share. Not where nodes are held.
    pub inflation: f64,
    /// Whether to scale the start about its centre to the size of least energy. Not done where nodes are held.
    pub rescale: bool,
    /// Whether a start that lies in a plane is kept in it. Else rounding decides where compressed fabric buckles.
    pub keep_flat: bool,
}

impl Default for RelaxOptions {
    fn default() -> Self {
        Self {
            residual: 1e-4,
            iterations: 6000,
            rounds: 20_000,
            held: Vec::new(),
            acceleration: DVec3::ZERO,
            stiffer: 1.0,
            inflation: 0.0,
            rescale: true,
            keep_flat: true,
        }
    }
}

impl RelaxOptions {
    /// For garments that nobody wears: smooth before they buckle, and on a form that keeps them open.
    pub fn garment() -> Self {
        Self { stiffer: 30.0, inflation: 0.03, ..Self::default() }
    }
}

/// How it went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RelaxReport {
    /// Steps of both kinds.
    pub iterations: usize,
    /// Of these, steps without second derivatives.
    pub descents: usize,
    /// Rounds of conjugate gradients, together.
    pub rounds: usize,
    /// The largest force on a node at the end, relative to [`Cloth::force_unit`].
    pub residual: f64,
    /// Whether that is within the bound.
    pub converged: bool,
    /// Energy of the start as given, J (with the load's).
    pub energy_start: f64,
    /// Energy at the end, J.
    pub energy_end: f64,
    /// By what the start was scaled.
    pub scale: f64,
    /// Whether it was kept in its plane.
    pub flat: bool,
    /// Faces that fold upon themselves or their neighbours at the end ([`Cloth::folded_faces`]).
    pub folded: usize,
}

/// Relaxes node positions, m, in place.
///
/// # Errors
/// Another number of positions than nodes, positions that are not finite, held nodes that there are not, options out of range.
pub fn relax(cloth: &Cloth, nodes: &mut [DVec3], options: &RelaxOptions) -> Result<RelaxReport> {
    check(cloth, nodes, options)?;
    let start = nodes.to_vec();
    let mut report = RelaxReport { scale: 1.0, ..RelaxReport::default() };
    let free = options.held.is_empty() && options.acceleration == DVec3::ZERO;
    let mut problem = Problem::new(cloth, options);
    report.energy_start = problem.energy(nodes);
    if free {
        if options.rescale {
            report.scale = rescale(cloth, nodes);
        }
        problem.plane = if options.keep_flat { plane(cloth, nodes) } else { None };
        report.flat = problem.plane.is_some();
        problem.inflate(nodes, options.inflation);
    }
    if options.stiffer > 1.0 && !report.flat {
        let stiff = cloth.stiffer(options.stiffer);
        let first = RelaxOptions {
            residual: options.residual.max(SMOOTH),
            iterations: options.iterations / 2,
            rounds: options.rounds / 2,
            ..options.clone()
        };
        let mut problem = Problem::new(&stiff, &first);
        if free {
            problem.inflate(nodes, options.inflation);
        }
        problem.run(nodes, &first, &mut report);
    }
    problem.run(nodes, options, &mut report);
    if free && !report.flat {
        align(nodes, &start, &cloth.masses);
    }
    report.folded = cloth.folded_faces(nodes).len();
    Ok(report)
}

fn check(cloth: &Cloth, nodes: &[DVec3], options: &RelaxOptions) -> Result<()> {
    if nodes.len() != cloth.node_count() {
        return Err(Error::invalid(format_args!(
            "{} positions, expected {}, one for each node",
            nodes.len(),
            cloth.node_count()
        )));
    }
    assemble::check_finite(nodes)?;
    if let Some(node) = options.held.iter().find(|n| **n as usize >= nodes.len()) {
        return Err(Error::invalid(format_args!("held node {node}, expected numbers below {}", nodes.len())));
    }
    let RelaxOptions { residual, acceleration, stiffer, inflation, .. } = options;
    let fine = (1.0..=1e6).contains(stiffer) && (0.0..=0.5).contains(inflation);
    if !(*residual > 0.0 && acceleration.is_finite() && fine) {
        return Err(Error::invalid(format_args!(
            "a residual of {residual}, an acceleration of {acceleration}, bending {stiffer} times as stiff, inflation by {inflation}, \
             expected a positive number, finite ones, 1 to 1e6, 0 to 0.5"
        )));
    }
    Ok(())
}

/// Scales about the centre to the size of least energy and returns the factor: stretched springs `k (s l - L)^2 / 2` and
/// curvatures `k (s c)^2 / 2` are least at `s = sum k l L / sum (k l^2 + k c^2)`.
fn rescale(cloth: &Cloth, x: &mut [DVec3]) -> f64 {
    let (mut along, mut square) = (0.0, 0.0);
    for s in &cloth.springs {
        let l = x[s.nodes[0] as usize].distance(x[s.nodes[1] as usize]);
        along += s.stiffness * l * s.length;
        square += s.stiffness * l * l;
    }
    square += cloth.bends.iter().map(|b| b.stiffness * b.curvature(x).length_squared()).sum::<f64>();
    let scale = along / square;
    if !(scale.is_finite() && scale > 0.0) {
        return 1.0;
    }
    let middle = x.iter().sum::<DVec3>() / x.len() as f64;
    x.iter_mut().for_each(|p| *p = middle + (*p - middle) * scale);
    scale
}

/// The normal of the plane that all nodes lie in, if they do, to a millionth of the extent.
fn plane(cloth: &Cloth, x: &[DVec3]) -> Option<DVec3> {
    let middle = x.iter().sum::<DVec3>() / x.len() as f64;
    let cross = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|n| x[n as usize]);
        (b - a).cross(c - a)
    };
    // Faces of fabric folded flat face both ways.
    let first =
        cloth.triangles.iter().map(cross).reduce(|a, b| if b.length() > a.length() { b } else { a })?;
    let sum: DVec3 = cloth.triangles.iter().map(cross).map(|n| if n.dot(first) < 0.0 { -n } else { n }).sum();
    let normal = sum.try_normalize()?;
    let extent = x.iter().map(|p| (*p - middle).length()).fold(0.0, f64::max);
    let off = x.iter().map(|p| (*p - middle).dot(normal).abs()).fold(0.0, f64::max);
    (off <= 1e-6 * extent).then_some(normal)
}

/// Residual that is near enough of cloth that is stiffer than it will be.
pub const SMOOTH: f64 = 1e-3;

/// Newton's steps of a turn.
const NEWTON: usize = 100;

/// Lengths of a step that are tried.
const TRIES: usize = 30;

/// How a turn ended.
enum End {
    /// Where it was to.
    There,
    /// Within the bound on forces, or with no steps left.
    Spent,
    /// With no step that lowers the energy.
    Stuck,
}

struct Problem<'a> {
    cloth: &'a Cloth,
    /// `[node]` force of the load, N; empty without.
    load: Vec<DVec3>,
    held: Vec<u32>,
    plane: Option<DVec3>,
    inflation: Option<Inflation<'a>>,
    parts: Vec<f64>,
}

impl<'a> Problem<'a> {
    fn new(cloth: &'a Cloth, options: &RelaxOptions) -> Self {
        let load = if options.acceleration == DVec3::ZERO {
            Vec::new()
        } else {
            cloth.masses.iter().map(|m| options.acceleration * *m).collect()
        };
        let parts = vec![0.0; cloth.part_count()];
        Self { cloth, load, held: options.held.clone(), plane: None, inflation: None, parts }
    }

    /// Sets it under pressure, if it encloses room.
    fn inflate(&mut self, x: &[DVec3], strain: f64) {
        if strain > 0.0 && self.plane.is_none() {
            self.inflation = Inflation::new(self.cloth, x, strain);
        }
    }

    fn energy(&mut self, x: &[DVec3]) -> f64 {
        let pressure = self.inflation.as_ref().map_or(0.0, |i| i.energy(x));
        self.cloth.energy_in(x, &mut self.parts) - dot(&self.load, x) + pressure
    }

    fn forces(&self, x: &[DVec3], out: &mut [DVec3]) {
        self.cloth.forces(x, out);
        out.iter_mut().zip(&self.load).for_each(|(f, load)| *f += *load);
        if let Some(inflation) = &self.inflation {
            inflation.add_forces(x, out);
        }
        self.keep(out);
    }

    /// Leaves of a vector what may move.
    fn keep(&self, v: &mut [DVec3]) {
        self.held.iter().for_each(|n| v[*n as usize] = DVec3::ZERO);
        if let Some(normal) = self.plane {
            v.iter_mut().for_each(|v| *v -= normal * normal.dot(*v));
        }
    }

    fn run(&mut self, x: &mut [DVec3], options: &RelaxOptions, report: &mut RelaxReport) {
        report.energy_end = self.energy(x);
        let mut descent = None;
        // What stays flat does not buckle out of its plane: Newton alone is there in a few steps.
        let mut newton_first = report.flat;
        let mut bound = 10.0 * options.residual;
        loop {
            let mut stuck = true;
            if !newton_first {
                if descent.is_none() {
                    descent = Some(Descent::new(self.cloth, &options.held));
                }
                if let Some(Some(descent)) = &mut descent {
                    match self.descend(x, descent, bound, options, report) {
                        End::Spent => return,
                        End::Stuck => {}
                        End::There => stuck = false,
                    }
                    // Should Newton's method not end it from there, the next turn goes all the way.
                    bound = options.residual;
                }
            }
            newton_first = false;
            let turns = !matches!(descent, Some(None));
            let most = if turns { NEWTON } else { usize::MAX };
            match self.newton(x, most, options, report) {
                End::Spent => return,
                End::Stuck if stuck => return,
                End::There | End::Stuck => {}
            }
        }
    }

    /// Sets the report's residual, and whether to go on.
    fn judge(&self, forces: &[DVec3], options: &RelaxOptions, report: &mut RelaxReport) -> bool {
        let greatest = forces.iter().map(|f| f.length()).fold(0.0, f64::max);
        report.residual = greatest / self.cloth.force_unit;
        report.converged = report.residual <= options.residual;
        let spent = report.iterations >= options.iterations || report.rounds >= options.rounds;
        !(report.converged || spent || !report.energy_end.is_finite())
    }

    /// Downhill until no force passes `bound`.
    fn descend(
        &mut self,
        x: &mut [DVec3],
        descent: &mut Descent,
        bound: f64,
        options: &RelaxOptions,
        report: &mut RelaxReport,
    ) -> End {
        let [mut forces, mut after, mut step, mut trial] = [(); 4].map(|()| vec![DVec3::ZERO; x.len()]);
        descent.forget();
        self.forces(x, &mut forces);
        loop {
            if !self.judge(&forces, options, report) {
                return End::Spent;
            }
            if report.residual <= bound {
                return End::There;
            }
            report.iterations += 1;
            report.descents += 1;
            let energy = report.energy_end;
            descent.step(&forces, &mut step, |v| self.keep(v));
            let slope = dot(&step, &forces);
            let mut share = 1.0;
            let taken = (0..if slope > 0.0 { TRIES } else { 0 }).find_map(|_| {
                trial.iter_mut().zip(x.iter()).zip(&step).for_each(|((t, x), p)| *t = *x + *p * share);
                let there = self.energy(&trial);
                if there <= energy - 1e-4 * share * slope {
                    return Some(there);
                }
                // The least of the parabola through what is known.
                let least = slope * share * share / (2.0 * (there - energy + slope * share));
                share = if least > 0.1 * share { least.min(0.5 * share) } else { 0.1 * share };
                None
            });
            let Some(there) = taken else {
                if descent.forget() {
                    continue;
                }
                return End::Stuck;
            };
            self.forces(&trial, &mut after);
            step.iter_mut().for_each(|s| *s *= share);
            descent.learn(&step, &forces, &after);
            std::mem::swap(&mut forces, &mut after);
            x.copy_from_slice(&trial);
            report.energy_end = there;
        }
    }

    /// So many of Newton's steps.
    fn newton(
        &mut self,
        x: &mut [DVec3],
        most: usize,
        options: &RelaxOptions,
        report: &mut RelaxReport,
    ) -> End {
        let cloth = self.cloth;
        let n = x.len();
        let mut system = System::new(cloth);
        let [mut forces, mut step, mut trial] = [(); 3].map(|()| vec![DVec3::ZERO; n]);
        let mut radius = None;
        let mut moved = true;
        for step_number in 0.. {
            self.forces(x, &mut forces);
            if !self.judge(&forces, options, report) {
                return End::Spent;
            }
            if step_number == most {
                break;
            }
            let energy = report.energy_end;
            if moved {
                // Far from the end what is negative only misleads; near it, steps without it would creep.
                system.set(cloth, x, report.residual < 0.1);
            }
            // As exact as it pays: the nearer the end, the more.
            let tolerance = report.residual.sqrt().clamp(1e-3, 0.1);
            let rounds = (options.rounds - report.rounds).min(400);
            let solved =
                system.solve(cloth, &forces, &mut step, (tolerance, rounds, radius), &|v| self.keep(v));
            report.rounds += solved.rounds;
            report.iterations += 1;
            trial.iter_mut().zip(x.iter()).zip(&step).for_each(|((t, x), p)| *t = *x + *p);
            let there = self.energy(&trial);
            let ratio = (energy - there) / solved.predicted;
            // Near the end differences drown in rounding, and any step that does not rise counts.
            let blind = solved.predicted <= 1e-12 * energy.abs();
            moved = there <= energy && (ratio > 1e-4 || blind);
            let next = match ratio {
                r if moved && (r > 0.75 || blind) && solved.bounded => 2.0 * solved.radius,
                r if r < 0.25 || !moved => 0.25 * solved.radius,
                _ => solved.radius,
            };
            radius = Some(next);
            if moved {
                x.copy_from_slice(&trial);
                report.energy_end = there;
            } else if blind || next < 1e-30 || next.is_nan() {
                return End::Stuck;
            }
        }
        End::There
    }
}
