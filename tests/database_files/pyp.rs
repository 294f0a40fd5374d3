//! Patterns as text.

use super::message;
use crate::common::database;
use glam::{DVec2, DVec3, IVec2};
use knotmesh::io::pyp;
use knotmesh::pattern::{Pattern, PatternEdge};
use std::path::Path;

const TEXT: &str = "*pattern # px py r n
1 2 0.1 2

*Q # x y z theta
0 0 0 0
0.5 1e-1 -3 0.1
*RK # passed over
no numbers at all
*E
1 0 1 0
0 1 0 -2
*RL
0.5
0.25
*RefD1
0 1 0
0 0 1
";

fn read(text: &str) -> knotmesh::Result<Pattern> {
    pyp::read(Path::new("in"), text.as_bytes())
}

#[test]
fn a_small_pattern() {
    let expected = Pattern {
        size: DVec2::new(1.0, 2.0),
        radius: 0.1,
        places: vec![DVec3::ZERO, DVec3::new(0.5, 0.1, -3.0)],
        twists: vec![0.0, 0.1],
        edges: vec![
            PatternEdge { from: 1, to: 0, tile: IVec2::new(1, 0) },
            PatternEdge { from: 0, to: 1, tile: IVec2::new(0, -2) },
        ],
        rest_lengths: vec![0.5, 0.25],
        directors: vec![DVec3::Y, DVec3::Z],
    };
    assert_eq!(read(TEXT).unwrap(), expected);
    assert_eq!(read(&TEXT.replace('\n', "\r\n")).unwrap(), expected);
    // Blocks in any order.
    let (begin, end) = TEXT.split_at(TEXT.find("*RefD1").unwrap());
    assert_eq!(read(&format!("{end}{begin}")).unwrap(), expected);
}

/// Seen red with numbers written in 13 digits.
#[test]
fn patterns_round_trip_to_the_bit() {
    let mut pattern = database::pattern();
    pattern.twists[0] = -0.0;
    pattern.twists[1] = 5e-324;
    pattern.twists[2] = f64::MAX;
    pattern.places[3].x = 1.0 / 3.0;
    let back = read(&pyp::write(&pattern)).unwrap();
    assert_eq!(back, pattern);
    assert!(back.twists[0].is_sign_negative());
}

/// A line is replaced (by several, or none), and the message is the one given.
#[test]
fn what_is_wrong_is_named_with_its_place() {
    const PLACE: &str = "expected n, the number of vertices, a whole number";
    for (line, text, expected) in [
        (1, "1", "in:1:1: found '1', expected a block, such as '*pattern', before any row"),
        (1, "*pattern 1", "in:1:10: found '1', expected the end of the line"),
        (1, "*patter", "in:17:1: found the end of the file, expected a block '*pattern'"),
        (2, "1 2 0.1", &format!("in:2:8: found the end of the line, {PLACE}")),
        (2, "1 2 0.1 2.5", &format!("in:2:9: found '2.5', {PLACE}")),
        (2, "1 2 0.1 2 5", "in:2:11: found '5', expected the end of the line"),
        (2, "1 2 x 2", "in:2:5: found 'x', expected r, the yarn radius, a number"),
        (2, "1 nan 1 2", "in:2:3: found 'nan', expected py, the period along v, a number"),
        (2, "1 -2 0.1 2", "in:2:3: found -2, expected a positive number"),
        (2, "1 2 0 2", "in:2:5: found 0, expected a positive number"),
        (2, "1 2 1 0", "in:2:7: found 0, expected 1 to 65536 vertices"),
        (2, "1 2 1 -7", "in:2:7: found -7, expected 1 to 65536 vertices"),
        (2, "1 2 1 999999999999", "in:2:7: found 999999999999, expected 1 to 65536 vertices"),
        (2, "1 2 1 3", "in:4:1: found 2 rows in '*Q', expected 3 as '*pattern' says: one a vertex"),
        (2, "1 2 1 1", "in:6:1: found 2 rows in '*Q', expected 1 as '*pattern' says: one a vertex"),
        (2, "1 2 1 2\n 1 2 1 2", "in:3:2: found 2 rows in '*pattern', expected 1"),
        (2, "", "in:1:1: found 0 rows in '*pattern', expected 1"),
        (5, "0 0 0", "in:5:6: found the end of the line, expected theta, the twist, a number"),
        (5, "0 0 1e999 0", "in:5:5: found '1e999', expected z, a number"),
        (5, "0 0 0 0\n0 0 0 0", "in:7:1: found 3 rows in '*Q', expected 2 as '*pattern' says: one a vertex"),
        (10, "2 0 1 0", "in:10:1: found 2, expected a vertex from 0 to 1"),
        (10, "1 -1 1 0", "in:10:3: found -1, expected a vertex from 0 to 1"),
        (10, "1 0 1.5 0", "in:10:5: found '1.5', expected dx, a number of periods"),
        (10, "1 0 1 9999999999", "in:10:7: found 9999999999, expected a number of periods within 32 bits"),
        (11, "1 1 0 0", "in:11:1: found 1, expected a vertex that no other edge leaves"),
        (11, "0 0 0 0", "in:11:3: found 0, expected a vertex that no other edge reaches"),
        (13, "0", "in:13:1: found 0, expected a positive number"),
        (14, " -0.25", "in:14:2: found -0.25, expected a positive number"),
        (14, "", "in:12:1: found 1 rows in '*RL', expected 2 as '*pattern' says: one a vertex"),
        (15, "*RL", "in:15:1: found '*RL', expected each block once"),
        (15, "*RefD", "in:17:1: found the end of the file, expected a block '*RefD1'"),
        (17, "0 0 1 0", "in:17:7: found '0', expected the end of the line"),
    ] {
        let mut lines: Vec<_> = TEXT.lines().collect();
        lines[line - 1] = text;
        assert_eq!(message(Path::new("."), read(&lines.join("\n"))), expected, "{line}: {text}");
    }
    let message = |bytes: &[u8]| message(Path::new("."), pyp::read(Path::new("in"), bytes));
    assert_eq!(message(b""), "in:1:1: found the end of the file, expected a block '*pattern'");
    assert_eq!(message(b"*pattern\n1 \xff"), "in:2:3: found bytes that are not UTF-8, expected a text file");
}
