//! Stage 3: the energy of a stitch, its gradient, its Gauss-Newton matrix and its curvature
//! (Huang et al. 2025, eq. 3, 5, 6; model section 4).

use super::start::KnotState;
use super::sums::{self, At, Sums};
use crate::math::{Real, V2};
use crate::scene::{NOT_OWN, Role, Stencil, Term};

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
pub(super) struct Segment<T> {
    /// In-plane part of its direction; zero for a segment without length.
    pub unit: V2<T>,
    /// z part of its direction.
    pub up: T,
    pub length: T,
    /// 1 / length; 0 for a segment without length.
    pub inverse: T,
}

/// Scratch space of a stitch's energy, sized for a stencil.
#[derive(Clone, Debug, Default)]
pub struct Points<T> {
    /// `[point]` in-plane places: those of interpolated points are set by the caller.
    pub plane: Vec<V2<T>>,
    /// `[knot]` centres.
    pub centers: Vec<V2<T>>,
    /// `[point]` places relative to the knot's centre.
    pub(super) offsets: Vec<V2<T>>,
    segments: Vec<Segment<T>>,
    /// Lengths within knots, and 1 / length.
    own: Vec<(T, T)>,
}

impl<T: Real> Points<T> {
    /// Makes room for a stencil.
    pub fn fit(&mut self, stencil: &Stencil<T::Scalar>) {
        self.plane.resize(stencil.points.len(), V2::zero());
        self.offsets.resize(stencil.points.len(), V2::zero());
        self.centers.resize(stencil.knot_count(), V2::zero());
        self.segments.resize(stencil.terms.lengths.len(), Segment::default());
        self.own.resize(stencil.terms.own_lengths.len(), Default::default());
    }

    /// Puts contacts and controls where the knots' state says (eq. 1).
    #[inline(always)]
    pub fn place(&mut self, stencil: &Stencil<T::Scalar>, state: &[KnotState<T>]) {
        let radius = T::splat(stencil.yarn_radius);
        for (i, p) in stencil.points.iter().enumerate() {
            let k = p.knot as usize;
            let offset = match p.role {
                Role::Boundary | Role::Free => continue,
                Role::Contact => state[k].direction * (T::splat(p.sign) * state[k].half_length),
                Role::Control => {
                    let d = state[k].direction;
                    V2::new(d.v, -d.u) * (T::splat(p.sign) * radius)
                }
            };
            self.offsets[i] = offset;
            self.plane[i] = self.centers[k] + offset;
        }
        for (length, (own, inverse)) in stencil.terms.own_lengths.iter().zip(&mut self.own) {
            let l = state[length.knot as usize].half_length;
            *own = (l * l + T::splat(length.square)).sqrt();
            *inverse = inverse_or_zero(*own);
        }
    }

    #[inline(always)]
    fn measure(&mut self, stencil: &Stencil<T::Scalar>) {
        let terms = &stencil.terms;
        let points = terms.lengths.iter().zip(terms.own.iter().zip(&terms.rises));
        for ((term, (own, rise)), segment) in points.zip(&mut self.segments) {
            let (i, rise) = (term.point as usize, T::splat(*rise));
            *segment = if *own == NOT_OWN {
                let plane = self.plane[i + 1] - self.plane[i];
                let length = (plane.dot(plane) + rise * rise).sqrt();
                let inverse = inverse_or_zero(length);
                Segment { unit: plane * inverse, up: rise * inverse, length, inverse }
            } else {
                let (length, inverse) = self.own[*own as usize];
                let plane = self.offsets[i + 1] - self.offsets[i];
                Segment { unit: plane * inverse, up: rise * inverse, length, inverse }
            };
        }
    }

    /// The energy E of the points as they are placed.
    #[inline(always)]
    pub fn energy(
        &mut self,
        stencil: &Stencil<T::Scalar>,
        weights: &Weights<T>,
        state: &[KnotState<T>],
    ) -> T {
        self.measure(stencil);
        let terms = &stencil.terms;
        let mut energy = self.fixed_energy(stencil, weights);
        for (own, (length, _)) in terms.own_lengths.iter().zip(&self.own) {
            let r = weights.length * (*length - T::splat(own.rest));
            energy += T::splat(own.count) * (r * r);
        }
        for own in &terms.own_cosines {
            let of = &terms.own_lengths[own.length as usize];
            let (_, inverse) = self.own[own.length as usize];
            let l = state[of.knot as usize].half_length;
            let cosine = (T::splat(own.sign) * (l * l) + T::splat(own.offset)) * (inverse * inverse);
            let r = weights.angle * (cosine - T::splat(own.rest));
            energy += T::splat(own.count) * (r * r);
        }
        self.add_terms(energy, stencil, weights, [&terms.cross_lengths, &terms.cross_cosines])
    }

