//! The terms of a stencil's energy, sorted by what they depend on.
//!
//! A contact and a control of one knot lie l and r from its centre at right angles, so a segment between them has the
//! length sqrt(l^2 + r^2 + dz^2), whatever the knot's direction. Such lengths, and the cosines of two of them, depend
//! on l alone, and the ones that are equal are counted instead of repeated: 12 of a plain knit's 27 residuals become
//! two a knot.

use super::stencil::{Role, StencilPoint};
use crate::math::Scalar;

/// Marks a segment that is no [`OwnLength`].
pub const NOT_OWN: u32 = u32::MAX;

/// A residual over consecutive points: a segment's length, or the cosine of two segments.
#[derive(Clone, Copy, Debug)]
pub struct Term<T> {
    /// The first of the points.
    pub point: u32,
    /// The first of the segments.
    pub segment: u32,
    /// The value at rest: a length (template units) or a cosine.
    pub rest: T,
    /// Distinct knots that it depends on, `knot_count` of them.
    pub knots: [u32; 3],
    /// How many.
    pub knot_count: u32,
    /// `[point]` 0 for an interpolated point, else 1 + 2 x (place in `knots`), and 1 more for a control.
    pub codes: [u32; 3],
}

impl<T> Term<T> {
    /// All codes in one number, octal digits; the first point's is the last digit.
    pub fn pattern(&self) -> u32 {
        self.codes[0] + 8 * self.codes[1] + 64 * self.codes[2]
    }
}

/// The length sqrt(l^2 + square) of segments within a knot.
#[derive(Clone, Copy, Debug)]
pub struct OwnLength<T> {
    /// The knot.
    pub knot: u32,
    /// r^2 + dz^2.
    pub square: T,
    /// The length at rest.
    pub rest: T,
    /// How many segments are so.
    pub count: T,
}

/// The cosine (sign l^2 + offset) / (l^2 + square) of two segments within a knot.
#[derive(Clone, Copy, Debug)]
pub struct OwnCosine<T> {
    /// Index of the [`OwnLength`] of both segments.
    pub length: u32,
    /// +1 from one contact to the other, -1 from a contact back to itself.
    pub sign: T,
    /// dz dz' - r^2.
    pub offset: T,
    /// The cosine at rest.
    pub rest: T,
    /// How many pairs are so.
    pub count: T,
}

/// The residuals of a stencil, and which are worked out how.
#[derive(Clone, Debug, Default)]
pub struct Terms<T> {
    /// `[segment]` all lengths.
    pub lengths: Vec<Term<T>>,
    /// All cosines.
    pub cosines: Vec<Term<T>>,
    /// `[segment]` dz.
    pub rises: Vec<T>,
    /// `[segment]` index of its [`OwnLength`], or [`NOT_OWN`].
    pub own: Vec<u32>,
    /// Lengths within knots.
    pub own_lengths: Vec<OwnLength<T>>,
    /// Cosines within knots.
    pub own_cosines: Vec<OwnCosine<T>>,
    /// Lengths (indices) that depend on no knot, and those that depend on some and are not within one.
    pub fixed_lengths: Vec<u32>,
    /// The same of cosines.
    pub fixed_cosines: Vec<u32>,
    /// The other lengths.
    pub cross_lengths: Vec<u32>,
    /// The other cosines.
    pub cross_cosines: Vec<u32>,
}

