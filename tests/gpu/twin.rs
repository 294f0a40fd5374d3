//! The stages of a stitch on the CPU, one by one, in the order in which `knotmesh::backend::gpu::trace` names them.

use knotmesh::backend::Precision;
use knotmesh::knot::energy::{Points, Weights};
use knotmesh::knot::frame::{Frame, blend, face_frame, space_knots};
use knotmesh::knot::lift::{interpolate, seat};
use knotmesh::knot::{Given, Kernel, KnotState, Solver, Workspace, factor, solve, start};
use knotmesh::math::{Real, V2, V3};
use knotmesh::scene::{Batch, Role, Scene};

/// An earlier state is no start beyond this (`knot::LEAP`).
const LEAP: f32 = 8.0;

/// Earlier states, and whether they are of the frame before.
pub type Earlier<'a> = Option<(&'a [KnotState<f32>], bool)>;

/// What a stage comes to, by name; stages that a face does not reach are left out.
pub type Stages = Vec<(&'static str, Vec<f32>)>;

/// A face as the kernels see it.
pub struct Face {
    corners: Vec<V3<f32>>,
    normals: Vec<V3<f32>>,
    /// Whether all corners are finite.
    whole: bool,
}

impl Face {
    /// From the places, areas and normals of a frame.
    pub fn load(scene: &Scene, batch: &Batch, index: usize, surface: &[V3<f32>]) -> Self {
        let n = scene.stencils[batch.stencil].corner_count;
        let vertices = &batch.corners[index * n..(index + 1) * n];
        let areas = scene.vertex_count;
        let normal = |vertex: u32| match &scene.corner_groups {
            Some(groups) => {
                surface[areas + scene.face_places.len() + groups.of_vertex[vertex as usize] as usize]
            }
            None => surface[areas + batch.faces[index].index()],
        };
        let mut corners: Vec<_> = vertices.iter().map(|v| surface[*v as usize]).collect();
        let finite: Vec<_> = corners.iter().copied().filter(|c| c.finite()).collect();
        let whole = finite.len() == n;
        // Corners that are not finite stand at the mean of the others.
        let share = 1.0 / finite.len().max(1) as f32;
        let middle = finite.iter().fold(V3::zero(), |sum, c| sum + *c * share);
        corners.iter_mut().filter(|c| !c.finite()).for_each(|c| *c = middle);
        let first = corners[0];
        corners.iter_mut().for_each(|c| *c = *c - first);
        Self { corners, normals: vertices.iter().map(|v| normal(*v)).collect(), whole }
    }
}

fn pairs(vectors: &[V2<f32>]) -> Vec<f32> {
    vectors.iter().flat_map(|p| [p.u, p.v]).collect()
}

fn triples(vectors: &[V3<f32>]) -> Vec<f32> {
    vectors.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
}

fn knots(state: &[KnotState<f32>]) -> Vec<f32> {
    state.iter().flat_map(|k| [k.direction.u, k.direction.v, k.half_length]).collect()
}

/// All stages of a face.
pub fn stages(kernel: &Kernel<f32>, face: &Face, earlier: Earlier) -> Stages {
    let stencil = &kernel.stencil;
    let n = stencil.corner_count;
    let mut stages = Stages::new();
    let (frame, usable) = face_frame(&stencil.frame_gradients, &face.corners);
    if usable && face.whole {
        framed(kernel, face, &frame, earlier, &mut stages);
    }

    let mut work = Workspace::default();
    kernel.fit(&mut work);
    work.corners.copy_from_slice(&face.corners);
    work.normals.copy_from_slice(&face.normals);
    let mut given = Given::nothing();
    if let Some((earlier, near)) = earlier {
        work.state.copy_from_slice(earlier);
        (given.start, given.near) = (true, near);
    }
    let ended = f32::face(kernel, &mut work, given);
    if face.whole && ended.sound {
        stages.push(("knots", knots(&work.state)));
        stages.push(("points", triples(&work.points)));
    } else {
        let point = |(i, p): (usize, &knotmesh::scene::StencilPoint<f32>)| {
            let weights = &stencil.weights[i * n..(i + 1) * n];
            interpolate(weights, blend(weights, &face.corners), &face.normals, p.z)
        };
        let points: Vec<_> = stencil.points.iter().enumerate().map(point).collect();
        stages.push(("points", triples(&points)));
    }
    stages
}

/// Those of a face that has a frame, up to the first step.
fn framed(kernel: &Kernel<f32>, face: &Face, frame: &Frame<f32>, earlier: Earlier, stages: &mut Stages) {
    let stencil = &kernel.stencil;
    let n = stencil.corner_count;
    let mut words = triples(&[frame.t1, frame.t2, frame.n]);
    words.extend([frame.f11, frame.f12, frame.f22]);
    stages.push(("frame", words));

    let seat = |k| seat(stencil, frame, &face.corners, &face.normals, k);
    let seats: Vec<_> = (0..stencil.knot_count()).map(seat).collect();
    let mut points = Points::default();
    points.fit(stencil);
    points.centers = seats.iter().map(|s| s.center).collect();
    if let Some(beta) = kernel.beta() {
        space_knots(stencil, beta, &mut points.centers);
    }
    let words = seats
        .iter()
        .zip(&points.centers)
        .flat_map(|(s, c)| [c.u, c.v, s.height, s.slope.u, s.slope.v, s.normal.x, s.normal.y, s.normal.z]);
    stages.push(("seats", words.collect()));

    let mut state = vec![KnotState::default(); stencil.knot_count()];
    let mut damping = 0.0;
    if kernel.solves() {
        damping = begin(kernel, frame, earlier, &mut state);
    } else {
        start::rigid(stencil, &mut state);
    }
    stages.push(("start", knots(&state)));
    if !kernel.solves() || kernel.iterations() == 0 {
        return;
    }

    for (i, p) in stencil.points.iter().enumerate() {
        if matches!(p.role, Role::Boundary | Role::Free) {
            let weights = &stencil.weights[i * n..(i + 1) * n];
            points.plane[i] = frame.plane(blend(weights, &face.corners));
        }
    }
    first_step(kernel, &mut points, &mut state, damping, stages);
}

/// The solve's start; gives the damping of the first step.
fn begin(kernel: &Kernel<f32>, frame: &Frame<f32>, earlier: Earlier, state: &mut [KnotState<f32>]) -> f32 {
    start::affine(&kernel.stencil, frame, state);
    let mut damping = solve::DAMPING;
    if let Some(table) = kernel.table() {
        table.correct(frame, state);
        damping = solve::DAMPING_TABLE;
    }
    if let Some((earlier, near)) = earlier {
        let known = state.iter().zip(earlier).all(|(state, earlier)| {
            let (l, before) = (state.half_length, earlier.half_length);
            0.0 < before && (!near || l < before * LEAP && before < l * LEAP)
        });
        if known {
            state.copy_from_slice(earlier);
            damping = solve::DAMPING_PREVIOUS;
        }
    }
    damping as f32
}

/// From the points at the start to the first step.
fn first_step(
    kernel: &Kernel<f32>,
    points: &mut Points<f32>,
    state: &mut [KnotState<f32>],
    damping: f32,
    stages: &mut Stages,
) {
    let stencil = &kernel.stencil;
    let safe = kernel.solver() == Solver::Safeguarded;
    let shortest = stencil.yarn_radius * 0.5;
    if safe {
        state.iter_mut().for_each(|k| k.half_length = k.half_length.max(shortest));
    }
    points.place(stencil, state);
    stages.push(("plane", pairs(&points.plane)));
    let n = 2 * state.len();
    let (mut a, mut b) = (vec![0.0; n * n], vec![0.0; n]);
    let mut c = a.clone();
    let weights: Weights<f32> = kernel.weights();
    let energy =
        points.assemble(stencil, &weights, state, (&mut a, if safe { Some(&mut c) } else { None }, &mut b));
    stages.push(("energy", vec![energy]));
    let mut words = Vec::new();
    for i in 0..n {
        words.push(b[i]);
        (0..=i).for_each(|j| words.extend([a[i * n + j], c[i * n + j]]));
    }
    stages.push(("normal_equations", words));
    if safe && energy <= f32::REST_ENERGY as f32 {
        return;
    }

    let mut frozen = vec![false; n];
    if safe {
        for (k, knot) in state.iter().enumerate() {
            frozen[2 * k + 1] = knot.half_length <= shortest && 0.0 < b[2 * k + 1];
        }
    }
    let mu = if safe { damping } else { 0.0 };
    let (mut factors, mut step) = (vec![0.0; n * n], vec![0.0; n]);
    if !factor::factorise(&a, &c, safe, mu, &frozen, &mut factors) && safe {
        factor::factorise(&a, &c, false, mu, &frozen, &mut factors);
    }
    factor::solve(&factors, &b, &mut step);
    let mut words = Vec::new();
    for i in 0..n {
        words.push(step[i]);
        words.extend(&factors[i * n..=i * n + i]);
    }
    stages.push(("step", words));
}
