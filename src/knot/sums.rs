//! What each residual adds to the normal equations and to the curvature (model section 4).

use super::energy::Segment;
use super::start::KnotState;
use crate::math::{Real, V2};
use crate::scene::{OwnCosine, OwnLength, Stencil, Term};

/// What is summed over the terms: A and C as lower triangles, row-major n x n, and b. C only where `curved`.
pub(super) struct Sums<'a, T> {
    pub a: &'a mut [T],
    pub c: &'a mut [T],
    pub b: &'a mut [T],
    pub curved: bool,
}

/// Adds the lengths within a knot; gives their energy.
#[inline(always)]
pub(super) fn add_own_length<T: Real>(
    own: &OwnLength<T::Scalar>,
    w: T,
    l: T,
    (length, inverse): (T, T),
    sums: &mut Sums<T>,
) -> T {
    let r = w * (length - T::splat(own.rest));
    let slope = l * inverse;
    let second = (T::one() - slope * slope) * inverse;
    add_own::<T>(own.knot, T::splat(own.count), w, (r, slope, second), sums)
}

/// Adds the cosines within a knot; gives their energy.
#[inline(always)]
pub(super) fn add_own_cosine<T: Real>(
    own: &OwnCosine<T::Scalar>,
    of: &OwnLength<T::Scalar>,
    w: T,
    l: T,
    inverse: T,
    sums: &mut Sums<T>,
) -> T {
    let (sign, offset, square) = (T::splat(own.sign), T::splat(own.offset), T::splat(of.square));
    let (ll, m) = (l * l, inverse * inverse);
    let r = w * ((sign * ll + offset) * m - T::splat(own.rest));
    // With c = (sign l^2 + offset) / (l^2 + square).
    let g = (sign * square - offset) * (m * m);
    let g = g + g;
    let second = g * (square - (ll + ll + ll)) * m;
    add_own::<T>(of.knot, T::splat(own.count), w, (r, g * l, second), sums)
}

#[inline(always)]
fn add_own<T: Real>(knot: u32, count: T, w: T, (r, slope, second): (T, T, T), sums: &mut Sums<T>) -> T {
    let i = 2 * knot as usize + 1;
    let at = i * sums.b.len() + i;
    let row = w * slope;
    let counted = count * row;
    sums.b[i] += counted * r;
    sums.a[at] += counted * row;
    if sums.curved {
        sums.c[at] += count * r * (w * second);
    }
    count * (r * r)
}

/// Where the stitch stands.
pub(super) struct At<'a, T: Real> {
    pub stencil: &'a Stencil<T::Scalar>,
    /// `[point]` places relative to the knot's centre.
    pub offsets: &'a [V2<T>],
    pub state: &'a [KnotState<T>],
}

impl<T: Real> Clone for At<'_, T> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}
impl<T: Real> Copy for At<'_, T> {}

/// A term whose points' codes are looked up as it runs.
const ANY: u32 = u32::MAX;
/// Patterns of codes (see [`Term::pattern`]) that stencils are full of: f an interpolated point, c a contact, p a
/// control, of a first and of a second knot. Known to the compiler, they cost no lookups.
const FC: u32 = 0o10;
const CF: u32 = 0o01;
const CC2: u32 = 0o31;
const FCP: u32 = 0o210;
const PCF: u32 = 0o012;
const PCC2: u32 = 0o312;
const CC2P2: u32 = 0o431;

/// Adds the residual r of a segment's length.
#[inline(always)]
pub(super) fn length<T: Real>(
    at: At<T>,
    w: T,
    term: &Term<T::Scalar>,
    segment: &Segment<T>,
    r: T,
    sums: &mut Sums<T>,
) {
    macro_rules! add {
        ($n:literal, $pattern:expr) => {
            add_length::<T, $n, { $pattern }>(at, w, term, segment, r, sums)
        };
    }
    match term.pattern() {
        FC => add!(2, FC),
        CF => add!(2, CF),
        CC2 => add!(4, CC2),
        _ => add!(4, ANY),
    }
}

/// Adds the residual r of the cosine of two segments.
#[inline(always)]
pub(super) fn cosine<T: Real>(
    at: At<T>,
    w: T,
    term: &Term<T::Scalar>,
    pair: [&Segment<T>; 2],
    values: (T, T),
    sums: &mut Sums<T>,
) {
    macro_rules! add {
        ($n:literal, $pattern:expr) => {
            add_cosine::<T, $n, { $pattern }>(at, w, term, pair, values, sums)
        };
    }
    match term.pattern() {
        FCP => add!(2, FCP),
        PCF => add!(2, PCF),
        PCC2 => add!(4, PCC2),
        CC2P2 => add!(4, CC2P2),
        _ => add!(6, ANY),
    }
}

