//! Cloth: relaxation and frames of a sheet and a tube of 150 x 152 stitches (22,800), as CSV.
//!
//! `cargo bench --bench cloth [-- ROUNDS]`. Relaxation begins from a 2x2 rib shaken by 0.15 of a stitch; frames are those of
//! cloth that hangs from its top row and swings, 4 substeps each, the median of 30; of each the least of the rounds. What motion was
//! chosen over is measured by `cargo run --release --manifest-path benches/projective/Cargo.toml`.

#[path = "../tests/common/grid.rs"]
#[allow(dead_code)]
mod grid;

use glam::DVec3;
use grid::Wrap;
use knotmesh::cloth::{Cloth, ClothOptions, RelaxOptions, Sizes, StepOptions, Stepper, Surroundings, relax};
use knotmesh::measure::machine::heading;
use knotmesh::template::TemplateLibrary;
use std::time::Instant;

const COLUMNS: usize = 150;
const ROWS: usize = 152;
const WIDTH: f64 = 0.0045;

struct Hung(Vec<u32>);

impl Surroundings for Hung {
    fn accelerate(&mut self, _: f64, dt: f64, _: &[DVec3], velocities: &mut [DVec3]) {
        velocities.iter_mut().for_each(|v| *v += DVec3::new(0.0, -9.81, 2.0) * dt);
    }
    fn held(&self) -> &[u32] {
        &self.0
    }
}

fn main() {
    println!("{}", heading("cloth"));
    // Cargo adds flags of its own.
    let rounds = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(3_usize).max(1);
    let library = TemplateLibrary::embedded();
    println!(
        "mesh,threads,relax_s,iterations,rounds,residual,compile_s,first_frame_ms,frame_ms,factor_entries"
    );
    for (name, wrap) in [("sheet", Wrap::Flat), ("tube", Wrap::Tube)] {
        let key = |_, i: usize| {
            let stitch = if i % 4 < 2 { "knit+" } else { "purl+" };
            format!("{stitch} -lX +yX +lX -yX")
        };
        let mut mesh = grid::grid(COLUMNS, ROWS, wrap, false, key);
        if wrap == Wrap::Tube {
            let round = grid::tube_place(COLUMNS, false);
            mesh = grid::placed(mesh, COLUMNS, |u, v| {
                let p = round(u, v);
                DVec3::new(p.x, p.z, -p.y)
            });
        }
        mesh.positions.iter_mut().for_each(|p| *p *= WIDTH);
        let sizes = Sizes { course: WIDTH, wale: WIDTH * grid::HEIGHT };
        let options = ClothOptions { sizes: Some(sizes), ..ClothOptions::default() };
        let began = Instant::now();
        let cloth = Cloth::new(&mesh, &library, &options).expect("a mesh that is fine");
        let compile = began.elapsed().as_secs_f64();
        let (mut relaxed, mut first, mut frame, mut entries) = (f64::MAX, f64::MAX, f64::MAX, 0);
        let mut report = None;
        for _ in 0..rounds {
            let mut random = fastrand::Rng::with_seed(7);
            let mut next = || (random.f64() - 0.5) * 0.3 * WIDTH;
            let mut nodes: Vec<DVec3> =
                cloth.rest_positions().iter().map(|p| *p + DVec3::new(next(), next(), next())).collect();
            let began = Instant::now();
            report = Some(relax(&cloth, &mut nodes, &RelaxOptions::default()).expect("a start that is fine"));
            relaxed = relaxed.min(began.elapsed().as_secs_f64());

            let high = nodes.iter().map(|p| p.y).fold(f64::MIN, f64::max);
            let held =
                (0..nodes.len() as u32).filter(|n| nodes[*n as usize].y > high - 0.5 * sizes.wale).collect();
            let mut around = Hung(held);
            let mut stepper = Stepper::new(cloth.clone(), &nodes, StepOptions::default(), &around)
                .expect("a start that is fine");
            entries = stepper.factor_entries();
            let mut times: Vec<f64> = (0..31)
                .map(|_| {
                    let began = Instant::now();
                    stepper.frame(1.0 / 30.0, &mut around);
                    began.elapsed().as_secs_f64()
                })
                .collect();
            first = first.min(times.remove(0));
            times.sort_by(f64::total_cmp);
            frame = frame.min(times[15]);
        }
        let report = report.expect("a round");
        println!(
            "{name},{},{relaxed:.3},{},{},{:.2e},{compile:.3},{:.1},{:.2},{entries}",
            rayon::current_num_threads(),
            report.iterations,
            report.rounds,
            report.residual,
            first * 1e3,
            frame * 1e3
        );
    }
}
