//! Stage 3: the energy of a stitch, its gradient, its Gauss-Newton matrix and its curvature
//! (Huang et al. 2025, eq. 3, 5, 6; model section 4).

use super::start::KnotState;
use crate::math::{Real, V2};
use crate::scene::{NO_SLOT, Role, Stencil, Term};

/// Square roots of the weights: residuals are sqrt(w) (value - rest).
#[derive(Clone, Copy, Debug)]
pub struct Weights<T> {
    /// sqrt(w_angle).
    pub angle: T,
    /// sqrt(w_length).
    pub length: T,
}

/// A segment between consecutive points.
#[derive(Clone, Copy, Debug, Default)]
struct Segment<T> {
    /// In-plane part.
    plane: V2<T>,
    /// z part.
    z: T,
    length: T,
    /// 1 / length; 0 for a segment without length.
    inverse: T,
}

/// Scratch space of a stitch's energy, sized for a stencil.
#[derive(Clone, Debug, Default)]
pub struct Points<T> {
    /// `[point]` in-plane places: those of interpolated points are set by the caller.
    pub plane: Vec<V2<T>>,
    /// `[knot]` centres.
    pub centers: Vec<V2<T>>,
    segments: Vec<Segment<T>>,
}

impl<T: Real> Points<T> {
    /// Makes room for a stencil.
    pub fn fit(&mut self, stencil: &Stencil<T>) {
        self.plane.resize(stencil.points.len(), V2::zero());
        self.centers.resize(stencil.knot_count(), V2::zero());
        self.segments.resize(stencil.lengths.len(), Segment::default());
    }

    /// Puts contacts and controls where the knots' state says (eq. 1).
    #[inline(always)]
    pub fn place(&mut self, stencil: &Stencil<T>, state: &[KnotState<T>]) {
        for (p, plane) in stencil.points.iter().zip(&mut self.plane) {
            let k = p.knot as usize;
            match p.role {
                Role::Boundary | Role::Free => {}
                Role::Contact => {
                    *plane = self.centers[k] + state[k].direction * (p.sign * state[k].half_length);
                }
                Role::Control => {
                    let d = state[k].direction;
                    *plane = self.centers[k] + V2::new(d.v, -d.u) * (p.sign * stencil.yarn_radius);
                }
            }
        }
    }

    #[inline(always)]
    fn measure(&mut self, stencil: &Stencil<T>) {
        for (term, segment) in stencil.lengths.iter().zip(&mut self.segments) {
            let i = term.point as usize;
            let plane = self.plane[i + 1] - self.plane[i];
            let z = stencil.points[i + 1].z - stencil.points[i].z;
            let length = (plane.dot(plane) + z * z).sqrt();
            let some = T::zero().lt(length);
            let inverse = T::select(some, T::one() / T::select(some, length, T::one()), T::zero());
            *segment = Segment { plane, z, length, inverse };
        }
    }

    /// The energy E of the points as they are placed.
    #[inline(always)]
    pub fn energy(&mut self, stencil: &Stencil<T>, weights: &Weights<T>) -> T {
        self.measure(stencil);
        let mut energy = T::zero();
        for (term, segment) in stencil.lengths.iter().zip(&self.segments) {
            let r = weights.length * (segment.length - term.rest);
            energy += r * r;
        }
        for term in &stencil.cosines {
            let r = weights.angle * (self.cosine(term) - term.rest);
            energy += r * r;
        }
        energy
    }

    /// The residuals sqrt(w) (value - rest): lengths first, then cosines. For checks; the kernels sum as
    /// they go.
    pub fn residuals(&mut self, stencil: &Stencil<T>, weights: &Weights<T>) -> Vec<T> {
        self.measure(stencil);
        let lengths = stencil.lengths.iter().zip(&self.segments);
        let lengths = lengths.map(|(term, segment)| weights.length * (segment.length - term.rest));
        let cosines = stencil.cosines.iter().map(|term| weights.angle * (self.cosine(term) - term.rest));
        lengths.chain(cosines).collect()
    }

    #[inline(always)]
    fn cosine(&self, term: &Term<T>) -> T {
        let (e, f) = (&self.segments[term.segment as usize], &self.segments[term.segment as usize + 1]);
        (e.plane.dot(f.plane) + e.z * f.z) * e.inverse * f.inverse
    }

    /// The energy, and the normal equations: A = sum J J^T (lower triangle, row-major n x n) and
    /// b = sum J r, half the gradient. Unknown 2k is the tilt of knot k, 2k + 1 its half-length.
    #[inline(always)]
    pub fn assemble(
        &mut self,
        stencil: &Stencil<T>,
        weights: &Weights<T>,
        state: &[KnotState<T>],
        a: &mut [T],
        b: &mut [T],
    ) -> T {
        self.sum_terms::<false>(stencil, weights, state, Sums { a, c: &mut [], b })
    }

