//! What a stitch costs on a GPU, on paper: operations and bytes by stage, the kernels around it, the limits that follow for
//! a tube of 22,800 stitches, and what crosses the bus. No device is needed, and none is asked.
//!
//! `cargo bench --bench account [-- STITCHES]`. `tests/gpu_account.rs` and `tests/gpu_account_kernels.rs` hold the account
//! against counters.

use knotmesh::backend::gpu::account::kernels::{
    Choice, Choosing, Looks, Segment, areas, carry, choose, corner_normals, curve, join, steps,
};
use knotmesh::backend::gpu::account::{Costs, Events, Kind, PEAKS, STAGES, STITCH_STAGES, Way, stitch};
use knotmesh::backend::gpu::layout::{Counts, Variant};
use knotmesh::backend::gpu::shader;
use knotmesh::io::smobj;
use knotmesh::knot::table::Grid;
use knotmesh::knot::{Kernel, Settings, Solver, Start};
use knotmesh::measure::machine::heading;
use knotmesh::scene::{Mode, Scene, SceneOptions, Stencil};
use knotmesh::template::{Coordinates, TemplateLibrary};

#[path = "../examples/tube/mod.rs"]
#[allow(dead_code)]
mod tube;

/// Bytes a second over PCIe 4 with 16 lanes, as transfers reach it (31.5e9 at its peak).
const BUS: f64 = 25e9;
const KNIT: &str = "knit+ -lX +yX +lX -yX";
/// Extra samples a segment.
const EXTRA: usize = 3;

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
        let own = [Kind::Surface, Kind::Topology];
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
    for (name, stage) in STAGES.iter().zip(costs).take(STITCH_STAGES) {
        let stage = columns(stage);
        all.iter_mut().zip(stage).for_each(|(sum, n)| *sum += n);
        row(name, stage);
    }
    row("all", all);
}

/// Prints the limits of what is paid so many times, for so many stitches.
fn limits(costs: &Costs, times: f64, stitches: usize) {
    let [own, shared] = costs.all_bytes();
    println!(
        "{stitches} stitches: {:.1} million operations, {:.2} MB of their own, {:.2} MB that caches answer",
        times * costs.total(Kind::Operations) as f64 / 1e6,
        times * own as f64 / 1e6,
        times * shared as f64 / 1e6,
    );
    for peak in PEAKS {
        let limits = peak.limits(costs, times);
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

/// What the kernels around stitches cost on a scene: each by what it is for, how many threads, and all of them.
fn around(scene: &Scene) -> Vec<(String, usize, Costs)> {
    fn all(name: &str, threads: impl Iterator<Item = Costs>) -> (String, usize, Costs) {
        let (mut sum, mut count) = (Costs::default(), 0);
        for costs in threads {
            sum.add(&costs, 1);
            count += 1;
        }
        (name.into(), count, sum)
    }
    let lengths =
        |offsets: &[u32]| -> Vec<usize> { offsets.windows(2).map(|o| (o[1] - o[0]) as usize).collect() };
    let groups = scene.corner_groups.as_ref().map_or(Vec::new(), |g| lengths(&g.offsets));
    let yarns = &scene.yarns;
    let segment = |yarn: usize, i: usize| {
        let (n, inside) = (yarns.range(yarn).len(), Segment::inside(steps(yarn, yarns.len())));
        match yarns.closed[yarn] {
            true => inside,
            false if i + 1 == n => Segment { mirrored: None, ..inside },
            false => Segment { mirrored: Some(usize::from(i == 0) + usize::from(i + 2 == n)), ..inside },
        }
    };
    let points = (0..yarns.len()).flat_map(|y| (0..yarns.range(y).len()).map(move |i| (y, i)));
    let sides = yarns.point_count() + 2 * yarns.seams.len();
    let mut rows = vec![
        all("areas", lengths(&scene.face_offsets).into_iter().map(areas)),
        all("corner_normals", groups.into_iter().map(corner_normals)),
        all("join", yarns.seams.iter().map(|_| join())),
        all("curve", points.map(|(yarn, i)| curve(&segment(yarn, i), EXTRA))),
        all("carry", (0..sides).map(|_| carry())),
    ];
    let stencil = &scene.stencils[0];
    let (n, k) = (stencil.corner_count, stencil.knot_count());
    for (name, choice) in [
        ("hidden", Choice::Hidden { first: false }),
        ("unmoved", Choice::Unmoved),
        ("rigid", Choice::Rigid),
        ("rest", Choice::Rest),
        ("shared", Choice::Shared),
        ("solved", Choice::Solved),
    ] {
        let choosing = Choosing { sight: name == "hidden", rigid: true, near: true };
        let cost = choose(n, k, &choosing, choice, &Looks::least(choice, &choosing, n));
        rows.push(all(&format!("choose: {name}"), (0..scene.face_count).map(|_| cost)));
    }
    rows
}

/// Prints what the kernels around stitches cost, a thread and a stitch.
fn print_around(scene: &Scene) {
    let stitches = scene.face_count as f64;
    println!("## Kernels around stitches, on a tube of {stitches} of them, {EXTRA} extra samples a segment");
    println!(
        "{:16} {:>8} | a thread: {:>8} {:>6} {:>7} {:>6} | a stitch: {:>8} {:>6} {:>7} {:>6}",
        "kernel", "threads", "operat.", "read", "written", "shared", "operat.", "read", "written", "shared"
    );
    let rows = around(scene);
    let row = |name: &str, threads: Option<usize>, costs: &Costs| {
        let operations = costs.total(Kind::Operations);
        let [own, shared] = costs.all_bytes();
        let written: u64 = Kind::ALL.into_iter().filter(|k| k.is_written()).map(|k| costs.total(k)).sum();
        let cells = [operations, own - written, written, shared];
        let by = |n: f64| cells.map(|cell| format!("{:.1}", cell as f64 / n));
        let [a, b, c, d] = threads.map_or([const { String::new() }; 4], |n| by(n.max(1) as f64));
        let threads = threads.map_or(String::new(), |n| n.to_string());
        let [e, f, g, h] = by(stitches);
        println!("{name:16} {threads:>8} | {a:>18} {b:>6} {c:>7} {d:>6} | {e:>18} {f:>6} {g:>7} {h:>6}");
    };
    for (name, threads, costs) in &rows {
        row(name, Some(*threads), costs);
    }
    for (name, count) in [("surface, seams", 3), ("and curves", 4)] {
        let mut sum = Costs::default();
        rows[..count].iter().for_each(|(_, _, costs)| sum.add(costs, 1));
        row(name, None, &sum);
        limits(&sum, 1.0, scene.face_count);
    }
    for (name, _, costs) in rows.iter().filter(|row| row.0 == "carry" || row.0.starts_with("choose")) {
        println!("{name}:");
        limits(costs, 1.0, scene.face_count);
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
    println!("{}", heading("account"));
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
        limits(&stitch(&all[at], way, &events), stitches as f64, stitches);
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
    let (mut sum, mut knots) = (0, 0);
    for (name, places) in rows {
        sum += 12 * places;
        if name.starts_with("knots") {
            knots = 12 * places;
        }
        println!(
            "{name:14} {:>9} bytes ({:.1} a stitch) {:.4} ms",
            12 * places,
            12.0 * places as f64 / stitches as f64,
            1e3 * 12.0 * places as f64 / BUS
        );
    }
    let row = |name: &str, bytes: usize| {
        println!("{name:24} {bytes:>9} bytes {:.4} ms", 1e3 * bytes as f64 / BUS);
    };
    row("all", sum);
    row("unless knots are wanted", sum - knots);
    println!();
    print_around(&scene);
}
