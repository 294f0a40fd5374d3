//! Building tables: each node solved to its end, on the branch that is continuous from rest.

use super::Settings;
use super::energy::{Points, Weights};
use super::factor;
use super::frame::space_knots;
use super::solve::{DAMPING, Solve, Solver, stepped};
use super::start::KnotState;
use super::table::{Block, GROUP, Grid, Table, deformation};
use crate::math::V2;
use crate::scene::Stencil;
use glam::DVec2;
use rayon::prelude::*;

/// Steps after which a node counts as one without an optimum.
const STEPS: u32 = 200;
/// Step of central differences by the strains; their error is about the square of it.
const DIFFERENCE: f64 = 1e-5;
/// Optima of neighbours, each carried halfway along its slopes, that lie farther apart than this (in r) are on
/// different branches.
/// Measured: 1 and 2 leave cells of tucks whole in which a mean of two branches starts far from both.
const BREAK: f64 = 0.5;

/// What the optima of a stitch type depend on besides the deformation.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The stitch type.
    pub stencil: &'a Stencil<f64>,
    /// The template's corners, template units.
    pub corners: &'a [DVec2],
    /// Knot spacing.
    pub beta: f64,
    /// Square roots of the weights.
    pub weights: Weights<f64>,
}

impl<'a> Subject<'a> {
    /// A stitch type under the settings' weights and spacing.
    pub fn new(stencil: &'a Stencil<f64>, corners: &'a [DVec2], settings: &Settings) -> Self {
        let weights = Weights { angle: settings.weight_angle.sqrt(), length: settings.weight_length.sqrt() };
        Self { stencil, corners, beta: settings.beta, weights }
    }
}

/// The optimum at a node.
#[derive(Clone, Debug)]
struct Optimum {
    /// `[knot]`.
    state: Vec<KnotState<f64>>,
    /// `[unknown][strain]` derivatives.
    slopes: Vec<[f64; 3]>,
    energy: f64,
    /// Whether it is one: the solve has ended and the Hessian is positive definite.
    sound: bool,
}

/// Tabulates a stitch type, in f32, which is far below the error of interpolation; `None` for one without knots.
/// Runs in rayon's current pool.
pub fn tabulate(subject: Subject, grid: &Grid) -> Option<Table<f32>> {
    let knots = subject.stencil.knot_count();
    let optima = if knots > 0 { optima(subject, grid) } else { return None };
    let of_node = |(node, optimum)| blocks(subject, grid, node, optimum);
    let blocks: Vec<Block<f32>> = optima.par_iter().enumerate().flat_map_iter(of_node).collect();
    let cell = |node| if cell_is_whole(subject, grid, node, &optima) { 1.0 } else { 0.0 };
    let whole = (0..grid.node_count()).into_par_iter().map(cell).collect();
    // Settings without sense (no weights at all) may give none.
    let finite = blocks.iter().all(|b| b.0.iter().flatten().all(|x| x.is_finite()));
    let shortest = (subject.stencil.yarn_radius * 0.5) as f32;
    Table::new(*grid, knots, shortest, blocks, whole).filter(|_| finite)
}

/// All nodes, shell by shell outwards from rest: the same for any number of threads.
fn optima(subject: Subject, grid: &Grid) -> Vec<Optimum> {
    let face = Face::new(subject);
    let stencil = subject.stencil;
    let rest: Vec<_> = stencil
        .knot_direction
        .iter()
        .zip(&stencil.knot_half_length)
        .map(|(d, l)| KnotState { direction: *d, half_length: *l })
        .collect();
    let shell = |node: &usize| grid.offset(*node).map(i32::abs).into_iter().max().unwrap_or(0);
    let mut order: Vec<usize> = (0..grid.node_count()).collect();
    order.sort_by_key(shell);
    let mut nodes: Vec<Option<Optimum>> = vec![None; order.len()];
    for nodes_of_shell in order.chunk_by(|a, b| shell(a) == shell(b)) {
        let known = &nodes;
        let solve_node = |work: &mut Solve<f64>, node: &usize| {
            let here = grid.offset(*node);
            let mut best: Option<Optimum> = None;
            for parent in parents(here) {
                let Some(from) = grid.node(parent).and_then(|n| known[n].as_ref()) else { continue };
                let by = steps_between(grid, parent, here);
                let optimum = face.solve(work, grid.strains(here), &carried(from, by, 1.0, stencil));
                if optimum.sound && apart(from, &optimum, by, stencil) <= BREAK {
                    return optimum;
                }
                // No way on along a branch: the lowest of what was found.
                if best.as_ref().is_none_or(|b| optimum.energy < b.energy) {
                    best = Some(optimum);
                }
            }
            best.unwrap_or_else(|| face.solve(work, grid.strains(here), &rest))
        };
        let solved: Vec<_> = nodes_of_shell.par_iter().map_init(Solve::default, solve_node).collect();
        for (node, optimum) in nodes_of_shell.iter().zip(solved) {
            nodes[*node] = Some(optimum);
        }
    }
    nodes.into_iter().flatten().collect()
}