    /// What terms add that depend on no knot.
    #[inline(always)]
    fn fixed_energy(&self, stencil: &Stencil<T::Scalar>, weights: &Weights<T>) -> T {
        let terms = &stencil.terms;
        self.add_terms(T::zero(), stencil, weights, [&terms.fixed_lengths, &terms.fixed_cosines])
    }

    /// The energy with that of some lengths and cosines added one by one: the order is that of
    /// [`Points::assemble`], so that both give the same bits.
    #[inline(always)]
    fn add_terms(
        &self,
        mut energy: T,
        stencil: &Stencil<T::Scalar>,
        weights: &Weights<T>,
        [lengths, cosines]: [&[u32]; 2],
    ) -> T {
        let terms = &stencil.terms;
        for i in lengths {
            let (segment, term) = (&self.segments[*i as usize], &terms.lengths[*i as usize]);
            let r = weights.length * (segment.length - T::splat(term.rest));
            energy += r * r;
        }
        for i in cosines {
            let term = &terms.cosines[*i as usize];
            let r = weights.angle * (self.cosine(term) - T::splat(term.rest));
            energy += r * r;
        }
        energy
    }

    /// The residuals sqrt(w) (value - rest): lengths first, then cosines. For checks; the kernels sum as
    /// they go.
    pub fn residuals(&mut self, stencil: &Stencil<T::Scalar>, weights: &Weights<T>) -> Vec<T> {
        self.measure(stencil);
        let lengths = stencil.terms.lengths.iter().zip(&self.segments);
        let lengths = lengths.map(|(term, segment)| weights.length * (segment.length - T::splat(term.rest)));
        let cosines = stencil
            .terms
            .cosines
            .iter()
            .map(|term| weights.angle * (self.cosine(term) - T::splat(term.rest)));
        lengths.chain(cosines).collect()
    }

    #[inline(always)]
    fn cosine(&self, term: &Term<T::Scalar>) -> T {
        let (e, f) = (&self.segments[term.segment as usize], &self.segments[term.segment as usize + 1]);
        e.unit.dot(f.unit) + e.up * f.up
    }

    /// The energy, and the normal equations `(a, c, b)`: A = sum J J^T (lower triangle, row-major n x n),
    /// b = sum J r, half the gradient, and where asked for the curvature C = sum r H_r (lower triangle), H_r
    /// the second derivatives of a residual: A + C is half the Hessian of E. Unknown 2k is the tilt of knot k,
    /// 2k + 1 its half-length.
    #[inline(always)]
    pub fn assemble(
        &mut self,
        stencil: &Stencil<T::Scalar>,
        weights: &Weights<T>,
        state: &[KnotState<T>],
        (a, c, b): (&mut [T], Option<&mut [T]>, &mut [T]),
    ) -> T {
        let curved = c.is_some();
        let mut sums = Sums { a, c: c.unwrap_or_default(), b, curved };
        self.measure(stencil);
        for sum in [&mut sums.a, &mut sums.b, &mut sums.c] {
            sum.fill(T::zero());
        }
        let terms = &stencil.terms;
        let mut energy = self.fixed_energy(stencil, weights);
        for (own, (length, inverse)) in terms.own_lengths.iter().zip(&self.own) {
            let l = state[own.knot as usize].half_length;
            energy += sums::add_own_length(own, weights.length, l, (*length, *inverse), &mut sums);
        }
        for own in &terms.own_cosines {
            let of = &terms.own_lengths[own.length as usize];
            let (_, inverse) = self.own[own.length as usize];
            let l = state[of.knot as usize].half_length;
            energy += sums::add_own_cosine(own, of, weights.angle, l, inverse, &mut sums);
        }
        let at = At { stencil, offsets: &self.offsets, state };
        for i in &terms.cross_lengths {
            let (term, segment) = (&terms.lengths[*i as usize], &self.segments[*i as usize]);
            let r = weights.length * (segment.length - T::splat(term.rest));
            energy += r * r;
            sums::length(at, weights.length, term, segment, r, &mut sums);
        }
        for i in &terms.cross_cosines {
            let term = &terms.cosines[*i as usize];
            let pair = [term.segment as usize, term.segment as usize + 1].map(|s| &self.segments[s]);
            let cosine = self.cosine(term);
            let r = weights.angle * (cosine - T::splat(term.rest));
            energy += r * r;
            let values = (cosine, r);
            sums::cosine(at, weights.angle, term, pair, values, &mut sums);
        }
        energy
    }
}

#[inline(always)]
fn inverse_or_zero<T: Real>(length: T) -> T {
    let some = T::zero().lt(length);
    T::select(some, T::one() / T::select(some, length, T::one()), T::zero())
}
