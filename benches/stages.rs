//! The stages of a stitch's work on a plain knit, and whole frames, lanes by lanes:
//! `cargo bench --bench stages [-- NAME]`.

use divan::{Bencher, black_box};
use glam::{DVec2, DVec3};
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Precision, Running, Skip};
use knotmesh::io::smobj;
use knotmesh::knot::energy::Points;
use knotmesh::knot::frame::{Frame, blend, face_frame};
use knotmesh::knot::lift::{interpolate, seat};
use knotmesh::knot::{Given, Kernel, KnotState, Settings, Solver, Start, Weights, Workspace, factor, start};
use knotmesh::math::{Scalar, V3, Width};
use knotmesh::scene::{Mode, Role, Scene, SceneOptions, Stencil};
use knotmesh::template::{Coordinates, Template, TemplateLibrary};
use std::sync::Arc;
use tube::Vertices;

#[path = "../examples/tube/mod.rs"]
#[allow(dead_code)]
mod tube;

fn main() {
    divan::main();
}

/// A knit under a mild deformation, at its affine start.
struct Face<T> {
    stencil: Stencil<T>,
    corners: Vec<V3<T>>,
    normals: Vec<V3<T>>,
    frame: Frame<T>,
    points: Points<T>,
    state: Vec<KnotState<T>>,
    weights: Weights<T>,
}

fn knit() -> (Template, Stencil<f64>) {
    let library = TemplateLibrary::embedded();
    let template = library.by_key("knit+ -lX +yX +lX -yX").expect("it is there").clone();
    let stencil = Stencil::new(&template, Mode::Relax, Coordinates::MeanValue);
    (template, stencil)
}

/// Corners relative to the first.
fn corners<T: Scalar>(template: &Template) -> Vec<V3<T>> {
    let deformed = |c: &DVec2| {
        let p = *c - template.corners[0];
        V3::of(DVec3::new(1.15 * p.x + 0.1 * p.y, 0.95 * p.y, 0.05 * p.x * p.y))
    };
    template.corners.iter().map(deformed).collect()
}

impl<T: Scalar> Face<T> {
    fn new() -> Self {
        let (template, stencil) = knit();
        let stencil = stencil.cast();
        let corners = corners::<T>(&template);
        let normals = vec![V3::new(T::of(0.1), T::zero(), T::one()); corners.len()];
        let (frame, _) = face_frame(&stencil.frame_gradients, &corners);
        let mut face = Self {
            points: Points::default(),
            state: vec![KnotState::default(); stencil.knot_count()],
            weights: Weights { angle: T::one(), length: T::of(10.0) },
            stencil,
            corners,
            normals,
            frame,
        };
        face.points.fit(&face.stencil);
        let n = face.stencil.corner_count;
        for i in 0..face.stencil.points.len() {
            let weights = &face.stencil.weights[i * n..(i + 1) * n];
            face.points.plane[i] = face.frame.plane(blend(weights, &face.corners));
        }
        for k in 0..face.stencil.knot_count() {
            let seat = seat(&face.stencil, &face.frame, &face.corners, &face.normals, k);
            face.points.centers[k] = seat.center;
        }
        start::affine(&face.stencil, &face.frame, &mut face.state);
        face.points.place(&face.stencil, &face.state);
        face
    }

    fn unknowns(&self) -> usize {
        2 * self.stencil.knot_count()
    }
}

#[divan::bench(types = [f32, f64])]
fn a_frame<T: Scalar>(bencher: Bencher) {
    let face = Face::<T>::new();
    bencher.bench_local(|| face_frame(black_box(&face.stencil.frame_gradients), black_box(&face.corners)));
}

#[divan::bench(types = [f32, f64])]
fn b_affine_start<T: Scalar>(bencher: Bencher) {
    let face = Face::<T>::new();
    let mut state = face.state.clone();
    bencher.bench_local(|| start::affine(black_box(&face.stencil), &face.frame, black_box(&mut state)));
}

#[divan::bench(types = [f32, f64])]
fn c_place<T: Scalar>(bencher: Bencher) {
    let mut face = Face::<T>::new();
    bencher.bench_local(|| face.points.place(black_box(&face.stencil), black_box(&face.state)));
}

#[divan::bench(types = [f32, f64])]
fn d_energy<T: Scalar>(bencher: Bencher) {
    let mut face = Face::<T>::new();
    bencher
        .bench_local(|| face.points.energy(black_box(&face.stencil), black_box(&face.weights), &face.state));
}

#[divan::bench(types = [f32, f64])]
fn e_assemble<T: Scalar>(bencher: Bencher) {
    let mut face = Face::<T>::new();
    let n = face.unknowns();
    let (mut a, mut b) = (vec![T::zero(); n * n], vec![T::zero(); n]);
    bencher.bench_local(|| {
        let (stencil, weights, state) = (black_box(&face.stencil), &face.weights, &face.state);
        face.points.assemble(stencil, weights, state, (black_box(&mut a), None, black_box(&mut b)))
    });
}

#[divan::bench(types = [f32, f64])]
fn f_assemble_curved<T: Scalar>(bencher: Bencher) {
    let mut face = Face::<T>::new();
    let n = face.unknowns();
    let (mut a, mut b) = (vec![T::zero(); n * n], vec![T::zero(); n]);
    let mut c = a.clone();
    bencher.bench_local(|| {
        let (stencil, weights, state) = (black_box(&face.stencil), &face.weights, &face.state);
        let (a, b, c) = (black_box(&mut a), black_box(&mut b), black_box(&mut c));
        face.points.assemble(stencil, weights, state, (a, Some(c), b))
    });
}

