//! Curves through control points, and the samples that uniform splines are drawn through.

mod common;

use common::Random;
use common::curves::collect;
use common::grid::{Wrap, grid, placed, tube_place};
use common::run::run;
use glam::DVec3;
use knotmesh::curve::{FrameCurves, UNIFORM_SUBDIVISION};
use knotmesh::knot::Settings;
use knotmesh::knot::curve::{Segment, neighbour, sampled_len};
use knotmesh::math::V3;
use knotmesh::measure::clearance::clearance;
use knotmesh::scene::SceneOptions;
use knotmesh::template::TemplateLibrary;
use knotmesh::yarn::{CurveSource, Curves};

fn centripetal(p: [DVec3; 4], t: f64) -> DVec3 {
    Segment::centripetal(p.map(V3::of)).at(t).to_f64()
}

fn uniform(p: [DVec3; 4], t: f64) -> DVec3 {
    Segment::uniform(p.map(V3::of)).at(t).to_f64()
}

/// The greatest distance of the uniform Catmull-Rom curve through a yarn's samples from the curve they were
/// taken of. `.bcc` and USD draw the former. Seen above the bound with control points alone (0.3 r).
#[test]
fn uniform_splines_through_the_samples_stay_near_the_curve() {
    let library = TemplateLibrary::embedded();
    let mut random = Random::new(5);
    let subdivide = UNIFORM_SUBDIVISION;
    for strength in [0.0, 0.3, 0.8] {
        let mesh = grid(12, 10, Wrap::Helix, false, |k, i| {
            let name = ["knit+", "purl+", "knit-twisted+"][(k * 5 + i) % 3];
            format!("{name} -lX +yX +lX -yX")
        });
        let bend = tube_place(12, true);
        let shear = random.between(-0.5, 0.5) * strength;
        let mesh = placed(mesh, 12, |u, v| {
            let p = bend(u, v);
            DVec3::new(p.x * (1.0 + strength), p.y * (1.0 - 0.5 * strength), p.z + shear * p.x)
        });
        let run = run::<f64>(&mesh, &library, SceneOptions::default(), &Settings::default(), 1);
        let curves = FrameCurves::new(&run.scene, &run.output, subdivide, None);
        let r = run.scene.yarn_radius * run.scene.gauge;
        let mut worst: f64 = 0.0;
        for yarn in 0..curves.yarn_count() {
            let closed = curves.yarn_closed(yarn);
            let range = run.scene.yarns.range(yarn);
            let control: Vec<DVec3> = range.map(|p| run.output.world(p)).collect();
            let samples = collect(&curves, yarn);
            let at = |points: &[DVec3], i: usize, k: isize| {
                neighbour(i as isize + k, points.len(), closed, |j| V3::<f64>::of(points[j])).to_f64()
            };
            let segments = if closed { samples.len() } else { samples.len() - 1 };
            for i in 0..segments {
                let (segment, part) = (i / (subdivide + 1), i % (subdivide + 1));
                let p = [-1, 0, 1, 2].map(|k| at(&control, segment, k));
                let q = [-1, 0, 1, 2].map(|k| at(&samples, i, k));
                for t in [0.25, 0.5, 0.75] {
                    let drawn = uniform(q, t);
                    // The nearest point of the true curve around there.
                    let near = (0..=40).map(|j| {
                        let s = (part as f64 + j as f64 / 40.0) / (subdivide + 1) as f64;
                        (centripetal(p, s) - drawn).length()
                    });
                    worst = worst.max(near.fold(f64::INFINITY, f64::min) / r);
                }
            }
        }
        println!("strain {strength}: {worst:.4} r off");
        assert!(worst < 0.02, "strain {strength}: {worst} r off");
    }
}

#[test]
fn curves_go_through_their_control_points_and_are_smooth() {
    let mut random = Random::new(9);
    let mut point = || DVec3::new(random.unit(), random.unit(), random.unit());
    for _ in 0..200 {
        let p: [DVec3; 5] = std::array::from_fn(|_| point());
        let (first, second) = ([p[0], p[1], p[2], p[3]], [p[1], p[2], p[3], p[4]]);
        assert!((centripetal(first, 0.0) - p[1]).length() < 1e-14);
        assert!((centripetal(first, 1.0) - p[2]).length() < 1e-14);
        // The direction is continuous at p[2].
        let h = 1e-6;
        let before = (centripetal(first, 1.0) - centripetal(first, 1.0 - h)).normalize();
        let after = (centripetal(second, h) - centripetal(second, 0.0)).normalize();
        assert!(before.dot(after) > 1.0 - 1e-8, "{before} {after}");
    }
    // Coincident points do no harm.
    let p = DVec3::new(1.0, 2.0, 3.0);
    for run in [[p; 4], [p, p, DVec3::X, DVec3::X], [DVec3::X, p, p, DVec3::Y]] {
        assert!(centripetal(run, 0.4).is_finite());
    }
}

#[test]
fn counts_match_what_is_visited() {
    let library = TemplateLibrary::embedded();
    for wrap in [Wrap::Tube, Wrap::Flat] {
        let mesh = grid(6, 4, wrap, false, |_, _| "knit+ -lX +yX +lX -yX".into());
        let run = run::<f32>(&mesh, &library, SceneOptions::default(), &Settings::default(), 1);
        for subdivide in [0, 1, 4] {
            let curves = FrameCurves::new(&run.scene, &run.output, subdivide, None);
            for yarn in 0..curves.yarn_count() {
                let n = run.scene.yarns.range(yarn).len();
                assert_eq!(curves.yarn_len(yarn), sampled_len(n, curves.yarn_closed(yarn), subdivide));
                assert_eq!(collect(&curves, yarn).len(), curves.yarn_len(yarn));
            }
        }
    }
}

/// Two straight yarns crossing at a known distance, and a ring, against closed forms. Seen red with the cell
/// size halved.
#[test]
fn clearance_of_known_curves() {
    let line = |from: DVec3, to: DVec3| (0..=100).map(move |i| from.lerp(to, f64::from(i) / 100.0));
    for apart in [0.9, 1.7, 2.4] {
        let mut curves = Curves::empty();
        curves.points.extend(line(DVec3::new(-5.0, 0.0, -0.01), DVec3::new(5.0, 0.0, -0.01)));
        curves.end_yarn(false, None);
        let z = apart - 0.01;
        curves.points.extend(line(DVec3::new(0.0, -5.0, z), DVec3::new(0.0, 5.0, z)));
        curves.end_yarn(false, None);
        let found = clearance(&curves, 1.0).unwrap();
        assert!((found.smallest - apart).abs() < 1e-9, "{found:?}");
        // Nearer than a limit where |x| < sqrt(limit^2 - apart^2), of 10 along each.
        for (limit, share) in
            [(1.0, found.share_below_r), (1.5, found.share_below_1_5r), (2.0, found.share_below_2r)]
        {
            let expected = 2.0 * f64::max(limit * limit - apart * apart, 0.0).sqrt() / 10.0;
            assert!((share - expected).abs() < 0.06, "{found:?} {expected}");
        }
    }

    // A ring of radius 3 r has nothing nearer than 2.5 r that counts.
    let mut ring = Curves::empty();
    ring.points.extend((0..200).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i) / 200.0;
        DVec3::new(angle.cos(), angle.sin(), 0.0) * 3.0
    }));
    ring.end_yarn(true, None);
    let found = clearance(&ring, 1.0).unwrap();
    assert_eq!((found.share_below_2r, found.smallest), (0.0, 2.5));
}
