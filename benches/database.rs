//! Yarn vertices a second of the precomputed method, over strains, displacement and mapping:
//! `cargo bench --bench database [-- [--adapter NAME] [VERTICES ...]]`. With `KNOTMESH_DATA` the models of Sperl et al. are
//! timed beside a made-up one. Every vertex of the mesh moves in every frame; medians over the rounds. A GPU is timed beside
//! the CPU where there is one of hardware, or the adapter of that name; software says nothing of what a GPU takes. Its lines
//! end in what its passes took by its own clock, and in how many floats of the last frame differ from the CPU's.

#[path = "../tests/common/fabric.rs"]
#[allow(dead_code)]
mod fabric;

use glam::{DVec2, DVec3};
use knotmesh::Result;
use knotmesh::database::{Cpu, Fabric, RunningYarn, Settings, SkipYarn, YarnFrame};
use knotmesh::io::yarn_model;
use knotmesh::math::Width;
use knotmesh::measure::machine::heading;
use knotmesh::pattern::YarnModel;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

const ROUNDS: usize = 9;

fn main() -> Result<()> {
    println!("{}", heading("database"));
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let named = arguments.iter().position(|a| a == "--adapter").map(|at| at + 1);
    let rest = arguments.iter().enumerate().filter(|(at, _)| Some(*at) != named);
    let mut sizes: Vec<usize> = rest.filter_map(|(_, a)| a.parse().ok()).collect();
    let gpus = gpu::adapters(named.and_then(|at| arguments.get(at)).map(String::as_str))?;
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
            time(name, model, *size, &gpus)?;
        }
    }
    Ok(())
}

/// A sheet with faces of 1 cm, and room for so many yarn vertices.
fn time(name: &str, model: &YarnModel, vertices: usize, gpus: &[gpu::Adapter]) -> Result<()> {
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
    let line = |threads: &str, width: &str, times: &mut [f64]| {
        times.sort_by(f64::total_cmp);
        let median = times[times.len() / 2];
        let (points, faces) = (fabric.point_count(), fabric.face_count());
        let (ms, million) = (median * 1e3, points as f64 / median / 1e6);
        format!("{name:12} {points:11} {faces:8} {threads:>8} {width:>5} {setup:8.2} {ms:10.3} {million:5.1}")
    };
    for ((threads, width), (_, _, times)) in ways.iter().zip(&mut backends) {
        println!("{}", line(&threads.to_string(), &format!("{width:?}"), times));
    }
    let twin = &backends[0].1;
    for adapter in gpus {
        let (mut times, more) = gpu::time(adapter, &fabric, &frames, twin)?;
        println!("{} {more}", line("GPU", "-", &mut times));
    }
    Ok(())
}

#[cfg(feature = "gpu")]
mod gpu {
    pub use knotmesh::backend::gpu::Adapter;

    use super::*;
    use knotmesh::backend::gpu::GpuOptions;
    use knotmesh::database::gpu::{Gpu, GpuYarn};

    /// The one of that name, or one of hardware, if there is one.
    pub fn adapters(named: Option<&str>) -> Result<Vec<Adapter>> {
        match named {
            Some(name) => Ok(vec![Adapter::choose(Some(name))?]),
            None => Ok(Adapter::hardware().into_iter().collect()),
        }
    }

    /// Seconds of each frame, and what else there is to say.
    pub fn time(
        adapter: &Adapter,
        fabric: &Arc<Fabric>,
        frames: &[Vec<DVec3>],
        twin: &YarnFrame<f32>,
    ) -> Result<(Vec<f64>, String)> {
        let device = GpuOptions { timed: true, ..GpuOptions::default() };
        let options = GpuYarn { skip: SkipYarn::NOTHING, device };
        let mut gpu = match Gpu::new(fabric.clone(), &options, adapter) {
            Ok(gpu) => gpu,
            // Sizes that others have room for are timed all the same.
            Err(e) => return Ok((vec![f64::NAN], e.to_string())),
        };
        let mut output = YarnFrame::default();
        // Shaders are compiled for real as they are first run.
        gpu.frame(&frames[0], &mut output)?;
        let mut times = Vec::new();
        let mut passes: Vec<(&str, Vec<f64>)> = Vec::new();
        for positions in frames {
            let began = Instant::now();
            gpu.frame(positions, &mut output)?;
            times.push(began.elapsed().as_secs_f64());
            for (i, (name, seconds)) in gpu.device_times().iter().enumerate() {
                if passes.len() <= i {
                    passes.push((name, Vec::new()));
                }
                passes[i].1.push(*seconds);
            }
        }
        let bits = |frame: &YarnFrame<f32>| -> Vec<u32> {
            let points = frame.points.iter().flat_map(|p| [p.x, p.y, p.z]);
            points.chain(frame.twists.iter().copied()).map(f32::to_bits).collect()
        };
        let differing = bits(&output).iter().zip(bits(twin)).filter(|(a, b)| **a != *b).count();
        let mut more = String::new();
        for (name, seconds) in &mut passes {
            seconds.sort_by(f64::total_cmp);
            more += &format!("{name} {:.3}, ", seconds[seconds.len() / 2] * 1e3);
        }
        Ok((times, format!("{more}{differing} floats differ")))
    }
}

#[cfg(not(feature = "gpu"))]
mod gpu {
    use super::*;

    pub enum Adapter {}

    pub fn adapters(_: Option<&str>) -> Result<Vec<Adapter>> {
        Ok(Vec::new())
    }

    pub fn time(
        adapter: &Adapter,
        _: &Arc<Fabric>,
        _: &[Vec<DVec3>],
        _: &YarnFrame<f32>,
    ) -> Result<(Vec<f64>, String)> {
        match *adapter {}
    }
}