    /// [`Points::assemble`], and the curvature C = sum r H_r (lower triangle), H_r the second derivatives of
    /// a residual: A + C is half the Hessian of E.
    #[inline(always)]
    pub fn assemble_curved(
        &mut self,
        stencil: &Stencil<T>,
        weights: &Weights<T>,
        state: &[KnotState<T>],
        a: &mut [T],
        c: &mut [T],
        b: &mut [T],
    ) -> T {
        self.sum_terms::<true>(stencil, weights, state, Sums { a, c, b })
    }

    #[inline(always)]
    fn sum_terms<const CURVED: bool>(
        &mut self,
        stencil: &Stencil<T>,
        weights: &Weights<T>,
        state: &[KnotState<T>],
        mut sums: Sums<T>,
    ) -> T {
        self.measure(stencil);
        for sum in [&mut sums.a, &mut sums.b, &mut sums.c] {
            sum.fill(T::zero());
        }
        let mut energy = T::zero();
        for (term, segment) in stencil.lengths.iter().zip(&self.segments) {
            let r = weights.length * (segment.length - term.rest);
            energy += r * r;
            // Sizes known to the compiler: 2 unknowns a knot.
            match term.knot_count {
                0 => {}
                1 => add_length::<T, CURVED, 2>(stencil, weights, state, term, segment, r, &mut sums),
                _ => add_length::<T, CURVED, 4>(stencil, weights, state, term, segment, r, &mut sums),
            }
        }
        for term in &stencil.cosines {
            let pair = [term.segment as usize, term.segment as usize + 1].map(|s| &self.segments[s]);
            let cos = self.cosine(term);
            let r = weights.angle * (cos - term.rest);
            energy += r * r;
            match term.knot_count {
                0 => {}
                1 => add_cosine::<T, CURVED, 2>(stencil, weights, state, term, pair, (cos, r), &mut sums),
                2 => add_cosine::<T, CURVED, 4>(stencil, weights, state, term, pair, (cos, r), &mut sums),
                _ => add_cosine::<T, CURVED, 6>(stencil, weights, state, term, pair, (cos, r), &mut sums),
            }
        }
        energy
    }
}

/// What is summed over the terms: A and C as lower triangles, row-major n x n, and b.
struct Sums<'a, T> {
    a: &'a mut [T],
    c: &'a mut [T],
    b: &'a mut [T],
}

/// Adds the residual r of a segment's length; N is twice the number of its knots.
#[inline(always)]
fn add_length<T: Real, const CURVED: bool, const N: usize>(
    stencil: &Stencil<T>,
    weights: &Weights<T>,
    state: &[KnotState<T>],
    term: &Term<T>,
    segment: &Segment<T>,
    r: T,
    sums: &mut Sums<T>,
) {
    let n = sums.b.len();
    let w = weights.length;
    let unit = segment.plane * segment.inverse;
    let [de, _] = moves::<T, N>(stencil, state, term, 2);
    let along: [T; N] = std::array::from_fn(|i| unit.dot(de[i]));
    add_first(term, &along.map(|x| w * x), r, sums);
    if CURVED {
        let share = r * w * segment.inverse;
        for i in 0..N {
            for j in 0..=i {
                // d2 len = (de . de - d len d len) / len; u . d2 e follows.
                sums.c[entry(term, i, j, n)] += share * (de[i].dot(de[j]) - along[i] * along[j]);
            }
        }
        let g = unit * (r * w);
        add_turning(stencil, state, term, &[g * -T::one(), g], n, sums.c);
    }
}

