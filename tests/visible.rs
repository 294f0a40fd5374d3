//! Which faces a camera sees.

mod common;

use common::Random;
use common::grid::{Wrap, grid, single};
use glam::{DMat4, DVec3, DVec4};
use knotmesh::io::smobj;
use knotmesh::knot::Settings;
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Camera, NO_SECOND_SLOT, Scene, SceneOptions, visible_faces};
use knotmesh::template::TemplateLibrary;
use std::path::Path;

const KNIT: &str = "knit+ -lX +yX +lX -yX";

/// World to camera, which looks along -z.
fn view(eye: DVec3, at: DVec3, up: DVec3) -> DMat4 {
    let back = (eye - at).normalize();
    let right = up.cross(back).normalize();
    let rows = [right, back.cross(right), back].map(|r| r.extend(-r.dot(eye)));
    DMat4::from_rows(rows[0], rows[1], rows[2], DVec4::W)
}

/// Half the picture's height is `half` of the distance; depths from 0 to 1, or from 1 to 0 at infinity.
fn perspective(half: f64, aspect: f64, near: f64, far: Option<f64>) -> DMat4 {
    let depth = match far {
        Some(far) => DVec4::new(0.0, 0.0, far / (near - far), near * far / (near - far)),
        None => DVec4::new(0.0, 0.0, 0.0, near),
    };
    let (x, y) = (DVec4::X / (half * aspect), DVec4::Y / half);
    DMat4::from_rows(x, y, depth, -DVec4::Z)
}

/// At the eye, looking at a point.
fn camera(eye: DVec3, at: DVec3) -> Camera {
    let projection = perspective(0.42, 1.5, 0.1, Some(1e3));
    let up = if (at - eye).normalize().y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
    Camera {
        view_projection: projection * view(eye, at, up),
        eye,
        height: 1080.0,
        hide_backs: false,
        least_pixels: 0.0,
    }
}

fn seen(camera: &Camera) -> bool {
    let library = TemplateLibrary::embedded();
    let mesh = single(library.by_key(KNIT).unwrap());
    let scene = Scene::compile(&mesh, &library, SceneOptions::default()).unwrap();
    let mut visible = Vec::new();
    visible_faces(&scene, &mesh.positions, camera, &mut visible).unwrap();
    assert!(visible_faces(&scene, &mesh.positions[1..], camera, &mut visible).is_err());
    visible[0]
}

/// One face around the origin, its front towards +z.
#[test]
fn one_face() {
    let front = DVec3::new(0.3, 0.2, 5.0);
    assert!(seen(&camera(front, DVec3::ZERO)), "in front");
    assert!(!seen(&camera(front, front * 2.0)), "behind the camera");
    assert!(!seen(&camera(front, DVec3::new(20.0, 0.0, 5.0))), "beside");
    assert!(!seen(&camera(front * 1000.0, DVec3::ZERO)), "beyond the far plane");
    // An infinitely far plane, and depths from 1 to 0.
    let eye = front * 1000.0;
    let infinite = perspective(0.42, 1.5, 0.1, None);
    let view = view(eye, DVec3::ZERO, DVec3::Y);
    let far = Camera { view_projection: infinite * view, ..camera(eye, DVec3::ZERO) };
    assert!(seen(&far), "far off");
    assert!(!seen(&Camera { least_pixels: 2.0, ..far }), "tiny");
    assert!(seen(&Camera { least_pixels: 0.01, ..far }), "tiny, but wanted");
    let back = DVec3::new(0.3, 0.2, -5.0);
    let behind = camera(back, DVec3::ZERO);
    assert!(seen(&behind), "from behind");
    assert!(!seen(&Camera { hide_backs: true, ..behind }), "from behind, where that is left out");
    assert!(seen(&Camera { hide_backs: true, ..camera(front, DVec3::ZERO) }), "its front stays");
    let edge_on = camera(DVec3::new(5.0, 0.0, -0.05), DVec3::ZERO);
    assert!(seen(&Camera { hide_backs: true, ..edge_on }), "edge on, the yarn stands out");
    assert!(
        seen(&Camera { least_pixels: 100.0, ..camera(DVec3::new(0.0, 0.0, 0.2), DVec3::ZERO) }),
        "around"
    );
}

/// No face is hidden that has a point of its yarn in the picture, on random cameras and strains.
#[test]
fn yarn_in_the_picture_is_never_hidden() {
    let lace = Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches/lace.smobj");
    let meshes: [StitchMesh; 2] =
        [smobj::read_file(&lace).unwrap(), grid(12, 12, Wrap::Flat, true, |_, _| KNIT.into())];
    let mut random = Random::new(3);
    let (mut hidden, mut kept) = (0, 0);
    for mut mesh in meshes {
        let rest = mesh.positions.clone();
        for _ in 0..8 {
            let stretch = DVec3::new(random.between(0.7, 1.5), random.between(0.7, 1.5), 1.0);
            let (bend, noise) = (random.between(0.0, 0.1), random.between(0.0, 0.1));
            for (p, rest) in mesh.positions.iter_mut().zip(&rest) {
                let mut next = || random.between(-noise, noise);
                *p = *rest * stretch + DVec3::new(next(), next(), next() + bend * rest.x * rest.x);
            }
            let options = SceneOptions { gauge: Some(1.0), ..SceneOptions::default() };
            let run = common::run::run::<f64>(
                &mesh,
                &TemplateLibrary::embedded(),
                options,
                &Settings::default(),
                1,
            );
            let slots = run.scene.point_slots();
            for _ in 0..40 {
                let point = |random: &mut Random, size: f64| {
                    let mut next = || random.between(-size, size);
                    DVec3::new(next() + 5.0, next() + 4.0, next())
                };
                let camera = camera(point(&mut random, 9.0), point(&mut random, 6.0));
                let camera = Camera { least_pixels: random.below(2) as f64 * 0.5, ..camera };
                let mut visible = Vec::new();
                visible_faces(&run.scene, &mesh.positions, &camera, &mut visible).unwrap();
                hidden += visible.iter().filter(|v| !**v).count();
                kept += visible.iter().filter(|v| **v).count();
                for (i, slots) in slots.iter().enumerate() {
                    let clip: DVec4 = camera.view_projection * run.output.world(i).extend(1.0);
                    if clip.w <= 0.0
                        || clip.x.abs() > clip.w
                        || clip.y.abs() > clip.w
                        || clip.z.abs() > clip.w
                    {
                        continue;
                    }
                    for slot in slots.iter().filter(|s| **s != NO_SECOND_SLOT) {
                        let (batch, index, _) = run.scene.slot_place(*slot);
                        assert!(visible[batch.faces[index].index()], "point {i} of a hidden face is seen");
                    }
                }
            }
        }
    }
    assert!(hidden > 10_000 && kept > 10_000, "{hidden} hidden, {kept} kept");
}
