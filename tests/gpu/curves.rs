//! Curves that the device samples, against those that the CPU does of the twin's control points.
//!
//! Seeded faults, each seen red: see `FAULTS`; in `gpu_skip`, samples of a mesh that turned left as they were.

use crate::case::{Case, JOINT, compiled, same};
use crate::common::curves::samples;
use crate::common::faces::motion;
use crate::common::gpu::adapter;
use crate::common::grid::{Wrap, grid, placed, tube_place};
use crate::frames::{everything, tube};
use glam::DVec3;
use knotmesh::backend::gpu::{Adapter, GpuOptions};
use knotmesh::backend::{Backend, FrameOutput, Wanted};
use knotmesh::knot::Settings;
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::Mode;
use knotmesh::template::Coordinates;

/// How many numbers differ, of how many; control points and states among them.
fn differ(case: &Case, adapter: &Adapter, options: &GpuOptions, subdivide: usize) -> [usize; 2] {
    let (mut twin, mut device) = (case.twin(), case.device(adapter, options));
    device.set_wanted(Wanted { points: true, knots: false, curves: subdivide }).expect("there is room");
    let [mut a, mut b] = [FrameOutput::default(), FrameOutput::default()];
    let mut counts = [0; 2];
    for positions in case.motion {
        twin.frame(positions, &mut a).expect("as many as vertices");
        device.frame(positions, &mut b).expect("as many as vertices");
        let made = device.part_count() == 1;
        assert_eq!(b.curves.subdivide, if made { subdivide } else { 0 }, "who samples");
        assert!(b.knots.is_empty(), "nobody asked for knots");
        let [x, y] = [&a, &b].map(|output| samples(case.scene, output, subdivide));
        assert_eq!(x.len(), y.len());
        assert_eq!(a.points.len(), b.points.len());
        let points = a.points.iter().zip(&b.points).map(|(p, q)| (p.to_f64(), q.to_f64()));
        for (p, q) in x.into_iter().zip(y).chain(points) {
            for (p, q) in p.to_array().into_iter().zip(q.to_array()) {
                let agree = same(p as f32, q as f32) && (p == q || p.is_nan());
                counts[0] += usize::from(!agree);
                counts[1] += 1;
            }
        }
    }
    counts
}

fn compare(mesh: &StitchMesh, motion: &[Vec<DVec3>], most_bytes: Option<u64>) {
    let Some(adapter) = adapter() else { return };
    let scene = compiled(mesh, Mode::Relax, Coordinates::MeanValue);
    let case = Case::new(&scene, motion, Settings::default());
    let options = GpuOptions { most_bytes, ..JOINT };
    for subdivide in [1, 4, 7] {
        let [off, all] = differ(&case, &adapter, &options, subdivide);
        println!("{subdivide} extra points a segment: {off} of {all} numbers differ");
        assert!(off == 0 || !case.device(&adapter, &options).is_exact(), "{off} of {all} numbers differ");
    }
}

/// Yarns with ends.
#[test]
fn of_a_helix() {
    let (mesh, motion) = tube();
    compare(&mesh, &motion, None);
}

fn closed() -> (StitchMesh, Vec<Vec<DVec3>>) {
    let mesh = grid(9, 12, Wrap::Tube, false, |_, _| "knit+ -lX +yX +lX -yX".into());
    let mesh = placed(mesh, 9, tube_place(9, false));
    let wide = mesh.positions.iter().map(|p| *p * DVec3::new(1.2, 1.1, 0.8)).collect();
    let motion = vec![mesh.positions.clone(), wide];
    (mesh, motion)
}

#[test]
fn of_closed_yarns() {
    let (mesh, motion) = closed();
    compare(&mesh, &motion, None);
}

/// Yarns of few points, folded and lost ones among them.
#[test]
fn of_all_templates() {
    let mesh = everything();
    compare(&mesh, &motion(&mesh, 31), None);
}

/// In more buffers than one, and where the scene is in parts.
#[test]
fn beyond_what_shaders_see() {
    let (mesh, motion) = tube();
    compare(&mesh, &motion, Some(200_000));
    compare(&mesh, &motion, Some(20_000));
}

const FAULTS: [(&str, &str); 5] = [
    ("3.0 * t2 + 1.0", "3.03 * t2 + 1.0"),
    ("return sqrt(length3(b - a));", "return length3(b - a);"),
    ("begin + (i + 2u) % n", "begin + (i + 1u) % n"),
    ("if i + 2u > last {", "if i + 3u > last {"),
    ("before * sizes.subdivide - sizes.first_sample", "before * sizes.subdivide"),
];

#[test]
fn faults_are_found() {
    let Some(adapter) = adapter() else { return };
    let text = std::fs::read_to_string("shaders/curve.wgsl").expect("it is there");
    let meshes = [tube(), closed()];
    for fault in FAULTS {
        assert!(text.contains(fault.0), "{} is no part of the shader", fault.0);
        let found = meshes.iter().any(|(mesh, motion)| {
            let scene = compiled(mesh, Mode::Relax, Coordinates::MeanValue);
            let case = Case::new(&scene, motion, Settings::default());
            let options = GpuOptions { fault: Some(fault), most_bytes: Some(200_000), ..JOINT };
            differ(&case, &adapter, &options, 4)[0] > 0
        });
        assert!(found, "{} instead of {} is not found", fault.1, fault.0);
    }
}
