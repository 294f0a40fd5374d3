//! The kernels on paper: what a stitch costs, stage by stage, worked out from its stencil and from how its solve goes,
//! without running anything; what the [`kernels`] around it cost; and the least time that a device takes for them.
//!
//! `tests/gpu_account.rs` holds it against [`counters`](super::counters), which say what is counted and what is not.

pub mod kernels;
mod kind;
mod limits;
mod terms;

pub use kind::Kind;
pub use limits::{Limits, PEAKS, Peak};

use crate::knot::Solver;
use crate::knot::table::GROUP;
use crate::scene::{Role, Stencil};
use terms::{Pattern, cosine_sums, length_sums, own_sums};

/// The stages of a stitch, by the shader files that they stand in; then the [`KERNELS`].
pub const STAGES: [&str; 16] = [
    "load", "frame", "start", "table", "lift", "energy", "sums", "factor", "solve", "stitch", KERNELS[0],
    KERNELS[1], KERNELS[2], KERNELS[3], KERNELS[4], KERNELS[5],
];

/// How many of [`STAGES`] a stitch has.
pub const STITCH_STAGES: usize = STAGES.len() - KERNELS.len();

/// The other kernels, by their names.
pub const KERNELS: [&str; 6] = ["areas", "corner_normals", "join", "carry", "choose", "curve"];

/// A stage of [`STAGES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Load,
    Frame,
    Start,
    Table,
    Lift,
    Energy,
    Sums,
    Factor,
    Solve,
    Stitch,
    Areas,
    CornerNormals,
    Join,
    Carry,
    Choose,
    Curve,
}

/// `[stage][kind]` what is counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Costs(pub [[u64; Kind::COUNT]; STAGES.len()]);

impl Costs {
    /// Adds others, so many times.
    pub fn add(&mut self, other: &Costs, times: u64) {
        for (to, from) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            *to += times * from;
        }
    }

    /// All stages together.
    pub fn total(&self, kind: Kind) -> u64 {
        self.0.iter().map(|stage| stage[kind as usize]).sum()
    }

    /// Bytes of a stage's own buffers and of those that all stitches share.
    pub fn bytes(stage: &[u64; Kind::COUNT]) -> [u64; 2] {
        let mut bytes = [0; 2];
        for kind in Kind::ALL.into_iter().filter(|kind| *kind != Kind::Operations) {
            bytes[usize::from(kind.is_shared())] += stage[kind as usize];
        }
        bytes
    }

    /// [`Costs::bytes`] of all stages.
    pub fn all_bytes(&self) -> [u64; 2] {
        let of_stage = self.0.iter().map(Self::bytes);
        of_stage.fold([0; 2], |sum, bytes| [sum[0] + bytes[0], sum[1] + bytes[1]])
    }

    fn put(&mut self, stage: Stage, kind: Kind, n: usize) {
        self.0[stage as usize][kind as usize] += n as u64;
    }

    fn work(&mut self, stage: Stage, operations: usize) {
        self.put(stage, Kind::Operations, operations);
    }

    fn stencil(&mut self, stage: Stage, bytes: usize) {
        self.put(stage, Kind::Stencil, bytes);
    }
}

/// How stitches are solved, as far as it changes what they cost.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// The iteration; none where knots are carried along.
    pub solver: Option<Solver>,
    /// Steps at most.
    pub iterations: usize,
    /// Whether starts come from tables.
    pub table: bool,
    /// Whether knots are spaced otherwise than by plain interpolation.
    pub spaced: bool,
    /// Whether energies are worked out that the method does not need.
    pub energies: bool,
}

/// What became of a stitch, as far as it changes what it costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Events {
    /// Corners whose places are finite.
    pub finite_corners: usize,
    /// Whether it had a frame, and so a solve.
    pub framed: bool,
    /// Whether the table's cell is one where the branch of optima breaks.
    pub broken: bool,
    /// Normal equations put together.
    pub assembled: usize,
    /// Factorings, the second ones of a step too.
    pub factored: usize,
    /// Steps solved for.
    pub stepped: usize,
    /// Whether it was interpolated in the end.
    pub fell_back: bool,
}

impl Events {
    /// A solve that makes all its steps, each with one factoring.
    pub fn all_steps(corners: usize, iterations: usize) -> Self {
        Self {
            finite_corners: corners,
            framed: true,
            broken: false,
            assembled: iterations,
            factored: iterations,
            stepped: iterations,
            fell_back: false,
        }
    }
}

