//! Displacements between the nodes of the table.

use crate::math::Scalar;
use crate::pattern::StrainTable;

/// A table in a precision.
#[derive(Clone, Debug)]
pub struct Lookup<T> {
    /// `[vertex][sy][sa][sx]` along u, v, height and twist.
    values: Vec<[T; 4]>,
    nodes: usize,
    /// From a node to the next along sx, sa and sy; 0 where an axis has but one.
    strides: [usize; 3],
}

impl<T: Scalar> Lookup<T> {
    /// Takes a table in, times a factor.
    pub fn new(table: &StrainTable, factor: f64) -> Self {
        let [x, a, y] = table.axes().each_ref().map(Vec::len);
        let stride = |n: usize, stride: usize| if n > 1 { stride } else { 0 };
        Self {
            values: table.values().iter().map(|v| v.map(|x| T::of(f64::from(x) * factor))).collect(),
            nodes: table.node_count(),
            strides: [stride(x, 1), stride(a, x), stride(y, x * a)],
        }
    }

    /// The displacement of a pattern vertex in a cell: along sx first, then sa, then sy.
    #[inline(always)]
    pub fn at(&self, vertex: usize, node: usize, fraction: [T; 3]) -> [T; 4] {
        let [sx, sa, sy] = self.strides;
        let from = vertex * self.nodes + node;
        let values = &self.values[from..from + sx + sa + sy + 1];
        let along = |at: usize| mix(values[at], values[at + sx], fraction[0]);
        let low = mix(along(0), along(sa), fraction[1]);
        let high = mix(along(sy), along(sy + sa), fraction[1]);
        mix(low, high, fraction[2])
    }
}

#[inline(always)]
fn mix<T: Scalar>(a: [T; 4], b: [T; 4], t: T) -> [T; 4] {
    let mut out = a;
    for k in 0..4 {
        out[k] = a[k] + (b[k] - a[k]) * t;
    }
    out
}
