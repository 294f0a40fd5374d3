//! Every pattern of `stitches/`, from text to yarn: how long each step takes and how well it ends, as CSV.
//!
//! `cargo bench --bench garments [-- NAME...]`. Times are the least of three runs (of one that takes over two seconds), milliseconds, with two threads where
//! there are several; `relax_ms` is a frame of yarn (start from tables, 2 steps, f32, nothing skipped) after the tables were built.
//! `below_1_5r`, `below_r`: shares of samples of yarn that come nearer than 1.5 r and r to other yarn; `plain` and `rib` the same of
//! patches in stockinette and in 2x2 rib, of the same yarn at the pattern's gauge, relaxed alike: what a garment of such stitches
//! may come to. Ribs are folded, as `render` and `view` do.

use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running, Skip, table_cache};
use knotmesh::cloth::{Cloth, ClothOptions, RelaxOptions, RelaxReport, Ribs, Sizes, relax};
use knotmesh::curve::FrameCurves;
use knotmesh::design::{Knitted, Settings as Pattern, knit};
use knotmesh::io::pattern::{Beside, knit_file};
use knotmesh::knot::{Settings, Start};
use knotmesh::measure::clearance::{Clearance, clearance};
use knotmesh::measure::machine::heading;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

const ROUNDS: usize = 3;
/// Extra points a segment that distances are measured on.
const DENSE: usize = 4;

fn main() {
    println!("{}", heading("garments"));
    // Cargo adds flags of its own.
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches");
    let mut patterns: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("stitches").map(|e| e.expect("an entry").path()).collect();
    patterns.retain(|p| p.extension().is_some_and(|e| e == "knit"));
    patterns.sort();
    let library = TemplateLibrary::embedded();
    println!(
        "pattern,stitches,faces,yarns,knit_ms,mesh_ms,mesh_steps,mesh_residual,relax_ms,fell_back,stuck,below_1_5r,below_r,smallest,plain_below_1_5r,plain_below_r,rib_below_1_5r,rib_below_r"
    );
    for path in patterns {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if !wanted.is_empty() && !wanted.contains(&name) {
            continue;
        }
        let (knit_ms, knitted) = least(|| knit_file(&path, &Pattern::default()).expect("a pattern"));
        let run = Run::new(knitted, &library);
        let gauge = run.knitted.gauge;
        let swatch = |[front, back]: [&str; 2]| {
            let text =
                format!("co 42\nRow 1 (RS): {front}\nRow 2 (WS): {back}\nrep rows 1-2 20 more times\nbo\n");
            let settings = Pattern { gauge: Some(gauge), ..Pattern::default() };
            let path = Path::new("swatch.knit");
            let knitted = knit(path, &text, &settings, &Beside::new(path)).expect("a swatch");
            let clearance = Run::new(knitted, &library).clearance;
            format!("{:.4},{:.4}", clearance.share_below_1_5r, clearance.share_below_r)
        };
        let (plain, rib) =
            (swatch(["k", "p"]), swatch(["k2, *p2, k2; rep from *", "p2, *k2, p2; rep from *"]));
        println!(
            "{name},{},{},{},{knit_ms:.2},{:.1},{},{:.1e},{:.2},{},{},{:.4},{:.4},{:.3},{plain},{rib}",
            run.knitted.made.total(),
            run.knitted.mesh.face_count(),
            run.yarns,
            run.mesh_ms,
            run.report.iterations,
            run.report.residual,
            run.relax_ms,
            run.fell_back,
            run.stuck,
            run.clearance.share_below_1_5r,
            run.clearance.share_below_r,
            run.clearance.smallest,
        );
    }
}

struct Run {
    knitted: Knitted,
    mesh_ms: f64,
    report: RelaxReport,
    yarns: usize,
    relax_ms: f64,
    fell_back: usize,
    stuck: usize,
    clearance: Clearance,
}

impl Run {
    fn new(mut knitted: Knitted, library: &TemplateLibrary) -> Self {
        let sizes = Some(Sizes { course: knitted.gauge.width, wale: knitted.gauge.height });
        let options = ClothOptions { sizes, ..ClothOptions::default() };
        let cloth = Cloth::new(&knitted.mesh, library, &options).expect("known stitches");
        // As `knit --relax` does.
        let options = RelaxOptions::garment();
        let (mesh_ms, (report, nodes)) = least(|| {
            let mut nodes = cloth.rest_positions().to_vec();
            let report = relax(&cloth, &mut nodes, &options).expect("finite places");
            (report, nodes)
        });
        cloth.write_back(&nodes, &mut knitted.mesh.positions);
        let width = knitted.gauge.width;
        let options = SceneOptions { gauge: Some(width), ..SceneOptions::default() };
        let scene = Arc::new(Scene::compile(&knitted.mesh, library, options).expect("compiles"));
        let settings = Settings { start: Start::Table, iterations: 2, ..Settings::default() };
        let cache = table_cache::folder();
        let running = Running { threads: 2, skip: Skip::NOTHING, ..Running::default() };
        let mut backend = CpuBackend::<f32>::with_cache(scene.clone(), &settings, &running, cache.as_deref())
            .expect("settings are in range");
        let mut output = FrameOutput::default();
        let mut positions = knitted.mesh.positions.clone();
        Ribs::new(&knitted.mesh, library, width).fold(&mut positions);
        let (relax_ms, ()) = least(|| {
            backend.frame(&positions, &mut output).expect("as many as vertices");
        });
        let status = |name: &str| {
            (0..scene.face_places.len())
                .filter(|f| {
                    let status = output.face(&scene, (*f).into()).status;
                    format!("{status:?}").eq_ignore_ascii_case(name)
                })
                .count()
        };
        let (fell_back, stuck) = (status("FellBack"), status("Stuck"));
        let curves = FrameCurves::new(&scene, &output, DENSE, None);
        let clearance = clearance(&curves, scene.yarn_radius * scene.gauge).expect("memory");
        let yarns = scene.yarns.len();
        Self { knitted, mesh_ms, report, yarns, relax_ms, fell_back, stuck, clearance }
    }
}

/// The least time of a few runs, in milliseconds, and what the last one gave.
fn least<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut best = f64::INFINITY;
    let mut last = None;
    for _ in 0..ROUNDS {
        let began = Instant::now();
        last = Some(run());
        best = best.min(began.elapsed().as_secs_f64() * 1e3);
        if best > 2000.0 {
            // Long runs repeat well enough.
            break;
        }
    }
    (best, last.expect("a run"))
}
