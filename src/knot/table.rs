//! The tabulated start: optima of a stitch type over the deformations of its face, and how they are looked up
//! (model section 5).
//!
//! For a face whose mapping is affine the optimum depends on F alone. The table holds what is to be added to the
//! affine start, and the slopes of that, at the nodes of a regular grid; in between, the nodes of the simplex
//! around a place say, by a half of their slopes, what is there, and are averaged: exact for quadratic functions,
//! so that the error is of third order, continuous, and four cache lines for each two knots.

use super::frame::Frame;
use super::solve::stepped;
use super::start::KnotState;
use crate::math::{Real, Scalar};

/// Unknowns that stand side by side in a [`Block`]: those of two knots.
pub const GROUP: usize = 4;

/// Nodes at equal distances on each of the three axes, one of them at rest.
///
/// The coordinates are those of [`strains`]: course strain, shear, wale strain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Grid {
    /// Steps a unit of strain.
    pub density: u32,
    /// `[axis]` nodes below rest; as many as above for shear.
    pub below: [u32; 3],
    /// `[axis]` nodes above rest.
    pub above: [u32; 3],
}

impl Default for Grid {
    /// Stretches from 1/2 to 2, shear up to 3/4.
    fn default() -> Self {
        Self { density: 12, below: [8, 9, 8], above: [8, 9, 8] }
    }
}

impl Grid {
    /// Number of nodes on an axis.
    pub fn count(&self, axis: usize) -> usize {
        (self.below[axis] + self.above[axis]) as usize + 1
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        (0..3).map(|axis| self.count(axis)).product()
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        (0..3).map(|axis| self.count(axis) - 1).product()
    }

    /// How many nodes lie between neighbours on each axis.
    pub fn strides(&self) -> [usize; 3] {
        [self.count(1) * self.count(2), self.count(2), 1]
    }

    /// Steps from rest to a node.
    pub fn offset(&self, node: usize) -> [i32; 3] {
        let strides = self.strides();
        std::array::from_fn(|a| (node / strides[a] % self.count(a)) as i32 - self.below[a] as i32)
    }

    /// The node that many steps from rest; `None` outside of the grid.
    pub fn node(&self, offset: [i32; 3]) -> Option<usize> {
        let strides = self.strides();
        let mut node = 0;
        for a in 0..3 {
            let i = usize::try_from(offset[a] + self.below[a] as i32).ok()?;
            if i >= self.count(a) {
                return None;
            }
            node += i * strides[a];
        }
        Some(node)
    }

    /// Strains at a number of steps from rest.
    pub fn strains(&self, offset: [i32; 3]) -> [f64; 3] {
        offset.map(|o| f64::from(o) / f64::from(self.density))
    }
}

/// The coordinates of a deformation in tables: 2 (F11 - 1) / (F11 + 1), F12 / h and 2 (h - 1) / (h + 1) with
/// h = |F e_v|. The first and the last are logarithms of stretches up to the third order, and lie in -2..2.
#[inline(always)]
pub fn strains<T: Real>(frame: &Frame<T>) -> [T; 3] {
    let (one, two) = (T::one(), T::of(2.0));
    let h = (frame.f12 * frame.f12 + frame.f22 * frame.f22).sqrt();
    [two * (frame.f11 - one) / (frame.f11 + one), frame.f12 / h, two * (h - one) / (h + one)]
}

/// F11, F12 and F22 with these [`strains`].
pub fn deformation([course, shear, wale]: [f64; 3]) -> [f64; 3] {
    let stretch = |s: f64| (2.0 + s) / (2.0 - s);
    let h = stretch(wale);
    [stretch(course), shear * h, h * (1.0 - shear * shear).max(0.0).sqrt()]
}

/// Where a table has no continuous branch of optima: faces there start from the nearest node's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gaps {
    /// Cells through which the branch breaks.
    pub cells: usize,
    /// The lowest corner, in [`strains`], of the one nearest to rest.
    pub nearest: Option<[f64; 3]>,
}

/// `[value, and half its slope by each strain, a grid step][unknown]` of what is added to the affine start.
/// Unknown 2k is the turn of knot k by Cayley's map, 2k + 1 its lengthening in template units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Block<S>(pub [[S; GROUP]; 4]);

/// The optima of a stitch type.
#[derive(Clone, Debug, PartialEq)]
pub struct Table<S> {
    grid: Grid,
    knots: usize,
    shortest: S,
    /// `[node][group]`
    blocks: Vec<Block<S>>,
    /// `[node]` 1 where the cell between the node and the next on each axis is whole.
    whole: Vec<S>,
}

