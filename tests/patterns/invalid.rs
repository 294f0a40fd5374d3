//! What cannot be knit is said in one line with its place; nothing makes it panic or hang.

use super::{folder, worked};
use fastrand::Rng;
use std::time::Instant;

/// Pattern, and the message after `test.knit:`.
const CASES: &[(&str, &str)] = &[
    (
        "co 5\nRow 1: k6\nbo",
        "2:8: found a stitch that uses 1 where 0 are left, expected as many stitches as the row before made",
    ),
    (
        "co 5\nRow 1: k4\nbo",
        "2:1: found 1 stitches not worked at the end of the row, expected a row that uses all stitches, or ends in a turn",
    ),
    (
        "co 5\nRow 1: k4, k2tog\nbo",
        "2:12: found a stitch that uses 2 where 1 are left, expected as many stitches as the row before made",
    ),
    (
        "co 5\nRow 1: k2, pm, k3\nRow 2: p\nRow 3: k1, k2tog, k2\nbo",
        "4:12: found a stitch across a marker, expected all its stitches on one side",
    ),
    (
        "co 5\nRow 1: *k2; rep from *\nbo",
        "2:8: found 1 stitches, and a repeat of 2, expected repeats that come out even",
    ),
    (
        "co 5\nRow 1: *yo; rep from *\nbo",
        "2:8: found a repeat that uses no stitch, expected one that comes to an end",
    ),
    ("co 5\nRow 1 (WS): k\nbo", "2:1: found a WS row, expected a RS row now"),
    ("co 5\nRow 1: k\nRow 3: k\nbo", "3:1: found row 3 after row 1, expected row 2"),
    ("co 5\nRow 2: k\nRow 2: k\nbo", "3:1: found row 2 a second time, expected each row once"),
    (
        "co 5\nRow 1: k\n",
        "2:1: found 5 stitches still on the needles, expected bo, draw, hold or graft before this",
    ),
    (
        "co 5\nRow 1: k\nhold as a",
        "3:1: found 5 stitches still held as 'a', expected from, graft or another use of them",
    ),
    ("co 5\nRow 1: k (6 sts)\nbo", "2:10: found 6 stitches, expected 5, as there are after this row"),
    ("Row 1: k", "1:1: found a row with nothing on the needles, expected stitches: co N first"),
    ("co 0\nbo", "1:1: found a cast-on of no stitches, expected 1 or more"),
    ("co {5 / 0}\nbo", "1:7: found 5 / 0, expected a finite number"),
    ("co {5 / 2}\nbo", "1:1: found 2.5, expected a whole number (round, floor or ceil make one)"),
    ("co {n}\nbo", "1:5: found the unknown name 'n', expected one of: a number"),
    (
        "co {f(2)}\nbo",
        "1:5: found the unknown function 'f', expected stitches, rows, width, height, round, floor, ceil, multiple, min, max or rest",
    ),
    ("co 5\nRnd 1: k\nbo", "2:1: found a round in a flat piece, expected rows, or 'piece NAME round' before"),
    (
        "piece a round\nco 5\nRow 1: k3, turn\nRnd 2: k\nbo",
        "4:1: found a round while the wrong side faces you, expected a row that turns back first",
    ),
    (
        "co 5\nRow 1: k5, turn\nbo",
        "2:12: found a turn with no stitch ahead, expected at least one stitch before the row's end",
    ),
    ("co 5\nRow 1: k2, turn, k3\nbo", "2:12: found more after a turn, expected the next row"),
    (
        "co 5\nRow 1: k2, tuck, k2\nRow 2: p2, tuck, p2\nbo",
        "3:12: found another stitch on a tucked one, expected a plain purl stitch, which holds the tucked yarn",
    ),
    (
        "co 5\nRow 1: bo 2, yo, k3\nbo",
        "2:14: found something else after a bind-off, expected a knit or purl stitch to hold it",
    ),
    (
        "co 5\nRow 1: k5\nhold 2 as a\nhold 3 as b\ngraft a with b",
        "5:1: found 2 stitches of 'a' and 3 of 'b', expected as many of each",
    ),
    ("co 5\nRow 1: sm, k5\nbo", "2:8: found no marker here (none follows), expected a marker"),
    ("co 5\nRow 1: k to m, k3\nbo", "2:8: found no marker in the 5 stitches ahead, expected a marker"),
    (
        "co 5\nRow 1: with red, k5\nbo",
        "2:8: found the unknown colour 'red', expected the name of a colour (there are none)",
    ),
    ("co 5\nRow 1: dec 3 evenly\nbo", "2:8: found 3 decreases over 5 stitches, expected at most 2"),
    ("title \"A", "1:7: found text without an end, expected a closing '\"' on the same line"),
    (
        "co 5\nRow 1: (k2, p3\nbo",
        "2:16: found the end of the line, expected a comma and the next instruction, or ')'",
    ),
    ("for i = 1 to 2\nco 5\nbo", "1:1: found a 'for' without its end, expected 'end' on a line of its own"),
    (
        "co 5\nRow 1: k2 k3\nbo",
        "2:11: found 'k3', expected a comma and the next instruction, or the end of the row",
    ),
    (
        "color a #12345\nco 5\nbo",
        "1:9: found #12345, expected a colour of six hexadecimal digits, such as #c0392b",
    ),
    (
        "gauge 0\nco 5\nbo",
        "1:1: found a gauge out of bounds, expected 0.1 to 1000 stitches and rows on 10 cm",
    ),
    ("co 5 \u{20ac}\nbo", "1:6: found '\u{20ac}', expected a word, a number or a sign"),
    ("piece a flat\npiece a flat\nco 3\nbo", "2:1: found a second piece 'a', expected another name"),
    ("co 5\nRow 1: as row 1\nbo", "2:1: found row 1 as itself, expected another row"),
    ("co 5\nbo\npick up x = right edge of y", "3:1: found 'y', expected one of: fabric"),
    (
        "co 5\nRow: k\nhold 2 as a\nco 3\nRow: p\nbo",
        "4:1: found a cast-on between rows, with no yarn at the end of one, expected co N within a row",
    ),
    (
        "co 5\nRow: k\ncut\nco 3\nRow: p\nbo",
        "4:1: found a cast-on between rows, with no yarn at the end of one, expected co N within a row",
    ),
    ("co 5\nRows 5-2: k\nbo", "2:1: found rows 5 to 2, expected numbers from 1 upwards"),
    ("size s: n = 5\nsize s: n = 6\nco {n}\nbo", "2:1: found a second size 's', expected another name"),
    ("", "1:1: found a pattern without stitches, expected co N and rows"),
];