// Operations on vectors, as `vector.wgsl` writes them out.
/// a.x b.x + a.y b.y.
const DOT2: usize = 3;
/// Three products, two sums.
const DOT3: usize = 5;
/// Six products, three differences.
const CROSS3: usize = 9;
/// A root more than a dot product.
const LENGTH3: usize = DOT3 + 1;
/// The length, its inverse, three products.
const NORMALIZED3: usize = LENGTH3 + 1 + 3;
/// `sum + v * w` of three components.
const ADD_SCALED3: usize = 6;
/// Two dot products.
const IN_PLANE: usize = 2 * DOT3;
/// The sum of two squares of lengths.
const SIZE: usize = 2 * DOT3 + 1;
/// Cayley's map: h (1), its scale (3), cosine (3), sine (2), two rows of the turn (3 each), the length (1).
const STEPPED: usize = 16;
/// Bytes of a word.
const WORD: usize = 4;
/// Bytes of a place.
const PLACE: usize = 3 * WORD;

/// What a stitch costs where all faces are worked on, none chosen, by the shader that serves all stitch types.
pub fn stitch(stencil: &Stencil<f32>, way: &Way, events: &Events) -> Costs {
    let mut costs = Costs::default();
    let solves = way.solver.is_some();
    let safe = way.solver == Some(Solver::Safeguarded);
    load(&mut costs, stencil.corner_count, events.finite_corners);
    surface(&mut costs, stencil, way, events);
    if events.framed {
        let knots = stencil.knot_count();
        match solves {
            true => {
                // A direction (2 words) and a half-length. v = l F d: 2 + 4, its length 4, its direction 3.
                costs.stencil(Stage::Start, 3 * WORD * knots);
                costs.work(Stage::Start, 13 * knots);
            }
            false => costs.stencil(Stage::Start, 3 * WORD * knots),
        }
        if solves && way.table {
            table(&mut costs, knots, events.broken);
        }
        solve(&mut costs, stencil, way, safe, events);
    }
    store(&mut costs, stencil);
    costs
}

/// A face's corners, so many of them finite.
fn load(costs: &mut Costs, n: usize, finite: usize) {
    // Indices of a place and a normal, and both.
    costs.put(Stage::Load, Kind::Topology, 2 * WORD * n);
    costs.put(Stage::Load, Kind::Surface, 2 * PLACE * n);
    // Finite ones are counted (in f32); all are taken relative to the first.
    costs.work(Stage::Load, finite + 3 * n);
    if finite < n {
        // The mean of the finite ones.
        costs.work(Stage::Load, 1 + ADD_SCALED3 * finite);
    }
}

/// The frame of a face with so many corners.
fn frame(costs: &mut Costs, n: usize) {
    // Each corner into both columns of the deformation, with a gradient of two words.
    costs.work(Stage::Frame, 2 * ADD_SCALED3 * n);
    costs.stencil(Stage::Frame, 2 * WORD * n);
    // Normal, area, size, course; is it usable; t1 and n by their inverse lengths; t2; F12 and F22.
    costs.work(Stage::Frame, CROSS3 + LENGTH3 + SIZE + LENGTH3 + 1 + 2 * 4 + CROSS3 + 2 * DOT3);
}

