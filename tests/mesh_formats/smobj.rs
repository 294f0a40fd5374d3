use crate::{message, path};
use glam::DVec3;
use knotmesh::ids::{FaceId, TypeId, VertexId};
use knotmesh::io::smobj::{read, write};
use knotmesh::mesh::{Checkpoint, FaceEdge, Join, StitchMesh, YarnUnit};
use std::fmt::Write as _;

/// Two quads and a triangle, with every kind of line and lines in odd places.
const SAMPLE: &str = "\u{feff}# a comment first
# gauge the first that is one counts
# gauge 0.5 1e-1
# gauge 1 2
T 1
e 1/3 2/-1
L knit -l +y +l -y # types may follow faces that use them
L end -l +y x
v 0 0 0
v 1 0 0
v 1 1e0 0.5 #with a comment
v 0 1 .5
f 1 2 3 4
v 1 2 -.25\r
\tv 0 2 0
o 0/1 2/1 u
f -3/7 -4/8/9 5//3 6

f 6 5 5
T 1
T 2
N 7
N 7
N 9
e 2/3 3/1
e 1/-2 1/-4
U 1 1.0
U na 0.1
c 1/2/1 1.5 2 0 1
c 1/2/2
h 1/1 f0.5 i
t 1 front h
l 1 0 1 u
I 1/1
xfer f0 b0
vt 0 0
ci 1/1
vt 1 1
usemtl wool
mtllib a.mtl
vn 0 0 1";

fn sample() -> StitchMesh {
    read(path(), SAMPLE.as_bytes()).unwrap()
}

fn edge(face: u32, edge: u32) -> FaceEdge {
    FaceEdge { face: FaceId(face), edge }
}

#[test]
fn every_kind_of_line_is_kept_or_counted() {
    let mesh = sample();
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!(mesh.positions[2], DVec3::new(1.0, 1.0, 0.5));
    assert_eq!(mesh.positions[4], DVec3::new(1.0, 2.0, -0.25));
    assert_eq!(mesh.face_offsets, [0, 4, 8, 11]);
    assert_eq!(mesh.face_vertices, [0, 1, 2, 3, 3, 2, 4, 5, 5, 4, 4].map(VertexId));
    assert_eq!(mesh.face_types, [0, 0, 1].map(TypeId));
    assert_eq!(mesh.face_type(FaceId(2)).key(), "end -l +y x");
    assert_eq!(mesh.face_source, [7, 7, 9]);
    assert_eq!(mesh.gauge, Some([0.5, 0.1]));
    let joins = [
        Join { a: edge(0, 2), b: edge(1, 0), flipped: true },
        Join { a: edge(1, 2), b: edge(2, 0), flipped: false },
        Join { a: edge(0, 1), b: edge(0, 3), flipped: false },
    ];
    assert_eq!(mesh.joins, joins);
    let unit = |name: &str, length| YarnUnit { name: name.into(), length };
    assert_eq!(mesh.units, [unit("1", 1.0), unit("na", 0.1)]);
    let checkpoints = [
        Checkpoint { at: edge(0, 1), crossing: 0, lengths: vec![(1.5, 1), (0.0, 0)] },
        Checkpoint { at: edge(0, 1), crossing: 1, lengths: vec![] },
    ];
    assert_eq!(mesh.checkpoints, checkpoints);
    assert_eq!(
        mesh.hints,
        ["o 0/1 2/1 u", "h 1/1 f0.5 i", "t 1 front h", "l 1 0 1 u", "I 1/1", "xfer f0 b0"]
    );
    let ignored = [("vt", 2), ("ci", 1), ("usemtl", 1), ("mtllib", 1), ("vn", 1)];
    assert_eq!(mesh.ignored, ignored.map(|(kind, count)| (kind.to_string(), count)));
}

#[test]
fn what_is_written_reads_back_the_same() {
    let mut mesh = sample();
    mesh.ignored.clear();
    let extremes = [0.1 + 0.2, -0.0, 5e-324, f64::MAX, 1e-5, 1e16, 123456789.12345678, -1.0 / 3.0];
    mesh.positions.extend(extremes.windows(3).map(|w| DVec3::new(w[0], w[1], w[2])));
    let mut text = Vec::new();
    write(&mesh, &mut text).unwrap();
    let again = read(path(), &text).unwrap();
    assert_eq!(again, mesh);
    assert!(again.positions[7].x.is_sign_negative());
}

#[test]
fn names_that_would_not_read_back_are_refused() {
    let broken: [fn(&mut StitchMesh); 6] = [
        |m| m.types[0].name = "two words".into(),
        |m| m.types[0].labels[0] = "a#b".into(),
        |m| m.units[1].name = String::new(),
        |m| m.hints[0].push('\n'),
        |m| m.positions[0].y = f64::NAN,
        |m| m.checkpoints[0].lengths[0].0 = f64::INFINITY,
    ];
    for break_it in broken {
        let mut mesh = sample();
        break_it(&mut mesh);
        assert_eq!(write(&mesh, &mut Vec::new()).unwrap_err().kind(), std::io::ErrorKind::InvalidInput);
    }
}

