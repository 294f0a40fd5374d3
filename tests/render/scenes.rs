//! What is drawn in tests.

use glam::DVec3;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running};
use knotmesh::io::smobj;
use knotmesh::knot::Settings;
use knotmesh::mesh::StitchMesh;
use knotmesh::render::{Background, Camera, Look, Painter, Picture, Strands};
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::Path;
use std::sync::Arc;

/// A yarn through points, radius and colour given.
pub fn yarn(points: &[DVec3], closed: bool, radius: f32) -> Strands {
    Strands {
        origin: DVec3::ZERO,
        unit: 1.0,
        points: points.iter().map(|p| p.as_vec3().to_array()).collect(),
        offsets: vec![0, points.len() as u32],
        closed: vec![closed],
        radius: vec![radius],
        rest: vec![0.0; points.len()],
        colours: vec![[196, 84, 76]; points.len()],
    }
}

/// A camera so far away that things are as large in front as behind; so many world units from the top to the bottom.
pub fn far(target: DVec3, height: f64) -> Camera {
    let field = 0.002;
    Camera { eye: target + DVec3::Z * (height / 2.0 / f64::tan(field / 2.0)), target, up: DVec3::Y, field }
}

/// Nothing but yarn, on nothing.
pub fn plain() -> Look {
    Look { background: Background::Transparent, samples: 16, ..Look::default() }
}

pub fn paint(painter: &Painter, strands: &Strands, camera: &Camera, look: &Look, size: [u32; 2]) -> Picture {
    let canvas = painter.canvas(size[0], size[1]).expect("there is room");
    let mut yarn = painter.yarn(strands).expect("the strands are whole");
    painter.paint(&canvas, &mut yarn, camera, look).expect("it is painted");
    painter.picture(&canvas).expect("it comes back")
}

/// Pixels that are covered, in parts too.
pub fn covered(picture: &Picture) -> f64 {
    picture.pixels.iter().map(|p| f64::from(p[3]) / 255.0).sum()
}

/// The mean of the pixels' channels' differences, of 255.
pub fn apart(a: &Picture, b: &Picture) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let difference =
        |(p, q): (&[u8; 4], &[u8; 4])| (0..4).map(|c| f64::from(p[c].abs_diff(q[c]))).sum::<f64>();
    a.pixels.iter().zip(&b.pixels).map(difference).sum::<f64>() / (4 * a.pixels.len()) as f64
}

/// A sample mesh, compiled.
pub fn sample(name: &str) -> (StitchMesh, Arc<Scene>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches").join(name);
    let mesh = smobj::read_file(&path).expect("the sample reads");
    let scene = Scene::compile(&mesh, &TemplateLibrary::embedded(), SceneOptions::default());
    (mesh, Arc::new(scene.expect("the sample compiles")))
}

/// Its yarn, relaxed on the CPU.
pub fn relaxed(mesh: &StitchMesh, scene: &Arc<Scene>) -> FrameOutput<f32> {
    let mut backend =
        CpuBackend::new(scene.clone(), &Settings::default(), &Running::default()).expect("it runs");
    let mut output = FrameOutput::default();
    backend.frame(&mesh.positions, &mut output).expect("it solves");
    output
}
