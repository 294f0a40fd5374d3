//! Natural sizes, energies, relaxation and motion of cloth: closed forms, differences, invariants, stability.

#[path = "../common/grid.rs"]
#[allow(dead_code)]
mod grid;

mod energy;
mod folds;
mod inflation;
mod natural;
mod relaxation;
mod ribs;
mod steps;

use glam::DVec3;
use grid::{Wrap, placed, tube_place};
use knotmesh::cloth::{Cloth, ClothOptions, Sizes};
use knotmesh::io::smobj;
use knotmesh::mesh::StitchMesh;
use knotmesh::template::TemplateLibrary;

/// Width and height of a plain stitch, m.
const WIDTH: f64 = 0.0045;
const HEIGHT: f64 = 0.0030;

const KNIT: &str = "knit+ -lX +yX +lX -yX";
const PURL: &str = "purl+ -lX +yX +lX -yX";

fn knit_where(knit: bool) -> String {
    if knit { KNIT } else { PURL }.to_string()
}

/// A grid of stitches at plain size.
fn fabric(columns: usize, rows: usize, wrap: Wrap, knit: impl Fn(usize, usize) -> bool) -> StitchMesh {
    let mesh = grid::grid(columns, rows, wrap, false, |k, i| knit_where(knit(k, i)));
    let scale = DVec3::new(WIDTH / grid::WIDTH, HEIGHT / grid::HEIGHT, WIDTH / grid::WIDTH);
    let mut mesh = if wrap == Wrap::Tube {
        let round = tube_place(columns, false);
        placed(mesh, columns, |u, v| {
            let p = round(u, v);
            DVec3::new(p.x, p.z, -p.y)
        })
    } else {
        mesh
    };
    mesh.positions.iter_mut().for_each(|p| *p *= scale);
    mesh
}

fn options() -> ClothOptions {
    ClothOptions { sizes: Some(Sizes { course: WIDTH, wale: HEIGHT }), ..ClothOptions::default() }
}

fn cloth(mesh: &StitchMesh, options: &ClothOptions) -> Cloth {
    Cloth::new(mesh, &TemplateLibrary::embedded(), options).unwrap()
}

/// A sample of `stitches/`, in metres.
fn sample(name: &str) -> StitchMesh {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches").join(name);
    let mut mesh = smobj::read_file(&path).unwrap();
    mesh.positions.iter_mut().for_each(|p| *p *= WIDTH);
    mesh
}

const SAMPLES: [&str; 7] = [
    "degenerate.smobj",
    "garter.smobj",
    "lace.smobj",
    "rib.smobj",
    "swatch.smobj",
    "tube.smobj",
    "weave.smobj",
];

/// Positions moved by up to `size`, m, each way.
fn shaken(places: &[DVec3], size: f64, seed: u64) -> Vec<DVec3> {
    let mut rng = fastrand::Rng::with_seed(seed);
    let mut next = || (2.0 * rng.f64() - 1.0) * size;
    places.iter().map(|p| *p + DVec3::new(next(), next(), next())).collect()
}

/// Runs on so many threads.
fn on_threads<T: Send>(threads: usize, run: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run)
}
