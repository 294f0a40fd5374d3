//! The account of the stitch kernel on paper against what its threads count, face by face: every stage and every buffer,
//! exactly. Frames, solves and fall-backs of deformed, degenerate and not finite faces.
//!
//! What Gauss-Newton does is known beforehand, but for whether a face has a frame and a finite end; how often a safeguarded
//! solve assembles, factors and tries is taken from the counters. Not among it: starts from the frame before, and faces
//! that are only lifted. The other kernels are in `gpu_account_kernels.rs`.
//!
//! Seeded faults, each seen red: a step of Cayley's map one operation more on paper; quotients not counted; entries of a
//! length's curvature counted as a square instead of a triangle.
#![cfg(feature = "gpu")]

mod common;
#[path = "../examples/tube/mod.rs"]
#[allow(dead_code)]
mod tube;

use common::faces::{faces, motion};
use common::gpu::adapter;
use glam::DVec3;
use knotmesh::backend::gpu::account::{Costs, Events, Kind, STAGES, STITCH_STAGES, Way, stitch};
use knotmesh::backend::gpu::counters::{self, CALLS, COUNTERS, Counted};
use knotmesh::backend::gpu::layout::{Counts, Variant};
use knotmesh::backend::gpu::{GpuBackend, GpuOptions, shader};
use knotmesh::backend::{Backend, FrameOutput, Running, Skip};
use knotmesh::io::smobj;
use knotmesh::knot::table::Grid;
use knotmesh::knot::{Kernel, Settings, Solver, Start, Status};
use knotmesh::math::{V3, Width};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Batch, Mode, Scene, SceneOptions, Stencil};
use knotmesh::template::{Coordinates, Template, TemplateLibrary};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Faces of each template.
const FACES: usize = 13;
/// Which of the segments of `correct_start` that cost anything is the one of a cell where the branch of optima breaks.
const BROKEN: usize = 5;

/// Four templates: one, two and three knots, and edges of their own.
fn chosen() -> Vec<Template> {
    let library = TemplateLibrary::embedded();
    let names = ["knit+ -lX +yX +lX -yX", "knittuck", "decrease", "slip"];
    let of_name = |name| library.templates().iter().find(|t: &&Template| t.name.starts_with(name));
    names.map(|name| library.by_key(name).or_else(|| of_name(name)).expect("a template").clone()).into()
}

fn finite_corners(scene: &Scene, batch: &Batch, index: usize, surface: &[V3<f32>]) -> usize {
    let n = scene.stencils[batch.stencil].corner_count;
    let corners = &batch.corners[index * n..(index + 1) * n];
    let finite = |v: &&u32| {
        let p = surface[**v as usize];
        p.x.is_finite() && p.y.is_finite() && p.z.is_finite()
    };
    corners.iter().filter(finite).count()
}

/// What became of a face. Only what the data decides is taken from the counters.
fn events(way: &Way, finite_corners: usize, fell_back: bool, counted: &Counted) -> Events {
    let framed = counted.calls("run_solve") > 0;
    let broken = counted.runs.get("correct_start").is_some_and(|runs| runs[BROKEN] > 0);
    let safe = way.solver == Some(Solver::Safeguarded);
    let [assembled, factored, stepped] = match (safe, way.solver) {
        (true, _) => ["assemble", "factorise", "solve_factors"].map(|name| counted.calls(name) as usize),
        (false, Some(_)) => [way.iterations; 3],
        (false, None) => [0; 3],
    };
    Events { finite_corners, framed, broken, assembled, factored, stepped, fell_back }
}

/// What was seen of all faces.
#[derive(Debug, Default)]
struct Seen {
    faces: usize,
    framed: usize,
    broken: usize,
    fell_back: usize,
    ragged: usize,
    assembled: usize,
    factored: usize,
    tried: usize,
}

