//! L D L^T factorisation of small symmetric matrices.

use crate::math::Real;

/// Pivots at or below this share of the largest diagonal entry leave their unknown unchanged.
const SMALLEST_PIVOT: f64 = 1e-12;

/// Factorises A + mu diag A, and + C where `newton` is set; `a` and `c` are lower triangles, row-major n x n,
/// `factor` takes the result. Unknowns with `frozen` set, or without a usable pivot, are left out; says whether
/// all others had one.
#[inline(always)]
pub fn factorise<T: Real>(
    a: &[T],
    c: &[T],
    newton: T::Mask,
    mu: T,
    frozen: &[T::Mask],
    factor: &mut [T],
) -> T::Mask {
    let n = frozen.len();
    let damp = T::one() + mu;
    let mut largest = T::zero();
    for i in 0..n {
        largest = largest.max(a[i * n + i] * damp);
    }
    let smallest = largest * T::of(SMALLEST_PIVOT);
    let mut positive = T::mask(true);
    for j in 0..n {
        let mut pivot = a[j * n + j] * damp + T::select(newton, c[j * n + j], T::zero());
        for k in 0..j {
            let l = factor[j * n + k];
            // Below the diagonal L, on it 1 / D.
            pivot -= l * l * factor[k * n + k];
        }
        positive = T::and(positive, T::or(smallest.lt(pivot), frozen[j]));
        let usable = T::and(smallest.lt(pivot), T::not(frozen[j]));
        let inverse = T::select(usable, T::one() / T::select(usable, pivot, T::one()), T::zero());
        factor[j * n + j] = inverse;
        for i in j + 1..n {
            let mut entry = a[i * n + j] + T::select(newton, c[i * n + j], T::zero());
            for k in 0..j {
                entry -= factor[i * n + k] * factor[j * n + k] * factor[k * n + k];
            }
            factor[i * n + j] = entry;
        }
    }
    positive
}

/// Solves for x in (the matrix factorised) x = -b; unknowns left out stay 0.
#[inline(always)]
pub fn solve<T: Real>(factor: &[T], b: &[T], x: &mut [T]) {
    let n = b.len();
    for i in 0..n {
        let mut y = -b[i];
        for k in 0..i {
            y -= factor[i * n + k] * factor[k * n + k] * x[k];
        }
        x[i] = y;
    }
    for i in (0..n).rev() {
        let inverse = factor[i * n + i];
        let mut y = x[i] * inverse;
        for k in i + 1..n {
            y -= factor[k * n + i] * inverse * x[k];
        }
        x[i] = y;
    }
}
