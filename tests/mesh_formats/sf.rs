use crate::{message, path};
use glam::{DVec2, DVec3};
use knotmesh::io::sf::{PlainPoint, PlainTemplate, read};

const KNIT: &str = "face knit+
\tedge (-1,-0.61) -lX
\tedge ( 1 , -0.61 ) +yX # blanks inside the brackets
\tedge (1,0.61) +lX
\tedge (-1,0.61) -yX
\tyarn [3:0.75,0] (-0.3,-0.2,-0.1) [2:0.725,+0.25]
\tyarn [0:0.25,0] [2:1,0]
\tyarn [1:0,0](0.5, 0.25,0)(0,0,1)[ 0 : 1.0 , 0 ]
";

fn faces(text: &str) -> Vec<PlainTemplate> {
    read(path(), text.as_bytes()).unwrap()
}

fn boundary(edge: u32, along: f64, z: f64) -> PlainPoint {
    PlainPoint::Boundary { edge, along, z }
}

fn inside(x: f64, y: f64, z: f64) -> PlainPoint {
    PlainPoint::Interior(DVec3::new(x, y, z))
}

#[test]
fn faces_are_read_and_ends_at_corners_dropped() {
    let faces = faces(KNIT);
    assert_eq!(faces.len(), 1);
    assert_eq!(faces[0].key(), "knit+ -lX +yX +lX -yX");
    assert_eq!(faces[0].corners, [(-1.0, -0.61), (1.0, -0.61), (1.0, 0.61), (-1.0, 0.61)].map(DVec2::from));
    let strands = [
        vec![boundary(3, 0.75, 0.0), inside(-0.3, -0.2, -0.1), boundary(2, 0.725, 0.25)],
        vec![boundary(0, 0.25, 0.0)],
        vec![inside(0.5, 0.25, 0.0), inside(0.0, 0.0, 1.0)],
    ];
    assert_eq!(faces[0].strands, strands);
}

#[test]
fn mirror_x_renumbers_from_the_end_of_the_leading_run() {
    let text = format!("{KNIT}derive knit- -lX -yX +lX +yX by mirror-x from knit+  -lX +yX +lX -yX\n");
    let knit = &faces(&text)[1];
    assert_eq!(knit.key(), "knit- -lX -yX +lX +yX");
    assert_eq!(knit.corners, [(-1.0, -0.61), (1.0, -0.61), (1.0, 0.61), (-1.0, 0.61)].map(DVec2::from));
    let strands = [
        vec![boundary(1, 0.25, 0.0), inside(0.3, -0.2, -0.1), boundary(2, 1.0 - 0.725, 0.25)],
        vec![boundary(0, 0.75, 0.0)],
        vec![inside(-0.5, 0.25, 0.0), inside(0.0, 0.0, 1.0)],
    ];
    assert_eq!(knit.strands, strands);

    // The run is two edges: digits at the end of a type do not count, its direction does.
    let text = "face d\nedge (-2,0) -l1\nedge (0,-1) -l2\nedge (3,0) +y\nedge (1,1) +l\nedge (-1,1) -y
        yarn [0:0.25,1] [4:0.5,2]
        derive e by mirror-x from d -l1 -l2 +y +l -y";
    let mirrored = &faces(text)[1];
    assert_eq!(mirrored.key(), "e -l2 -l1 -y +l +y");
    assert_eq!(
        mirrored.corners,
        [(-3.0, 0.0), (0.0, -1.0), (2.0, 0.0), (1.0, 1.0), (-1.0, 1.0)].map(DVec2::from)
    );
    assert_eq!(mirrored.strands, [vec![boundary(1, 0.75, 1.0), boundary(2, 0.5, 2.0)]]);
}

