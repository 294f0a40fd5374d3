//! From a strain to a place in the table: the clamp of eigenvalues (section 4.3) and the strains sx, sa, sy (eq. 4).

use super::Compat;
use crate::math::{Real, Scalar};
use crate::pattern::StrainTable;

/// Eigenvalues never go below this: strains have to be numbers.
const LEAST_EIGENVALUE: f64 = 1e-4;
/// Components of C beyond this say no more than this.
pub const MOST: f64 = 1e6;
/// Where MADYPG takes eigenvalues for equal, squared.
const MADYPG_EQUAL: f64 = 1e-4;

/// The table's axes as kernels search them.
#[derive(Clone, Debug)]
pub struct Axes<T> {
    pub axes: [Axis<T>; 3],
    pub least: f64,
    compat: Compat,
}

#[derive(Clone, Debug)]
pub struct Axis<T> {
    pub nodes: Vec<T>,
    /// One over the width of the interval that begins at each node but the last.
    pub inverses: Vec<T>,
}

/// Where a strain lies in the table.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cell<R: Real> {
    /// Number of the node at its lower corner.
    pub node: R,
    /// Along sx, sa and sy, 0 to 1.
    pub fraction: [R; 3],
}

impl<T: Scalar> Axes<T> {
    pub fn new(table: &StrainTable, min_eigenvalue: f64, compat: Compat) -> Self {
        let axis = |nodes: &Vec<f32>| Axis {
            nodes: nodes.iter().map(|x| T::of((*x).into())).collect(),
            inverses: nodes.windows(2).map(|w| T::of(1.0 / (f64::from(w[1]) - f64::from(w[0])))).collect(),
        };
        Self { axes: table.axes().each_ref().map(axis), least: min_eigenvalue.max(LEAST_EIGENVALUE), compat }
    }

    /// Keeps the eigenvalues of a strain C (uu, uv, vv) from falling below their bound. What is no number is rest.
    #[inline(always)]
    pub fn clamp<R: Real<Scalar = T>>(&self, c: [R; 3]) -> [R; 3] {
        let finite = R::and(R::and(c[0].finite(), c[1].finite()), c[2].finite());
        let rest = [R::one(), R::zero(), R::one()];
        let most = R::of(MOST);
        let within = |x: R| x.min(most).max(-most);
        let mut a = [R::zero(); 3];
        for k in 0..3 {
            a[k] = within(R::select(finite, c[k], rest[k]));
        }
        match self.compat {
            Compat::None => self.clamp_exactly(a),
            Compat::Madypg => self.clamp_as_madypg(a),
        }
    }

    /// Both eigenvalues are mean and deviation; the clamped ones share their eigenvectors.
    #[inline(always)]
    fn clamp_exactly<R: Real<Scalar = T>>(&self, [uu, uv, vv]: [R; 3]) -> [R; 3] {
        let half = R::of(0.5);
        let least = R::of(self.least);
        let (mean, lean) = ((uu + vv) * half, (uu - vv) * half);
        let deviation = (lean * lean + uv * uv).sqrt();
        let (high, low) = ((mean + deviation).max(least), (mean - deviation).max(least));
        let (mean, spread) = ((high + low) * half, (high - low) * half);
        // Where the deviation is nothing, so are the components that it scales.
        let scale = spread / deviation.max(R::of(1e-30));
        [mean + lean * scale, uv * scale, mean - lean * scale]
    }

    #[inline(always)]
    fn clamp_as_madypg<R: Real<Scalar = T>>(&self, [a, c, b]: [R; 3]) -> [R; 3] {
        let half = R::of(0.5);
        let least = R::of(self.least);
        let lean = a - b;
        let squared = R::of(4.0) * c * c + lean * lean;
        let equal = squared.lt(R::of(MADYPG_EQUAL));
        let d = R::select(equal, R::one(), squared).sqrt();
        let (low, high) = (((a + b - d) * half).max(least), ((a + b + d) * half).max(least));
        let (sum, spread) = (low + high, high - low);
        let scale = half / d;
        let both = a.max(least);
        [
            R::select(equal, both, (d * sum + spread * lean) * scale),
            R::select(equal, c, c * spread / d),
            R::select(equal, both, (d * sum - spread * lean) * scale),
        ]
    }

    /// sx, sa, sy of a clamped strain.
    #[inline(always)]
    pub fn strains<R: Real<Scalar = T>>(&self, [uu, uv, vv]: [R; 3]) -> [R; 3] {
        [uu.sqrt() - R::one(), uv / (uu * vv).sqrt(), vv.sqrt() - R::one()]
    }

    /// The cell that strains fall into, the nearest one outside the table, and whether they are outside.
    #[inline(always)]
    pub fn find<R: Real<Scalar = T>>(&self, strains: [R; 3]) -> (Cell<R>, R::Mask) {
        let mut cell = Cell { node: R::zero(), fraction: [R::zero(); 3] };
        let mut outside = R::mask(false);
        let mut stride = 1.0;
        for (k, (axis, s)) in self.axes.iter().zip(strains).enumerate() {
            let n = axis.nodes.len();
            let (first, last) = (R::splat(axis.nodes[0]), R::splat(axis.nodes[n - 1]));
            outside = R::or(outside, R::or(s.lt(first), last.lt(s)));
            if n > 1 {
                let (mut node, mut at, mut inverse) = (R::zero(), first, R::splat(axis.inverses[0]));
                for j in 1..n - 1 {
                    let x = R::splat(axis.nodes[j]);
                    let beyond = x.le(s);
                    node = R::select(beyond, R::of(j as f64 * stride), node);
                    at = R::select(beyond, x, at);
                    inverse = R::select(beyond, R::splat(axis.inverses[j]), inverse);
                }
                cell.node += node;
                cell.fraction[k] = ((s - at) * inverse).max(R::zero()).min(R::one());
            }
            stride *= if k == 0 { n.max(2) } else { n } as f64;
        }
        (cell, outside)
    }
}
