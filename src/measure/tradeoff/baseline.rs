//! A general-purpose baseline: each stitch solved by the `levenberg-marquardt` crate (MINPACK's algorithm) on
//! nalgebra, in f64, as somebody without these kernels would write it. The energy is model section 4, with
//! an analytic Jacobian; unknowns are (theta, l) of each knot, free of bounds; the start is the affine one. Of
//! the compiled scene it takes the templates' numbers and nothing that computes.

use super::face_geometry::{Axes, Face, Seat};
use super::layout::gather;
use crate::backend::FrameOutput;
use crate::knot::{FaceResult, KnotState, Settings, Status};
use crate::math::{V2, V3};
use crate::scene::{Batch, Role, Scene, Stencil};
use crate::{Error, Result};
use glam::DVec3;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned, Vector2, Vector3};
use std::sync::Arc;

/// The numbers of a template.
#[derive(Debug)]
pub(super) struct Stitch {
    points: Vec<Point>,
    /// First point and rest length of each segment.
    segments: Vec<(usize, f64)>,
    /// First of three points and cosine at rest of each bend.
    bends: Vec<(usize, f64)>,
    pub knots: Vec<Knot>,
    pub frame_gradients: Vec<Vector2<f64>>,
    yarn_radius: f64,
    spread: f64,
}

#[derive(Debug)]
struct Point {
    role: Role,
    knot: usize,
    sign: f64,
    z: f64,
    weights: Vec<f64>,
}

#[derive(Debug)]
pub(super) struct Knot {
    /// d0 l0.
    half: Vector2<f64>,
    /// Weights of the centre over the corners, and their gradients.
    pub mapping: (Vec<f64>, Vec<Vector2<f64>>),
}

impl Stitch {
    fn new(stencil: &Stencil<f64>) -> Self {
        let n = stencil.corner_count;
        let vector = |v: &V2<f64>| Vector2::new(v.u, v.v);
        let point = |(i, p): (usize, &crate::scene::StencilPoint<f64>)| Point {
            role: p.role,
            knot: p.knot as usize,
            sign: p.sign,
            z: p.z,
            weights: stencil.weights[i * n..(i + 1) * n].to_vec(),
        };
        let knot = |k: usize| Knot {
            half: vector(&stencil.knot_direction[k]) * stencil.knot_half_length[k],
            mapping: (
                stencil.knot_weights[k * n..(k + 1) * n].to_vec(),
                stencil.knot_gradients[k * n..(k + 1) * n].iter().map(vector).collect(),
            ),
        };
        Self {
            points: stencil.points.iter().enumerate().map(point).collect(),
            segments: stencil.terms.lengths.iter().map(|t| (t.point as usize, t.rest)).collect(),
            bends: stencil.terms.cosines.iter().map(|t| (t.point as usize, t.rest)).collect(),
            knots: (0..stencil.knot_count()).map(knot).collect(),
            frame_gradients: stencil.frame_gradients.iter().map(vector).collect(),
            yarn_radius: stencil.yarn_radius,
            spread: stencil.rest_spread,
        }
    }
}

/// The least-squares problem of one stitch.
struct Problem<'a> {
    stitch: &'a Stitch,
    centers: Vec<Vector2<f64>>,
    /// sqrt(w_length) and sqrt(w_angle).
    weights: [f64; 2],
    /// theta and l of each knot.
    unknowns: DVector<f64>,
    /// Points in the face plane, z the template's.
    points: Vec<Vector3<f64>>,
}

