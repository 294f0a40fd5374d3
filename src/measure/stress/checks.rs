//! What must hold, each as a function of what was recorded of a face: the words of what is wrong, or nothing.

use crate::knot::{FaceResult, KnotState, Status};
use crate::math::{Scalar, V3};

/// What a run promises of faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Check {
    /// Nothing panics.
    Panic,
    /// Points, knots and energies are finite.
    Finite,
    /// A face with a corner that is not finite falls back.
    Named,
    /// No other face changes by a bit when such a face is drawn together to one point instead.
    Spared,
    /// A face falls back only for want of area, or for a size out of the precision's range (safeguarded).
    Founded,
    /// E at the end is not above E at the start (safeguarded).
    Descent,
    /// Half-lengths are r / 2 or more (safeguarded).
    HalfLength,
    /// Directions of knots are unit vectors.
    Direction,
    /// The energy reported is that of the end state, f64 (safeguarded).
    Energy,
    /// The same bytes at 1 and at N threads.
    Threads,
    /// Interpolated points, f32 against f64: see [`super::precision`].
    Interpolated,
    /// The f32 energies, f32 against f64: see [`super::precision`].
    SingleEnergy,
    /// All points of mild faces, f32 against f64: see [`super::precision`].
    Mild,
}

impl Check {
    /// All of them.
    pub const ALL: [Check; 13] = [
        Check::Panic,
        Check::Finite,
        Check::Named,
        Check::Spared,
        Check::Founded,
        Check::Descent,
        Check::HalfLength,
        Check::Direction,
        Check::Energy,
        Check::Threads,
        Check::Interpolated,
        Check::SingleEnergy,
        Check::Mild,
    ];

    /// As printed.
    pub fn name(self) -> &'static str {
        match self {
            Check::Panic => "no panic",
            Check::Finite => "finite output",
            Check::Named => "corners that are not finite: falls back",
            Check::Spared => "... and no other face changes",
            Check::Founded => "no face falls back without cause",
            Check::Descent => "E not above its start",
            Check::HalfLength => "l at r / 2 or more",
            Check::Direction => "directions of length 1",
            Check::Energy => "E is that of the end state",
            Check::Threads => "same bytes at 1 and N threads",
            Check::Interpolated => "f32: interpolated points",
            Check::SingleEnergy => "f32: energies",
            Check::Mild => "f32: points of mild faces, 1 in 1000 free",
        }
    }
}

/// What a frame gave for one face.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a, T> {
    /// Energies and status.
    pub result: FaceResult<T>,
    /// Its knots' end states.
    pub knots: &'a [KnotState<T>],
    /// Its points, template units around the origin.
    pub points: &'a [V3<T>],
}

impl<T: Scalar> Record<'_, T> {
    /// Whether a solve ended in it.
    pub fn solved(&self) -> bool {
        use Status::{AtRest, Converged, Stepped, Stuck};
        !self.knots.is_empty() && matches!(self.result.status, Stepped | Converged | AtRest | Stuck)
    }

    fn energies(&self) -> [f64; 2] {
        [self.result.energy_start.to_f64(), self.result.energy.to_f64()]
    }

    /// All numbers.
    fn numbers(&self) -> impl Iterator<Item = f64> {
        let points = self.points.iter().flat_map(|p| [p.x, p.y, p.z]);
        let knots = self.knots.iter().flat_map(|k| [k.direction.u, k.direction.v, k.half_length]);
        self.energies().into_iter().chain(points.chain(knots).map(Scalar::to_f64))
    }
}

/// [`Check::Finite`].
pub fn finite<T: Scalar>(record: &Record<T>) -> Option<String> {
    let bad = record.numbers().find(|x| !x.is_finite())?;
    Some(format!("{bad} in the output"))
}

/// [`Check::Named`], of a face with a corner that is not finite.
pub fn named<T: Scalar>(record: &Record<T>) -> Option<String> {
    let status = record.result.status;
    // A stitch without yarn has nothing to spoil.
    let fine = status == Status::FellBack || record.points.is_empty();
    (!fine).then(|| format!("status {status:?}"))
}

/// [`Check::Descent`].
pub fn descent<T: Scalar>(record: &Record<T>) -> Option<String> {
    let [start, end] = record.energies();
    // False for NaN.
    let fine = end <= start;
    (!fine).then(|| format!("E {start:e} at the start, {end:e} at the end"))
}

/// [`Check::HalfLength`], r the yarn radius.
pub fn half_length<T: Scalar>(record: &Record<T>, r: f64) -> Option<String> {
    let least = (T::of(r) * T::of(0.5)).to_f64();
    let lengths = record.knots.iter().map(|k| k.half_length.to_f64());
    // Not `<`: NaN is no length either.
    let short = lengths.enumerate().find(|(_, l)| !matches!(l.partial_cmp(&least), Some(o) if o.is_ge()))?;
    Some(format!("knot {} has l {:e}, r / 2 is {least:e}", short.0, short.1))
}

/// A direction is turned by a product of two numbers a step: each adds some units in the last place.
const DIRECTION_UNITS: f64 = 100.0;

/// [`Check::Direction`].
pub fn direction<T: Scalar>(record: &Record<T>, steps: u32) -> Option<String> {
    let allowed = DIRECTION_UNITS * unit::<T>() * f64::from(1 + steps);
    let lengths = record.knots.iter().map(|k| k.direction.u.to_f64().hypot(k.direction.v.to_f64()));
    let (knot, length) = lengths.enumerate().find(|(_, l)| (l - 1.0).abs() > allowed || l.is_nan())?;
    Some(format!("the direction of knot {knot} has length 1 {:+e}", length - 1.0))
}

/// [`Check::Founded`], of a finite face: `slant` is |D|^2 / |D e_u x D e_v| of its frame, `size` the greatest
/// distance of a corner from the first.
pub fn founded<T: Scalar>(record: &Record<T>, slant: f64, size: f64) -> Option<String> {
    // A face has no frame at a slant of 1e6 and more; squares of areas must be within the precision's range.
    let range = if is_single::<T>() { 1e-8..1e8 } else { 1e-60..1e60 };
    let unfounded = record.result.status == Status::FellBack && slant < 1e5 && range.contains(&size);
    unfounded.then(|| format!("falls back at slant {slant:.1e} and size {size:.1e}"))
}

/// [`Check::Energy`]: the end state's energy, worked out anew.
pub fn energy(record: &Record<f64>, anew: f64) -> Option<String> {
    let given = record.result.energy;
    // The same operations in the same order but for sums, which a matrix goes along with.
    let fine = (given - anew).abs() <= 1e-12 * given.abs().max(f64::MIN_POSITIVE);
    (!fine).then(|| format!("E {given:e} given, {anew:e} worked out"))
}

/// [`Check::Threads`] and [`Check::Spared`]: to the bit.
pub fn same<T: Scalar>(a: &Record<T>, b: &Record<T>) -> Option<String> {
    let bits = |r: &Record<T>| r.numbers().map(f64::to_bits).collect::<Vec<_>>();
    let fine = a.result.status == b.result.status && bits(a) == bits(b);
    (!fine).then(|| format!("ended {:?} and {:?}, with other bits", a.result.status, b.result.status))
}

/// One unit in the last place of 1.
pub fn unit<T: Scalar>() -> f64 {
    if is_single::<T>() { f64::from(f32::EPSILON) } else { f64::EPSILON }
}

fn is_single<T>() -> bool {
    size_of::<T>() == 4
}