impl<S: Scalar> Table<S> {
    /// A table of `knots` knots whose half-lengths are at least `shortest`, from its blocks
    /// (`[node][group]`) and which of its cells are whole (`[node]`); `None` where sizes do not fit.
    pub fn new(grid: Grid, knots: usize, shortest: S, blocks: Vec<Block<S>>, whole: Vec<S>) -> Option<Self> {
        let nodes = grid.node_count();
        let sizes = blocks.len() == nodes * Self::groups_of(knots) && whole.len() == nodes;
        // Places are carried as f32.
        let axes = grid.below[1] == grid.above[1] && (0..3).all(|axis| grid.above[axis] > 0);
        let fits = nodes < 1 << 22 && axes;
        (sizes && fits && knots > 0).then_some(Self { grid, knots, shortest, blocks, whole })
    }

    /// Blocks a node.
    pub fn groups_of(knots: usize) -> usize {
        (2 * knots).div_ceil(GROUP)
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Number of knots.
    pub fn knot_count(&self) -> usize {
        self.knots
    }

    /// Least half-length, template units.
    pub fn shortest(&self) -> S {
        self.shortest
    }

    /// `[node][group]`.
    pub fn blocks(&self) -> &[Block<S>] {
        &self.blocks
    }

    /// `[node]` 1 for a whole cell, else 0.
    pub fn whole(&self) -> &[S] {
        &self.whole
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        std::mem::size_of_val(&self.blocks[..]) + std::mem::size_of_val(&self.whole[..])
    }

    /// Where the branch of optima that is continuous from rest breaks.
    pub fn gaps(&self) -> Gaps {
        let broken = (0..self.whole.len()).filter(|node| self.whole[*node].to_f64() < 0.5);
        let offsets = broken.map(|node| self.grid.offset(node));
        Gaps {
            cells: offsets.clone().count(),
            nearest: offsets
                .min_by_key(|o| o.map(|x| x * x).iter().sum::<i32>())
                .map(|o| self.grid.strains(o)),
        }
    }

    /// The same table in another precision.
    pub fn cast<T: Scalar>(&self) -> Table<T> {
        let cast = |x: &S| T::of(x.to_f64());
        Table {
            grid: self.grid,
            knots: self.knots,
            shortest: cast(&self.shortest),
            blocks: self.blocks.iter().map(|b| Block(b.0.map(|row| row.map(|x| cast(&x))))).collect(),
            whole: self.whole.iter().map(cast).collect(),
        }
    }

    /// Turns `state`, the affine start, into the tabulated one. In a cell through which the branch of optima
    /// breaks the nearest node of the simplex speaks alone, by its whole slopes; outside of the grid the nodes at
    /// the border do, by half of theirs.
    #[inline(always)]
    pub fn correct<T: Real<Scalar = S>>(&self, frame: &Frame<T>, state: &mut [KnotState<T>]) {
        let mut simplex = Simplex::around(&self.grid, frame);
        let whole = T::gather(&self.whole, simplex.cell);
        simplex.leave_to_nearest(whole.lt(T::of(0.5)));
        let groups = Self::groups_of(self.knots);
        let shortest = T::splat(self.shortest);
        for (group, knots) in state.chunks_mut(GROUP / 2).enumerate() {
            let mut sums = [T::zero(); GROUP];
            // A stitch at a time: its blocks are whole cache lines, whose unknowns lie side by side.
            for lane in 0..T::LANES {
                let mut sum = [S::zero(); GROUP];
                for (node, shares) in simplex.nodes.iter().zip(&simplex.shares) {
                    let place = node.lane(lane).to_f64() as usize * groups + group;
                    let block = &self.blocks[place.min(self.blocks.len() - 1)].0;
                    for (share, row) in shares.iter().zip(block) {
                        let share = share.lane(lane);
                        for (sum, value) in sum.iter_mut().zip(row) {
                            *sum += share * *value;
                        }
                    }
                }
                for (sums, sum) in sums.iter_mut().zip(sum) {
                    sums.set_lane(lane, sum);
                }
            }
            for (i, knot) in knots.iter_mut().enumerate() {
                *knot = stepped(*knot, sums[2 * i], sums[2 * i + 1]);
                knot.half_length = knot.half_length.max(shortest);
            }
        }
    }
}

/// The simplex of the grid around a deformation: of the six into which each cell is cut along the same diagonal
/// (Kuhn's), mirrored for negative shear; so that neighbours agree on what they share.
struct Simplex<T> {
    /// The lowest corner of the cell.
    cell: T,
    /// Nodes on the way from the corner nearest to rest in shear, else lowest, to the opposite one, as whole
    /// numbers.
    nodes: [T; 4],
    /// What a node's value and half slopes are multiplied by: barycentric weights times 1 and the steps
    /// from the node.
    shares: [[T; 4]; 4],
}

impl<T: Real> Simplex<T> {
    #[inline(always)]
    fn around(grid: &Grid, frame: &Frame<T>) -> Self {
        let (zero, one) = (T::zero(), T::one());
        // No closures: what is not inlined cannot use the lanes' instructions.
        let mut strides = [zero; 3];
        for (stride, of) in strides.iter_mut().zip(grid.strides()) {
            *stride = T::of(of as f64);
        }
        let mut strains = strains(frame);
        // Faces sheared the other way see the grid mirrored, so that mirrored stitches start alike.
        let mirrored = strains[1].lt(zero);
        let side = T::select(mirrored, -one, one);
        strains[1] = strains[1].abs();
        strides[1] = strides[1] * side;
        let mut base = zero;
        let (mut f, mut steps) = ([zero; 3], [zero; 3]);
        for a in 0..3 {
            let rest = T::of(f64::from(grid.below[a]));
            let from = if a == 1 { zero } else { rest };
            let x = strains[a] * T::of(f64::from(grid.density)) + from;
            let last = T::of(f64::from(grid.above[a])) + from;
            let inside = x.max(zero).min(last);
            let cell = inside.floor().min(last - one);
            f[a] = inside - cell;
            steps[a] = x - cell;
            base += (if a == 1 { rest * side + cell } else { cell }) * strides[a];
        }
        let lowest = base - T::select(mirrored, T::of(grid.strides()[1] as f64), zero);
        // The greatest fraction steps first; equal ones in the order of the axes.
        let (xy, xz, yz) = (f[1].le(f[0]), f[2].le(f[0]), f[2].le(f[1]));
        let (yx, zx, zy) = (T::not(xy), T::not(xz), T::not(yz));
        let first = [flag::<T>(xy, xz), flag::<T>(yx, yz), flag::<T>(zx, zy)];
        let last = [flag::<T>(yx, zx), flag::<T>(xy, zy), flag::<T>(xz, yz)];
        let high = f[0].max(f[1]).max(f[2]);
        let low = f[0].min(f[1]).min(f[2]);
        let middle = f[0].min(f[1]).max(f[0].max(f[1]).min(f[2]));
        let diagonal = base + strides[0] + strides[1] + strides[2];
        let weights = [one - high, high - middle, middle - low, low];
        let but_last = [one - last[0], one - last[1], one - last[2]];
        let ahead = [[zero; 3], first, but_last, [one; 3]];
        let mut shares = [[zero; 4]; 4];
        for ((shares, w), ahead) in shares.iter_mut().zip(weights).zip(ahead) {
            *shares =
                [w, w * (steps[0] - ahead[0]), w * (steps[1] - ahead[1]) * side, w * (steps[2] - ahead[2])];
        }
        let nodes = [base, base + reach(first, strides), diagonal - reach(last, strides), diagonal];
        Self { cell: lowest, nodes, shares }
    }