impl Problem<'_> {
    /// Puts contacts and controls where the unknowns say.
    fn place(&mut self) {
        for (point, at) in self.stitch.points.iter().zip(&mut self.points) {
            let (theta, l) = match point.role {
                Role::Contact | Role::Control => {
                    (self.unknowns[2 * point.knot], self.unknowns[2 * point.knot + 1])
                }
                _ => continue,
            };
            let (sin, cos) = theta.sin_cos();
            let offset = match point.role {
                Role::Contact => Vector2::new(cos, sin) * l,
                _ => Vector2::new(sin, -cos) * self.stitch.yarn_radius,
            };
            let place = self.centers[point.knot] + offset * point.sign;
            *at = Vector3::new(place.x, place.y, point.z);
        }
    }

    /// How a point moves with its knot's theta and l.
    fn moves(&self, i: usize) -> Option<(usize, [Vector3<f64>; 2])> {
        let point = &self.stitch.points[i];
        let k = point.knot;
        let theta = || self.unknowns[2 * k].sin_cos();
        match point.role {
            Role::Boundary | Role::Free => None,
            Role::Contact => {
                let ((sin, cos), l) = (theta(), self.unknowns[2 * k + 1]);
                let turn = Vector3::new(-sin, cos, 0.0) * (l * point.sign);
                Some((k, [turn, Vector3::new(cos, sin, 0.0) * point.sign]))
            }
            Role::Control => {
                let (sin, cos) = theta();
                let turn = Vector3::new(cos, sin, 0.0) * (self.stitch.yarn_radius * point.sign);
                Some((k, [turn, Vector3::zeros()]))
            }
        }
    }

    fn cosine(&self, i: usize) -> f64 {
        let (e, f) = (self.points[i + 1] - self.points[i], self.points[i + 2] - self.points[i + 1]);
        let lengths = e.norm() * f.norm();
        if lengths > 0.0 { e.dot(&f) / lengths } else { 0.0 }
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, unknowns: &DVector<f64>) {
        self.unknowns.copy_from(unknowns);
        self.place();
    }

    fn params(&self) -> DVector<f64> {
        self.unknowns.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let [length, angle] = self.weights;
        let segments = self.stitch.segments.iter();
        let segments =
            segments.map(|(i, rest)| length * ((self.points[i + 1] - self.points[*i]).norm() - rest));
        let bends = self.stitch.bends.iter().map(|(i, rest)| angle * (self.cosine(*i) - rest));
        let count = self.stitch.segments.len() + self.stitch.bends.len();
        Some(DVector::from_iterator(count, segments.chain(bends)))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let [length, angle] = self.weights;
        let segments = self.stitch.segments.len();
        let mut jacobian = DMatrix::zeros(segments + self.stitch.bends.len(), self.unknowns.len());
        let mut add = |row: usize, point: usize, gradient: Vector3<f64>| {
            if let Some((k, [turn, lengthen])) = self.moves(point) {
                jacobian[(row, 2 * k)] += gradient.dot(&turn);
                jacobian[(row, 2 * k + 1)] += gradient.dot(&lengthen);
            }
        };
        let unit = |e: Vector3<f64>| e.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        for (row, (i, _)) in self.stitch.segments.iter().enumerate() {
            let along = unit(self.points[i + 1] - self.points[*i]) * length;
            add(row, *i, -along);
            add(row, i + 1, along);
        }
        for (row, (i, _)) in self.stitch.bends.iter().enumerate() {
            let (e, f) = (self.points[i + 1] - self.points[*i], self.points[i + 2] - self.points[i + 1]);
            if e.norm() == 0.0 || f.norm() == 0.0 {
                continue;
            }
            let (u, v) = (unit(e), unit(f));
            let cosine = u.dot(&v);
            let by_e = (v - u * cosine) * (angle / e.norm());
            let by_f = (u - v * cosine) * (angle / f.norm());
            add(segments + row, *i, -by_e);
            add(segments + row, i + 1, by_e - by_f);
            add(segments + row, i + 2, by_f);
        }
        Some(jacobian)
    }
}

/// Runs a scene's frames stitch by stitch.
#[derive(Debug)]
pub struct Baseline {
    scene: Arc<Scene>,
    stitches: Vec<Stitch>,
    solver: LevenbergMarquardt<f64>,
    weights: [f64; 2],
    beta: f64,
    slots: Vec<V3<f64>>,
}

