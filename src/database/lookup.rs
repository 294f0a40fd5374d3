//! Displacements between the nodes of the table.

use crate::math::Scalar;
use crate::pattern::StrainTable;

/// A table in a precision.
#[derive(Clone, Debug)]
pub struct Lookup<T> {
    /// `[vertex][sy][sa][sx]` along u, v, height and twist. An axis sx of one node is doubled: neighbours along it are read
    /// as one.
    pub values: Vec<[T; 4]>,
    /// Of a vertex.
    pub nodes: usize,
    /// From a node to the next along sa and sy; 0 where an axis has but one.
    pub strides: [usize; 2],
}

/// Nodes along sx, at least two.
pub fn width(table: &StrainTable) -> usize {
    table.axes()[0].len().max(2)
}

impl<T: Scalar> Lookup<T> {
    /// Takes a table in, times a factor.
    pub fn new(table: &StrainTable, factor: f64) -> Self {
        let [x, a, y] = table.axes().each_ref().map(Vec::len);
        let times = width(table) / x;
        let stride = |n: usize, stride: usize| if n > 1 { stride } else { 0 };
        let values = table.values().iter().map(|v| v.map(|x| T::of(f64::from(x) * factor)));
        Self {
            values: values.flat_map(|v| std::iter::repeat_n(v, times)).collect(),
            nodes: table.node_count() * times,
            strides: [stride(a, x * times), stride(y, x * times * a)],
        }
    }

    /// The displacement of a pattern vertex in a cell: along sy first, then sa, then sx, so that as much as can be is done to
    /// numbers that stand side by side.
    #[inline(always)]
    pub fn at(&self, vertex: usize, node: usize, fraction: [T; 3]) -> [T; 4] {
        let [sa, sy] = self.strides;
        let from = vertex * self.nodes + node;
        let values = self.values[from..from + sa + sy + 2].as_flattened();
        let pair = |at: usize| -> &[T; 8] { values[4 * at..4 * at + 8].try_into().expect("eight") };
        let near = mix(pair(0), pair(sy), fraction[2]);
        let far = mix(pair(sa), pair(sa + sy), fraction[2]);
        let both = mix(&near, &far, fraction[1]);
        let mut out = [T::zero(); 4];
        for k in 0..4 {
            out[k] = both[k] + (both[k + 4] - both[k]) * fraction[0];
        }
        out
    }
}

#[inline(always)]
fn mix<T: Scalar>(a: &[T; 8], b: &[T; 8], t: T) -> [T; 8] {
    let mut out = [T::zero(); 8];
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = *a + (*b - *a) * t;
    }
    out
}
