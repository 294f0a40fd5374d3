//! What is far is drawn with fewer points, and what is not seen not at all.

use super::gpu::adapter;
use super::scenes::{apart, covered, far, paint, plain, relaxed, sample};
use glam::DVec3;
use knotmesh::render::camera::Axes;
use knotmesh::render::{Camera, Look, Painter, Strands, View};

pub fn levels_follow_the_distance_and_nothing_out_of_view_is_drawn(painter: &Painter) {
    let (mesh, scene) = sample("rib.smobj");
    let strands = Strands::of_frame(&mesh, &scene, &relaxed(&mesh, &scene));
    let canvas = painter.canvas(320, 240).unwrap();
    let mut yarn = painter.yarn(&strands).unwrap();
    let bounds = yarn.bounds();
    let mut counts = |zoom: f64, aside: f64| {
        let camera = Camera::framing(bounds, &Axes::Y_UP, View::FRONT, 320.0 / 240.0, zoom);
        let away = DVec3::X * aside * (bounds[1].x - bounds[0].x);
        let camera = Camera { eye: camera.eye + away, target: camera.target + away, ..camera };
        painter.paint(&canvas, &mut yarn, &camera, &Look::default()).unwrap();
        painter.counts(&yarn).unwrap()
    };
    let all = strands.points.len() as u32;
    let whole = counts(1.0, 0.0);
    // Open yarns have a segment less than points, and two ends.
    let yarns = strands.yarn_count() as u32;
    assert_eq!(whole.drawn.iter().sum::<u32>(), all + yarns);
    assert!(whole.drawn[2] > all / 2, "{whole:?}");
    // Far away, most segments are drawn by eights.
    let far_off = counts(0.02, 0.0);
    assert_eq!(far_off.drawn[1..], [0; 4]);
    assert!((all / 8..all / 4).contains(&(far_off.drawn[0] - 2 * yarns)), "{far_off:?}");
    let near = counts(20.0, 0.0);
    assert_eq!(near.drawn[..3], [0, 0, 0]);
    let seen = near.drawn[3] + near.drawn[4];
    assert!(seen > 10 && seen < all / 10, "{near:?}");
    // Beside the fabric nothing is seen.
    assert_eq!(counts(1.0, 3.0).drawn, [0; 5]);
}

/// Levels look alike where one gives way to the next.
pub fn a_finer_level_changes_little(painter: &Painter) {
    let (mesh, scene) = sample("lace.smobj");
    let strands = Strands::of_frame(&mesh, &scene, &relaxed(&mesh, &scene));
    let bounds = strands.bounds().unwrap();
    for height in [4.0, 8.0, 16.0, 36.0, 60.0, 120.0] {
        let camera = far((bounds[0] + bounds[1]) / 2.0, height * scene.gauge);
        let picture =
            |detail: f32, size| paint(painter, &strands, &camera, &Look { detail, ..plain() }, [size; 2]);
        let (coarse, fine) = (picture(1.0, 300), picture(20.0, 300));
        let covers = covered(&coarse) / covered(&fine);
        // Even the finest level covers too much where yarn is thinner than what is drawn at least.
        assert!(height > 60.0 || (covers - 1.0).abs() < 0.02, "{height}: {covers}");
        assert!(apart(&coarse, &fine) < 2.5, "{height}: {}", apart(&coarse, &fine));
        if height < 30.0 {
            continue;
        }
        // What it covers in a picture four times as large.
        let covers = 16.0 * covered(&coarse) / covered(&picture(20.0, 1200));
        assert!((covers - 1.0).abs() < 0.02, "{height}: {covers} of what it should cover");
    }
}

/// Yarn in many parts is the same yarn. Seen red with parts that lack the point after next.
#[test]
fn parts_make_no_difference() {
    let Some(adapter) = adapter() else { return };
    let (mesh, scene) = sample("lace.smobj");
    let strands = Strands::of_frame(&mesh, &scene, &relaxed(&mesh, &scene));
    // Near enough for tangents to show.
    let camera = Camera::framing(strands.bounds().unwrap(), &Axes::Y_UP, View::FRONT, 4.0 / 3.0, 3.0);
    let whole = Painter::open(&adapter).unwrap();
    let parts = Painter::open(&adapter).unwrap().with_parts_of(96);
    let [a, b] = [&whole, &parts].map(|p| paint(p, &strands, &camera, &Look::default(), [320, 240]));
    assert!(a == b, "{}", apart(&a, &b));
}
