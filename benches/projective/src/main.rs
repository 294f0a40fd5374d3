//! Small steps of XPBD against projective dynamics: error against a converged solution, and time. Projective dynamics twice:
//! with faer's sparse Cholesky factor, and as knotmesh does it (a factor of its own in f32, solved in parallel).
//!
//! A sheet or tube of 22,800 stitches hangs from its top row and swings from 30 degrees (sheet) or is let go (tube) for half a
//! second, undamped. The converged solution is symplectic Euler on `Cloth::forces` with steps of 1/24000 s, far below the limit
//! of stability; that it has converged is shown by the error of one with twice the step. The error is the root mean square
//! distance of nodes from it, after 15 frames of 1/30 s, in stitch widths.
//!
//! Prints CSV: scene, method, substeps a frame, iterations a substep, ms a frame, error.

mod projective;
mod xpbd;

use glam::{DQuat, DVec3};
use knotmesh::cloth::{Cloth, ClothOptions, Sizes, StepOptions, Stepper, Surroundings};
use knotmesh::ids::VertexId;
use knotmesh::mesh::{StitchMesh, StitchType};
use knotmesh::template::TemplateLibrary;
use std::time::Instant;

const COLUMNS: usize = 150;
const ROWS: usize = 152;
const WIDTH: f64 = 0.0045;
const HEIGHT: f64 = WIDTH * 0.61;
const FRAMES: usize = 15;
const DT: f64 = 1.0 / 30.0;
const GRAVITY: DVec3 = DVec3::new(0.0, -9.81, 0.0);

/// Gravity, and a row that is held.
struct Hung(Vec<u32>);

impl Surroundings for Hung {
    fn accelerate(&mut self, _: f64, dt: f64, _: &[DVec3], velocities: &mut [DVec3]) {
        velocities.iter_mut().for_each(|v| *v += GRAVITY * dt);
    }
    fn held(&self) -> &[u32] {
        &self.0
    }
}

/// A welded grid of knits, round or flat, its top row at y = 0.
fn mesh(round: bool) -> StitchMesh {
    let across = if round { COLUMNS } else { COLUMNS + 1 };
    let radius = COLUMNS as f64 * WIDTH / std::f64::consts::TAU;
    let place = |i: usize, k: usize| {
        let y = (k as f64 - ROWS as f64) * HEIGHT;
        let angle = i as f64 / COLUMNS as f64 * std::f64::consts::TAU;
        if round {
            DVec3::new(radius * angle.cos(), y, -radius * angle.sin())
        } else {
            DQuat::from_rotation_x(std::f64::consts::FRAC_PI_6) * DVec3::new(i as f64 * WIDTH, y, 0.0)
        }
    };
    let labels = ["-lX", "+yX", "+lX", "-yX"].map(String::from).to_vec();
    let mut mesh = StitchMesh { face_offsets: vec![0], ..StitchMesh::default() };
    mesh.types.push(StitchType { name: "knit+".into(), labels });
    mesh.positions = (0..=ROWS).flat_map(|k| (0..across).map(move |i| place(i, k))).collect();
    for k in 0..ROWS {
        for i in 0..COLUMNS {
            let at = |di: usize, dk: usize| ((k + dk) * across + (i + di) % across);
            mesh.face_types.push(0.into());
            mesh.face_vertices.extend([at(0, 0), at(1, 0), at(1, 1), at(0, 1)].map(VertexId::from));
            mesh.face_offsets.push(mesh.face_vertices.len() as u32);
        }
    }
    mesh
}

fn main() {
    let options =
        ClothOptions { sizes: Some(Sizes { course: WIDTH, wale: HEIGHT }), ..ClothOptions::default() };
    println!("scene,method,substeps,iterations,ms_per_frame,error_in_stitches");
    for (scene, round) in [("sheet", false), ("tube", true)] {
        let mesh = mesh(round);
        let cloth = Cloth::new(&mesh, &TemplateLibrary::embedded(), &options).expect("a mesh that is fine");
        let start = cloth.rest_positions().to_vec();
        let across = mesh.positions.len() / (ROWS + 1);
        let top = ROWS * across..(ROWS + 1) * across;
        let held: Vec<u32> = top.map(|v| cloth.node_of_vertex()[v]).collect();
        let truth = converged(&cloth, &start, &held, 800);
        let row = |method: &str, substeps: usize, iterations: usize, time: f64, x: &[DVec3]| {
            let sum: f64 = x.iter().zip(&truth).map(|(a, b)| a.distance_squared(*b)).sum();
            let error = (sum / x.len() as f64).sqrt() / WIDTH;
            println!("{scene},{method},{substeps},{iterations},{:.2},{error:.4}", time * 1e3 / FRAMES as f64);
        };
        let began = Instant::now();
        let twice = converged(&cloth, &start, &held, 400);
        row("explicit", 400, 1, began.elapsed().as_secs_f64(), &twice);
        for (substeps, iterations) in [(1, 1), (2, 1), (2, 2), (4, 1), (4, 3), (6, 1), (8, 1), (16, 1)] {
            let step = StepOptions { substeps, iterations, damping: 0.0, ..StepOptions::default() };
            let mut around = Hung(held.clone());
            let mut stepper =
                Stepper::new(cloth.clone(), &start, step, &around).expect("a start that is fine");
            // The first frame factors.
            let began = Instant::now();
            stepper.frame(DT, &mut around);
            eprintln!("{scene}: first frame {:.0} ms", began.elapsed().as_secs_f64() * 1e3);
            let began = Instant::now();
            let cut: u32 = (1..FRAMES).map(|_| stepper.frame(DT, &mut around).cut).sum();
            let time = began.elapsed().as_secs_f64() * FRAMES as f64 / (FRAMES - 1) as f64;
            row(
                if cut == 0 { "knotmesh" } else { "knotmesh (cut)" },
                substeps,
                iterations,
                time,
                stepper.positions(),
            );
        }
        for substeps in [4, 8, 16, 24, 32, 64, 128] {
            let mut method = xpbd::Xpbd::new(&cloth, &start, &held);
            let began = Instant::now();
            for _ in 0..FRAMES * substeps {
                method.step(GRAVITY, DT / substeps as f64);
            }
            row("xpbd", substeps, 1, began.elapsed().as_secs_f64(), &method.x);
        }
        for (substeps, iterations) in [(2, 2), (4, 1), (8, 1)] {
            let mut method = projective::Projective::new(&cloth, &start, &held, DT / substeps as f64);
            let began = Instant::now();
            for _ in 0..FRAMES * substeps {
                method.step(GRAVITY, iterations);
            }
            row("faer", substeps, iterations, began.elapsed().as_secs_f64(), &method.x);
        }
    }
}

/// Symplectic Euler in steps small enough to be stable.
fn converged(cloth: &Cloth, start: &[DVec3], held: &[u32], substeps: usize) -> Vec<DVec3> {
    let h = DT / substeps as f64;
    let mut x = start.to_vec();
    let mut v = vec![DVec3::ZERO; x.len()];
    let mut forces = v.clone();
    for _ in 0..FRAMES * substeps {
        cloth.forces(&x, &mut forces);
        for ((v, f), m) in v.iter_mut().zip(&forces).zip(cloth.masses()) {
            *v += (*f / *m + GRAVITY) * h;
        }
        held.iter().for_each(|n| v[*n as usize] = DVec3::ZERO);
        x.iter_mut().zip(&v).for_each(|(x, v)| *x += *v * h);
    }
    x
}
