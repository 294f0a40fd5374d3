//! Real files, where `KNOTMESH_DATA` names a directory with them.

use glam::DVec2;
use knotmesh::io::sf::{self, PlainPoint, PlainTemplate};
use knotmesh::io::{obj_mesh, smobj};
use std::collections::HashSet;
use std::path::PathBuf;

fn data() -> Option<PathBuf> {
    let data = std::env::var_os("KNOTMESH_DATA").map(PathBuf::from);
    if data.is_none() {
        println!("skipped: KNOTMESH_DATA is not set");
    }
    data
}

/// The counts were taken with awk, not with this reader.
#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn stitch_meshes() {
    let Some(data) = data() else { return };
    // File, vertices, faces, joins, joins that are not flipped, types, hints, ignored lines.
    for (name, expected) in [
        ("smobj/decrease-hinted.smobj", [51, 12, 17, 0, 30, 75, 4]),
        ("smobj/decrease.smobj", [57, 14, 19, 0, 37, 0, 0]),
        ("smobj/k.smobj", [5188, 1287, 1440, 336, 16, 0, 0]),
        ("smobj/short-row-hinted-2.smobj", [139, 34, 58, 0, 13, 266, 0]),
        ("smobj/short-row-hinted.smobj", [139, 34, 58, 0, 13, 259, 0]),
        ("smobj/short-row.smobj", [139, 34, 58, 0, 7, 0, 0]),
        ("smobj/spacer.smobj", [166, 37, 58, 0, 25, 166, 0]),
        ("smobj/tube-decrease.smobj", [105, 26, 39, 0, 24, 0, 0]),
        ("smobj/twill.smobj", [100, 25, 40, 0, 2, 0, 0]),
        ("smobj/two-sheets.smobj", [82, 20, 24, 0, 24, 148, 0]),
        ("welded/relaxed_stitch0400.smobj", [361, 324, 612, 0, 1, 0, 0]),
        ("knitgraph/bob.smobj", [12752, 3182, 6376, 0, 9, 0, 0]),
    ] {
        let mesh = smobj::read_file(&data.join(name)).unwrap();
        let counts = [
            mesh.positions.len(),
            mesh.face_count(),
            mesh.joins.len(),
            mesh.joins.iter().filter(|join| !join.flipped).count(),
            mesh.types.len(),
            mesh.hints.len(),
            mesh.ignored.iter().map(|(_, count)| count).sum(),
        ];
        assert_eq!(counts, expected, "{name}");
        let sourced = if name.starts_with("welded") { 0 } else { mesh.face_count() };
        assert_eq!(mesh.face_source.len(), sourced, "{name}");

        let mut text = Vec::new();
        smobj::write(&mesh, &mut text).unwrap();
        let mut kept = mesh;
        kept.ignored.clear();
        assert_eq!(smobj::read(name.as_ref(), &text).unwrap(), kept, "{name}");
    }
    let knit = smobj::read_file(&data.join("smobj/k.smobj")).unwrap();
    assert_eq!((knit.units.len(), knit.checkpoints.len()), (8, 338));
    assert_eq!(knit.checkpoints[0].lengths, [(1.0, 1), (52.0, 2), (26.0, 3)]);
    assert_eq!(knit.checkpoints.iter().map(|c| c.lengths.len()).sum::<usize>(), 169 + 128 * 2 + 41 * 3);
    let spacer = smobj::read_file(&data.join("smobj/spacer.smobj")).unwrap();
    assert_eq!((0..37).map(|f| spacer.face(f.into()).len()).max(), Some(18));
}

fn area(face: &PlainTemplate) -> f64 {
    let next = face.corners.iter().cycle().skip(1);
    face.corners.iter().zip(next).map(|(a, b)| 0.5 * a.perp_dot(*b)).sum()
}

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn face_libraries() {
    let Some(data) = data() else { return };
    let mut keys = HashSet::new();
    for (name, faces, drawn, yarns) in
        [("illustration", 56, 27, 109), ("knitout", 138, 87, 316), ("weave", 2, 2, 4)]
    {
        let path = data.join(format!("smobj/{name}.sf"));
        let library = sf::read_file(&path).unwrap();
        assert_eq!(library.len(), faces, "{name}");
        // The faces that are drawn (not derived) hold the file's yarn lines.
        let text = std::fs::read_to_string(&path).unwrap();
        let derived: HashSet<_> = text
            .lines()
            .filter_map(|line| line.strip_prefix("derive "))
            .map(|line| line.split(" by ").next().unwrap().trim().to_string())
            .collect();
        let own: Vec<_> = library.iter().filter(|face| !derived.contains(&face.key())).collect();
        assert_eq!(own.len(), drawn, "{name}");
        assert_eq!(own.iter().map(|face| face.strands.len()).sum::<usize>(), yarns, "{name}");
        for face in &library {
            // Mirrored outlines stay counter-clockwise.
            assert!(area(face) > 0.0, "{name}: {}", face.key());
            assert!(keys.insert(face.key()) || name != "weave");
        }
    }
    let library = sf::read_file(&data.join("smobj/illustration.sf")).unwrap();
    let find = |key: &str| library.iter().find(|face| face.key() == key).unwrap();
    let knit = find("knit- -lX -yX +lX +yX");
    assert_eq!(knit.corners, [(-1.0, -0.61), (1.0, -0.61), (1.0, 0.61), (-1.0, 0.61)].map(DVec2::from));
    assert_eq!(knit.strands[0][0], PlainPoint::Boundary { edge: 1, along: 0.25, z: 0.0 });
    assert_eq!(knit.strands[0][1], PlainPoint::Interior((0.321847, -0.211278, -0.19533).into()));
    // A strand that ends inside the face begins without a boundary point.
    let start = find("start> -lX +lX +yX");
    assert!(matches!(start.strands[1][0], PlainPoint::Interior(_)) && start.strands[1].len() == 4);
    // Faces whose stitch no library has: `drop+` and `drop-`, which the libraries call `drop`. (By awk.)
    for (name, missing) in [
        ("decrease-hinted", 2),
        ("decrease", 0),
        ("k", 0),
        ("short-row", 0),
        ("spacer", 8),
        ("tube-decrease", 6),
        ("twill", 0),
        ("two-sheets", 6),
    ] {
        let mesh = smobj::read_file(&data.join(format!("smobj/{name}.smobj"))).unwrap();
        let lacking = (0..mesh.face_count()).filter(|&f| !keys.contains(&mesh.face_type(f.into()).key()));
        assert_eq!(lacking.count(), missing, "{name}");
    }
}

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn polygons_of_other_programs() {
    let Some(data) = data() else { return };
    let sock = obj_mesh::read_file(&data.join("madypg/objstatic/sock/cloth.obj")).unwrap();
    println!(
        "sock: {} vertices, {} faces, {} joins",
        sock.positions.len(),
        sock.face_count(),
        sock.joins.len()
    );
    assert!(sock.joins.iter().all(|join| join.flipped));
    // Yarn as polylines has vertices but no faces.
    let path = data.join("obj-lines/houdiniobj.obj");
    let error = obj_mesh::read_file(&path).unwrap_err().to_string();
    assert!(error.ends_with("found the end of the file, expected at least one face (f line)"), "{error}");
    let mut positions = Vec::new();
    obj_mesh::read_positions(&path, &std::fs::read(&path).unwrap(), &mut positions).unwrap();
    assert!(!positions.is_empty());
}
