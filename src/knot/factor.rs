//! L D L^T factorisation of small symmetric matrices.

use crate::math::Real;

/// Pivots at or below this share of the largest diagonal entry leave their unknown unchanged.
const SMALLEST_PIVOT: f64 = 1e-12;

/// Solves (A + mu diag A) x = -b, where `a` is the lower triangle of A, row-major n x n, and `factor`
/// is scratch of the same size. Unknowns with `frozen` set, or without a usable pivot, stay 0.
#[inline(always)]
pub fn solve<T: Real>(a: &[T], b: &[T], mu: T, frozen: &[T::Mask], factor: &mut [T], x: &mut [T]) {
    let n = b.len();
    let damp = T::one() + mu;
    let mut largest = T::zero();
    for i in 0..n {
        largest = largest.max(a[i * n + i] * damp);
    }
    let smallest = largest * T::of(SMALLEST_PIVOT);
    for j in 0..n {
        let mut pivot = a[j * n + j] * damp;
        for k in 0..j {
            let l = factor[j * n + k];
            // Below the diagonal L, on it 1 / D.
            pivot -= l * l * factor[k * n + k];
        }
        let usable = T::and(smallest.lt(pivot), T::not(frozen[j]));
        let inverse = T::select(usable, T::one() / T::select(usable, pivot, T::one()), T::zero());
        factor[j * n + j] = inverse;
        for i in j + 1..n {
            let mut entry = a[i * n + j];
            for k in 0..j {
                entry -= factor[i * n + k] * factor[j * n + k] * factor[k * n + k];
            }
            factor[i * n + j] = entry;
        }
    }
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
