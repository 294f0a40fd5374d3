//! Stage 3: the energy of a stitch, its gradient and the Gauss-Newton matrix
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
        self.measure(stencil);
        a.fill(T::zero());
        b.fill(T::zero());
        let mut energy = T::zero();
        for (term, segment) in stencil.lengths.iter().zip(&self.segments) {
            let r = weights.length * (segment.length - term.rest);
            energy += r * r;
            let g = segment.plane * (segment.inverse * weights.length);
            self.accumulate(stencil, state, term, &[g * -T::one(), g], r, a, b);
        }
        for term in &stencil.cosines {
            let (e, f) = (&self.segments[term.segment as usize], &self.segments[term.segment as usize + 1]);
            let c = self.cosine(term);
            let r = weights.angle * (c - term.rest);
            energy += r * r;
            let (eu, fu) = (e.plane * e.inverse, f.plane * f.inverse);
            // d cos / d e and d cos / d f, in the plane.
            let de = (fu - eu * c) * (e.inverse * weights.angle);
            let df = (eu - fu * c) * (f.inverse * weights.angle);
            self.accumulate(stencil, state, term, &[de * -T::one(), de - df, df], r, a, b);
        }
        energy
    }

    /// Adds one residual whose derivatives by its points are `gradients`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn accumulate(
        &self,
        stencil: &Stencil<T>,
        state: &[KnotState<T>],
        term: &Term<T>,
        gradients: &[V2<T>],
        r: T,
        a: &mut [T],
        b: &mut [T],
    ) {
        let n = b.len();
        let mut row = [T::zero(); 6];
        for (i, g) in gradients.iter().enumerate() {
            if term.slot[i] == NO_SLOT {
                continue;
            }
            let p = &stencil.points[term.point as usize + i];
            let knot = &state[p.knot as usize];
            let s = 2 * term.slot[i] as usize;
            match p.role {
                Role::Contact => {
                    row[s] += g.dot(knot.direction.turned()) * (p.sign * knot.half_length);
                    row[s + 1] += g.dot(knot.direction) * p.sign;
                }
                // Turning d turns b along; d b / d theta = d.
                _ => row[s] += g.dot(knot.direction) * (p.sign * stencil.yarn_radius),
            }
        }
        let used = 2 * term.knot_count as usize;
        let unknown = |i: usize| 2 * term.knots[i / 2] as usize + i % 2;
        for i in 0..used {
            let row_i = unknown(i);
            b[row_i] += row[i] * r;
            for j in 0..used {
                let column = unknown(j);
                if column <= row_i {
                    a[row_i * n + column] += row[i] * row[j];
                }
            }
        }
    }
}