#[test]
fn mirroring_twice_gives_the_face_back() {
    let text = format!(
        "{KNIT}derive a by mirror-x from knit+ -lX +yX +lX -yX\nderive b by mirror-x from a -lX -yX +lX +yX"
    );
    let faces = faces(&text);
    assert_eq!((&faces[2].labels, &faces[2].corners), (&faces[0].labels, &faces[0].corners));
    assert_eq!(faces[2].strands.len(), faces[0].strands.len());
    for (a, b) in faces[2].strands.iter().flatten().zip(faces[0].strands.iter().flatten()) {
        match (*a, *b) {
            (PlainPoint::Interior(a), PlainPoint::Interior(b)) => assert_eq!(a, b),
            (
                PlainPoint::Boundary { edge: a, along: s, z: y },
                PlainPoint::Boundary { edge: b, along: t, z },
            ) => {
                assert!((a, y) == (b, z) && (s - t).abs() < 1e-15)
            }
            _ => panic!("a point changed its kind"),
        }
    }
}

#[test]
fn the_other_operations_leave_the_outline() {
    let key = "knit+ -lX +yX +lX -yX";
    let text = format!("{KNIT}derive p by mirror-z reverse-yarn from {key}\nderive c from {key}");
    let faces = faces(&text);
    assert_eq!(faces[1].key(), "p -lX -yX +lX +yX");
    assert_eq!(faces[1].corners, faces[0].corners);
    assert_eq!(faces[1].strands[0][1..], [inside(-0.3, -0.2, 0.1), boundary(2, 0.725, -0.25)]);
    assert_eq!((faces[2].key().as_str(), &faces[2].strands), ("c -lX +yX +lX -yX", &faces[0].strands));
}

#[test]
fn sources_may_follow_and_be_derived() {
    let text =
        format!("derive c from b -lX -yX +lX +yX\nderive b by mirror-x from knit+ -lX +yX +lX -yX\n{KNIT}");
    let names: Vec<_> = faces(&text).into_iter().map(|face| face.key()).collect();
    assert_eq!(names, ["c -lX -yX +lX +yX", "b -lX -yX +lX +yX", "knit+ -lX +yX +lX -yX"]);
}

