//! Ribs fold between cloth and yarn.

use super::{HEIGHT, WIDTH, fabric};
use crate::grid::Wrap;
use glam::DVec3;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running};
use knotmesh::cloth::Ribs;
use knotmesh::curve::FrameCurves;
use knotmesh::ids::FaceId;
use knotmesh::knot::Settings;
use knotmesh::measure::clearance::{Clearance, clearance};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::sync::Arc;

/// 2x2 rib, as wide as its stitches times `squeezed`.
fn rib(squeezed: f64) -> StitchMesh {
    let mut mesh = fabric(16, 10, Wrap::Flat, |_, column| column % 4 < 2);
    mesh.positions.iter_mut().for_each(|p| p.x *= squeezed);
    mesh
}

fn ribs(mesh: &StitchMesh) -> Ribs {
    Ribs::new(mesh, &TemplateLibrary::embedded(), WIDTH)
}

/// Between two knits fabric comes forward, between two purls it goes back, by 0.6 of what would keep its width; where they meet it
/// stays, and edges of one place stay together. Seen red with all of the height, with purls that rise, and with one of a
/// place's vertices moved.
#[test]
fn knits_come_forward_and_purls_go_back() {
    let flat = rib(0.62);
    let mut positions = flat.positions.clone();
    ribs(&flat).fold(&mut positions);
    let height = 0.6 * WIDTH * (1.0 - 0.62_f64 * 0.62).sqrt();
    for (before, after) in flat.positions.iter().zip(&positions) {
        let wale = (before.x / (0.62 * WIDTH)).round() as usize;
        // Wales begin with two knits, whose left side is the fabric's.
        let expected = match wale {
            0 | 16 => 0.0,
            _ => [0.0, 1.0, 0.0, -1.0][wale % 4],
        };
        let by = *after - *before;
        assert!((by - DVec3::Z * expected * height).length() < 1e-9, "wale {wale}: {by}");
    }
    // Stretched until its stitches are as wide as they are long, a rib is flat; and beyond.
    for wide in [1.0, 1.3] {
        let flat = rib(wide);
        let mut positions = flat.positions.clone();
        ribs(&flat).fold(&mut positions);
        assert!(positions.iter().zip(&flat.positions).all(|(a, b)| a.distance(*b) < 1e-9));
    }
}

/// Stockinette, garter, seed stitch and single wales have no crests. Seen red with borders along courses, and with crests at the fabric's sides.
#[test]
fn other_fabric_stays() {
    let fabrics: [fn(usize, usize) -> bool; 4] = [
        |_, _| true,
        |row, _| row % 2 == 0,
        |row, column| (row + column) % 2 == 0,
        |_, column| column % 2 == 0,
    ];
    for (number, knit) in fabrics.into_iter().enumerate() {
        assert!(ribs(&fabric(12, 8, Wrap::Flat, knit)).is_empty(), "fabric {number}");
    }
    // On a tube they rise away from its axis.
    let tube = fabric(24, 6, Wrap::Tube, |_, column| column % 4 < 2);
    let mut mesh = tube.clone();
    mesh.positions.iter_mut().for_each(|p| *p = DVec3::new(0.7 * p.x, p.y, 0.7 * p.z));
    let flat = mesh.positions.clone();
    ribs(&tube).fold(&mut mesh.positions);
    let (mut out, mut inwards) = (0, 0);
    for face in 0..mesh.face_count() {
        let knit = mesh.face_type(FaceId(face as u32)).name.starts_with("knit");
        for v in mesh.face(FaceId(face as u32)) {
            let radius = |p: DVec3| p.x.hypot(p.z);
            let by = radius(mesh.positions[v.index()]) - radius(flat[v.index()]);
            assert!(if knit { by > -1e-9 } else { by < 1e-9 }, "{by}");
            out += usize::from(by > 0.1 * HEIGHT);
            inwards += usize::from(by < -0.1 * HEIGHT);
        }
    }
    assert!(out > 100 && inwards > 100, "{out} {inwards}");
}

/// Yarn of a rib at its natural size keeps away from itself. Seen red with a tenth of the height.
#[test]
fn yarn_of_ribs_has_room() {
    let library = TemplateLibrary::embedded();
    let mesh = rib(0.62);
    let options = SceneOptions { gauge: Some(WIDTH), ..SceneOptions::default() };
    let scene = Arc::new(Scene::compile(&mesh, &library, options).unwrap());
    let measured = |positions: &[DVec3]| -> Clearance {
        let mut backend =
            CpuBackend::<f32>::new(scene.clone(), &Settings::default(), &Running::default()).unwrap();
        let mut output = FrameOutput::default();
        backend.frame(positions, &mut output).unwrap();
        clearance(&FrameCurves::new(&scene, &output, 8, None), scene.gauge * scene.yarn_radius).unwrap()
    };
    let flat = measured(&mesh.positions);
    let mut positions = mesh.positions.clone();
    ribs(&mesh).fold(&mut positions);
    let folded = measured(&positions);
    println!("{flat:?}\n{folded:?}");
    assert!(folded.smallest > 1.15, "flat {flat:?}, folded {folded:?}");
}
