//! What a stitch costs on a GPU, on paper: operations and bytes by stage, the limits that follow for a tube of 22,800
//! stitches, and what crosses the bus. No device is needed, and none is asked.
//!
//! `cargo bench --bench account [-- STITCHES]`. `tests/gpu_account.rs` holds the account against counters.

use knotmesh::backend::gpu::account::{Costs, Events, Kind, PEAKS, STAGES, Way, stitch};
use knotmesh::backend::gpu::layout::{Counts, Variant};
use knotmesh::backend::gpu::shader;
use knotmesh::io::smobj;
use knotmesh::knot::table::Grid;
use knotmesh::knot::{Kernel, Settings, Solver, Start};
use knotmesh::scene::{Mode, Scene, SceneOptions, Stencil};
use knotmesh::template::{Coordinates, TemplateLibrary};

#[path = "../examples/tube/mod.rs"]
#[allow(dead_code)]
mod tube;

/// Bytes a second over PCIe 4 with 16 lanes, as transfers reach it (31.5e9 at its peak).
const BUS: f64 = 25e9;
const KNIT: &str = "knit+ -lX +yX +lX -yX";

const WAYS: [(&str, Way); 2] = [
    (
        "Gauss-Newton, 3 steps from the affine start",
        Way {
            solver: Some(Solver::GaussNewton),
            iterations: 3,
            table: false,
            spaced: false,
            energies: false,
        },
    ),
    (
        "safeguarded, 2 steps from the table, all made and each factored once",
        Way { solver: Some(Solver::Safeguarded), iterations: 2, table: true, spaced: false, energies: false },
    ),
];

/// The mean of some stitch types.
fn mean(stencils: &[Stencil<f32>], way: &Way) -> [[f64; Kind::COUNT]; STAGES.len()] {
    let mut sum = Costs::default();
    for stencil in stencils {
        let solver = way.solver.filter(|_| stencil.knot_count() > 0);
        let events = Events::all_steps(stencil.corner_count, way.iterations);
        let events = if solver.is_some() { events } else { Events::all_steps(stencil.corner_count, 0) };
        sum.add(&stitch(stencil, &Way { solver, ..*way }, &events), 1);
    }
    sum.0.map(|stage| stage.map(|n| n as f64 / stencils.len() as f64))
}

fn stages(costs: &[[f64; Kind::COUNT]; STAGES.len()]) {
    println!(
        "{:8} {:>10} {:>10} {:>10} {:>10} {:>10}",
        "stage", "operations", "own read", "written", "stencil", "table"
    );
    let columns = |stage: &[f64; Kind::COUNT]| {
        let sum = |kinds: &[Kind]| kinds.iter().map(|kind| stage[*kind as usize]).sum::<f64>();
        let own = [Kind::Surface, Kind::Topology, Kind::Lists, Kind::KnotsRead, Kind::ResultsRead];
        let written = [Kind::Points, Kind::Knots, Kind::Results];
        [
            stage[Kind::Operations as usize],
            sum(&own),
            sum(&written),
            stage[Kind::Stencil as usize],
            stage[Kind::Table as usize],
        ]
    };
    let row = |name: &str, row: [f64; 5]| {
        let cells: Vec<_> = row.iter().map(|n| format!("{n:>10.0}")).collect();
        println!("{name:8} {}", cells.join(" "));
    };
    let mut all = [0.0; 5];
    for (name, stage) in STAGES.iter().zip(costs) {
        let stage = columns(stage);
        all.iter_mut().zip(stage).for_each(|(sum, n)| *sum += n);
        row(name, stage);
    }
    row("all", all);
}