#[test]
fn faces_may_be_degenerate_and_have_any_number_of_corners() {
    let mut text = "L a x x x\nf 1 1 1\nT 1\nv 0 0 0\nL b".to_string();
    let mut face = "f".to_string();
    for _ in 0..1000 {
        text.push_str(" x");
        face.push_str(" -1");
    }
    write!(text, "\n{face}\nT 2\n").unwrap();
    let mesh = read(path(), text.as_bytes()).unwrap();
    assert_eq!(mesh.face_offsets, [0, 3, 1003]);
}

#[test]
fn malformed_lines_are_named() {
    const VERTEX: &str = "a vertex number (from 1, or negative from the last vertex so far)";
    const EDGE: &str = "face/edge, counted from 1 (a negative edge is run through backwards)";
    const ORDER: &str = "face/instruction of an order hint (object names do not belong in .smobj)";
    const KINDS: &str = "one of L v f T N e U c h o t l I xfer ci vn vt usemtl mtllib";
    for (text, expected) in [
        ("v 1 2", "1:6: found the end of the line, expected the vertex's z".to_string()),
        ("v 1 2 \n", "1:6: found the end of the line, expected the vertex's z".into()),
        ("\nv 1 x 3", "2:5: found 'x', expected the vertex's y".into()),
        ("v 1 nan 3", "1:5: found 'nan', expected the vertex's y".into()),
        ("v 1 1e999 3", "1:5: found '1e999', expected the vertex's y".into()),
        ("v 1 2 3 4", "1:9: found '4', expected the end of the line".into()),
        ("v 1 2#3", "1:6: found the end of the line, expected the vertex's z".into()),
        ("v 1 \u{fc} 3", "1:5: found '\u{fc}', expected the vertex's y".into()),
        ("f 1 2", "1:6: found the end of the line, expected a face with at least three vertices".into()),
        ("f 0 1 2", format!("1:3: found '0', expected {VERTEX}")),
        ("v 0 0 0\nf 1 -2 1", format!("2:5: found '-2', expected {VERTEX}")),
        ("f 1 2/ 3", format!("1:5: found '2/', expected {VERTEX}")),
        ("f 1 2 3/x", format!("1:7: found '3/x', expected {VERTEX}")),
        ("f 1 99999999999 3", format!("1:5: found '99999999999', expected {VERTEX}")),
        ("T 0", "1:3: found '0', expected the number of a stitch type".into()),
        ("T", "1:2: found the end of the line, expected the number of a stitch type".into()),
        ("T 1 2", "1:5: found '2', expected the end of the line".into()),
        ("N -1", "1:3: found '-1', expected the number of a pattern line".into()),
        ("e 1/1", format!("1:6: found the end of the line, expected {EDGE}")),
        ("e 1/1 2", format!("1:7: found '2', expected {EDGE}")),
        ("e 1/0 2/1", format!("1:3: found '1/0', expected {EDGE}")),
        ("e -1/1 2/1", format!("1:3: found '-1/1', expected {EDGE}")),
        ("e 1/1 2/1 3/1", "1:11: found '3/1', expected the end of the line".into()),
        ("L a x x", "1:8: found the end of the line, expected at least three edge labels".into()),
        (
            "L a x x x\nL b x x x\n L  a x  x x",
            "3:5: found 'a x x x' for the second time, expected each name with its labels once".into(),
        ),
        ("U 1 2", "1:3: found '1 2', expected '1 1.0' as the first yarn unit".into()),
        ("U a 1", "1:3: found 'a 1', expected '1 1.0' as the first yarn unit".into()),
        ("U 1", "1:4: found the end of the line, expected the length of the unit".into()),
        ("c 1/2", "1:3: found '1/2', expected face/edge/crossing, counted from 1".into()),
        ("c 1/2/0", "1:3: found '1/2/0', expected face/edge/crossing, counted from 1".into()),
        ("c 1/2/1/1", "1:3: found '1/2/1/1', expected face/edge/crossing, counted from 1".into()),
        (
            "c 1/1/1 3",
            "1:10: found the end of the line, expected the number of a yarn unit after each length".into(),
        ),
        ("c 1/1/1 x 1", "1:9: found 'x', expected a yarn length".into()),
        ("c 1/1/1 3 0", "1:11: found '0', expected the number of a yarn unit".into()),
        ("o Cube", format!("1:3: found 'Cube', expected {ORDER}")),
        ("o 1/1", format!("1:6: found the end of the line, expected {ORDER}")),
        ("h 1 f0 u", "1:3: found '1', expected face/edge of a needle hint".into()),
        ("t front", "1:3: found 'front', expected the number of a face".into()),
        ("I 1", "1:3: found '1', expected face/instruction".into()),
        ("xfer", "1:5: found the end of the line, expected a needle".into()),
        ("g group", format!("1:1: found 'g', expected {KINDS}")),
        ("s 1", format!("1:1: found 's', expected {KINDS}")),
    ] {
        assert_eq!(message(read(path(), text.as_bytes())), format!("in:{expected}"), "{text}");
    }
    let text = b"v 0 0 0\nv 1 \xff 2";
    let expected = "in:2:5: found bytes that are not UTF-8, expected a text file";
    assert_eq!(message(read(path(), text)), expected);
}

