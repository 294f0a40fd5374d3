//! How much height ribs need: samples of yarn that come near other yarn, by share of the height that keeps stitches' width, as CSV.
//!
//! `cargo bench --bench ribs`. Tubes of 80 stitches (84 of threes) and 40 rounds at 16x22, relaxed as `knit --relax` does but for the form; yarn is
//! sampled at 4 extra points a segment. Shares of 0 are flat.

use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running, Skip, table_cache};
use knotmesh::cloth::{Cloth, ClothOptions, RelaxOptions, Ribs, Sizes, relax};
use knotmesh::curve::FrameCurves;
use knotmesh::design::{Settings as Pattern, knit};
use knotmesh::io::pattern::Beside;
use knotmesh::knot::{Settings, Start};
use knotmesh::measure::clearance::distances;
use knotmesh::measure::machine::heading;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::Path;
use std::sync::Arc;

const DENSE: usize = 4;

fn main() {
    println!("{}", heading("ribs"));
    println!("rib,beta,share,below_0_8r,below_r,below_1_2r,below_1_5r");
    for (name, round) in
        [("2x2", "*k2, p2; rep from *"), ("3x3", "*k3, p3; rep from *"), ("1x1", "*k1, p1; rep from *")]
    {
        for (beta, share) in [(1.0, 0.0), (0.7, 0.0), (1.0, 0.4), (1.0, 0.6), (1.0, 0.8), (1.0, 1.0)] {
            run(name, round, beta, share);
        }
    }
}

fn run(name: &str, round: &str, beta: f64, share: f64) {
    let library = TemplateLibrary::embedded();
    // Threes go into 84, not into 80.
    let stitches = if name == "3x3" { 84 } else { 80 };
    let text = format!("gauge 16 x 22\npiece tube round\nco {stitches}\nRnds 1-40: {round}\nbo\n");
    let path = Path::new("tube.knit");
    let mut knitted = knit(path, &text, &Pattern::default(), &Beside::new(path)).expect("a tube");
    let width = knitted.gauge.width;
    let sizes = Some(Sizes { course: width, wale: knitted.gauge.height });
    let cloth = Cloth::new(&knitted.mesh, &library, &ClothOptions { sizes, ..ClothOptions::default() })
        .expect("known stitches");
    let mut nodes = cloth.rest_positions().to_vec();
    let options = RelaxOptions { inflation: 0.0, ..RelaxOptions::garment() };
    relax(&cloth, &mut nodes, &options).expect("finite places");
    cloth.write_back(&nodes, &mut knitted.mesh.positions);
    let options = SceneOptions { gauge: Some(width), ..SceneOptions::default() };
    let scene = Arc::new(Scene::compile(&knitted.mesh, &library, options).expect("compiles"));
    let settings = Settings { start: Start::Table, iterations: 2, beta, ..Settings::default() };
    let running = Running { threads: 2, skip: Skip::NOTHING, ..Running::default() };
    let cache = table_cache::folder();
    let mut backend = CpuBackend::<f32>::with_cache(scene.clone(), &settings, &running, cache.as_deref())
        .expect("settings are in range");
    let mut positions = knitted.mesh.positions.clone();
    Ribs::new(&knitted.mesh, &library, width).with_share(share).fold(&mut positions);
    let mut output = FrameOutput::default();
    backend.frame(&positions, &mut output).expect("as many as vertices");
    let curves = FrameCurves::new(&scene, &output, DENSE, None);
    let radius = scene.yarn_radius * scene.gauge;
    let all = distances(&curves, radius).expect("memory");
    let below = |r: f64| all.iter().filter(|c| **c < r).count() as f64 / all.len() as f64;
    let [a, b, c, d] = [0.8, 1.0, 1.2, 1.5].map(below);
    println!("{name},{beta},{share},{a:.4},{b:.4},{c:.4},{d:.4}");
}
