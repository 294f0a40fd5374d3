//! Cloth on colliders, as CSV: `cargo bench --bench drape [-- ball|frames]`.
//!
//! `ball`: the scene `sphere-drop` after two seconds, by substeps a frame: what contact makes of cloth that hangs over a ball.
//! `frames`: 22,800 stitches that fall on a ball and the ground, with self-collision; milliseconds a frame.

#[path = "../tests/common/grid.rs"]
#[allow(dead_code)]
mod grid;

use glam::{DMat3, DVec3};
use grid::Wrap;
use knotmesh::drape::Drape;
use knotmesh::drape::motion::Pose;
use knotmesh::drape::scene::{Collider, DrapeScene, Friction, SelfCollision, Shape};
use knotmesh::io::{scene_json, smobj};
use knotmesh::measure::machine::heading;
use knotmesh::template::TemplateLibrary;
use std::path::Path;
use std::time::Instant;

const WIDTH: f64 = 0.0045;

fn main() {
    println!("{}", heading("drape"));
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    let library = TemplateLibrary::embedded();
    if is_wanted("ball") {
        ball(&library);
    }
    if is_wanted("frames") {
        frames(&library);
    }
}

/// The swatch on the ball, two seconds after it was let go.
fn ball(library: &TemplateLibrary) {
    println!(
        "substeps,ms_a_frame,elastic_uJ,contacts,worst_stretch,mean_stretch,speed_mm_s,deepest_nm,lowest_mm"
    );
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mesh = smobj::read_file(&root.join("stitches/swatch.smobj")).expect("a mesh");
    for substeps in [1, 2, 4, 8, 16, 32, 64, 128] {
        let mut scene =
            scene_json::read_file(&root.join("stitches/scenes/sphere-drop.json")).expect("a scene");
        scene.substeps = Some(substeps);
        scene.frames = 181;
        scene.damping = Some(5.0);
        let mut drape = Drape::new(&mesh, library, &scene, &Default::default()).expect("a scene");
        let began = Instant::now();
        let mut deepest = 0.0;
        let (mut last, mut speed) = (Vec::new(), 0.0);
        while drape.advance() {
            deepest = f64::max(deepest, drape.report().contact.deepest_penetration);
            let now = drape.stepper().positions();
            let moved =
                now.iter().zip(&last).map(|(p, q): (&DVec3, &DVec3)| p.distance(*q)).fold(0.0, f64::max);
            // The fastest of the last ten frames.
            if drape.report().frame > 170 {
                speed = f64::max(speed, moved * scene.fps);
            }
            last = now.to_vec();
        }
        let time = began.elapsed().as_secs_f64() / 180.0;
        let (x, obstacle) = (drape.stepper().positions(), &drape.stage().obstacles()[0]);
        let (mut worst, mut sum, mut count) = (0.0, 0.0, 0.0);
        for s in drape.stepper().cloth().springs() {
            let [a, b] = s.nodes.map(|n| x[n as usize]);
            let on = [a, b].iter().any(|p| obstacle.distance(*p) < obstacle.thickness() + 1e-6);
            let strain = a.distance(b) / s.length - 1.0;
            worst = f64::max(worst, strain);
            if on {
                sum += strain;
                count += 1.0;
            }
        }
        let contacts = x.iter().filter(|p| obstacle.distance(**p) < obstacle.thickness() + 1e-6).count();
        let report = drape.report();
        println!(
            "{substeps},{:.3},{:.1},{contacts},{worst:.5},{:.5},{:.3},{:.2},{:.3}",
            time * 1e3,
            report.elastic_energy * 1e6,
            sum / count,
            speed * 1e3,
            deepest * 1e9,
            x.iter().map(|p| p.y).fold(f64::MAX, f64::min) * 1e3
        );
    }
}

/// 150 x 152 stitches on a ball on the ground.
fn frames(library: &TemplateLibrary) {
    println!("scene,substeps,threads,median_ms,worst_ms,contacts,self_contacts,cut,deepest_nm");
    let key = |_, _| "knit+ -lX +yX +lX -yX".to_string();
    let mesh = grid::grid(150, 152, Wrap::Flat, true, key);
    let middle = mesh.positions.iter().sum::<DVec3>() * (WIDTH / mesh.positions.len() as f64);
    let linear = DMat3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let collider = |shape| Collider {
        shape,
        motions: Vec::new(),
        friction: Friction::default(),
        thickness: None,
        name: String::new(),
    };
    for (name, own) in [("ball", None), ("ball and itself", Some(SelfCollision::default()))] {
        for substeps in [4, 8] {
            let scene = DrapeScene {
                unit: WIDTH,
                frames: 31,
                substeps: Some(substeps),
                place: Pose { linear, offset: DVec3::Y * 0.22 - linear * middle },
                colliders: vec![
                    collider(Shape::Sphere { center: DVec3::ZERO, radius: 0.2 }),
                    collider(Shape::Plane { point: DVec3::Y * -0.2, normal: DVec3::Y }),
                ],
                self_collision: own,
                ..DrapeScene::default()
            };
            let mut drape = Drape::new(&mesh, library, &scene, &Default::default()).expect("a scene");
            drape.advance();
            let (mut times, mut all) = (Vec::new(), (0, 0, 0, 0.0));
            loop {
                let began = Instant::now();
                if !drape.advance() {
                    break;
                }
                times.push(began.elapsed().as_secs_f64() * 1e3);
                let report = drape.report();
                all = (
                    report.contact.contacts.max(all.0),
                    report.contact.self_contacts.max(all.1),
                    report.cut + all.2,
                    report.contact.deepest_penetration.max(all.3),
                );
            }
            // The first frame factors.
            times.remove(0);
            times.sort_by(f64::total_cmp);
            println!(
                "{name},{substeps},{},{:.1},{:.1},{},{},{},{:.2}",
                rayon::current_num_threads(),
                times[times.len() / 2],
                times[times.len() - 1],
                all.0,
                all.1,
                all.2,
                all.3 * 1e9
            );
        }
    }
}