impl Baseline {
    /// For a scene of mode `relax`, with the weights and the knot spacing of `settings`; `tolerance` as in
    /// [`super::variants::Engine::LevenbergMarquardt`].
    pub fn new(scene: Arc<Scene>, settings: &Settings, tolerance: Option<f64>) -> Self {
        let solver = LevenbergMarquardt::new();
        Self {
            stitches: scene.stencils.iter().map(Stitch::new).collect(),
            solver: tolerance.map_or(solver, |tolerance| solver.with_tol(tolerance)),
            weights: [settings.weight_length.sqrt(), settings.weight_angle.sqrt()],
            beta: settings.beta,
            slots: vec![V3::zero(); scene.slot_count],
            scene,
        }
    }

    /// Solves one frame, as [`crate::backend::Backend::frame`] does.
    ///
    /// # Errors
    /// Another number of positions than the scene has vertices.
    pub fn frame(&mut self, positions: &[DVec3], output: &mut FrameOutput<f64>) -> Result<()> {
        let scene = self.scene.clone();
        if positions.len() != scene.vertex_count {
            return Err(Error::invalid(format_args!(
                "a frame of {} positions, expected {} as the mesh has vertices",
                positions.len(),
                scene.vertex_count
            )));
        }
        output.origin = positions.first().copied().unwrap_or(DVec3::ZERO);
        output.gauge = scene.gauge;
        output.knots.resize(scene.knot_count, KnotState::default());
        let none = FaceResult { energy_start: 0.0, energy: 0.0, status: Status::Interpolated };
        output.faces.resize(scene.face_count, none);
        let normals = corner_normals(&scene, positions);
        for batch in &scene.batches {
            let stitch = &self.stitches[batch.stencil];
            for i in 0..batch.faces.len() {
                let (face, first) = face_of(&scene, batch, i, positions, &normals);
                let first = (first - output.origin) / scene.gauge;
                let begin = batch.first_slot + i * stitch.points.len();
                let slots = &mut self.slots[begin..begin + stitch.points.len()];
                let begin = batch.first_knot + i * stitch.knots.len();
                let knots = &mut output.knots[begin..begin + stitch.knots.len()];
                let (result, points) = solve(stitch, &face, &self.solver, self.weights, self.beta, knots);
                output.faces[batch.first_face + i] = result;
                for (slot, point) in slots.iter_mut().zip(points) {
                    *slot = V3::of(DVec3::new(point.x, point.y, point.z) + first);
                }
            }
        }
        gather(&scene, &self.slots, &mut output.points);
        Ok(())
    }
}

/// Solves one stitch: its points relative to the face's first corner, template units.
fn solve(
    stitch: &Stitch,
    face: &Face,
    solver: &LevenbergMarquardt<f64>,
    weights: [f64; 2],
    beta: f64,
    knots: &mut [KnotState<f64>],
) -> (FaceResult<f64>, Vec<Vector3<f64>>) {
    let mut lifted: Vec<_> = stitch.points.iter().map(|p| face.raised(&p.weights, p.z)).collect();
    let Some(axes) = face.axes(stitch) else {
        knots.fill(KnotState::default());
        return (FaceResult { energy_start: 0.0, energy: 0.0, status: Status::FellBack }, lifted);
    };
    let seats: Vec<Seat> = (0..stitch.knots.len()).map(|k| face.seat(stitch, &axes, k)).collect();
    let plane = |p: &Point| {
        let place = axes.plane(&face.at(&p.weights));
        Vector3::new(place.x, place.y, p.z)
    };
    let mut problem = Problem {
        stitch,
        centers: spaced(&seats, beta, stitch.spread),
        weights,
        unknowns: start(stitch, &axes),
        points: stitch.points.iter().map(plane).collect(),
    };
    problem.place();
    let energy = |problem: &Problem| problem.residuals().map_or(0.0, |r| r.norm_squared());
    let energy_start = energy(&problem);
    let mut status = Status::Interpolated;
    if !knots.is_empty() {
        let (solved, report) = solver.minimize(problem);
        problem = solved;
        status = if report.termination.was_successful() { Status::Converged } else { Status::Stepped };
    }
    for (k, state) in knots.iter_mut().enumerate() {
        let (sin, cos) = problem.unknowns[2 * k].sin_cos();
        *state = KnotState { direction: V2::new(cos, sin), half_length: problem.unknowns[2 * k + 1] };
    }
    for ((point, at), lifted) in stitch.points.iter().zip(&problem.points).zip(&mut lifted) {
        if matches!(point.role, Role::Contact | Role::Control) {
            *lifted = seats[point.knot].lift(&axes, at);
        }
    }
    (FaceResult { energy_start, energy: energy(&problem), status }, lifted)
}

