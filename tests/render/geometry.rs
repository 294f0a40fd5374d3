//! Pixels against closed forms. (`proved.rs` runs these, and sees each fail.)

use super::scenes::{apart, covered, far, paint, plain, yarn};
use glam::{DQuat, DVec3};
use knotmesh::render::{Camera, Look, Painter};
use std::f64::consts::PI;

const SIZE: [u32; 2] = [400, 300];

/// A straight yarn with round ends covers 2 r l + pi r^2, whatever the level at which it is drawn, and wherever it points.
pub fn a_cylinder_covers_what_it_should(painter: &Painter) {
    for pixels in [0.5, 0.9, 1.5, 3.0, 6.0, 14.0, 20.0, 60.0] {
        for degrees in [17.0, 71.0] {
            let direction = DQuat::from_rotation_z(f64::to_radians(degrees)) * DVec3::X;
            // 300 pixels are 3 units high.
            let (radius, half) = (pixels / 100.0, 0.6);
            let points: Vec<DVec3> =
                (0..7).map(|i| direction * (half * (f64::from(i) / 3.0 - 1.0))).collect();
            let strands = yarn(&points, false, radius as f32);
            let picture = paint(painter, &strands, &far(DVec3::ZERO, 3.0), &plain(), SIZE);
            let exact = (4.0 * half * radius + PI * radius * radius) * 1e4;
            let found = covered(&picture);
            // Of a border that long, samples miss some of a pixel.
            let border = (4.0 * half + 2.0 * PI * radius) * 100.0;
            let allowed = 0.012 * exact + 0.02 * border;
            assert!(
                (found - exact).abs() < allowed,
                "radius {pixels} px, {degrees} degrees: {found:.1} pixels, expected {exact:.1} +- {allowed:.1}"
            );
        }
    }
}

/// A closed yarn has no ends: a ring covers 2 pi R 2 r.
pub fn a_ring_covers_what_it_should(painter: &Painter) {
    let at = |i: u32| DQuat::from_rotation_z(f64::from(i) * PI / 12.0) * DVec3::X;
    let points: Vec<DVec3> = (0..24).map(at).collect();
    for radius in [0.02, 0.05, 0.2] {
        let strands = yarn(&points, true, radius as f32);
        let picture = paint(painter, &strands, &far(DVec3::ZERO, 3.0), &plain(), SIZE);
        let exact = 2.0 * PI * 2.0 * radius * 1e4;
        let found = covered(&picture);
        assert!(
            (found - exact).abs() < 0.015 * exact + 12.0,
            "radius {radius}: {found:.1}, expected {exact:.1}"
        );
    }
}

/// Stretched to twice its length, yarn is 1 / sqrt 2 as thick.
pub fn volume_is_kept(painter: &Painter) {
    let points: Vec<DVec3> = (0..9).map(|i| DVec3::X * (f64::from(i) / 2.0 - 2.0)).collect();
    let mut strands = yarn(&points, false, 0.2);
    strands.rest = vec![0.25; points.len()];
    // The picture is 2 units wide: the ends are out of it.
    let camera = far(DVec3::ZERO, 1.5);
    let area = |look: &Look| covered(&paint(painter, &strands, &camera, look, SIZE)) / (400.0 * 300.0);
    let kept = area(&plain());
    let exact = 0.4 / f64::sqrt(2.0) / 1.5;
    assert!((kept - exact).abs() < 0.01 * exact, "{kept}, expected {exact}");
    let thick = area(&Look { keep_volume: false, ..plain() });
    assert!((thick - 0.4 / 1.5).abs() < 0.003, "{thick}");
}

/// Yarn and camera turned and moved alike give the same picture: light goes with the camera, plies with the yarn.
pub fn a_picture_does_not_depend_on_axes(painter: &Painter) {
    let at = |i: u32| {
        let t = f64::from(i) / 30.0 * 2.0 * PI;
        DVec3::new(
            (2.0 + (3.0 * t).cos()) * (2.0 * t).cos(),
            (2.0 + (3.0 * t).cos()) * (2.0 * t).sin(),
            (3.0 * t).sin(),
        )
    };
    let knot: Vec<DVec3> = (0..30).map(at).collect();
    let camera = Camera { eye: DVec3::new(3.0, 4.0, 16.0), target: DVec3::ZERO, up: DVec3::Y, field: 0.5 };
    let first = paint(painter, &yarn(&knot, true, 0.3), &camera, &plain(), SIZE);
    assert!(covered(&first) > 5000.0);
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 2.1);
    let turned: Vec<DVec3> = knot.iter().map(|p| turn * *p).collect();
    let mut strands = yarn(&turned, true, 0.3);
    strands.origin = DVec3::new(100.0, 50.0, -20.0);
    let camera = Camera {
        eye: strands.origin + turn * camera.eye,
        target: strands.origin,
        up: turn * camera.up,
        ..camera
    };
    let second = paint(painter, &strands, &camera, &plain(), SIZE);
    // Where plies begin around the first point is any direction across it.
    let smooth =
        |strands: &_, camera: &_| paint(painter, strands, camera, &Look { plies: false, ..plain() }, SIZE);
    let eye = Camera { eye: DVec3::new(3.0, 4.0, 16.0), target: DVec3::ZERO, up: DVec3::Y, field: 0.5 };
    let [a, b] = [smooth(&yarn(&knot, true, 0.3), &eye), smooth(&strands, &camera)];
    assert!(apart(&a, &b) < 0.5, "{}", apart(&a, &b));
    assert!((covered(&first) - covered(&second)).abs() < 20.0);
}