/// N is at least twice the number of the term's knots.
#[inline(always)]
fn add_length<T: Real, const N: usize, const PATTERN: u32>(
    at: At<T>,
    w: T,
    term: &Term<T::Scalar>,
    segment: &Segment<T>,
    r: T,
    sums: &mut Sums<T>,
) {
    let n = sums.b.len();
    let moves = Moves::<T>::new::<PATTERN, 2>(at, term);
    let (mut de, mut along, mut row) = ([None; N], [None; N], [None; N]);
    for i in 0..N {
        de[i] = moves.segment(0, i);
        if let Some(de) = de[i] {
            let slope = segment.unit.dot(de);
            (along[i], row[i]) = (Some(slope), Some(w * slope));
        }
    }
    add_first(term, &row, r, sums);
    if sums.curved {
        let rw = r * w;
        let share = rw * segment.inverse;
        for i in 0..N {
            for j in 0..=i {
                // d2 len = (de . de - d len d len) / len; u . d2 e follows.
                if let (Some(di), Some(dj), Some(li), Some(lj)) = (de[i], de[j], along[i], along[j]) {
                    sums.c[entry(term, i, j, n)] += share * (di.dot(dj) - li * lj);
                }
            }
        }
        let g = segment.unit * rw;
        moves.add_turning(term, 0, -g, sums);
        moves.add_turning(term, 1, g, sums);
    }
}

/// N is at least twice the number of the term's knots.
#[inline(always)]
fn add_cosine<T: Real, const N: usize, const PATTERN: u32>(
    at: At<T>,
    w: T,
    term: &Term<T::Scalar>,
    [e, f]: [&Segment<T>; 2],
    (cos, r): (T, T),
    sums: &mut Sums<T>,
) {
    let n = sums.b.len();
    let (eu, fu) = (e.unit, f.unit);
    // d cos / d e and d cos / d f, in the plane, times the lengths.
    let (p, q) = (fu - eu * cos, eu - fu * cos);
    let moves = Moves::<T>::new::<PATTERN, 3>(at, term);
    let (mut de, mut df, mut row) = ([None; N], [None; N], [None; N]);
    for i in 0..N {
        de[i] = Part::new(moves.segment(0, i), e, p);
        df[i] = Part::new(moves.segment(1, i), f, q);
        row[i] = match (de[i], df[i]) {
            (Some(e), Some(f)) => Some(w * (e.turn + f.turn)),
            (Some(part), None) | (None, Some(part)) => Some(w * part.turn),
            (None, None) => None,
        };
    }
    add_first(term, &row, r, sums);
    if sums.curved {
        let share = r * w;
        for i in 0..N {
            for j in 0..=i {
                let mut second = None;
                if let (Some(e), Some(f)) = (de[i], df[j]) {
                    second = plus(second, mixed(e, f, cos));
                }
                if let (Some(e), Some(f)) = (de[j], df[i]) {
                    second = plus(second, mixed(e, f, cos));
                }
                if let (Some(a), Some(b)) = (de[i], de[j]) {
                    second = plus(second, square(a, b, cos));
                }
                if let (Some(a), Some(b)) = (df[i], df[j]) {
                    second = plus(second, square(a, b, cos));
                }
                if let Some(second) = second {
                    sums.c[entry(term, i, j, n)] += share * second;
                }
            }
        }
        let (ge, gf) = (p * (share * e.inverse), q * (share * f.inverse));
        moves.add_turning(term, 0, -ge, sums);
        moves.add_turning(term, 1, ge - gf, sums);
        moves.add_turning(term, 2, gf, sums);
    }
}

/// How one segment of a cosine moves with an unknown, measured by its length.
#[derive(Clone, Copy)]
struct Part<T> {
    /// The movement.
    by: V2<T>,
    /// What it does to the cosine.
    turn: T,
    /// What it does to the length.
    along: T,
}

impl<T: Real> Part<T> {
    #[inline(always)]
    fn new(by: Option<V2<T>>, segment: &Segment<T>, slope: V2<T>) -> Option<Self> {
        match by {
            Some(by) => {
                let by = by * segment.inverse;
                Some(Self { by, turn: slope.dot(by), along: segment.unit.dot(by) })
            }
            None => None,
        }
    }
}