/// Adds the residual r of the cosine of two segments.
#[inline(always)]
fn add_cosine<T: Real, const CURVED: bool, const N: usize>(
    stencil: &Stencil<T>,
    weights: &Weights<T>,
    state: &[KnotState<T>],
    term: &Term<T>,
    [e, f]: [&Segment<T>; 2],
    (cos, r): (T, T),
    sums: &mut Sums<T>,
) {
    let n = sums.b.len();
    let w = weights.angle;
    let (eu, fu) = (e.plane * e.inverse, f.plane * f.inverse);
    // d cos / d e and d cos / d f, in the plane, times the lengths.
    let (p, q) = (fu - eu * cos, eu - fu * cos);
    let [de, df] = moves::<T, N>(stencil, state, term, 3);
    let de = de.map(|d| d * e.inverse);
    let df = df.map(|d| d * f.inverse);
    let turn_e: [T; N] = std::array::from_fn(|i| p.dot(de[i]));
    let turn_f: [T; N] = std::array::from_fn(|i| q.dot(df[i]));
    let row: [T; N] = std::array::from_fn(|i| w * (turn_e[i] + turn_f[i]));
    add_first(term, &row, r, sums);
    if CURVED {
        let along_e: [T; N] = std::array::from_fn(|i| eu.dot(de[i]));
        let along_f: [T; N] = std::array::from_fn(|i| fu.dot(df[i]));
        let share = r * w;
        // With u, v the segments' directions: du_i . dv_j, and what second derivatives of u and v add.
        let mixed = |i: usize, j: usize| {
            de[i].dot(df[j]) - (turn_e[i] + cos * along_e[i]) * along_f[j] - along_e[i] * turn_f[j]
        };
        for i in 0..N {
            for j in 0..=i {
                let square_e = along_e[i] * turn_e[j]
                    + turn_e[i] * along_e[j]
                    + cos * (de[i].dot(de[j]) - along_e[i] * along_e[j]);
                let square_f = along_f[i] * turn_f[j]
                    + turn_f[i] * along_f[j]
                    + cos * (df[i].dot(df[j]) - along_f[i] * along_f[j]);
                let second = mixed(i, j) + mixed(j, i) - square_e - square_f;
                sums.c[entry(term, i, j, n)] += share * second;
            }
        }
        let (ge, gf) = (p * (share * e.inverse), q * (share * f.inverse));
        add_turning(stencil, state, term, &[ge * -T::one(), ge - gf, gf], n, sums.c);
    }
}

/// Where the entry of a term's unknowns i and j stands in a lower triangle.
#[inline(always)]
fn entry<T>(term: &Term<T>, i: usize, j: usize, n: usize) -> usize {
    let unknown = |i: usize| 2 * term.knots[i / 2] as usize + i % 2;
    let (i, j) = (unknown(i), unknown(j));
    i.max(j) * n + i.min(j)
}

/// How the first and the second segment of a term move with its unknowns; `count` points.
#[inline(always)]
fn moves<T: Real, const N: usize>(
    stencil: &Stencil<T>,
    state: &[KnotState<T>],
    term: &Term<T>,
    count: usize,
) -> [[V2<T>; N]; 2] {
    let mut moves = [[V2::zero(); N]; 2];
    for i in 0..count {
        if term.slot[i] == NO_SLOT {
            continue;
        }
        let p = &stencil.points[term.point as usize + i];
        let knot = &state[p.knot as usize];
        let s = 2 * term.slot[i] as usize;
        let d = knot.direction;
        // Turning d turns b along; d b / d theta = d.
        let (turn, lengthen) = match p.role {
            Role::Contact => (d.turned() * (p.sign * knot.half_length), d * p.sign),
            _ => (d * (p.sign * stencil.yarn_radius), V2::zero()),
        };
        // The point ends segment i - 1 and begins segment i.
        if i > 0 {
            let end = &mut moves[i - 1];
            end[s] = end[s] + turn;
            end[s + 1] = end[s + 1] + lengthen;
        }
        if i + 1 < count {
            let begin = &mut moves[i];
            begin[s] = begin[s] - turn;
            begin[s + 1] = begin[s + 1] - lengthen;
        }
    }
    moves
}

/// Adds a residual r with the derivatives `row` by the term's unknowns to A and b.
#[inline(always)]
fn add_first<T: Real, const N: usize>(term: &Term<T>, row: &[T; N], r: T, sums: &mut Sums<T>) {
    let n = sums.b.len();
    for i in 0..N {
        sums.b[2 * term.knots[i / 2] as usize + i % 2] += row[i] * r;
        for j in 0..=i {
            sums.a[entry(term, i, j, n)] += row[i] * row[j];
        }
    }
}

/// Adds what the points' own second derivatives bring: `gradients` are those of a residual by its points,
/// times the residual.
#[inline(always)]
fn add_turning<T: Real>(
    stencil: &Stencil<T>,
    state: &[KnotState<T>],
    term: &Term<T>,
    gradients: &[V2<T>],
    n: usize,
    c: &mut [T],
) {
    for (i, g) in gradients.iter().enumerate() {
        if term.slot[i] == NO_SLOT {
            continue;
        }
        let p = &stencil.points[term.point as usize + i];
        let k = p.knot as usize;
        let d = state[k].direction;
        // d2 x / d theta2 = center - x; d2 x / d theta d l = d turned, for a contact.
        match p.role {
            Role::Contact => {
                c[2 * k * n + 2 * k] -= g.dot(d) * (p.sign * state[k].half_length);
                c[(2 * k + 1) * n + 2 * k] += g.dot(d.turned()) * p.sign;
            }
            _ => c[2 * k * n + 2 * k] += g.dot(d.turned()) * (p.sign * stencil.yarn_radius),
        }
    }
}