/// Compares account and counters; `None` where nothing can be counted.
fn compare(
    (mesh, motion): &(StitchMesh, Vec<Vec<DVec3>>),
    mode: Mode,
    settings: Settings,
    energies: bool,
) -> Option<Seen> {
    let adapter = adapter()?;
    let options = SceneOptions {
        mode,
        coordinates: Coordinates::MeanValue,
        gauge: Some(1.0),
        ..SceneOptions::default()
    };
    let scene = Scene::compile(mesh, &TemplateLibrary::embedded(), options).expect("compiles");
    let scene = Arc::new(scene);
    let running = Running { threads: 1, width: Width::One, skip: Skip::NOTHING, energies };
    let options = GpuOptions { count: true, ..GpuOptions::PLAIN };
    let tables = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gpu-tables");
    let mut backend = GpuBackend::new(scene.clone(), &settings, &running, &options, &adapter, Some(&tables))
        .expect("taken");
    if !backend.is_exact() {
        println!("skipped: shaders are not taken as they are written");
        return None;
    }
    let mut seen = Seen::default();
    let (mut faults, mut means) = (BTreeMap::new(), BTreeMap::<_, (Costs, u64)>::new());
    let mut output = FrameOutput::default();
    for positions in motion {
        backend.frame(positions, &mut output).expect("as many as vertices");
        let surface = backend.surface().expect("read");
        for (b, batch) in scene.batches.iter().enumerate() {
            let stencil: Stencil<f32> = scene.stencils[batch.stencil].cast();
            let solves = mode == Mode::Relax && stencil.knot_count() > 0;
            let way = Way {
                solver: solves.then_some(settings.solver),
                iterations: settings.iterations as usize,
                table: settings.start == Start::Table,
                spaced: settings.beta != 1.0,
                energies,
            };
            let key = scene.templates[batch.stencil].key();
            let told = backend.counted(b).expect("read");
            assert!(stencil.points.is_empty() || told.len() >= batch.faces.len(), "all faces are counted");
            for (i, counted) in told.iter().take(batch.faces.len()).enumerate() {
                let finite = finite_corners(&scene, batch, i, &surface);
                let fell_back = output.faces[batch.first_face + i].status == Status::FellBack;
                let events = events(&way, finite, fell_back, counted);
                let account = stitch(&stencil, &way, &events);
                for (s, stage) in STAGES.iter().enumerate() {
                    for kind in Kind::ALL {
                        let [paper, count] = [&account, &counted.costs].map(|c| c.0[s][kind as usize]);
                        if paper != count {
                            let fault = (key.clone(), *stage, format!("{kind:?}"));
                            faults.entry(fault).or_insert((paper, count, events));
                        }
                    }
                }
                let (costs, faces) = means.entry(key.clone()).or_default();
                costs.add(&counted.costs, 1);
                *faces += 1;
                seen.faces += 1;
                seen.framed += usize::from(events.framed);
                seen.broken += usize::from(events.broken);
                seen.fell_back += usize::from(fell_back);
                seen.ragged += usize::from(finite < stencil.corner_count);
                if events.framed {
                    seen.assembled += events.assembled;
                    seen.factored += events.factored;
                    seen.tried += events.stepped;
                }
            }
        }
    }
    println!("{mode:?} {settings:?}: {seen:?}");
    for (key, (costs, faces)) in &means {
        let [own, shared] = costs.all_bytes().map(|b| b / faces);
        let operations = costs.total(Kind::Operations) / faces;
        println!("{key}: {operations} operations, {own} + {shared} bytes");
    }
    assert!(
        faults.is_empty(),
        "{} differ (paper, counted), such as {:#?}",
        faults.len(),
        faults.iter().take(9).collect::<Vec<_>>()
    );
    Some(seen)
}

/// Faces of their own, so many of each template, in motion.
fn moving(templates: &[Template], count: usize, seed: u64) -> (StitchMesh, Vec<Vec<DVec3>>) {
    let mesh = faces(templates, |_| count);
    let motion = motion(&mesh, seed);
    (mesh, motion)
}

fn everything(seed: u64) -> (StitchMesh, Vec<Vec<DVec3>>) {
    moving(TemplateLibrary::embedded().templates(), FACES, seed)
}

