//! Closed triangle meshes against what they stand for.

use crate::common::Random;
use glam::DVec3;
use knotmesh::drape::scene::Solid;
use knotmesh::drape::solid::SolidState;

/// A ball of triangles: an octahedron's faces cut into four so many times, corners on the sphere.
pub fn ball(radius: f64, cuts: usize) -> Solid {
    let mut vertices = vec![DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for x in [0, 1] {
        for y in [2, 3] {
            for z in [4, 5] {
                let even = (x + y + z) % 2 == 0;
                triangles.push(if even { [x, y, z] } else { [y, x, z] });
            }
        }
    }
    for _ in 0..cuts {
        let mut middles = std::collections::HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    vertices.iter_mut().for_each(|v| *v *= radius);
    Solid { frames: vec![vertices], fps: 30.0, triangles }
}

fn cube() -> Solid {
    let corner = |k: usize| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    Solid { frames: vec![(0..8).map(corner).collect()], fps: 30.0, triangles }
}

#[test]
fn distances_from_a_cube_are_exact() {
    // Seen red with all points taken as outside, and with boxes passed over at half the distance.
    let solid = cube();
    solid.check().unwrap();
    let state = SolidState::new(solid);
    let mut dice = Random::new(5);
    for _ in 0..20_000 {
        let p = DVec3::from_array(std::array::from_fn(|_| dice.between(-1.0, 2.0)));
        let outside = (-p).max(p - DVec3::ONE);
        let expected = outside.max(DVec3::ZERO).length() + outside.max_element().min(0.0);
        let touch = state.touch(p, f64::INFINITY, dice.below(14) as u32).unwrap();
        assert!((touch.distance - expected).abs() < 1e-12, "{p}: {} {expected}", touch.distance);
        assert!((touch.normal.length() - 1.0).abs() < 1e-9);
        let near = state.touch(p, 0.5, 0);
        assert_eq!(near.is_some(), expected.abs() <= 0.5, "{p}");
    }
}

#[test]
fn distances_from_a_ball_are_those_of_a_sphere() {
    let state = SolidState::new(ball(0.1, 5));
    // The triangles' middles lie this deep under the sphere: h^2 / 6 R for edges of length h = R pi / 2 / 32, some of them 1.6
    // times as long.
    let sagitta = 0.1 * (1.6 * std::f64::consts::FRAC_PI_2 / 32.0_f64).powi(2) / 6.0;
    let mut dice = Random::new(6);
    for _ in 0..5_000 {
        let p = DVec3::from_array(std::array::from_fn(|_| dice.between(-0.15, 0.15)));
        let touch = state.touch(p, f64::INFINITY, 0).unwrap();
        assert!(touch.distance - (p.length() - 0.1) > -1e-12, "{p}");
        // Inside, the nearest facet is nearer than the sphere.
        assert!((touch.distance - (p.length() - 0.1)).abs() <= sagitta, "{p} {}", touch.distance);
    }
    let (point, normal) = state.enters(DVec3::X, -DVec3::X).unwrap();
    assert!((point.x - 0.1).abs() < sagitta && normal.x > 0.99);
    assert!(state.enters(DVec3::ZERO, DVec3::X).is_none(), "leaving is not entering");
}

#[test]
fn what_is_not_closed_is_refused() {
    let check = |change: &dyn Fn(&mut Solid)| {
        let mut solid = cube();
        change(&mut solid);
        solid.check().expect_err("refused").0
    };
    assert!(check(&|s| s.triangles.truncate(11)).contains("open edge"));
    assert!(check(&|s| s.triangles[0].swap(0, 1)).contains("twice in one direction"));
    assert!(check(&|s| s.triangles.iter_mut().for_each(|t| t.swap(0, 1))).contains("volume"));
    assert!(check(&|s| s.triangles[0][0] = 99).contains("vertex 99"));
    assert!(check(&|s| s.triangles[0][0] = s.triangles[0][1]).contains("corner twice"));
    assert!(check(&|s| s.frames[0][3].x = f64::NAN).contains("vertex 3 of frame 0"));
    assert!(check(&|s| s.frames.push(vec![])).contains("0 vertices in frame 1"));
    assert!(check(&|s| s.frames.clear()).contains("no positions"));
    assert!(check(&|s| s.triangles.clear()).contains("no triangles"));
}

#[test]
fn frames_of_a_solid_are_interpolated() {
    // Seen red without the surface's own motion.
    let mut solid = cube();
    let moved = solid.frames[0].iter().map(|p| *p + DVec3::X).collect();
    solid.frames.push(moved);
    solid.fps = 10.0;
    let mut state = SolidState::new(solid);
    state.set_times(0.04, 0.05);
    let touch = state.touch(DVec3::new(1.7, 0.5, 0.5), f64::INFINITY, 0).unwrap();
    assert!((touch.distance - 0.2).abs() < 1e-12 && touch.slide.abs_diff_eq(DVec3::X * 0.1, 1e-12));
    assert!(state.travelled() >= 0.5 - 1e-12);
    state.set_times(7.0, 8.0);
    let touch = state.touch(DVec3::new(2.2, 0.5, 0.5), f64::INFINITY, 0).unwrap();
    assert!((touch.distance - 0.2).abs() < 1e-12 && touch.slide == DVec3::ZERO);
}

#[test]
fn signs_hold_at_sharp_corners() {
    // A needle: at its tip, points outside lie behind the plane of a face that is as near as the others. Seen red with normals of
    // faces for pseudonormals.
    let tip = DVec3::new(0.0, 0.0, 10.0);
    let base = [DVec3::new(1.0, 0.0, 0.0), DVec3::new(-0.5, 0.8, 0.0), DVec3::new(-0.5, -0.8, 0.0)];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let vertices = vec![base[0], base[1], base[2], tip];
    let solid = Solid { frames: vec![vertices.clone()], fps: 30.0, triangles: triangles.clone() };
    solid.check().unwrap();
    let state = SolidState::new(solid);
    let mut dice = Random::new(8);
    let mut inside_count = 0;
    for _ in 0..50_000 {
        let p = DVec3::new(dice.between(-1.5, 1.5), dice.between(-1.5, 1.5), dice.between(-1.0, 12.0));
        let inside = triangles.iter().all(|t| {
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            (p - a).dot((b - a).cross(c - a)) < 0.0
        });
        let touch = state.touch(p, f64::INFINITY, 0).unwrap();
        assert_eq!(touch.distance < 0.0, inside, "{p} {}", touch.distance);
        inside_count += usize::from(inside);
    }
    assert!(inside_count > 500);
}