/// The frame, what is interpolated, seats, and the way back.
fn surface(costs: &mut Costs, stencil: &Stencil<f32>, way: &Way, events: &Events) {
    let (n, knots) = (stencil.corner_count, stencil.knot_count());
    frame(costs, n);
    if way.spaced && knots > 1 {
        // The share; means of two components, scaled; squares of distances; their mean's root; the scale; all moved.
        costs.work(Stage::Frame, 1 + 2 * knots + 2 + (2 + DOT2 + 1) * knots + 2 + 4 + 6 * knots);
        costs.stencil(Stage::Frame, WORD);
    }
    let is_still = |role| matches!(role, Role::Boundary | Role::Free);
    for (i, point) in stencil.points.iter().enumerate() {
        let used = stencil.weights[i * n..(i + 1) * n].iter().filter(|w| **w != 0.0).count();
        // Its role, before anything else.
        costs.stencil(Stage::Stitch, WORD);
        let still = is_still(point.role);
        if still {
            costs.work(Stage::Stitch, IN_PLANE);
        }
        // Interpolated where it is still, and once more where the face fell back.
        for _ in 0..usize::from(still) + usize::from(events.fell_back) {
            costs.stencil(Stage::Frame, WORD * n);
            costs.work(Stage::Frame, ADD_SCALED3 * used);
            costs.stencil(Stage::Lift, WORD);
            if point.z != 0.0 {
                // The normal there, made a unit, and the point along it.
                costs.stencil(Stage::Frame, WORD * n);
                costs.work(Stage::Frame, ADD_SCALED3 * used);
                costs.work(Stage::Lift, NORMALIZED3 + ADD_SCALED3);
            }
        }
        if events.framed {
            // All of the point; where it is a knot's, the tangent plane (6), then t1, t2, n and the normal.
            costs.stencil(Stage::Stitch, 4 * WORD);
            costs.work(Stage::Lift, if still { 0 } else { 6 + 4 * 3 + 3 * 3 });
        }
    }
    for k in 0..knots {
        let used = stencil.knot_weights[k * n..(k + 1) * n].iter().filter(|w| **w != 0.0).count();
        // A weight and a gradient of each corner: place and normal, both derivatives.
        costs.stencil(Stage::Lift, 3 * WORD * n);
        costs.work(Stage::Lift, 2 * ADD_SCALED3 * used + 2 * ADD_SCALED3 * n);
        // Derivatives in the plane and above; determinant and size; is it steep; the inverse; the slope (4 each).
        let slope = 2 * IN_PLANE + 2 * DOT3 + 3 + SIZE + 1 + 1 + 2 * 4;
        // Then the centre, its height, the unit normal.
        costs.work(Stage::Lift, slope + IN_PLANE + DOT3 + NORMALIZED3);
    }
}

fn table(costs: &mut Costs, knots: usize, broken: bool) {
    let groups = (2 * knots).div_ceil(GROUP);
    // h (4), three strains (4, 1, 4), the side of shear (1).
    costs.work(Stage::Table, 4 + 4 + 1 + 4 + 1);
    // On each axis: the place (2), the ends of the grid (2), fraction and step (2), the node (4).
    costs.work(Stage::Table, 3 * 10);
    // The lowest node (1), the diagonal (3), weights (3), all axes but the last (3).
    costs.work(Stage::Table, 10);
    // Shares of a node's value and slopes, the sheared one turned; the two nodes between, by five each and a sum.
    costs.work(Stage::Table, 4 * 7 + 2 * 6);
    // Whether the cell is whole.
    costs.put(Stage::Table, Kind::Table, WORD);
    if broken {
        costs.work(Stage::Table, 4 * 4);
    }
    // The least half-length.
    costs.stencil(Stage::Table, WORD);
    costs.work(Stage::Table, 1);
    // Of each two knots: four nodes of 16 words, each times its share and added.
    costs.put(Stage::Table, Kind::Table, 4 * 16 * WORD * groups);
    costs.work(Stage::Table, 4 * 16 * 2 * groups + STEPPED * knots);
}

fn solve(costs: &mut Costs, stencil: &Stencil<f32>, way: &Way, safe: bool, events: &Events) {
    let (knots, terms) = (stencil.knot_count(), &stencil.terms);
    let iterations = if way.solver.is_some() { way.iterations } else { 0 };
    let late = !safe || iterations == 0;
    let tried = if safe { events.stepped } else { 0 };
    let energies = tried + usize::from(late && way.energies);
    // The least half-length.
    costs.stencil(Stage::Solve, WORD);
    costs.work(Stage::Solve, 1);
    // Placed before each assembly, each trial and at the end.
    for _ in 0..events.assembled + tried + 1 {
        place(costs, stencil);
    }
    let patterns = |list: &[u32], all: &[crate::scene::Term<f32>], count| -> Vec<Pattern> {
        list.iter().map(|i| Pattern::new(&all[*i as usize], count)).collect()
    };
    let lengths = patterns(&terms.cross_lengths, &terms.lengths, 2);
    let cosines = patterns(&terms.cross_cosines, &terms.cosines, 3);
    for _ in 0..events.assembled {
        residuals(costs, stencil);
        // Own terms hand their energy over: one sum each.
        costs.work(Stage::Energy, terms.own_lengths.len() + terms.own_cosines.len());
        own_sums(costs, terms, safe);
        lengths.iter().for_each(|pattern| length_sums(costs, pattern, safe));
        cosines.iter().for_each(|pattern| cosine_sums(costs, pattern, safe));
    }
    for _ in 0..energies {
        residuals(costs, stencil);
        // Own lengths: four words; the residual 2, its square counted and added 3.
        costs.stencil(Stage::Energy, 4 * WORD * terms.own_lengths.len());
        costs.work(Stage::Energy, 5 * terms.own_lengths.len());
        // Own cosines: five words and a knot; the cosine 5, the residual 2, its square 3.
        costs.stencil(Stage::Energy, 6 * WORD * terms.own_cosines.len());
        costs.work(Stage::Energy, 10 * terms.own_cosines.len());
    }
    costs.work(Stage::Factor, events.factored * factoring(2 * knots));
    costs.work(Stage::Factor, events.stepped * solving(2 * knots));
    costs.work(Stage::Solve, events.stepped * STEPPED * knots);
    // Each trial: what is little (2), what was gained (1), what is noise (3), the next damping (2).
    costs.work(Stage::Solve, 8 * tried);
    if late && !way.energies {
        // Whether it is finite, by squares: w w (l l) + d . d.
        costs.work(Stage::Solve, (2 + 1 + DOT2 + 1 + 1) * knots);
    }
}

