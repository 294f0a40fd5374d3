use crate::{message, path};
use glam::{DVec2, DVec3};
use knotmesh::ids::{FaceId, VertexId};
use knotmesh::io::obj_mesh::{ObjMesh, read, read_positions};
use knotmesh::mesh::{FaceEdge, Join, StitchType};

/// Two quads and a triangle in a row, the second run through the other way round.
const SAMPLE: &str = "# made by hand
mtllib a.mtl
o object
v 0 0 0
v 1 0 0 1.0
v 1 1 0 0.5 0.5 0.5
v 0 1 0 1 0.5 0.5 0.5
vt 0 0
vt 1 0 0
vt 1
vn 0 0 1
s off
f 1/1 2/2/1 3/3 -4/1
v 2 0 0
v 2 1 0
g front upper
f 2//1 3//1 6 \\
  5
usemtl knit
v 3 0 0
l 1 2
f 6 5 7
";

fn mesh(text: &str) -> ObjMesh {
    read(path(), text.as_bytes()).unwrap()
}

fn edge(face: u32, edge: u32) -> FaceEdge {
    FaceEdge { face: FaceId(face), edge }
}

#[test]
fn polygons_are_read_with_names_and_joins() {
    let text = SAMPLE.replace("-4/1", "4/-3");
    let mesh = mesh(&text);
    assert_eq!(mesh.positions.len(), 7);
    assert_eq!(mesh.positions[2], DVec3::new(1.0, 1.0, 0.0));
    let faces: Vec<_> = (0..3).map(|f| (mesh.face_name(f), mesh.face(f), mesh.face_lines[f])).collect();
    let expected: [(&str, &[u32], u32); 3] =
        [("object", &[0, 1, 2, 3], 13), ("front upper", &[1, 2, 5, 4], 17), ("knit", &[5, 4, 6], 22)];
    assert_eq!(faces, expected);
    let uvs = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (0.0, 0.0)].map(DVec2::from).to_vec();
    assert_eq!([0, 1, 2].map(|f| mesh.face_uvs(f)), [Some(uvs), None, None]);
    let joins = [
        Join { a: edge(0, 1), b: edge(1, 0), flipped: false },
        Join { a: edge(1, 2), b: edge(2, 0), flipped: false },
    ];
    assert_eq!(mesh.joins, joins);

    let mut positions = vec![DVec3::NAN; 3];
    read_positions(path(), text.as_bytes(), &mut positions).unwrap();
    assert_eq!(positions, mesh.positions);
}