#[test]
fn references_are_checked_wherever_they_stand() {
    // One square on lines 1 to 7; each case adds lines from 8 on.
    const SQUARE: &str = "L k a b c d\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nT 1\n";
    for (text, expected) in [
        ("f 1 2 3 5\nT 1", "8:9: found '5', expected a vertex from 1 to 4 (v lines)"),
        (
            "T 1\nf 1 2 3\n",
            "8:3: found 'k a b c d' with 4 edges, expected a stitch type with 3 edges, as face 2 has",
        ),
        ("f 1 2 3 4\nT 2\n", "9:3: found '2', expected a stitch type from 1 to 1 (L lines)"),
        ("f 1 2 3 4", "8:1: found a face without one, expected a stitch type (T line) for each face"),
        ("T 1", "8:1: found one more than there are faces, expected a stitch type (T line) for each face"),
        (
            "N 1\nf 1 2 3 4\nT 1",
            "9:1: found a face without one, expected a pattern line (N line) for each face or for none",
        ),
        (
            "N 1\nN 2",
            "9:1: found one more than there are faces, expected a pattern line (N line) for each face or for none",
        ),
        ("e 1/1 2/1", "8:7: found '2/1', expected a face from 1 to 1 (f lines)"),
        ("e 1/5 1/1", "8:3: found '1/5', expected an edge from 1 to 4 of face 1"),
        ("e 1/1 1/-1", "8:7: found edge 1 of face 1 again, expected each edge in one e line at most"),
        (
            "#e 1/1\ne 1/1 1/2\ne 1/3 1/-2",
            "10:7: found edge 2 of face 1 again, expected each edge in one e line at most",
        ),
        ("c 1/5/1", "8:3: found '1/5/1', expected an edge from 1 to 4 of face 1"),
        ("c 2/1/1", "8:3: found '2/1/1', expected a face from 1 to 1 (f lines)"),
        ("c 1/1/1 5 1", "8:11: found '1', expected a yarn unit, but the file has no U lines"),
        ("c 1/1/1 1 1 5 2\nU 1 1", "8:15: found '2', expected a yarn unit from 1 to 1 (U lines)"),
    ] {
        assert_eq!(
            message(read(path(), format!("{SQUARE}{text}").as_bytes())),
            format!("in:{expected}"),
            "{text}"
        );
    }
    for (text, expected) in [
        ("", "1:1: found the end of the file, expected at least one face (f line)"),
        ("v 0 0 0\n\n", "2:1: found the end of the file, expected at least one face (f line)"),
        ("f 1 2 3\nT 1", "1:3: found '1', expected a vertex, but the file has no v lines"),
        ("v 0 0 0\nf 1 1 1\nT 1", "3:3: found '1', expected a stitch type, but the file has no L lines"),
    ] {
        assert_eq!(message(read(path(), text.as_bytes())), format!("in:{expected}"), "{text}");
    }
}

/// An unwelded sheet: every stitch has its own four vertices, `e` lines join them.
fn sheet(columns: usize, rows: usize) -> String {
    let mut text = "L knit+ -lX +yX +lX -yX\n".to_string();
    for face in 0..columns * rows {
        let (x, y) = ((face % columns) as f64, (face / columns) as f64);
        for (u, v) in [(0.0, 0.0), (0.97, 0.0), (0.97, 0.61), (0.0, 0.61)] {
            let (x, y): (f64, f64) = (x + u, y * 0.61 + v);
            writeln!(text, "v {x:.5} {y:.5} {:.6}", (x * 0.3).sin()).unwrap();
        }
        let k = face * 4;
        writeln!(text, "f {} {} {} {}\nT 1\nN {}", k + 1, k + 2, k + 3, k + 4, y as usize).unwrap();
    }
    for face in 0..columns * rows {
        if (face + 1) % columns > 0 {
            writeln!(text, "e {}/2 {}/-4", face + 1, face + 2).unwrap();
        }
        if face + columns < columns * rows {
            writeln!(text, "e {}/3 {}/-1", face + 1, face + 1 + columns).unwrap();
        }
    }
    text
}

#[test]
fn sheets_are_read_and_written() {
    let mesh = read(path(), sheet(30, 20).as_bytes()).unwrap();
    assert_eq!((mesh.face_count(), mesh.positions.len(), mesh.joins.len()), (600, 2400, 29 * 20 + 30 * 19));
    let mut text = Vec::new();
    write(&mesh, &mut text).unwrap();
    assert_eq!(read(path(), &text).unwrap(), mesh);
}