fn place(costs: &mut Costs, stencil: &Stencil<f32>) {
    for point in &stencil.points {
        costs.stencil(Stage::Energy, 4 * WORD);
        match point.role {
            Role::Boundary | Role::Free => {}
            // The offset 3, the place 2; a control's offset is the yarn's radius.
            Role::Contact => costs.work(Stage::Energy, 3 + 2),
            Role::Control => {
                costs.stencil(Stage::Energy, WORD);
                costs.work(Stage::Energy, 3 + 2);
            }
        }
    }
    // sqrt(l l + square), and its inverse; knot and square.
    costs.stencil(Stage::Energy, 2 * WORD * stencil.terms.own_lengths.len());
    costs.work(Stage::Energy, (3 + 1) * stencil.terms.own_lengths.len());
}

/// Segments measured; energies of all terms but those within knots.
fn residuals(costs: &mut Costs, stencil: &Stencil<f32>) {
    let terms = &stencil.terms;
    for own in &terms.own {
        // Its point, its rise, whether it is a knot's own.
        costs.stencil(Stage::Energy, 3 * WORD);
        let own = *own != crate::scene::NOT_OWN;
        // The difference 2; the length DOT2 + 3; its inverse 1; the direction 3. An own one's length is known.
        costs.work(Stage::Energy, if own { 2 + 3 } else { 2 + DOT2 + 3 + 1 + 3 });
    }
    let lengths = terms.fixed_lengths.len() + terms.cross_lengths.len();
    let cosines = terms.fixed_cosines.len() + terms.cross_cosines.len();
    // Which one, and its length at rest; the residual 2, its square added 2.
    costs.stencil(Stage::Energy, 2 * WORD * lengths);
    costs.work(Stage::Energy, 4 * lengths);
    // Which one, its segment, its cosine at rest; the cosine DOT2 + 2.
    costs.stencil(Stage::Energy, 3 * WORD * cosines);
    costs.work(Stage::Energy, (DOT2 + 2 + 4) * cosines);
}

/// L D L^T of so many unknowns.
fn factoring(n: usize) -> usize {
    // 1 + mu; the largest pivot; the smallest that counts.
    let before = 1 + n + 1;
    // A pivot: damped and C added (2), less three for each column before it, its inverse (1). Below it, each value:
    // C added (1), less three for each column before.
    before + (0..n).map(|j| 2 + 3 * j + 1 + (n - 1 - j) * (1 + 3 * j)).sum::<usize>()
}

/// A step by the factors: forward and back, three for each pair of unknowns, and the pivots.
fn solving(n: usize) -> usize {
    2 * 3 * (n * n.saturating_sub(1) / 2) + n
}

fn store(costs: &mut Costs, stencil: &Stencil<f32>) {
    // All counts of the stitch type.
    costs.stencil(Stage::Stitch, super::layout::COUNTS.len() * WORD);
    // How it ended, and its knots.
    costs.put(Stage::Stitch, Kind::Results, 3 * WORD);
    costs.put(Stage::Stitch, Kind::Knots, 3 * WORD * stencil.knot_count());
    for strand in stencil.strand_offsets.windows(2) {
        let points = strand[1] - strand[0];
        // Where it begins and ends in the stencil.
        costs.stencil(Stage::Stitch, 2 * WORD);
        if points < 2 {
            continue;
        }
        // Where it begins (read twice: the place and the way it runs), and its two ends.
        costs.put(Stage::Stitch, Kind::Topology, 4 * WORD);
        // The first corner added.
        costs.work(Stage::Stitch, 3 * points);
        costs.put(Stage::Stitch, Kind::Points, PLACE * points);
    }
}