/// Nodes of the next shell inwards beside a node; the one on the straight way to rest first.
fn parents(here: [i32; 3]) -> Vec<[i32; 3]> {
    let shell = here.map(i32::abs).into_iter().max().unwrap_or(0);
    if shell == 0 {
        return Vec::new();
    }
    let share = f64::from(shell - 1) / f64::from(shell);
    let mut parents = vec![here.map(|x| (f64::from(x) * share).round() as i32)];
    for choice in 0..8 {
        let inwards = |a: usize| {
            let must = here[a].abs() == shell;
            if must || choice >> a & 1 == 1 { here[a] - here[a].signum() } else { here[a] }
        };
        let parent = std::array::from_fn(inwards);
        if !parents.contains(&parent) {
            parents.push(parent);
        }
    }
    parents
}

fn steps_between(grid: &Grid, from: [i32; 3], to: [i32; 3]) -> [f64; 3] {
    let (from, to) = (grid.strains(from), grid.strains(to));
    std::array::from_fn(|a| to[a] - from[a])
}

/// The state of an optimum carried along its slopes by a share of a difference of strains.
fn carried(from: &Optimum, by: [f64; 3], share: f64, stencil: &Stencil<f64>) -> Vec<KnotState<f64>> {
    let along = |unknown: usize| -> f64 { (0..3).map(|a| from.slopes[unknown][a] * by[a] * share).sum() };
    let carry = |(k, state): (usize, &KnotState<f64>)| {
        let mut to = stepped(*state, along(2 * k), along(2 * k + 1));
        to.half_length = to.half_length.max(stencil.yarn_radius * 0.5);
        to
    };
    from.state.iter().enumerate().map(carry).collect()
}

/// How far apart the points of two optima are, in r, each carried halfway towards the other.
fn apart(a: &Optimum, b: &Optimum, by: [f64; 3], stencil: &Stencil<f64>) -> f64 {
    let (a, b) = (carried(a, by, 0.5, stencil), carried(b, by, -0.5, stencil));
    let far = a.iter().zip(&b).map(|(a, b)| {
        let turn = a.direction - b.direction;
        let contact = a.direction * a.half_length - b.direction * b.half_length;
        turn.dot(turn).sqrt().max(contact.dot(contact).sqrt() / stencil.yarn_radius)
    });
    // A NaN is infinitely far.
    far.map(|d| if d.is_nan() { f64::INFINITY } else { d }).fold(0.0, f64::max)
}

/// Whether the branch goes unbroken through the cell above a node: all edges of its simplices.
fn cell_is_whole(subject: Subject, grid: &Grid, node: usize, optima: &[Optimum]) -> bool {
    let low = grid.offset(node);
    if grid.node(low.map(|o| o + 1)).is_none() {
        // No cell: the node is at the upper border.
        return true;
    }
    // Cells of negative shear are mirrored.
    let turned = if low[1] < 0 { 0b010 } else { 0 };
    let corner = |c: usize| std::array::from_fn(|a| low[a] + ((c ^ turned) >> a & 1) as i32);
    let at = |c: usize| &optima[grid.node(corner(c)).unwrap_or(node)];
    (0..8).all(|a| at(a).sound)
        && (0..8).all(|a| {
            // Edges go from a corner to those ahead of it in every axis in which they differ.
            (a + 1..8).filter(|b| a & b == a).all(|b| {
                apart(at(a), at(b), steps_between(grid, corner(a), corner(b)), subject.stencil) <= BREAK
            })
        })
}

/// What is added to the affine start at a node.
fn blocks(subject: Subject, grid: &Grid, node: usize, optimum: &Optimum) -> Vec<Block<f32>> {
    let stencil = subject.stencil;
    let groups = Table::<f32>::groups_of(stencil.knot_count());
    let mut blocks = vec![Block::default(); groups];
    let offset = grid.offset(node);
    let strains = grid.strains(offset);
    let at_rest = offset == [0; 3];
    for (k, state) in optimum.state.iter().enumerate() {
        let affine = |strains: [f64; 3]| {
            let d = stencil.knot_direction[k] * stencil.knot_half_length[k];
            mapped(deformation(strains), DVec2::new(d.u, d.v))
        };
        let v = affine(strains);
        let length = v.dot(v).sqrt();
        let d = v * (1.0 / length);
        // The turn by Cayley's map is 2 tan(angle / 2).
        let (sin, cos) = (d.turned().dot(state.direction), d.dot(state.direction));
        let turn = 2.0 * sin / (1.0 + cos).max(1e-3);
        let stretch = 1.0 + turn * turn / 4.0;
        let mut rows = [[turn, state.half_length - length], [0.0; 2], [0.0; 2], [0.0; 2]];
        if at_rest {
            // Nothing but rounding: a face at rest is to stay there.
            rows[0] = [0.0; 2];
        }
        let half_step = 0.5 / f64::from(grid.density);
        for a in 0..3 {
            let side = |sign: f64| {
                let mut at = strains;
                at[a] += sign * DIFFERENCE;
                affine(at)
            };
            let dv = (side(1.0) - side(-1.0)) * (0.5 / DIFFERENCE);
            let turning = optimum.slopes[2 * k][a] - d.turned().dot(dv) / length;
            let lengthening = optimum.slopes[2 * k + 1][a] - d.dot(dv);
            rows[1 + a] = [half_step * stretch * turning, half_step * lengthening];
        }
        for (target, row) in blocks[2 * k / GROUP].0.iter_mut().zip(rows) {
            for (i, value) in row.into_iter().enumerate() {
                target[2 * k % GROUP + i] = value as f32;
            }
        }
    }
    blocks
}

