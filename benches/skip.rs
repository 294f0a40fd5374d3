//! What skipping saves: a tube of 22,800 stitches, five motions of 20 frames, tables' start and one step. Prints CSV:
//! milliseconds a frame with every skip and with none, the share, and how many faces of a frame were left out and why
//! (means over the frames but the first). `compare` is what comparing the positions of two frames takes.
//!
//! `cargo bench --bench skip [-- ROUNDS [STITCHES]]`. The first frame is not counted; each frame's time is the least of
//! the rounds, and the median over the frames is printed.

use glam::DVec3;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running, Skip, Skipped, table_cache};
use knotmesh::io::smobj;
use knotmesh::knot::{Settings, Start};
use knotmesh::measure::machine::heading;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;
use tube::moves::Motion;

#[path = "../examples/tube/mod.rs"]
#[allow(dead_code)]
mod tube;

const FRAMES: usize = 20;

fn main() {
    println!("{}", heading("skip"));
    // Cargo adds flags of its own.
    let numbers: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let rounds = numbers.first().copied().unwrap_or(9).max(1);
    let stitches = numbers.get(1).copied().unwrap_or(22_800);
    let text = tube::smobj(stitches, tube::Vertices::Shared);
    let mesh = smobj::read("tube.smobj".as_ref(), text.as_bytes()).expect("a mesh");
    let library = TemplateLibrary::embedded();
    let scene = Arc::new(Scene::compile(&mesh, &library, SceneOptions::default()).expect("compiles"));
    let height = mesh.positions.iter().map(|p| p.z).fold(0.0, f64::max);

    println!("motion,threads,all_ms,none_ms,share,unmoved,rigid,rest,shared,solved");
    for motion in Motion::ALL {
        let place = |frame| -> Vec<DVec3> {
            mesh.positions.iter().map(|p| motion.place(*p, height, frame, FRAMES)).collect()
        };
        let frames: Vec<Vec<DVec3>> = (0..FRAMES).map(place).collect();
        for threads in [1, 2] {
            let [(all, s), (none, _)] = times(&scene, threads, &frames, rounds);
            let lifted = s.unmoved + s.rigid + s.rest + s.shared;
            println!(
                "{},{threads},{all:.3},{none:.3},{:.3},{},{},{},{},{}",
                motion.name(),
                all / none,
                s.unmoved,
                s.rigid,
                s.rest,
                s.shared,
                scene.face_count - lifted
            );
        }
    }
    println!("compare,1,{:.3}", compare(&mesh.positions));
}

/// Milliseconds a frame and what was left out, with every skip and with none.
fn times(scene: &Arc<Scene>, threads: usize, frames: &[Vec<DVec3>], rounds: usize) -> [(f64, Skipped); 2] {
    let settings = Settings { start: Start::Table, iterations: 1, ..Settings::default() };
    let cache = table_cache::folder();
    let mut runs = [Skip::default(), Skip::NOTHING].map(|skip| {
        let running = Running { threads, skip, energies: false, ..Running::default() };
        let backend = CpuBackend::<f32>::with_cache(scene.clone(), &settings, &running, cache.as_deref());
        let least = vec![f64::INFINITY; frames.len()];
        (backend.expect("settings are in range"), FrameOutput::default(), least, Skipped::default())
    });
    for round in 0..rounds {
        for (frame, positions) in frames.iter().enumerate() {
            // Side by side, so that whatever else the machine does meets both.
            for (backend, output, least, skipped) in &mut runs {
                let began = Instant::now();
                backend.frame(black_box(positions), output).expect("as many as vertices");
                least[frame] = least[frame].min(began.elapsed().as_secs_f64() * 1e3);
                if round == 0 && frame > 0 {
                    *skipped = *skipped + output.skipped;
                }
            }
        }
    }
    runs.map(|(_, _, mut least, s)| {
        let mean = |n: usize| n / (frames.len() - 1);
        least.remove(0);
        least.sort_by(f64::total_cmp);
        let s = Skipped {
            unmoved: mean(s.unmoved),
            rigid: mean(s.rigid),
            rest: mean(s.rest),
            shared: mean(s.shared),
            ..s
        };
        (least[least.len() / 2], s)
    })
}

/// Milliseconds to compare two frames.
fn compare(positions: &[DVec3]) -> f64 {
    let other = positions.to_vec();
    let time = |_| {
        let began = Instant::now();
        assert!(black_box(positions) == black_box(&other[..]));
        began.elapsed().as_secs_f64() * 1e3
    };
    (0..200).map(time).fold(f64::INFINITY, f64::min)
}
