//! What must hold of every mesh that is knitted.

use super::{from_stitches, from_text, settings};
use glam::DVec3;
use knotmesh::design::Settings;
use knotmesh::ids::FaceId;
use knotmesh::io::smobj;
use knotmesh::mesh::StitchMesh;
use std::collections::HashMap;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::path::Path;

/// Finite, welded, at least triangles, the same after writing and reading.
pub fn check(mesh: &StitchMesh, place: &str) {
    assert!(mesh.positions.iter().all(|p| p.is_finite()), "{place}: positions");
    let mut edges: HashMap<[u32; 2], Vec<bool>> = HashMap::new();
    for face in 0..mesh.face_count() {
        let vertices = mesh.face(FaceId(face as u32));
        let mut corners: Vec<u32> = vertices.iter().map(|v| v.0).collect();
        corners.sort_unstable();
        corners.dedup();
        let name = &mesh.face_type(FaceId(face as u32)).name;
        let line = mesh.face_source[face];
        assert!(corners.len() >= 3, "{place}: {name} of line {line} has {} corners", corners.len());
        for k in 0..vertices.len() {
            let (a, b) = (vertices[k].0, vertices[(k + 1) % vertices.len()].0);
            // A seam ends in a point where rounds close above it.
            if a != b {
                edges.entry([a.min(b), a.max(b)]).or_default().push(a < b);
            }
        }
    }
    for (edge, faces) in &edges {
        assert!(faces.len() <= 2, "{place}: {} faces at {edge:?}", faces.len());
        assert!(faces.len() < 2 || faces[0] != faces[1], "{place}: faces at {edge:?} are of two minds");
    }
    for join in &mesh.joins {
        let ends = |e: knotmesh::mesh::FaceEdge| {
            let vertices = mesh.face(e.face);
            [vertices[e.edge as usize], vertices[(e.edge as usize + 1) % vertices.len()]]
        };
        let ([a, b], [c, d]) = (ends(join.a), ends(join.b));
        assert!(a == d && b == c, "{place}: {join:?} is not welded");
    }
    let mut bytes = Vec::new();
    smobj::write(mesh, &mut bytes).unwrap();
    let again = smobj::read(Path::new("a.smobj"), &bytes).unwrap();
    assert!(again == *mesh, "{place}: comes back as another mesh");
}

/// Twice the face's area, along its normal.
fn normal(mesh: &StitchMesh, face: usize) -> DVec3 {
    let places: Vec<DVec3> =
        mesh.face(FaceId(face as u32)).iter().map(|v| mesh.positions[v.0 as usize]).collect();
    (1..places.len() - 1).map(|k| (places[k] - places[0]).cross(places[k + 1] - places[0])).sum()
}

fn middle(mesh: &StitchMesh, face: usize) -> DVec3 {
    let vertices = mesh.face(FaceId(face as u32));
    vertices.iter().map(|v| mesh.positions[v.0 as usize]).sum::<DVec3>() / vertices.len() as f64
}

/// Seen red with rounds that run the other way around.
#[test]
fn tubes_face_away_from_their_axis() {
    for (at, toward, start) in [
        (DVec3::ZERO, DVec3::Y, -DVec3::Z),
        (DVec3::new(0.5, 1.0, -0.25), -DVec3::X, -DVec3::Y),
        (DVec3::new(0.0, 0.25, 0.125), DVec3::new(1.0, 2.0, -2.0) / 3.0, DVec3::new(2.0, 1.0, 2.0) / 3.0),
    ] {
        let three = |v: DVec3| format!("({}, {}, {})", v.x, v.y, v.z);
        let text = format!(
            "piece tube round at {} toward {} start {}\nco 40\nRnds 1-25: *k2, p2; rep from *\nbo\n",
            three(at),
            three(toward),
            three(start)
        );
        let mesh = from_text(&text, &settings(Some((20.0, 30.0)), None)).unwrap().mesh;
        let mut highest: f64 = 0.0;
        for face in 0..mesh.face_count() {
            let out = middle(&mesh, face) - at;
            let along = out.dot(toward);
            let away = out - toward * along;
            assert!(normal(&mesh, face).dot(away) > 0.0, "face {face} of the tube along {toward}");
            // 40 stitches of 5 mm.
            assert!((away.length() - 0.2 / std::f64::consts::TAU).abs() < 0.004, "{}", away.length());
            highest = highest.max(along);
        }
        // Cast-on, 25 rounds, bind-off, of 1/3 cm each, and half a row of helix.
        assert!((highest - 0.09).abs() < 0.005, "{highest}");
        // Its first stitch is the round's first.
        let first = middle(&mesh, 0) - at;
        let away = (first - toward * first.dot(toward)).normalize();
        assert!(away.dot(start) > 0.98, "{away} for {start}");
    }
}

/// Seen red with wrong-side rows laid from right to left.
#[test]
fn flat_pieces_face_forward() {
    for name in [
        "stockinette",
        "garter",
        "rib-1x1",
        "feather-and-fan",
        "flame-chevron",
        "openwork-lace",
        "tuck",
        "slip-stitch",
    ] {
        let mesh = from_stitches(name, &Settings::default()).mesh;
        let turned = (0..mesh.face_count()).filter(|f| normal(&mesh, *f).z <= 0.0).count();
        assert_eq!(turned, 0, "{name}");
    }
}

/// Sleeves hang at the body's sides and the yoke joins them: what is joined lies near each other. Seen red with the left sleeve on the
/// right, and with sleeves turned about themselves by 24 degrees.
#[test]
fn the_sweater_is_put_together_in_space() {
    let mesh = from_stitches("raglan-sweater", &Settings::default()).mesh;
    let high = mesh.positions.iter().fold(DVec3::MIN, |a, b| a.max(*b));
    let low = mesh.positions.iter().fold(DVec3::MAX, |a, b| a.min(*b));
    let size = high - low;
    // From cuff to cuff the body, and twice a sleeve at half a right angle with the radii of its ends across.
    let (radius, sleeve, [top, cuff]) = (1.04 / TAU, 0.46, [0.37 / TAU, 0.23 / TAU]);
    let wide = 2.0 * (radius + FRAC_1_SQRT_2 * (sleeve + top + cuff));
    assert!((size.x - wide).abs() < 0.05, "{size}: {wide}");
    assert!(size.y > 0.55 && size.y < 0.8 && size.z < 0.45, "{size}");
    for face in 0..mesh.face_count() {
        let vertices = mesh.face(FaceId(face as u32));
        for k in 0..vertices.len() {
            let [a, b] = [k, (k + 1) % vertices.len()].map(|k| mesh.positions[vertices[k].0 as usize]);
            assert!(a.distance(b) < 0.04, "line {}: an edge of {}", mesh.face_source[face], a.distance(b));
        }
    }
}
