//! f32 against f64 after the default solver's 3 iterations: the greatest distance of a face's points, in r.
//!
//! Measured: all faces are within 1e-3 r, but for 3 of the 196 of the most deformed tube, up to 2.1e-3 r. Those
//! are not sensitive to their input (f64 moves by 7e-6 r when it is off by one f32 unit in the last place): their
//! E is some 100, of which f32 resolves 1e-5, and a last step that lowers it by less is undone. Near an optimum
//! E is flat: a place off by s costs s^2.
//!
//! Seeded faults, each seen red: f32 rounding of positions 2e4 from the origin (0 % within), rest values of
//! f32 stencils off by 0.05 % (unexplained faces).

mod common;

use common::Random;
use glam::DVec3;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Precision, Running, Skip};
use knotmesh::knot::Settings;
use knotmesh::math::V3;
use knotmesh::measure::misfit::misfit;
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const NEAR: f64 = 1e-3;
/// A face whose f64 result moves by this much, in r, when its input moves by one f32 unit in the last place.
const SENSITIVE: f64 = 1e-4;
/// Energies this near, as a share of 1 + E, are one to f32: sums of some thirty squares.
const SAME_ENERGY: f64 = 1e-6;

/// Points and energies [face] of a frame.
struct Faces {
    points: Vec<Vec<DVec3>>,
    energy: Vec<f64>,
}

fn solve<T: Precision>(scene: &Arc<Scene>, first: &[DVec3], positions: &[DVec3]) -> Faces {
    let running = Running { threads: 1, skip: Skip::NOTHING, ..Running::default() };
    let mut backend = CpuBackend::<T>::new(scene.clone(), &Settings::default(), &running).expect("in range");
    let mut output = FrameOutput::default();
    // The first frame sets the origin, the same for all.
    backend.frame(first, &mut output).expect("finite");
    backend.frame(positions, &mut output).expect("finite");
    let slots = backend.slots(&output);
    let mut faces = Faces { points: Vec::new(), energy: Vec::new() };
    for batch in &scene.batches {
        let stencil = &scene.stencils[batch.stencil];
        let count = stencil.points.len();
        if stencil.knot_count() == 0 {
            continue;
        }
        for i in 0..batch.faces.len() {
            let begin = batch.first_slot + i * count;
            faces.points.push(slots[begin..begin + count].iter().map(|p: &V3<T>| p.to_f64()).collect());
            faces.energy.push(output.faces[batch.first_face + i].energy.to_f64());
        }
    }
    faces
}

/// [face] the greatest distance of points, in r.
fn distances(a: &Faces, b: &Faces, r: f64) -> Vec<f64> {
    let far = |(a, b): (&Vec<DVec3>, &Vec<DVec3>)| {
        a.iter().zip(b).map(|(a, b)| a.distance(*b) / r).fold(0.0, f64::max)
    };
    a.points.iter().zip(&b.points).map(far).collect()
}

/// Positions moved by one f32 unit in the last place of what f32 computes with, up or down.
fn nudged(scene: &Scene, origin: DVec3, positions: &[DVec3], random: &mut Random) -> Vec<DVec3> {
    let mut nudge = |x: f64| {
        let x = x as f32;
        f64::from(if random.unit() < 0.5 { x.next_up() } else { x.next_down() })
    };
    positions
        .iter()
        .map(|p| {
            let local = (*p - origin) / scene.gauge;
            origin + DVec3::new(nudge(local.x), nudge(local.y), nudge(local.z)) * scene.gauge
        })
        .collect()
}

/// Compares the precisions on one frame.
fn check(name: &str, scene: &Arc<Scene>, positions: &[DVec3]) {
    let r = scene.yarn_radius;
    let reference = solve::<f64>(scene, positions, positions);
    let single = solve::<f32>(scene, positions, positions);
    let apart = distances(&single, &reference, r);
    let (low, high) = positions.iter().fold((positions[0], positions[0]), |(l, h), p| (l.min(*p), h.max(*p)));
    let mut sensitivity = vec![0.0f64; apart.len()];
    let mut random = Random::new(5);
    for _ in 0..4 {
        let moved = nudged(scene, low * 0.5 + high * 0.5, positions, &mut random);
        let other = solve::<f64>(scene, positions, &moved);
        for (s, d) in sensitivity.iter_mut().zip(distances(&other, &reference, r)) {
            *s = s.max(d);
        }
    }
    let rest: Vec<usize> = (0..apart.len()).filter(|f| apart[*f] > NEAR).collect();
    let sensitive = |f: &usize| sensitivity[*f] > SENSITIVE;
    let flat = |f: &usize| {
        let (a, b) = (single.energy[*f], reference.energy[*f]);
        (a - b).abs() <= SAME_ENERGY * (1.0 + b)
    };
    let unexplained: Vec<_> = rest.iter().filter(|f| !sensitive(f) && !flat(f)).collect();
    let share = 1.0 - rest.len() as f64 / apart.len() as f64;
    let strains: Vec<_> = misfit(scene, positions)
        .worst
        .iter()
        .take(2)
        .map(|w| [w.course, w.wale].map(|x| (100.0 * x).round() / 100.0))
        .collect();
    let mut sorted = apart.clone();
    sorted.sort_by(f64::total_cmp);
    println!(
        "{name}: worst strains {strains:?}; {} faces, within 1e-3 r {:.2} %; median {:.1e}, 95 % {:.1e}, worst {:.1e} r; of the {} others {} \
         sensitive, {} of one energy, {} neither",
        apart.len(),
        100.0 * share,
        sorted[sorted.len() / 2],
        sorted[sorted.len() * 95 / 100],
        sorted[sorted.len() - 1],
        rest.len(),
        rest.iter().filter(|f| sensitive(f)).count(),
        rest.iter().filter(|f| flat(f)).count(),
        unexplained.len()
    );
    assert!(apart.iter().any(|d| *d > 0.0), "f32 was not run");
    assert!(share >= 0.95, "{name}: only {share} of the faces within 1e-3 r");
    assert!(unexplained.len() * 200 <= apart.len(), "{name}: faces {unexplained:?}");
}

fn read(path: &Path) -> StitchMesh {
    knotmesh::io::smobj::read_file(path).expect("reads")
}

#[test]
fn a_tube_mildly_and_strongly_deformed() {
    let file =
        |name: &str| -> PathBuf { [env!("CARGO_MANIFEST_DIR"), "tests", "data", name].iter().collect() };
    let (rest, strong) = (read(&file("tube-rest.smobj")), read(&file("tube.smobj")));
    let options = SceneOptions { rest: Some(rest.positions.clone()), ..SceneOptions::default() };
    let scene = Scene::compile(&strong, &TemplateLibrary::embedded(), options).expect("compiles");
    let scene = Arc::new(scene);
    for share in [0.1, 0.25, 0.5, 1.0] {
        let pairs = rest.positions.iter().zip(&strong.positions);
        let positions: Vec<DVec3> = pairs.map(|(a, b)| a.lerp(*b, share)).collect();
        check(&format!("tube, deformed by {share}"), &scene, &positions);
    }
}

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn a_garment() {
    let Some(data) = common::data() else { return };
    let mesh = read(&data.join("knitgraph/bob.smobj"));
    let scene = Scene::compile(&mesh, &TemplateLibrary::embedded(), SceneOptions::default());
    check("garment", &Arc::new(scene.expect("compiles")), &mesh.positions);
}