/// Seen red with the column of a group's end.
#[test]
fn messages_say_where() {
    for (text, message) in CASES {
        let found = worked(text).map(|k| format!("{:?}", k.made)).unwrap_or_else(|e| e.to_string());
        assert_eq!(found, format!("test.knit:{message}"), "{text}");
    }
}

/// Counts beyond reason end at once. Seen red with stars that go on without a step.
#[test]
fn nothing_goes_on_for_ever() {
    let sum = format!("co {{1{}}}\nbo", "+1".repeat(200_000));
    let lists: Vec<String> = (0..40).map(|k| format!("{}-{}", k * 500_000 + 1, (k + 1) * 500_000)).collect();
    let rows = format!("co 5\nRows {}: k\nbo", lists.join(", "));
    for text in [
        "co 5\nRow 1: *k0; rep from * 1000000000 more times, k5\nbo",
        &sum,
        &rows,
        "co 5\nRows 2-20000: as row 1\nRow 1: k\nhold as a",
    ] {
        let began = Instant::now();
        let _ = worked(text);
        assert!(began.elapsed().as_secs() < 20, "{}", &text[..40]);
    }
}

/// Samples with bytes, words and numbers changed: a mesh or one line, within seconds.
/// Seen red (as a panic) with an index in `take` that is not checked.
#[test]
fn mutated_patterns_never_panic() {
    let mut texts: Vec<String> = Vec::new();
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "knit") {
            // Coarse, so that each takes little.
            let text = std::fs::read_to_string(&path).unwrap();
            let lines = text.lines().map(|l| if l.starts_with("gauge") { "gauge 5 x 6" } else { l });
            texts.push(lines.collect::<Vec<_>>().join("\n"));
        }
    }
    texts.sort();
    let words = [
        "k",
        "p",
        "yo",
        "turn",
        "co 3",
        "bo",
        "bo 2",
        "pm",
        "sm",
        "hold 2 as a",
        "from a",
        "*",
        ";",
        ",",
        "(",
        ")",
        "{",
        "}",
        "-1",
        "1e9",
        "99999999999",
        "0",
        "0.5",
        "draw",
        "cut",
        "rep",
        "to",
        "last",
        "end",
        "for",
        "graft a with b",
        "piece z round",
        "k{9-99}",
        "\"",
        "\u{e9}",
        "k2tog",
        "sk2p",
        "tuck",
    ];
    let mut rng = Rng::with_seed(7);
    let (mut sound, mut refused) = (0, 0);
    for _ in 0..1500 {
        let mut text = texts[rng.usize(0..texts.len())].clone();
        for _ in 0..rng.usize(1..4) {
            let mut at = rng.usize(0..=text.len());
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            match rng.usize(0..3) {
                0 => text.insert_str(at, words[rng.usize(0..words.len())]),
                1 => {
                    let mut end = (at + rng.usize(0..12)).min(text.len());
                    while !text.is_char_boundary(end) {
                        end -= 1;
                    }
                    text.replace_range(at..end.max(at), "");
                }
                _ => {
                    if let Some(digit) = text[at..].find(|c: char| c.is_ascii_digit()) {
                        text.insert_str(at + digit, words[rng.usize(0..words.len())]);
                    }
                }
            }
        }
        let began = Instant::now();
        match worked(&text) {
            Ok(knitted) => {
                sound += 1;
                assert_eq!(knitted.loose_loops, 0, "{text}");
            }
            Err(e) => {
                refused += 1;
                let message = e.to_string();
                assert!(message.starts_with("test.knit:") && !message.contains('\n'), "{message}");
            }
        }
        assert!(began.elapsed().as_secs() < 30, "{text}");
    }
    assert!(sound > 100 && refused > 300, "{sound} {refused}");
}
