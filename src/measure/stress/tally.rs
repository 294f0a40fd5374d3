//! What a run found, counted.

use super::checks::{self, Check, Record};
use super::precision::{self, LEVELS, Shape};
use super::round::{Face, Plan, Seen};
use super::shapes::Kind;
use crate::knot::{Solver, Start, Status};
use crate::math::Scalar;
use std::fmt::Write;
use std::time::Duration;

/// A face of which something does not hold.
#[derive(Clone, Debug)]
pub struct Offence {
    /// The face.
    pub number: u64,
    /// What is wrong.
    pub words: String,
}

/// One check over a run.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Faces (and precisions) it was made on.
    pub tested: u64,
    /// Those it failed on.
    pub failed: u64,
    /// The first of them.
    pub first: Option<Offence>,
    /// The greatest share of the bound that was used, for checks with one.
    pub worst: f64,
}

/// What a run found.
#[derive(Clone, Debug)]
pub struct Report {
    /// The seed.
    pub seed: u64,
    /// Faces run.
    pub faces: u64,
    /// `[f32, f64][kind][status]` how many ended so.
    pub outcomes: [[[u64; Status::ALL.len()]; Kind::ALL.len()]; 2],
    /// `[kind][level]` faces solved in both precisions by the greatest distance of their points, see [`LEVELS`].
    pub apart: [[u64; LEVELS.len()]; Kind::ALL.len()],
    /// `[kind]` of those, by the safeguarded solver: how many there are, and how many end at one energy.
    pub one_energy: [[u64; 2]; Kind::ALL.len()],
    /// Time taken.
    pub time: Duration,
    /// A face run alone, in words.
    pub description: String,
    tallies: [Tally; Check::ALL.len()],
}