fn mapped([f11, f12, f22]: [f64; 3], v: DVec2) -> V2<f64> {
    V2::new(f11 * v.x + f12 * v.y, f22 * v.y)
}

/// The template's own polygon, to be deformed.
struct Face<'a> {
    subject: Subject<'a>,
    /// `[point]` places at rest relative to the first corner; only those of interpolated points are used.
    points: Vec<DVec2>,
    /// `[knot]` the same of centres.
    centers: Vec<DVec2>,
}

impl<'a> Face<'a> {
    fn new(subject: Subject<'a>) -> Self {
        let n = subject.stencil.corner_count;
        let first = subject.corners[0];
        let blend = |weights: &[f64]| -> Vec<DVec2> {
            let place = |w: &[f64]| w.iter().zip(subject.corners).map(|(w, c)| *w * (*c - first)).sum();
            weights.chunks_exact(n).map(place).collect()
        };
        Self {
            subject,
            points: blend(&subject.stencil.weights),
            centers: blend(&subject.stencil.knot_weights),
        }
    }

    /// Deforms it.
    fn put(&self, points: &mut Points<f64>, strains: [f64; 3]) {
        let f = deformation(strains);
        for (target, rest) in points.plane.iter_mut().zip(&self.points) {
            *target = mapped(f, *rest);
        }
        for (target, rest) in points.centers.iter_mut().zip(&self.centers) {
            *target = mapped(f, *rest);
        }
        if self.subject.beta != 1.0 {
            space_knots(self.subject.stencil, self.subject.beta, &mut points.centers);
        }
    }

    /// The optimum to which a start leads, and how it moves with the strains: with the gradient g of E and its
    /// Hessian H, H dTheta = -dg along the branch.
    fn solve(&self, work: &mut Solve<f64>, strains: [f64; 3], start: &[KnotState<f64>]) -> Optimum {
        let Subject { stencil, weights, .. } = self.subject;
        work.fit(stencil);
        self.put(&mut work.points, strains);
        work.state.copy_from_slice(start);
        let outcome = work.run(stencil, &weights, Solver::Safeguarded, STEPS, DAMPING, true);
        let state = work.state.clone();
        let points = &mut work.points;
        let n = 2 * state.len();
        let (mut a, mut c, mut b) = (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n]);
        points.assemble(stencil, &weights, &state, (&mut a, Some(&mut c), &mut b));
        // A half-length at its bound stays there.
        let bound = stencil.yarn_radius * 0.5;
        let frozen: Vec<bool> =
            (0..n).map(|i| i % 2 == 1 && state[i / 2].half_length <= bound && b[i] > 0.0).collect();
        let mut factored = vec![0.0; n * n];
        let positive = factor::factorise(&a, &c, true, 0.0, &frozen, &mut factored);
        let mut slopes = vec![[0.0; 3]; n];
        let mut sides = [vec![0.0; n], vec![0.0; n]];
        for axis in 0..3 {
            for (side, sign) in sides.iter_mut().zip([1.0, -1.0]) {
                let mut at = strains;
                at[axis] += sign * DIFFERENCE;
                self.put(points, at);
                points.place(stencil, &state);
                points.assemble(stencil, &weights, &state, (&mut a, None, &mut side[..]));
            }
            let change: Vec<f64> =
                sides[0].iter().zip(&sides[1]).map(|(p, m)| (p - m) * (0.5 / DIFFERENCE)).collect();
            factor::solve(&factored, &change, &mut b);
            for i in 0..n {
                slopes[i][axis] = if frozen[i] { 0.0 } else { b[i] };
            }
        }
        let ended = outcome.at_rest || outcome.converged || outcome.steps < f64::from(STEPS);
        Optimum { state, slopes, energy: outcome.end, sound: positive && ended }
    }
}
