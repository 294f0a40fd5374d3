//! The meshes: welded, front out, as large as the gauge says, each face with its place in the pattern.

use super::{sample, worked};
use glam::DVec3;
use knotmesh::design::Knitted;
use knotmesh::io::smobj;
use std::collections::{BTreeMap, HashMap};

const NAMES: [&str; 6] = ["hat", "sock", "mitten", "raglan-sweater", "button-band", "cowl"];

fn normal(knitted: &Knitted, face: usize) -> DVec3 {
    let p: Vec<DVec3> =
        knitted.mesh.face(face.into()).iter().map(|v| knitted.mesh.positions[v.index()]).collect();
    (1..p.len() - 1).map(|k| (p[k] - p[0]).cross(p[k + 1] - p[0])).sum()
}

/// Seen red with the column left out by the writer.
#[test]
fn meshes_round_trip() {
    for name in NAMES.into_iter().chain(["slip-stitch"]) {
        let mesh = sample(name, 8.0, None, None).mesh;
        let mut bytes = Vec::new();
        smobj::write(&mesh, &mut bytes).unwrap();
        assert_eq!(smobj::read("a.smobj".as_ref(), &bytes).unwrap(), mesh, "{name}");
    }
}

/// Each edge belongs to two faces at most, and those that share one run along it in opposite directions; a face's
/// corners are different places. Seen red with a draw of triangles alone, whose last one collapses.
#[test]
fn meshes_are_welded() {
    for name in NAMES {
        let mesh = sample(name, 9.0, None, None).mesh;
        let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
        for face in 0..mesh.face_count() {
            let corners = mesh.face(face.into());
            for k in 0..corners.len() {
                let ends = [corners[k].0, corners[(k + 1) % corners.len()].0];
                assert_ne!(ends[0], ends[1], "{name}: face {face}");
                *edges.entry(ends).or_default() += 1;
            }
        }
        let twice = edges.iter().filter(|(_, n)| **n > 1).count();
        // The first stitch of a drawn-in round lies against the last one.
        assert!(twice <= 2, "{name}: {twice} edges run the same way in two faces");
    }
}

/// Held stitches come back on the wrong side as they left. Seen red with their order turned round.
#[test]
fn held_stitches_come_back_in_their_order() {
    for n in [6, 4] {
        let text = format!("co 6\nRow: k\nhold {n} as a\nRow: from a, p6\nbo\n");
        let mesh = worked(&text).unwrap().mesh;
        for face in 0..mesh.face_count() {
            let mut corners: Vec<u32> = mesh.face(face.into()).iter().map(|v| v.0).collect();
            corners.sort_unstable();
            corners.dedup();
            assert_eq!(corners.len(), mesh.face(face.into()).len(), "{text}: face {face}");
        }
    }
}

/// Seen red with rounds that run the other way around.
#[test]
fn fronts_face_out() {
    let tube = worked("piece t round\nco 40\nRnds 1-12: k\nbo\n").unwrap();
    for face in 0..tube.mesh.face_count() {
        let corners = tube.mesh.face(face.into());
        let centre: DVec3 =
            corners.iter().map(|v| tube.mesh.positions[v.index()]).sum::<DVec3>() / corners.len() as f64;
        let out = DVec3::new(centre.x, 0.0, centre.z);
        if tube.mesh.face_type(face.into()).labels.len() == 4 {
            assert!(normal(&tube, face).dot(out) > 0.0, "face {face}");
        }
    }
    // 40 stitches of 1 / 22 of 10 cm around.
    let radius = 40.0 * (0.1 / 22.0) / std::f64::consts::TAU;
    let wall = tube.mesh.positions.iter().filter(|p| (p.y - 0.01).abs() < 0.005);
    for p in wall {
        let r = DVec3::new(p.x, 0.0, p.z).length();
        assert!((r / radius - 1.0).abs() < 0.03, "{r} {radius}");
    }
    let flat = worked("co 10\nRow 1: k\nRow 2: p\nbo\n").unwrap();
    for face in 0..flat.mesh.face_count() {
        let n = normal(&flat, face);
        assert!(n.z > 0.0 && n.truncate().length() < 1e-9 * n.z, "face {face}: {n}");
    }
}

/// What the front shows of what was worked. Seen red with `p2tog` for `k2tog` on wrong sides.
#[test]
fn fronts_show_what_was_worked() {
    let names = |text: &str| {
        let knitted = worked(text).unwrap();
        let mut names: BTreeMap<String, usize> = BTreeMap::new();
        for face in 0..knitted.mesh.face_count() {
            *names.entry(knitted.mesh.face_type(face.into()).name.clone()).or_default() += 1;
        }
        names
    };
    let count = |names: &BTreeMap<String, usize>, name: &str| names.get(name).copied().unwrap_or(0);
    let stockinette = names("co 6\nRow 1: k\nRow 2: p\nRow 3: k\nbo\n");
    // Three rows to and fro, and the bind-off on the wrong side, which shows purls.
    assert_eq!([count(&stockinette, "knit-"), count(&stockinette, "knit+")], [12, 6]);
    assert_eq!(count(&stockinette, "purl-bind-off+"), 4);
    let garter = names("co 6\nRow 1: k\nRow 2: k\nbo\n");
    assert_eq!([count(&garter, "knit-"), count(&garter, "purl+")], [6, 6]);
    let decreases = names("co 9\nRow 1: k1, k2tog, k1, ssk, k1, p2tog\nRow 2: p2tog, k2, ssk\nbo\n");
    for (name, n) in [
        ("decrease-right-", 1),
        ("decrease-left-", 1),
        // A purl of right-side rows is a knit from behind: the mirror image leans the other way.
        ("purl-decrease-left-", 1),
        ("decrease-right+", 1),
        ("purl-decrease-right+", 1),
    ] {
        assert_eq!(count(&decreases, name), n, "{name}: {decreases:?}");
    }
    // A loop of the bare yarn shares the face of the stitch before it, to the left of it on right-side rows.
    let makes = names("co 6\nRow 1: k1, yo, k2, m1l, p1, m1r, kfb, k1\nRow 2: p1, yo, p to end\nbo\n");
    for name in [
        "make-left-tuck-",
        "make-left-tuck-twist-",
        "purl-make-left-tuck-twist-",
        "make-left-split-",
        "make-right-tuck+",
    ] {
        assert_eq!(count(&makes, name), 1, "{name}: {makes:?}");
    }
}

/// Seen red with columns counted from 0.
#[test]
fn faces_know_their_place() {
    let text = "co 4\nRow 1: k1, *p1,\n   k2\n; rep from *\nbo\n";
    assert!(worked(text).is_err(), "a line that ends in a number ends there");
    let knitted = worked("co 4\nRow 1: k1, (p1,\n   k1) x 1, p1\nbo\n").unwrap();
    let places = |line: u32| -> Vec<u32> {
        let mesh = &knitted.mesh;
        (0..mesh.face_count())
            .filter(|f| mesh.face_source[*f] == line && mesh.face_type((*f).into()).name.len() == 5)
            .map(|f| mesh.face_origins[f].column)
            .collect()
    };
    assert_eq!((places(2), places(3)), (vec![8, 13], vec![4, 13]));
}