impl Terms<f64> {
    /// Adds a strand: `first` is its first point, `rest` its points' places at rest with z.
    pub(super) fn add_strand(
        &mut self,
        points: &[StencilPoint<f64>],
        first: usize,
        rest: &[glam::DVec3],
        half_lengths: &[f64],
        radius: f64,
    ) {
        let first_segment = self.lengths.len();
        let segments: Vec<_> = rest.windows(2).map(|p| p[1] - p[0]).collect();
        for (i, segment) in segments.iter().enumerate() {
            let mut term = term(points, first + i, 2, first_segment + i, segment.length());
            let ends = &points[first + i..first + i + 2];
            let rise = ends[1].z - ends[0].z;
            self.rises.push(rise);
            let index = self.lengths.len() as u32;
            let within = term.knot_count == 1
                && matches!(
                    [ends[0].role, ends[1].role],
                    [Role::Contact, Role::Control] | [Role::Control, Role::Contact]
                );
            if within {
                let square = radius * radius + rise * rise;
                term.rest = (half_lengths[ends[0].knot as usize].powi(2) + square).sqrt();
                let own = self.count_length(ends[0].knot, square, term.rest);
                self.own.push(own);
            } else {
                self.own.push(NOT_OWN);
                let list =
                    if term.knot_count == 0 { &mut self.fixed_lengths } else { &mut self.cross_lengths };
                list.push(index);
            }
            self.lengths.push(term);
        }
        for (i, pair) in segments.windows(2).enumerate() {
            let lengths = pair[0].length() * pair[1].length();
            let cosine = if lengths > 0.0 { pair[0].dot(pair[1]) / lengths } else { 0.0 };
            let mut term = term(points, first + i, 3, first_segment + i, cosine);
            let index = self.cosines.len() as u32;
            let at = first_segment + i;
            let (own, next) = (self.own[at], self.own[at + 1]);
            let ends = [&points[first + i], &points[first + i + 2]];
            if own != NOT_OWN && own == next && ends[0].role == Role::Contact {
                let length = self.own_lengths[own as usize];
                let sign = -ends[0].sign * ends[1].sign;
                let offset = self.rises[at] * self.rises[at + 1] - radius * radius;
                let l = half_lengths[length.knot as usize];
                term.rest = (sign * l * l + offset) / (l * l + length.square);
                self.count_cosine(own, sign, offset, term.rest);
            } else {
                let list =
                    if term.knot_count == 0 { &mut self.fixed_cosines } else { &mut self.cross_cosines };
                list.push(index);
            }
            self.cosines.push(term);
        }
    }

    fn count_length(&mut self, knot: u32, square: f64, rest: f64) -> u32 {
        let known = self.own_lengths.iter().position(|o| o.knot == knot && o.square == square);
        let at = known.unwrap_or_else(|| {
            self.own_lengths.push(OwnLength { knot, square, rest, count: 0.0 });
            self.own_lengths.len() - 1
        });
        self.own_lengths[at].count += 1.0;
        at as u32
    }

    fn count_cosine(&mut self, length: u32, sign: f64, offset: f64, rest: f64) {
        let same = |o: &&mut OwnCosine<f64>| o.length == length && o.sign == sign && o.offset == offset;
        match self.own_cosines.iter_mut().find(same) {
            Some(own) => own.count += 1.0,
            None => self.own_cosines.push(OwnCosine { length, sign, offset, rest, count: 1.0 }),
        }
    }

    /// The same terms in another precision.
    pub fn cast<T: Scalar>(&self) -> Terms<T> {
        let term = |t: &Term<f64>| Term {
            point: t.point,
            segment: t.segment,
            rest: T::of(t.rest),
            knots: t.knots,
            knot_count: t.knot_count,
            codes: t.codes,
        };
        let own_length = |o: &OwnLength<f64>| OwnLength {
            knot: o.knot,
            square: T::of(o.square),
            rest: T::of(o.rest),
            count: T::of(o.count),
        };
        let own_cosine = |o: &OwnCosine<f64>| OwnCosine {
            length: o.length,
            sign: T::of(o.sign),
            offset: T::of(o.offset),
            rest: T::of(o.rest),
            count: T::of(o.count),
        };
        Terms {
            lengths: self.lengths.iter().map(term).collect(),
            cosines: self.cosines.iter().map(term).collect(),
            rises: self.rises.iter().map(|z| T::of(*z)).collect(),
            own: self.own.clone(),
            own_lengths: self.own_lengths.iter().map(own_length).collect(),
            own_cosines: self.own_cosines.iter().map(own_cosine).collect(),
            fixed_lengths: self.fixed_lengths.clone(),
            fixed_cosines: self.fixed_cosines.clone(),
            cross_lengths: self.cross_lengths.clone(),
            cross_cosines: self.cross_cosines.clone(),
        }
    }
}

fn term(points: &[StencilPoint<f64>], point: usize, count: usize, segment: usize, rest: f64) -> Term<f64> {
    let (mut knots, mut knot_count, mut codes) = ([0; 3], 0, [0; 3]);
    for (i, p) in points[point..point + count].iter().enumerate() {
        let control = match p.role {
            Role::Contact => 0,
            Role::Control => 1,
            Role::Boundary | Role::Free => continue,
        };
        let known = knots[..knot_count].iter().position(|k| *k == p.knot);
        let slot = known.unwrap_or(knot_count);
        codes[i] = 1 + 2 * slot as u32 + control;
        if known.is_none() {
            knots[knot_count] = p.knot;
            knot_count += 1;
        }
    }
    Term { point: point as u32, segment: segment as u32, rest, knots, knot_count: knot_count as u32, codes }
}
