//! A sparse matrix over nodes, factored once: `L D L^T` (the up-looking method, as in Davis 2005, "Algorithm 849").
//!
//! The factor is kept in f32, which halves what a solve reads; it corrects positions kept in f64, so its rounding is
//! corrected by the next iteration. Solves run over independent parts side by side, then over what separates them, and add in an
//! order of their own: the same bytes on any number of threads.

use super::dissect::{Dissection, dissect};
use glam::{DVec3, Vec3A};
use rayon::prelude::*;
use std::ops::Range;

/// Entries of a symmetric matrix: `[a, b]` with a share for the sum at (a, b) and (b, a).
pub(super) type Entry = ([u32; 2], f64);

/// The factor, and the order it is in.
pub(super) struct Factor {
    dissection: Dissection,
    /// `[node]` its place in the order.
    place: Vec<u32>,
    /// `[place + 1]` off-diagonal entries of the matrix above the diagonal, by column.
    starts: Vec<u32>,
    /// `[entry]` its row, ascending within a column.
    rows: Vec<u32>,
    /// `[place]` the next column of its row in the factor (the elimination tree).
    parent: Vec<u32>,
    /// `[place + 1]` entries of the factor by column.
    columns: Vec<u32>,
    indices: Vec<u32>,
    values: Vec<f32>,
    /// `[place]` entries of a column of a part that stay within it; the rest concern separators.
    inner: Vec<u32>,
    inverse: Vec<f32>,
    /// `[place]` workspaces of a solve.
    x: Vec<Vec3A>,
    /// `[part][place among separators]`
    carried: Vec<Vec<Vec3A>>,
}

const NONE: u32 = u32::MAX;

impl Factor {
    /// Finds the order and the factor's pattern for entries between `pairs` of nodes.
    pub fn new(places: &[DVec3], pairs: &[[u32; 2]]) -> Self {
        Self::build(places, pairs, u64::MAX).0
    }

    /// The same, if the factor has no more entries than that.
    pub fn within(places: &[DVec3], pairs: &[[u32; 2]], most: u64) -> Option<Self> {
        let (factor, fits) = Self::build(places, pairs, most);
        fits.then_some(factor)
    }

    fn build(places: &[DVec3], pairs: &[[u32; 2]], most: u64) -> (Self, bool) {
        let n = places.len();
        let dissection = dissect(places, pairs);
        let mut place = vec![0; n];
        dissection.order.iter().enumerate().for_each(|(k, node)| place[*node as usize] = k as u32);
        let mut above: Vec<[u32; 2]> = pairs
            .iter()
            .map(|pair| pair.map(|node| place[node as usize]))
            .filter(|[a, b]| a != b)
            .map(|[a, b]| [a.max(b), a.min(b)])
            .collect();
        above.sort_unstable();
        above.dedup();
        let starts =
            (0..=n as u32).map(|k| above.partition_point(|[column, _]| *column < k) as u32).collect();
        let rows = above.into_iter().map(|[_, row]| row).collect();
        let mut factor = Self {
            place,
            starts,
            rows,
            parent: vec![NONE; n],
            columns: vec![0; n + 1],
            indices: Vec::new(),
            values: Vec::new(),
            inner: vec![0; n],
            inverse: vec![0.0; n],
            x: vec![Vec3A::ZERO; n],
            carried: Vec::new(),
            dissection,
        };
        let fits = factor.pattern(most);
        (factor, fits)
    }

    /// Entries of the factor below its diagonal.
    pub fn entries(&self) -> usize {
        self.indices.len()
    }

    fn above(&self, column: usize) -> Range<usize> {
        self.starts[column] as usize..self.starts[column + 1] as usize
    }

    /// Whether there are no more entries than that; else it is not finished.
    fn pattern(&mut self, most: u64) -> bool {
        let n = self.parent.len();
        let mut flag = vec![NONE; n];
        let mut count = vec![0_u32; n];
        let mut all = 0;
        for k in 0..n {
            if all > most {
                return false;
            }
            flag[k] = k as u32;
            for entry in self.above(k) {
                let mut i = self.rows[entry] as usize;
                while flag[i] != k as u32 {
                    if self.parent[i] == NONE {
                        self.parent[i] = k as u32;
                    }
                    count[i] += 1;
                    all += 1;
                    flag[i] = k as u32;
                    i = self.parent[i] as usize;
                }
            }
        }
        for (k, count) in count.iter().enumerate() {
            self.columns[k + 1] = self.columns[k] + count;
        }
        let size = self.columns[n] as usize;
        self.indices = vec![0; size];
        self.values = vec![0.0; size];
        let separators = n - self.dissection.parts.last().map_or(0, |p| p.end);
        self.carried = vec![vec![Vec3A::ZERO; separators]; self.dissection.parts.len()];
        true
    }

