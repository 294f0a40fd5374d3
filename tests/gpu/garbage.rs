//! Garbage in buffers: the next frame comes all the same, soon and without an error, and where a buffer holds nothing but what
//! was found before, all points are finite.
//!
//! Seeded fault, seen red: points of faces that are not sound left as they are (`if false` for `if !sound`). A clamp taken
//! away is not seen on Mesa's drivers, which end all loops after 65,535 rounds: `tests/gpu_loops.rs` finds that in the text.

use crate::case::{compiled, tables};
use crate::common::Random;
use crate::common::gpu::adapter;
use crate::common::grid::{Wrap, grid, placed, tube_place};
use glam::DVec3;
use knotmesh::backend::gpu::{GpuBackend, GpuOptions};
use knotmesh::backend::{Backend, FrameOutput, Running, Skip};
use knotmesh::knot::{Settings, Start};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::Mode;
use knotmesh::template::Coordinates;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Buffers of what was found before, which each frame finds anew where all faces move.
const STATE: [&str; 7] =
    ["knots", "results", "control points", "shapes", "lists", "known shapes", "places and normals"];
/// Buffers of what is never written again.
const FIXED: [&str; 3] = ["table", "stencil", "topology"];

/// A frame takes milliseconds. Beyond this the process ends: nothing else stops a shader that goes on.
const LONGEST: Duration = Duration::from_secs(60);

/// Words by kind.
fn garbage(seed: u64) -> Vec<(&'static str, Vec<u32>)> {
    let mut random = Random::new(seed);
    let mut words =
        |most: u64| (0..997).map(|_| (random.bits() >> 16) as u32 as u64 % most).collect::<Vec<_>>();
    let mut of = |most| words(most).into_iter().map(|w| w as u32).collect::<Vec<u32>>();
    vec![
        ("random", of(1 << 32)),
        ("small", of(100)),
        ("ones", vec![u32::MAX]),
        ("nan", vec![f32::NAN.to_bits()]),
        ("infinite", vec![f32::INFINITY.to_bits(), f32::NEG_INFINITY.to_bits()]),
        ("huge", vec![1 << 30]),
        // Knots as long as knots are, so that solves do start from them.
        ("knots", vec![f32::NAN.to_bits(), f32::INFINITY.to_bits(), 0.25f32.to_bits()]),
    ]
}

fn mesh() -> StitchMesh {
    let (columns, rows) = (13, 9);
    let key = |row: usize, column: usize| {
        if (row + column).is_multiple_of(3) { "purl+ -lX +yX +lX -yX" } else { "knit+ -lX +yX +lX -yX" }
    };
    let mesh = grid(columns, rows, Wrap::Helix, false, |r, c| key(r, c).to_string());
    placed(mesh, columns, tube_place(columns, true))
}

/// Frames in which every vertex goes somewhere else.
struct Frames {
    backend: GpuBackend,
    output: FrameOutput<f32>,
    mesh: StitchMesh,
    random: Random,
}

impl Frames {
    fn next(&mut self, what: &str) {
        let random = &mut self.random;
        let mut step = || random.between(-0.1, 0.1);
        let positions: Vec<DVec3> =
            self.mesh.positions.iter().map(|p| *p + DVec3::new(step(), step(), step())).collect();
        let (done, wait) = channel::<()>();
        let named = what.to_string();
        let watch = std::thread::spawn(move || {
            if wait.recv_timeout(LONGEST) == Err(RecvTimeoutError::Timeout) {
                use std::io::Write;
                let _ = writeln!(std::io::stderr(), "{named}: no frame after {LONGEST:?}");
                std::process::abort();
            }
        });
        let found = self.backend.frame(&positions, &mut self.output);
        drop(done);
        watch.join().expect("it only waits");
        found.unwrap_or_else(|e| panic!("{what}: {e}"));
    }

    fn finite(&self) -> bool {
        self.output.points.iter().all(|p| p.x.is_finite() && p.y.is_finite() && p.z.is_finite())
    }
}

fn run(settings: Settings, skip: Skip, seed: u64) {
    let Some(adapter) = adapter() else { return };
    let mesh = mesh();
    let scene = compiled(&mesh, Mode::Relax, Coordinates::MeanValue);
    let running = Running { threads: 1, skip, ..Running::default() };
    let options = GpuOptions::default();
    let backend =
        GpuBackend::new(scene, &settings, &running, &options, &adapter, Some(&tables())).expect("in range");
    let mut frames = Frames { backend, output: FrameOutput::default(), mesh, random: Random::new(seed) };
    frames.next("nothing spoilt");
    let start = settings.start;
    for name in STATE {
        for (kind, words) in garbage(seed) {
            let what = format!("{start:?}: {name} {kind}");
            assert_eq!(frames.backend.spoil(name, &words), 1, "{what}");
            frames.next(&what);
            assert!(frames.finite(), "{what}: points are not finite");
        }
    }
    for name in FIXED {
        for (kind, words) in garbage(seed) {
            let what = format!("{start:?}: {name} {kind}");
            let expected = if name == "topology" { 1 } else { 2 };
            let expected = if name == "table" && start != Start::Table { 0 } else { expected };
            assert_eq!(frames.backend.spoil(name, &words), expected, "{what}");
            frames.next(&what);
        }
    }
}

#[test]
fn from_tables() {
    run(Settings { start: Start::Table, iterations: 2, ..Settings::default() }, Skip::default(), 21);
}

#[test]
fn from_the_frame_before() {
    for (skip, seed) in [(Skip::NOTHING, 22), (Skip::default(), 23)] {
        run(Settings { start: Start::Previous, ..Settings::default() }, skip, seed);
    }
}