    /// Where the mask is set, one node counts alone.
    #[inline(always)]
    fn leave_to_nearest(&mut self, alone: T::Mask) {
        let weights = [self.shares[0][0], self.shares[1][0], self.shares[2][0], self.shares[3][0]];
        let most = weights[0].max(weights[1]).max(weights[2]).max(weights[3]);
        let mut found = T::mask(false);
        for (shares, weight) in self.shares.iter_mut().zip(weights) {
            let nearest = T::and(most.le(weight), T::not(found));
            found = T::or(found, nearest);
            // Twice the half slopes; the weight is not 0 where it is the greatest of four.
            let whole = T::of(2.0) / T::select(nearest, weight, T::one());
            for (i, share) in shares.iter_mut().enumerate() {
                let only = if i == 0 { T::one() } else { *share * whole };
                let only = T::select(nearest, only, T::zero());
                *share = T::select(alone, only, *share);
            }
        }
    }
}

/// 1 where both are set, else 0.
#[inline(always)]
fn flag<T: Real>(a: T::Mask, b: T::Mask) -> T {
    T::select(T::and(a, b), T::one(), T::zero())
}

/// How far steps along the axes lead, in nodes.
#[inline(always)]
fn reach<T: Real>(flags: [T; 3], strides: [T; 3]) -> T {
    flags[0] * strides[0] + flags[1] * strides[1] + flags[2] * strides[2]
}