/// Shaders with counters are valid, and all stages have some; no device is needed.
#[test]
fn counters_fit() {
    let library = TemplateLibrary::embedded();
    let counts = |template: &Template| {
        let stencil = Stencil::new(template, Mode::Relax, Coordinates::MeanValue);
        Counts::new(&Kernel::new(&stencil, Mode::Relax, &Settings::default()))
    };
    let room = library.templates().iter().map(counts).fold(Counts::default(), Counts::max);
    let grid = Grid::default();
    for energies in [true, false] {
        let variant = Variant {
            room,
            own: false,
            grid: Some(&grid),
            spaced: true,
            energies,
            trace: false,
            count: true,
        };
        let text = shader::stitch(&variant, 64);
        let segments = counters::segments(&text).unwrap_or_else(|fault| panic!("{}", fault.0));
        println!("{} segments", segments.len());
        assert!(segments.len() <= COUNTERS && text.contains(&format!("COUNTERS: u32 = {COUNTERS}u;")));
        let mut once = Costs::default();
        segments.iter().for_each(|segment| once.add(&segment.costs, 1));
        // What the stages cost is charged to them: none is empty.
        assert!(once.0[..STITCH_STAGES].iter().all(|stage| stage[Kind::Operations as usize] > 0), "{once:?}");
        let count = |name: &str| segments.iter().filter(|s| s.function == name).count();
        assert!(CALLS.iter().all(|name| count(name) > 0), "calls are counted");
        let plain = shader::spirv(&shader::stitch(&Variant { count: false, ..variant }, 64), true);
        let counting = shader::spirv(&text, true);
        let words =
            |spirv: Result<Vec<u32>, _>| spirv.map_or_else(|f: shader::Fault| panic!("{}", f.0), |w| w.len());
        assert!(words(counting) > words(plain) + 5 * segments.len(), "counters are written");
    }
}

#[test]
fn gauss_newton() {
    let settings = Settings { solver: Solver::GaussNewton, iterations: 3, ..Settings::default() };
    for (energies, beta) in [(true, 1.0), (false, 0.3)] {
        let Some(seen) = compare(&everything(3), Mode::Relax, Settings { beta, ..settings }, energies) else {
            return;
        };
        assert!(seen.fell_back > 50 && seen.ragged > 50 && seen.framed > 500, "{seen:?}");
    }
}

#[test]
fn safeguarded() {
    let settings = Settings { iterations: 3, ..Settings::default() };
    let Some(seen) = compare(&everything(4), Mode::Relax, settings, false) else { return };
    assert!(seen.factored > seen.tried && seen.assembled > seen.tried, "{seen:?}");
}

#[test]
fn from_tables() {
    let moving = moving(&chosen(), 5 * FACES, 5);
    for (solver, iterations) in [(Solver::Safeguarded, 2), (Solver::GaussNewton, 1)] {
        let settings = Settings { solver, iterations, start: Start::Table, ..Settings::default() };
        let Some(seen) = compare(&moving, Mode::Relax, settings, false) else { return };
        assert!(seen.broken > 9 && seen.broken < seen.framed - 9, "{seen:?}");
    }
}

#[test]
fn without_a_solve() {
    compare(&everything(6), Mode::Knots, Settings::default(), true);
    compare(&everything(6), Mode::Embed, Settings::default(), false);
}

/// A tube of plain knit under strains of 5 %: what is taken for typical on paper. Faces share points and normals.
#[test]
fn of_a_tube() {
    let text = tube::smobj(1000, tube::Vertices::Shared);
    let mesh = smobj::read("tube.smobj".as_ref(), text.as_bytes()).expect("a mesh");
    let mut random = common::Random::new(7);
    let mut by = || random.between(-0.025, 0.025);
    let noise = mesh.positions.iter().map(|p| *p + DVec3::new(by(), by(), by())).collect();
    let moving = (mesh, vec![noise]);
    let settings = Settings { iterations: 2, start: Start::Table, ..Settings::default() };
    let Some(seen) = compare(&moving, Mode::Relax, settings, false) else { return };
    assert_eq!([seen.faces, seen.framed], [1000; 2]);
    // Two steps are made but for a few, and the first factoring does.
    assert!(seen.assembled == 2000 && seen.tried > 1900 && seen.factored < seen.tried + 20, "{seen:?}");
}