/// With u, v the segments' directions: du . dv.
#[inline(always)]
fn mixed<T: Real>(e: Part<T>, f: Part<T>, cos: T) -> T {
    e.by.dot(f.by) - (e.turn + cos * e.along) * f.along - e.along * f.turn
}

/// What the second derivatives of a segment's direction add.
#[inline(always)]
fn square<T: Real>(a: Part<T>, b: Part<T>, cos: T) -> T {
    cos * (a.along * b.along - a.by.dot(b.by)) - a.along * b.turn - a.turn * b.along
}

#[inline(always)]
fn plus<T: Real>(a: Option<T>, b: T) -> Option<T> {
    match a {
        Some(a) => Some(a + b),
        None => Some(b),
    }
}

/// How a term's points move with their knots.
struct Moves<T> {
    /// `[point]` code of the term's point: see [`Term::codes`].
    codes: [u32; 3],
    /// `[point]` place relative to the knot's centre.
    offsets: [V2<T>; 3],
    /// `[point]` signed direction of a contact.
    lengthen: [V2<T>; 3],
}

impl<T: Real> Moves<T> {
    #[inline(always)]
    fn new<const PATTERN: u32, const COUNT: usize>(at: At<T>, term: &Term<T::Scalar>) -> Self {
        let mut moves = Self { codes: [0; 3], offsets: [V2::zero(); 3], lengthen: [V2::zero(); 3] };
        for i in 0..COUNT {
            moves.codes[i] = if PATTERN == ANY { term.codes[i] } else { PATTERN >> (3 * i) & 7 };
            if moves.codes[i] == 0 {
                continue;
            }
            let point = term.point as usize + i;
            moves.offsets[i] = at.offsets[point];
            if moves.codes[i] % 2 == 1 {
                let p = &at.stencil.points[point];
                moves.lengthen[i] = at.state[p.knot as usize].direction * T::splat(p.sign);
            }
        }
        moves
    }

    /// How point i moves with the term's unknown j.
    #[inline(always)]
    fn point(&self, i: usize, j: usize) -> Option<V2<T>> {
        let code = self.codes[i];
        if code == 0 || (code as usize - 1) / 2 != j / 2 {
            None
        } else if j.is_multiple_of(2) {
            // Turning d turns what is measured from the centre along.
            Some(self.offsets[i].turned())
        } else if code % 2 == 1 {
            Some(self.lengthen[i])
        } else {
            None
        }
    }

    /// How segment s of the term moves with its unknown j.
    #[inline(always)]
    fn segment(&self, s: usize, j: usize) -> Option<V2<T>> {
        match (self.point(s + 1, j), self.point(s, j)) {
            (Some(end), Some(begin)) => Some(end - begin),
            (Some(end), None) => Some(end),
            (None, Some(begin)) => Some(-begin),
            (None, None) => None,
        }
    }

    /// Adds to C what point i's own second derivatives bring; `g` is the derivative of a residual by the point, times
    /// the residual.
    #[inline(always)]
    fn add_turning(&self, term: &Term<T::Scalar>, i: usize, g: V2<T>, sums: &mut Sums<T>) {
        let code = self.codes[i];
        if code == 0 {
            return;
        }
        let (n, k) = (sums.b.len(), term.knots[(code as usize - 1) / 2] as usize);
        // d2 x / d theta2 = center - x; d2 x / d theta d l = d turned, for a contact.
        sums.c[2 * k * n + 2 * k] -= g.dot(self.offsets[i]);
        if code % 2 == 1 {
            sums.c[(2 * k + 1) * n + 2 * k] += g.dot(self.lengthen[i].turned());
        }
    }
}

/// Where the entry of a term's unknowns i and j stands in a lower triangle.
#[inline(always)]
fn entry<T>(term: &Term<T>, i: usize, j: usize, n: usize) -> usize {
    let unknown = |i: usize| 2 * term.knots[i / 2] as usize + i % 2;
    let (i, j) = (unknown(i), unknown(j));
    i.max(j) * n + i.min(j)
}

/// Adds a residual r with the derivatives `row` by the term's unknowns to A and b.
#[inline(always)]
#[allow(clippy::needless_range_loop)]
fn add_first<T: Real, const N: usize>(
    term: &Term<T::Scalar>,
    row: &[Option<T>; N],
    r: T,
    sums: &mut Sums<T>,
) {
    let n = sums.b.len();
    for i in 0..N {
        let Some(x) = row[i] else { continue };
        sums.b[2 * term.knots[i / 2] as usize + i % 2] += x * r;
        for j in 0..=i {
            let Some(y) = row[j] else { continue };
            sums.a[entry(term, i, j, n)] += x * y;
        }
    }
}
