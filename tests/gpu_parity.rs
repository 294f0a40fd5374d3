//! The GPU against its f32 twin.
#![cfg(feature = "gpu")]

mod common;

use common::grid::{Wrap, grid};
use glam::DVec3;
use knotmesh::backend::gpu::{Adapter, GpuBackend, GpuOptions};
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running, Skip};
use knotmesh::knot::{Settings, Solver, Start};
use knotmesh::math::Width;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::Path;
use std::sync::Arc;

#[test]
fn first_light() {
    let mesh = grid(20, 10, Wrap::Flat, true, |_, _| "knit+ -lX +yX +lX -yX".into());
    let scene =
        Arc::new(Scene::compile(&mesh, &TemplateLibrary::embedded(), SceneOptions::default()).unwrap());
    let mut random = common::Random::new(3);
    let positions: Vec<DVec3> = mesh
        .positions
        .iter()
        .map(|p| {
            *p * DVec3::new(1.1, 0.9, 1.0)
                + DVec3::new(random.between(-0.1, 0.1), random.between(-0.1, 0.1), random.between(-0.1, 0.1))
        })
        .collect();
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("skip-tables");
    let adapter = Adapter::choose(None).unwrap();
    println!("{}", adapter.report());
    for exact in [true] {
        for (solver, start) in [(Solver::Safeguarded, Start::Affine)] {
            let settings = Settings { solver, start, ..Settings::default() };
            let running = Running { threads: 1, width: Width::One, skip: Skip::NOTHING, energies: true };
            let mut cpu =
                CpuBackend::<f32>::with_cache(scene.clone(), &settings, &running, Some(&cache)).unwrap();
            let options = GpuOptions { exact, ..GpuOptions::default() };
            let mut gpu =
                GpuBackend::new(scene.clone(), &settings, &running, &options, &adapter, Some(&cache))
                    .unwrap();
            let [mut a, mut b] = [FrameOutput::default(), FrameOutput::default()];
            cpu.frame(&positions, &mut a).unwrap();
            let began = std::time::Instant::now();
            gpu.frame(&positions, &mut b).unwrap();
            let took = began.elapsed();
            let same = a.points.iter().zip(&b.points).filter(|(p, q)| p == q).count();
            let most = a
                .points
                .iter()
                .zip(&b.points)
                .map(|(p, q)| (p.to_f64() - q.to_f64()).length())
                .fold(0.0, f64::max);
            println!(
                "exact {exact} {solver:?} {start:?}: {same} of {} same, {most:.1e}; {took:?}; {:?} {:?}",
                a.points.len(),
                a.faces[5],
                b.faces[5]
            );
        }
    }
}
