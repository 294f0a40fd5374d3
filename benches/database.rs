//! Yarn vertices a second of the precomputed method, over strains, displacement and mapping:
//! `cargo bench --bench database [-- VERTICES ...]`. With `KNOTMESH_DATA` the models of Sperl et al. are timed beside a
//! made-up one. Every vertex of the mesh moves in every frame; medians over the rounds.

#[path = "../tests/common/fabric.rs"]
#[allow(dead_code)]
mod fabric;

use glam::{DVec2, DVec3};
use knotmesh::Result;
use knotmesh::database::{Cpu, Fabric, RunningYarn, Settings, SkipYarn, YarnFrame};
use knotmesh::io::yarn_model;
use knotmesh::math::Width;
use knotmesh::pattern::YarnModel;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

const ROUNDS: usize = 9;

fn main() -> Result<()> {
    let mut sizes: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![1_000_000, 4_000_000];
    }
    let mut models = vec![("made-up".to_string(), fabric::model(50, 9))];
    if let Some(data) = std::env::var_os("KNOTMESH_DATA").map(PathBuf::from) {
        for name in ["stock", "rib", "stocktiniest"] {
            models
                .push((name.into(), yarn_model::read(&data.join(format!("madypg/models/model_{name}_9")))?));
        }
    }
    println!("model           vertices    faces  threads lanes  setup s   ms/frame  M/s");
    for (name, model) in &models {
        for size in &sizes {
            time(name, model, *size)?;
        }
    }
    Ok(())
}

/// A sheet with faces of 1 cm, and room for so many yarn vertices.
fn time(name: &str, model: &YarnModel, vertices: usize) -> Result<()> {
    let pattern = &model.pattern;
    let area = vertices as f64 / pattern.vertex_count() as f64 * pattern.size.x * pattern.size.y;
    let side = area.sqrt();
    let squares = (side / 0.01).round().max(1.0) as usize;
    let mesh = fabric::sheet([squares; 2], DVec2::splat(side));
    let began = Instant::now();
    let fabric = Arc::new(Fabric::new(&mesh, model.clone(), Settings::default())?);
    let setup = began.elapsed().as_secs_f64();
    let frames: Vec<Vec<DVec3>> = (0..ROUNDS).map(|i| fabric::waved(&mesh, i as f64 * 0.1)).collect();
    let ways: Vec<(usize, Width)> =
        vec![(1, Width::One), (1, Width::Eight), (1, Width::Auto), (2, Width::Auto)];
    let mut backends = Vec::new();
    for (threads, width) in &ways {
        let running = RunningYarn { threads: *threads, width: *width, skip: SkipYarn::NOTHING };
        backends.push((Cpu::<f32>::new(fabric.clone(), running)?, YarnFrame::default(), Vec::new()));
    }
    for positions in &frames {
        for (cpu, output, times) in &mut backends {
            let began = Instant::now();
            cpu.frame(positions, output)?;
            times.push(began.elapsed().as_secs_f64());
        }
    }
    for ((threads, width), (_, output, times)) in ways.iter().zip(&mut backends) {
        let _ = output;
        times.sort_by(f64::total_cmp);
        let median = times[times.len() / 2];
        println!(
            "{name:12} {:11} {:8} {threads:8} {:>5} {setup:8.2} {:10.3} {:5.1}",
            fabric.point_count(),
            fabric.face_count(),
            format!("{width:?}"),
            median * 1e3,
            fabric.point_count() as f64 / median / 1e6
        );
    }
    Ok(())
}