#[test]
fn neighbours_with_like_orientation_are_flipped() {
    let mesh = mesh("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
    assert_eq!(mesh.joins, [Join { a: edge(0, 2), b: edge(1, 0), flipped: true }]);
    assert_eq!(mesh.face_name(0), "");
}

#[test]
fn a_face_may_close_a_ring_and_have_edges_without_length() {
    // The corners 1 and 2 occur twice: edge 0 meets edge 2, edges 1 and 3 are single vertices.
    let mesh = mesh("v 0 0 0\nv 1 0 0\nf 1 2 2 1\n");
    assert_eq!(mesh.joins, [Join { a: edge(0, 0), b: edge(0, 2), flipped: true }]);
}

#[test]
fn malformed_lines_are_named() {
    const KEYWORD: &str = "a keyword of the OBJ format such as v, vt, f, usemtl, g or o";
    const CORNER: &str = "a corner as i, i/t, i//n or i/t/n";
    for (text, expected) in [
        ("", "1:1: found the end of the file, expected at least one face (f line)".to_string()),
        ("v 1 2", "1:6: found the end of the line, expected the vertex's z".into()),
        ("v 1 2 x", "1:7: found 'x', expected the vertex's z".into()),
        ("v 1 2 3 1 0 0 0 0", "1:17: found '0', expected the end of the line".into()),
        ("v 1 2 3 a", "1:9: found 'a', expected a weight or colour of the vertex".into()),
        ("vt", "1:3: found the end of the line, expected the texture coordinate u".into()),
        ("T 1", format!("1:1: found 'T', expected {KEYWORD}")),
        ("f 1 2 3", "1:3: found '1', expected a vertex, but none is defined before this line".into()),
        (
            "v 0 0 0\nf 1 1 2",
            "2:7: found '2', expected a vertex from 1 to 1, or from -1 to -1, defined before this line"
                .into(),
        ),
        (
            "v 0 0 0\nf 1 0 1",
            "2:5: found '0', expected a vertex from 1 to 1, or from -1 to -1, defined before this line"
                .into(),
        ),
        (
            "v 0 0 0\nf 1 -2 1",
            "2:5: found '-2', expected a vertex from 1 to 1, or from -1 to -1, defined before this line"
                .into(),
        ),
        ("v 0 0 0\nf 1 1/ 1", format!("2:5: found '1/', expected {CORNER}")),
        ("v 0 0 0\nf 1//x 1 1", format!("2:3: found '1//x', expected {CORNER}")),
        ("v 0 0 0\nf 1/1/1/1 1 1", format!("2:3: found '1/1/1/1', expected {CORNER}")),
        (
            "v 0 0 0\nf 1/1 1 1",
            "2:3: found '1/1', expected a texture coordinate, but none is defined before this line".into(),
        ),
        (
            "v 0 0 0\nvt 0 0\nf 1/1 1/1 1",
            "3:11: found '1', expected texture coordinates at all corners of a face or at none".into(),
        ),
        (
            "v 0 0 0\nf 1 1",
            "2:6: found the end of the line, expected a face with at least three vertices".into(),
        ),
        (
            "v 0 0 0\nf 1 \\\n 1 \\\n",
            "3:3: found the end of the line, expected a face with at least three vertices".into(),
        ),
        (
            "v 0 0 0\nv 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\nf 2 1 3\nf 4 \\\n 1 2",
            "8:2: found a third face on the edge of vertices 1 and 2, expected at most two faces on an edge"
                .into(),
        ),
    ] {
        assert_eq!(message(read(path(), text.as_bytes())), format!("in:{expected}"), "{text}");
    }
    let mut positions = Vec::new();
    let error = read_positions(path(), b"v 1 2 3\nvertex", &mut positions);
    assert_eq!(message(error), format!("in:2:1: found 'vertex', expected {KEYWORD}"));
}

fn stitch(count: usize) -> StitchType {
    StitchType { name: format!("s{count}"), labels: (0..count).map(|k| format!("+y{k}")).collect() }
}

#[test]
fn materials_become_stitches_and_corners_turn() {
    let mut calls = Vec::new();
    let mesh = mesh(&SAMPLE.replace("-4/1", "4/1"))
        .into_stitch_mesh(&mut |name, uvs, count| {
            calls.push((name.to_string(), uvs.is_some(), count));
            // Turn every face by one corner more than the last.
            Ok((stitch(count), calls.len() - 1))
        })
        .unwrap();
    let expected = [("object", true, 4), ("front upper", false, 4), ("knit", false, 3)];
    assert_eq!(calls, expected.map(|(name, uvs, count)| (name.to_string(), uvs, count)));
    assert_eq!(mesh.types, [stitch(4), stitch(3)]);
    assert_eq!(mesh.face_vertices, [0, 1, 2, 3, 2, 5, 4, 1, 6, 5, 4].map(VertexId));
    // Joined edges still run between the same vertices.
    for join in &mesh.joins {
        let [a, b] = [join.a, join.b].map(|side| {
            let corners = mesh.face(side.face);
            let k = side.edge as usize;
            let ends = [corners[k], corners[(k + 1) % corners.len()]];
            [ends[0].min(ends[1]), ends[0].max(ends[1])]
        });
        assert_eq!(a, b);
    }
    assert_eq!((mesh.joins.len(), mesh.face_source.len()), (2, 0));
}

#[test]
fn refusals_name_the_line_of_the_face() {
    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nusemtl wool\nf 1 2 3";
    let made = mesh(TRIANGLE).into_stitch_mesh(&mut |name, _, _| Err(format!("a template\nfor '{name}'")));
    assert_eq!(message(made), "in:6:1: found a face 'wool' with 3 corners, expected a template for 'wool'");
    let made = mesh(TRIANGLE).into_stitch_mesh(&mut |_, _, _| Ok((stitch(4), 0)));
    let expected =
        "in:6:1: found a face 'wool' with 3 corners, expected the 4 corners of 's4 +y0 +y1 +y2 +y3'";
    assert_eq!(message(made), expected);
    assert!(mesh(TRIANGLE).into_stitch_mesh(&mut |_, _, _| Ok((stitch(3), 3))).is_err());
}