    /// Factors the matrix of that diagonal and those off-diagonal entries (each once); nodes in `fixed` are left out of it:
    /// solutions are 0 there.
    pub fn factor(&mut self, diagonal: &[f64], entries: &[Entry], fixed: impl Fn(usize) -> bool) {
        let n = self.parent.len();
        let mut sums = vec![0.0; self.rows.len()];
        for ([a, b], value) in entries {
            if fixed(*a as usize) || fixed(*b as usize) {
                continue;
            }
            let [a, b] = [a, b].map(|node| self.place[*node as usize]);
            let (column, row) = (a.max(b), a.min(b));
            let range = self.above(column as usize);
            if let Ok(at) = self.rows[range.clone()].binary_search(&row) {
                sums[range.start + at] += value;
            }
        }
        let mut values = vec![0.0_f64; self.indices.len()];
        let mut flag = vec![NONE; n];
        let mut filled = vec![0_u32; n];
        let mut stack = vec![0_u32; n];
        let mut path = vec![0_u32; n];
        let mut y = vec![0.0; n];
        let mut pivots = vec![1.0; n];
        for k in 0..n {
            let node = self.dissection.order[k] as usize;
            flag[k] = k as u32;
            let mut top = n;
            for entry in self.above(k) {
                let mut i = self.rows[entry] as usize;
                y[i] += sums[entry];
                let mut length = 0;
                while flag[i] != k as u32 {
                    path[length] = i as u32;
                    length += 1;
                    flag[i] = k as u32;
                    i = self.parent[i] as usize;
                }
                while length > 0 {
                    length -= 1;
                    top -= 1;
                    stack[top] = path[length];
                }
            }
            let mut pivot = if fixed(node) { 1.0 } else { diagonal[node] };
            for i in &stack[top..] {
                let i = *i as usize;
                let yi = std::mem::take(&mut y[i]);
                let (begin, end) = (self.columns[i] as usize, (self.columns[i] + filled[i]) as usize);
                for (row, value) in self.indices[begin..end].iter().zip(&values[begin..end]) {
                    y[*row as usize] -= value * yi;
                }
                let l = yi / pivots[i];
                pivot -= l * yi;
                self.indices[end] = k as u32;
                values[end] = l;
                filled[i] += 1;
            }
            // The matrix is positive; only rounding could say otherwise.
            pivots[k] = if pivot > 0.0 { pivot } else { diagonal[node].abs().max(f64::MIN_POSITIVE) };
        }
        self.values.iter_mut().zip(&values).for_each(|(v, value)| *v = *value as f32);
        self.inverse.iter_mut().zip(&pivots).for_each(|(v, pivot)| *v = (1.0 / pivot) as f32);
        for part in &self.dissection.parts {
            for column in part.clone() {
                let rows = &self.indices[self.columns[column] as usize..self.columns[column + 1] as usize];
                self.inner[column] = rows.partition_point(|row| (*row as usize) < part.end) as u32;
            }
        }
    }

    /// Adds to `x` the solution for `right`.
    pub fn add_solution(&mut self, right: &[DVec3], x: &mut [DVec3]) {
        let Self { dissection, columns, indices, values, inner, inverse, x: y, carried, .. } = self;
        let (columns, indices, values, inner) = (&*columns, &*indices, &*values, &*inner);
        y.par_iter_mut().zip(&dissection.order).with_min_len(4096).for_each(|(y, node)| {
            *y = right[*node as usize].as_vec3a();
        });
        let split = dissection.parts.last().map_or(0, |p| p.end);
        let (parts, separators) = y.split_at_mut(split);
        let column = |k: usize| columns[k] as usize..columns[k + 1] as usize;

        // Forward: parts, each with its own sums for separators; then separators.
        each_part(parts, &dissection.parts, carried, &|part, y, carried| {
            carried.fill(Vec3A::ZERO);
            for k in part.clone() {
                let yk = y[k - part.start];
                let (entries, within) = (column(k), inner[k] as usize);
                let (rows, values) = (&indices[entries.clone()], &values[entries]);
                for (row, l) in rows[..within].iter().zip(values) {
                    y[*row as usize - part.start] -= yk * *l;
                }
                for (row, l) in rows[within..].iter().zip(&values[within..]) {
                    carried[*row as usize - split] += yk * *l;
                }
            }
        });
        for carried in &*carried {
            separators.iter_mut().zip(carried).for_each(|(y, c)| *y -= *c);
        }
        for k in 0..separators.len() {
            let yk = separators[k];
            let entries = column(split + k);
            for (row, l) in indices[entries.clone()].iter().zip(&values[entries]) {
                separators[*row as usize - split] -= yk * *l;
            }
        }

        // Backward: separators, then parts.
        for k in (0..separators.len()).rev() {
            let mut yk = separators[k] * inverse[split + k];
            let entries = column(split + k);
            for (row, l) in indices[entries.clone()].iter().zip(&values[entries]) {
                yk -= separators[*row as usize - split] * *l;
            }
            separators[k] = yk;
        }
        let separators = &*separators;
        each_part(parts, &dissection.parts, carried, &|part, y, _| {
            for k in part.clone().rev() {
                let mut yk = y[k - part.start] * inverse[k];
                let (entries, within) = (column(k), inner[k] as usize);
                let (rows, values) = (&indices[entries.clone()], &values[entries]);
                for (row, l) in rows[..within].iter().zip(values) {
                    yk -= y[*row as usize - part.start] * *l;
                }
                for (row, l) in rows[within..].iter().zip(&values[within..]) {
                    yk -= separators[*row as usize - split] * *l;
                }
                y[k - part.start] = yk;
            }
        });
        let (y, place) = (&self.x, &self.place);
        x.par_iter_mut()
            .zip(place)
            .with_min_len(4096)
            .for_each(|(x, place)| *x += y[*place as usize].as_dvec3());
    }
}

/// Runs over parts side by side: halves the list until one is left, which takes no room.
fn each_part(
    y: &mut [Vec3A],
    parts: &[Range<usize>],
    carried: &mut [Vec<Vec3A>],
    run: &(impl Fn(Range<usize>, &mut [Vec3A], &mut [Vec3A]) + Sync),
) {
    match parts {
        [] => {}
        [part] => run(part.clone(), y, &mut carried[0]),
        _ => {
            let half = parts.len() / 2;
            let (parts_a, parts_b) = parts.split_at(half);
            let (ya, yb) = y.split_at_mut(parts_b[0].start - parts_a[0].start);
            let (ca, cb) = carried.split_at_mut(half);
            rayon::join(|| each_part(ya, parts_a, ca, run), || each_part(yb, parts_b, cb, run));
        }
    }
}