/// The affine start: theta and l of F d0 l0.
fn start(stitch: &Stitch, axes: &Axes) -> DVector<f64> {
    let half = stitch.knots.iter().map(|k| axes.stretch * k.half);
    DVector::from_iterator(2 * stitch.knots.len(), half.flat_map(|v| [v.y.atan2(v.x), v.norm()]))
}

/// Knot centres, drawn towards or away from their mean (model section 3, knot spacing).
fn spaced(seats: &[Seat], beta: f64, rest: f64) -> Vec<Vector2<f64>> {
    let n = seats.len().max(1) as f64;
    let mean: Vector2<f64> = seats.iter().map(|s| s.center).sum::<Vector2<f64>>() / n;
    let spread = (seats.iter().map(|s| (s.center - mean).norm_squared()).sum::<f64>() / n).sqrt();
    let scale = if spread > 0.0 { (rest + beta * (spread - rest)) / spread } else { 1.0 };
    seats.iter().map(|s| mean + (s.center - mean) * scale).collect()
}

/// `[group]` sums of the vector areas around the corners, or `[face]` areas where corners are not joined.
fn corner_normals(scene: &Scene, positions: &[DVec3]) -> Vec<DVec3> {
    let area = |face: usize| {
        let range = scene.face_offsets[face] as usize..scene.face_offsets[face + 1] as usize;
        let at = |v: &u32| {
            (positions[*v as usize] - positions[scene.face_vertices[range.start] as usize]) / scene.gauge
        };
        let corners = &scene.face_vertices[range.clone()];
        let sum: DVec3 = corners.windows(2).map(|pair| at(&pair[0]).cross(at(&pair[1])) * 0.5).sum();
        sum
    };
    let areas: Vec<DVec3> = (0..scene.face_places.len()).map(area).collect();
    let Some(groups) = &scene.corner_groups else { return areas };
    let around = |g: usize| &groups.faces[groups.offsets[g] as usize..groups.offsets[g + 1] as usize];
    (0..groups.len()).map(|g| around(g).iter().map(|face| areas[*face as usize]).sum()).collect()
}

/// Face `i` of a batch, and its first corner in world units.
fn face_of(scene: &Scene, batch: &Batch, i: usize, positions: &[DVec3], normals: &[DVec3]) -> (Face, DVec3) {
    let n = scene.stencils[batch.stencil].corner_count;
    let corners = &batch.corners[i * n..(i + 1) * n];
    let first = positions[corners[0] as usize];
    let vector = |v: DVec3| Vector3::new(v.x, v.y, v.z);
    let normal = |v: &u32| match &scene.corner_groups {
        Some(groups) => normals[groups.of_vertex[*v as usize] as usize],
        None => normals[batch.faces[i].index()],
    };
    let face = Face {
        corners: corners.iter().map(|v| vector((positions[*v as usize] - first) / scene.gauge)).collect(),
        normals: corners.iter().map(|v| vector(normal(v))).collect(),
    };
    (face, first)
}