fn limits(costs: &Costs, stitches: f64) {
    let [own, shared] = costs.all_bytes();
    println!(
        "{stitches:.0} stitches: {:.1} million operations, {:.2} MB of their own, {:.1} MB that caches answer",
        stitches * costs.total(Kind::Operations) as f64 / 1e6,
        stitches * own as f64 / 1e6,
        stitches * shared as f64 / 1e6,
    );
    for peak in PEAKS {
        let limits = peak.limits(costs, stitches);
        println!(
            "{}: at least {:.4} ms by memory ({:.4} ms if no cache answered anything), {:.4} ms by arithmetic ({:.4} ms \
             as nothing is fused)",
            peak.name,
            1e3 * limits.memory,
            1e3 * limits.memory_without_caches,
            1e3 * limits.arithmetic,
            1e3 * limits.arithmetic_unfused,
        );
    }
}

/// Bytes of a thread's own arrays, with room for these counts.
fn private(room: Counts, grid: Option<&Grid>) -> Option<u32> {
    let variant =
        Variant { room, own: false, grid, spaced: false, energies: false, trace: false, count: false };
    let (module, _) = shader::parse(&shader::stitch(&variant, shader::WORKGROUP)).ok()?;
    let private = module.global_variables.iter().filter(|(_, v)| v.space == naga::AddressSpace::Private);
    Some(private.map(|(_, v)| module.types[v.ty].inner.size(module.to_ctx())).sum())
}

fn main() {
    // Cargo adds flags of its own.
    let stitches = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(22_800).max(1);
    let library = TemplateLibrary::embedded();
    let stencils: Vec<Stencil<f64>> = (library.templates().iter())
        .map(|template| Stencil::new(template, Mode::Relax, Coordinates::MeanValue))
        .collect();
    let all: Vec<Stencil<f32>> = stencils.iter().map(Stencil::cast).collect();
    let Some(at) = library.templates().iter().position(|t| t.key() == KNIT) else {
        return println!("the library has no {KNIT}");
    };
    for (name, way) in &WAYS {
        println!("## {KNIT}: {name}");
        println!("operations and bytes a stitch");
        stages(&mean(&all[at..=at], way));
        let events = Events::all_steps(all[at].corner_count, way.iterations);
        limits(&stitch(&all[at], way, &events), stitches as f64);
        println!("\n## Mean of all {} stitch types: {name}", all.len());
        stages(&mean(&all, way));
        println!();
    }

    println!("## Arrays of a thread that are indexed by what is not known beforehand");
    let settings = Settings { solver: Solver::Safeguarded, start: Start::Table, ..Settings::default() };
    let counts = |stencil: &Stencil<f64>| Counts::new(&Kernel::new(stencil, Mode::Relax, &settings));
    let most = stencils.iter().map(counts).fold(Counts::default(), Counts::max);
    let grid = Grid::default();
    for (name, room) in [("a plain knit alone", counts(&stencils[at])), ("all stitch types", most)] {
        if let Some(bytes) = private(room, Some(&grid)) {
            println!("room for {name}: {bytes} bytes");
        }
    }

    println!("\n## Across the bus, a frame of a tube of {stitches} stitches, at {} GB/s", BUS / 1e9);
    let text = tube::smobj(stitches, tube::Vertices::Shared);
    let scene = smobj::read("tube.smobj".as_ref(), text.as_bytes())
        .and_then(|mesh| Scene::compile(&mesh, &library, SceneOptions::default()));
    let scene = match scene {
        Ok(scene) => scene,
        Err(error) => return println!("{error}"),
    };
    let rows = [
        ("positions up", scene.vertex_count),
        ("points down", scene.yarns.point_count()),
        ("knots down", scene.knot_count),
        ("results down", scene.face_count),
    ];
    let mut sum = 0;
    for (name, places) in rows {
        sum += 12 * places;
        println!(
            "{name:14} {:>9} bytes ({:.1} a stitch) {:.4} ms",
            12 * places,
            12.0 * places as f64 / stitches as f64,
            1e3 * 12.0 * places as f64 / BUS
        );
    }
    println!("all {sum:>20} bytes {:.4} ms", 1e3 * sum as f64 / BUS);
}
