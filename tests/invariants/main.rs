//! The nine invariants of the model (section 8), each over random meshes, in f64 and f32.
//!
//! Each was seen red on a seeded fault; the fault is named at the test.

mod cases;
#[path = "../common/mod.rs"]
mod common;
mod finite;
mod knots;
mod surface;
mod symmetry;
mod yarns;

use common::Random;
use common::run::{Run, run};
use glam::DVec3;
use knotmesh::backend::Precision;
use knotmesh::knot::Settings;
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Mode, SceneOptions};
use knotmesh::template::{Coordinates, TemplateLibrary};

/// Modes and coordinates that invariants hold in.
const MODES: [Mode; 3] = [Mode::Relax, Mode::Knots, Mode::Embed];

fn options(mode: Mode) -> SceneOptions {
    SceneOptions { mode, coordinates: Coordinates::MeanValue, ..SceneOptions::default() }
}

fn solve<T: Precision>(mesh: &StitchMesh, library: &TemplateLibrary, mode: Mode) -> Run<T> {
    run(mesh, library, options(mode), &Settings::default(), 2)
}

/// How far each point moves, in template units, when each coordinate changes by one unit in the last place of
/// this precision: the solver's own sensitivity, which 'to rounding' is measured against.
fn sensitivity<T: Precision>(
    mesh: &StitchMesh,
    library: &TemplateLibrary,
    mode: Mode,
    random: &mut Random,
) -> f64 {
    let base = solve::<T>(mesh, library, mode);
    // A coordinate is rounded relative to the extent of the mesh, in this precision.
    let extent = mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let unit = if std::mem::size_of::<T>() == 4 { f64::from(f32::EPSILON) } else { f64::EPSILON };
    let mut worst = 0.0;
    for _ in 0..3 {
        let mut moved = mesh.clone();
        for p in &mut moved.positions {
            let mut jitter = || (random.unit() - 0.5) * 2.0 * unit * extent;
            *p += DVec3::new(jitter(), jitter(), jitter());
        }
        let mut options = options(mode);
        options.gauge = Some(base.scene.gauge);
        let moved = run::<T>(&moved, library, options, &Settings::default(), 1);
        for i in 0..base.output.points.len() {
            worst = f64::max(worst, (base.output.world(i) - moved.output.world(i)).length());
        }
    }
    worst / base.scene.gauge
}

/// What may remain between two runs that should agree: a hundred times the sensitivity (each of the solve's operations
/// rounds, not the input alone), plus the rounding of
/// results at the mesh's extent.
fn allowed<T: Precision>(
    mesh: &StitchMesh,
    library: &TemplateLibrary,
    mode: Mode,
    random: &mut Random,
) -> f64 {
    let unit = if std::mem::size_of::<T>() == 4 { 1e-6 } else { 1e-14 };
    let extent = mesh.positions.iter().map(|p| p.abs().max_element()).fold(1.0, f64::max);
    100.0 * sensitivity::<T>(mesh, library, mode, random) + unit * extent
}