impl Report {
    /// Of nothing yet.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            faces: 0,
            outcomes: Default::default(),
            apart: Default::default(),
            one_energy: Default::default(),
            time: Duration::ZERO,
            description: String::new(),
            tallies: Default::default(),
        }
    }

    /// Whether all that was checked holds.
    pub fn holds(&self) -> bool {
        Check::ALL.into_iter().all(|check| self.tally(check).failed <= self.allowed(check))
    }

    /// How many faces a check may fail on: none, but for [`Check::Mild`].
    fn allowed(&self, check: Check) -> u64 {
        match check {
            Check::Mild => self.tally(check).tested.div_ceil(precision::MILD_FACES),
            _ => 0,
        }
    }

    /// One check's count.
    pub fn tally(&self, check: Check) -> &Tally {
        &self.tallies[check as usize]
    }

    /// Counts a check of a face.
    pub fn check(&mut self, check: Check, number: u64, found: impl FnOnce() -> Option<String>) {
        let tally = &mut self.tallies[check as usize];
        tally.tested += 1;
        if let Some(words) = found() {
            tally.failed += 1;
            tally.first.get_or_insert(Offence { number, words });
        }
    }

    /// Counts a check of a value against a bound; words say what the value is.
    fn bound(&mut self, check: Check, number: u64, value: f64, bound: f64, words: &str) {
        let share = value / bound;
        let tally = &mut self.tallies[check as usize];
        tally.worst = tally.worst.max(if share.is_nan() { f64::INFINITY } else { share });
        // False for NaN.
        let fine = value <= bound;
        self.check(check, number, || (!fine).then(|| format!("{words}: {value:.2e}, allowed {bound:.2e}")));
    }

    /// Checks and counts a face.
    pub fn add(&mut self, plan: &Plan, face: &Face) {
        self.faces += 1;
        let shape = Shape::of(face.stencil, face.corners, plan.gauge);
        self.side(0, plan, face, &face.single, &shape);
        self.side(1, plan, face, &face.double, &shape);
        self.check(Check::Panic, face.place.number(), || None);
        if let Some(shape) = shape.filter(Shape::comparable) {
            self.compare(plan, face, &shape);
        }
    }

    fn side<T: Scalar>(
        &mut self,
        side: usize,
        plan: &Plan,
        face: &Face,
        seen: &Seen<T>,
        shape: &Option<Shape>,
    ) {
        let settings = &plan.variant.settings;
        let (record, number) = (&seen.alone, face.place.number());
        let precision = ["f32", "f64"][side];
        self.outcomes[side][face.kind as usize][record.result.status as usize] += 1;
        let mut check = |check, found: &dyn Fn() -> Option<String>| {
            self.check(check, number, || found().map(|words| format!("{precision}: {words}")));
        };
        check(Check::Finite, &|| checks::finite(record));
        check(Check::Threads, &|| checks::same(record, &seen.threaded));
        match shape {
            None => check(Check::Named, &|| checks::named(record)),
            Some(shape) => {
                check(Check::Spared, &|| checks::same(record, &seen.spared));
                if settings.solver == Solver::Safeguarded {
                    check(Check::Founded, &|| checks::founded(record, shape.slant, shape.size));
                }
            }
        }
        if record.solved() {
            check(Check::Direction, &|| checks::direction(record, plan.steps(face)));
            if settings.solver == Solver::Safeguarded {
                check(Check::Descent, &|| checks::descent(record));
                check(Check::HalfLength, &|| checks::half_length(record, face.template.yarn_radius));
            }
        }
    }

    /// f32 against f64, of a finite face.
    fn compare(&mut self, plan: &Plan, face: &Face, shape: &Shape) {
        let settings = &plan.variant.settings;
        let (single, double) = (&face.single.alone, &face.double.alone);
        let number = face.place.number();
        if single.result.status == Status::FellBack || double.result.status == Status::FellBack {
            return;
        }
        let off = |i: usize| single.points[i].to_f64().distance(double.points[i].to_f64());
        let interpolated = face.heights.iter().enumerate().filter_map(|(i, z)| Some((i, (*z)?)));
        let pairs = interpolated.map(|(i, z)| (off(i), precision::interpolated(shape, z)));
        if let Some((off, bound)) = pairs.max_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1))) {
            self.bound(Check::Interpolated, number, off, bound, "template units apart");
        }
        if !(single.solved() && double.solved()) {
            return;
        }
        let apart = (0..single.points.len()).map(off).fold(0.0, f64::max) / face.template.yarn_radius;
        let level = LEVELS.iter().position(|level| apart <= *level).unwrap_or(LEVELS.len() - 1);
        self.apart[face.kind as usize][level] += 1;
        if settings.solver != Solver::Safeguarded {
            return;
        }
        self.check(Check::Energy, number, || checks::energy(double, face.energies[1]));
        let root = face.energies[0].sqrt();
        let half_length = single.knots.iter().map(|k| f64::from(k.half_length)).fold(0.0, f64::max);
        let weight = settings.weight_angle.max(settings.weight_length);
        let bound = precision::energy(shape, half_length, weight, root);
        let roots = (f64::from(single.result.energy).sqrt() - root).abs();
        self.bound(Check::SingleEnergy, number, roots, bound, "sqrt(E) off by");
        let [single_end, double_end] = face.energies;
        let one = (single_end - double_end).abs() <= precision::ONE_ENERGY * (1.0 + double_end);
        let counts = &mut self.one_energy[face.kind as usize];
        counts[0] += 1;
        counts[1] += u64::from(one);
        if face.kind == Kind::Mild && settings.start == Start::Affine {
            self.bound(Check::Mild, number, apart, precision::MILD_POINTS, "r apart");
        }
    }

    /// Puts a face into words.
    pub fn describe(&mut self, plan: &Plan, face: &Face) {
        let text = &mut self.description;
        let place = face.place;
        let _ = writeln!(
            text,
            "face {}: {}, {}; {}; gauge {:e}, frame {} of its mesh",
            place.number(),
            face.kind.name(),
            face.template.key(),
            plan.variant.name,
            plan.gauge,
            place.frame
        );
        for (c, corner) in face.corners.iter().enumerate() {
            let _ = writeln!(text, "  corner {c}: {:e} {:e} {:e}", corner.x, corner.y, corner.z);
        }
        describe_side(text, "f32", &face.single.alone);
        describe_side(text, "f64", &face.double.alone);
    }
}

fn describe_side<T: Scalar>(text: &mut String, precision: &str, record: &Record<T>) {
    let result = &record.result;
    let _ = writeln!(
        text,
        "  {precision}: {:?}, E {:e} at the start, {:e} at the end",
        result.status,
        result.energy_start.to_f64(),
        result.energy.to_f64()
    );
    for (k, knot) in record.knots.iter().enumerate() {
        let [u, v, l] = [knot.direction.u, knot.direction.v, knot.half_length].map(Scalar::to_f64);
        let _ = writeln!(text, "    knot {k}: d {u:e} {v:e}, l {l:e}");
    }
}