#[test]
fn malformed_lines_are_named() {
    const OPERATIONS: &str = "'mirror-x', 'mirror-z' or 'reverse-yarn' or 'from'";
    for (text, expected) in [
        ("", "1:1: found the end of the file, expected at least one face".to_string()),
        ("vertex", "1:1: found 'vertex', expected 'face', 'edge', 'yarn' or 'derive'".into()),
        (" edge (0,0) x", "1:2: found 'edge', expected a 'face' line before this".into()),
        ("face", "1:5: found the end of the line, expected the name of the face".into()),
        ("face a b", "1:8: found 'b', expected the end of the line".into()),
        (
            "face a\nedge (0,0) x\nedge (1,0) x",
            "1:6: found 'a' with 2 edges, expected at least three edge lines".into(),
        ),
        ("face a\nedge 0,0) x", "2:6: found '0', expected '('".into()),
        ("face a\nedge (0 0) x", "2:9: found '0', expected ','".into()),
        ("face a\nedge (,0) x", "2:7: found ',', expected a number (x)".into()),
        ("face a\nedge (0,inf) x", "2:9: found 'inf', expected a number (y)".into()),
        ("face a\nedge (0,", "2:9: found the end of the line, expected a number (y)".into()),
        ("face a\nedge (0,0", "2:10: found the end of the line, expected ')'".into()),
        ("face a\nedge (0,0)", "2:11: found the end of the line, expected the label of the edge".into()),
        ("face a\nedge (0,0) x  y", "2:15: found 'y', expected one label for the edge".into()),
        ("face a\nyarn", "2:5: found the end of the line, expected '['".into()),
        ("face a\nyarn [x:0,0]", "2:7: found 'x', expected the number of an edge, counted from 0".into()),
        ("face a\nyarn [-1:0,0]", "2:7: found '-1', expected the number of an edge, counted from 0".into()),
        ("face a\nyarn [0:1.5,0]", "2:9: found '1.5', expected a fraction along the edge from 0 to 1".into()),
        (
            "face a\nyarn [0:-1e-9,0]",
            "2:9: found '-1e-9', expected a fraction along the edge from 0 to 1".into(),
        ),
        ("face a\nyarn [0:.5,]", "2:12: found ']', expected a number (z)".into()),
        ("face a\nyarn [0:.5,0] (1,2) [1:.5,0]", "2:19: found ')', expected ','".into()),
        ("face a\nyarn [0:.5,0] (1,2,3)", "2:22: found the end of the line, expected '['".into()),
        (
            "face a\nyarn [0:.5,0] [1:.5,0] (1,2,3)",
            "2:24: found '(1,2,3)', expected the end of the line after the yarn's second bracket".into(),
        ),
        (
            "face a\nyarn [0:0,0] [1:1,0]",
            "2:6: found a yarn without points, expected a point between two yarn ends".into(),
        ),
        (
            "face a\nyarn [0:.5,0] [3:.5,0]\nedge (0,0) x\nedge (1,0) x\nedge (1,1) x",
            "2:16: found '3', expected an edge from 0 to 2".into(),
        ),
        ("derive", "1:7: found the end of the line, expected the name of the derived face".into()),
        ("derive a x y", "1:13: found the end of the line, expected 'by' or 'from'".into()),
        ("derive a by", "1:12: found the end of the line, expected an operation or 'from'".into()),
        ("derive a by mirror-y from b", format!("1:13: found 'mirror-y', expected {OPERATIONS}")),
        (
            "derive a by mirror-z mirror-z from b",
            "1:22: found 'mirror-z' for the second time, expected each operation once".into(),
        ),
        (
            "derive a from",
            "1:14: found the end of the line, expected the name and labels of the source face".into(),
        ),
    ] {
        assert_eq!(message(read(path(), text.as_bytes())), format!("in:{expected}"), "{text}");
    }
}

#[test]
fn derivations_that_do_not_work_out_are_named() {
    // The face takes up lines 1 to 8.
    for (text, expected) in [
        (
            "derive b from knit+",
            "9:15: found 'knit+', expected the name and all labels of a face of this file",
        ),
        (
            "derive b -lX +yX from knit+ -lX +yX +lX -yX",
            "9:10: found '-lX +yX', expected '-lX +yX +lX -yX', the labels that result",
        ),
        (
            "derive b x y z from a x y z\nderive a x y z from b x y z",
            "9:21: found 'a x y z', which derives from this face, expected a source without a cycle",
        ),
        (
            "derive b x y z from a x y z\nderive a x y z from c",
            "10:21: found 'c', expected the name and all labels of a face of this file",
        ),
        (
            "derive b x y z from b x y z",
            "9:21: found 'b x y z', which derives from this face, expected a source without a cycle",
        ),
        (
            "derive knit+ from knit+ -lX +yX +lX -yX",
            "9:8: found 'knit+ -lX +yX +lX -yX', which line 1 has already, expected each name with its labels once",
        ),
        (
            "face a\nedge (0,0) x\nedge (1,0) x2\nedge (0,1) x\nderive b by mirror-x from a x x2 x",
            "13:27: found 'a x x2 x', whose edges are all alike, expected a face with an edge unlike edge 0 for mirror-x",
        ),
    ] {
        assert_eq!(
            message(read(path(), format!("{KNIT}{text}").as_bytes())),
            format!("in:{expected}"),
            "{text}"
        );
    }
}

#[test]
fn long_chains_of_derivations_do_not_overflow() {
    let mut text = String::new();
    for k in (0..20_000).rev() {
        text.push_str(&format!("derive f{} from f{k} a b c\n", k + 1));
    }
    text.push_str("face f0\nedge (0,0) a\nedge (1,0) b\nedge (0,1) c\n");
    assert_eq!(faces(&text).len(), 20_001);
}