#[divan::bench(types = [f32, f64])]
fn g_factorise_and_solve<T: Scalar>(bencher: Bencher) {
    let mut face = Face::<T>::new();
    let n = face.unknowns();
    let (mut a, mut b) = (vec![T::zero(); n * n], vec![T::zero(); n]);
    face.points.assemble(&face.stencil, &face.weights, &face.state, (&mut a, None, &mut b));
    let frozen = vec![T::mask(false); n];
    let (mut factors, mut x) = (a.clone(), b.clone());
    bencher.bench_local(|| {
        factor::factorise(black_box(&a), &a, T::mask(false), T::of(0.1), &frozen, &mut factors);
        factor::solve(&factors, black_box(&b), black_box(&mut x));
    });
}

#[divan::bench(types = [f32, f64])]
fn h_lift<T: Scalar>(bencher: Bencher) {
    let face = Face::<T>::new();
    let mut lifted = vec![V3::<T>::zero(); face.stencil.points.len()];
    let n = face.stencil.corner_count;
    bencher.bench_local(|| {
        let (stencil, frame) = (black_box(&face.stencil), &face.frame);
        let seat = |k| seat(stencil, frame, &face.corners, &face.normals, k);
        let seats = [seat(0), seat(1)];
        for (i, p) in stencil.points.iter().enumerate() {
            lifted[i] = match p.role {
                Role::Contact | Role::Control => {
                    seats[p.knot as usize].lift(frame, face.points.plane[i], p.z)
                }
                _ => {
                    let weights = &stencil.weights[i * n..(i + 1) * n];
                    interpolate(weights, blend(weights, &face.corners), &face.normals, p.z)
                }
            };
        }
        black_box(&mut lifted);
    });
}

/// One face from corners to points.
fn run<T: Precision>(bencher: Bencher, mode: Mode, solver: Solver, iterations: u32) {
    let (template, stencil) = knit();
    let settings = Settings { solver, iterations, ..Settings::default() };
    let kernel = Kernel::<T>::new(&stencil, mode, &settings);
    let mut work = Workspace::default();
    kernel.fit(&mut work);
    work.corners.copy_from_slice(&corners(&template));
    work.normals.fill(V3::new(T::of(0.1), T::zero(), T::one()));
    bencher.bench_local(|| T::face(&kernel, black_box(&mut work), Given::nothing()));
}

#[divan::bench(types = [f32, f64])]
fn i_kernel_knots<T: Precision>(bencher: Bencher) {
    run::<T>(bencher, Mode::Knots, Solver::Safeguarded, 0);
}

#[divan::bench(types = [f32, f64], args = [1, 3, 10])]
fn j_kernel_gauss_newton<T: Precision>(bencher: Bencher, iterations: u32) {
    run::<T>(bencher, Mode::Relax, Solver::GaussNewton, iterations);
}

#[divan::bench(types = [f32, f64], args = [1, 3, 10])]
fn k_kernel_safeguarded<T: Precision>(bencher: Bencher, iterations: u32) {
    run::<T>(bencher, Mode::Relax, Solver::Safeguarded, iterations);
}

/// A stretched tube of so many stitches, all of them solved, on one thread.
fn frame<T: Precision>(
    bencher: Bencher,
    (stitches, vertices): (usize, Vertices),
    settings: &Settings,
    width: Width,
) {
    let text = tube::smobj(stitches, vertices);
    let mesh = smobj::read("tube.smobj".as_ref(), text.as_bytes()).expect("a mesh");
    let library = TemplateLibrary::embedded();
    let scene = Arc::new(Scene::compile(&mesh, &library, SceneOptions::default()).expect("compiles"));
    let positions: Vec<DVec3> = mesh.positions.iter().map(|p| *p * DVec3::new(0.95, 0.95, 1.2)).collect();
    let running = Running { threads: 1, skip: Skip::NOTHING, energies: false, width };
    let mut backend = CpuBackend::<T>::new(scene, settings, &running).expect("in range");
    let mut output = FrameOutput::default();
    backend.frame(&positions, &mut output).expect("finite");
    bencher.bench_local(|| backend.frame(black_box(&positions), &mut output));
}

#[divan::bench(types = [f32, f64], args = [1_000, 22_800], sample_count = 20, sample_size = 1)]
fn l_backend_frame<T: Precision>(bencher: Bencher, stitches: usize) {
    frame::<T>(bencher, (stitches, Vertices::Shared), &Settings::default(), Width::Auto);
}

#[divan::bench(args = [1_000, 22_800], sample_count = 20, sample_size = 1)]
fn m_backend_frame_own_vertices(bencher: Bencher, stitches: usize) {
    frame::<f32>(bencher, (stitches, Vertices::Own), &Settings::default(), Width::Auto);
}

#[divan::bench(args = [Width::One, Width::Eight, Width::Sixteen], consts = [0, 1, 3], sample_count = 20, sample_size = 1)]
fn n_gauss_newton_by_lanes<const STEPS: u32>(bencher: Bencher, width: Width) {
    let settings = Settings { solver: Solver::GaussNewton, iterations: STEPS, ..Settings::default() };
    frame::<f32>(bencher, (22_800, Vertices::Shared), &settings, width);
}

#[divan::bench(args = [Width::One, Width::Eight, Width::Sixteen], consts = [0, 1, 2], sample_count = 20, sample_size = 1)]
fn o_table_by_lanes<const STEPS: u32>(bencher: Bencher, width: Width) {
    let settings = Settings { start: Start::Table, iterations: STEPS, ..Settings::default() };
    frame::<f32>(bencher, (22_800, Vertices::Shared), &settings, width);
}
