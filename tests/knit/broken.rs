//! What is said of patterns that cannot be followed: where, what, and what would be right.

use super::from_text;
use knotmesh::design::Settings;

/// Patterns, and their messages from the line on.
const CASES: &[(&str, &str)] = &[
    ("", "1:1: found a pattern without stitches, expected co N and rows"),
    ("co 10\n", "1:1: found 10 stitches still on the needles, expected bo, draw, hold or graft before this"),
    (
        "co 10\nRow 1: k\nhold as a\n",
        "3:1: found 10 stitches still held as 'a', expected from, graft or another use of them",
    ),
    ("co 0\nbo\n", "1:1: found a cast-on of no stitches, expected 1 or more"),
    ("Row 1: k\nbo\n", "1:1: found a row with nothing on the needles, expected stitches: co N first"),
    (
        "co 10\nRow 1: k4, k2tog, k5\nbo\n",
        "2:19: found a stitch that uses 1, with 0 left, expected as many stitches as the row before made",
    ),
    (
        "co 10\nRow 1: k8\nbo\n",
        "2:1: found 2 stitches not worked at the end of the row, expected a row that uses all stitches, or ends in a turn",
    ),
    (
        "co 10\nRow 1: k8, k3tog\nbo\n",
        "2:12: found a stitch that uses 3, with 2 left, expected as many stitches as the row before made",
    ),
    (
        "co 10\nRow 1: k9, k2tog\nbo\n",
        "2:12: found a stitch that uses 2, with 1 left, expected as many stitches as the row before made",
    ),
    (
        "co 10\nRow 1: k5, pm, k\nRow 2: p4, p2tog, p\nbo\n",
        "3:12: found a stitch across a marker, expected all its stitches on one side",
    ),
    ("co 10\nRow 1: k5, sm, k\nbo\n", "2:12: found no marker here (none follows), expected a marker"),
    ("co 10\nRow 1: k to m, k\nbo\n", "2:8: found no marker in the 10 stitches ahead, expected a marker"),
    (
        "co 10\nRow 1: k5, pm, k\nRow 2: p to 6 before m, p\nbo\n",
        "3:8: found a marker after 5 stitches, expected at least 6 before it",
    ),
    (
        "co 10\nRow 1: *k3, p1; rep from *\nbo\n",
        "2:8: found 10 stitches, and a repeat of 4, expected repeats that come out even",
    ),
    (
        "co 10\nRow 1: *yo; rep from *\nbo\n",
        "2:8: found a repeat that uses no stitch, expected one that comes to an end",
    ),
    ("co 10\nRow 1: k to last 12 sts, p\nbo\n", "2:8: found 10 stitches left, expected at least 12"),
    ("co 10\nRow 1: k  (11 sts)\nbo\n", "2:11: found 11 stitches, expected 10, as there are after this row"),
    ("co 10\nRow 1 (WS): p\nbo\n", "2:1: found (WS), expected (RS), the side that faces you now"),
    ("co 10, k\nbo\n", "1:8: found 'k', expected 'join in the round'"),
    ("co 10\njoin to work\nbo\n", "2:13: found the end of the line, expected 'in the round'"),
    (
        "co 10, join in the round\njoin\nbo\n",
        "2:1: found 'join', expected it once, right after the cast-on: co N, join in the round",
    ),
    (
        "co 10\nRow 1: k\njoin\nbo\n",
        "3:1: found 'join', expected it once, right after the cast-on: co N, join in the round",
    ),
    (
        "piece a flat\nco 10, join\nbo\n",
        "2:1: found a join in a flat piece, expected 'piece NAME round' before",
    ),
    (
        "co 10\nRnd 1: k\nbo\n",
        "2:1: found a round in a flat piece, expected rows, or 'join in the round' after the cast-on",
    ),
    (
        "piece a round\nco 10\nRow (RS): k5, turn\nRnd: k\nbo\n",
        "4:1: found a round while the wrong side faces you, expected a row that turns back first",
    ),
    (
        "piece a round\nco 10\nRow (RS): k5, turn\nRow (WS): p\nRnd: k\nbo\n",
        "4:1: found a wrong-side row to its end in the round, expected a turn at its end",
    ),
    ("co 10\nRow 1: k5, turn, k5\nbo\n", "2:12: found more after a turn, expected the next row"),
    (
        "co 10\nRow 1: k10, turn\nbo\n",
        "2:13: found a turn with no stitch ahead, expected at least one stitch before the row's end",
    ),
    (
        "co 10\nRow 1: k5, bo 2, k2tog, k\nbo\n",
        "2:18: found something else after a bind-off, expected a knit or purl stitch to hold it",
    ),
    (
        "co 10\nRow 1: k5, bo 2, yo, k\nbo\n",
        "2:18: found something else after a bind-off, expected a knit or purl stitch to hold it",
    ),
    (
        "co 10\nRow 1: k2, tuck, k\nRow 2: p6, p2tog, p\nbo\n",
        "3:12: found another stitch on a tucked one, expected a plain purl stitch, which holds the tucked yarn",
    ),
    (
        "co 10\nRow 1: k2, tuck, k\nRow 2: k\nbo\n",
        "3:8: found another stitch on a tucked one, expected a plain purl stitch, which holds the tucked yarn",
    ),
    (
        "co 10\nRow 1: k2, tuck, k\nbo\n",
        "3:1: found a bind-off on a tucked stitch, expected a row that knits it first",
    ),
    (
        "co 10\nRow 1: knot\nbo\n",
        "2:8: found 'knot', expected a stitch (k, p, ktbl, ptbl, k2tog, ssk, p2tog, ssp, k3tog, sk2p, p3tog, sssp, yo, m1l, m1r, kfb, pfb, tuck, sl or slf), pm, sm, rm, turn, bo, co, hold, from,...",
    ),
    (
        "co 10\nRow 1: k {wide}\nbo\n",
        "2:11: found the unknown name 'wide', expected a number or the name of one (there are none)",
    ),
    ("let n = 10\nco {m}\nbo\n", "2:5: found the unknown name 'm', expected a number or the name of one (n)"),
    ("co {10 / 0}\nbo\n", "1:8: found 10 / 0, expected a finite number"),
    ("co {2.5}\nbo\n", "1:1: found 2.5, expected a whole number (round, floor or ceil make one)"),
    ("co {-4}\nbo\n", "1:1: found -4, expected a number from 0 to 1,000,000,000"),
    (
        "let a = size(4)\n",
        "1:9: found the unknown function 'size', expected stitches, rows, width, height, round, floor, ceil, multiple, min, max, rest, sin or cos",
    ),
    ("let a = multiple(4)\n", "1:9: found 'multiple' of 1 numbers, expected 2 or 3 numbers"),
    (
        "co 10\nRow 1: with red, k\nbo\n",
        "2:8: found the unknown colour 'red', expected the name of a colour (there are none)",
    ),
    (
        "with red\nco 10\nbo\n",
        "1:1: found the unknown colour 'red', expected the name of a colour (there are none)",
    ),
    (
        "color red #12345\n",
        "1:11: found #12345, expected a colour of six hexadecimal digits, such as #c0392b",
    ),
    ("co 10\nfrom sleeve\nbo\n", "2:1: found 'sleeve', expected the name of held stitches (none are held)"),
    (
        "co 10\nRow 1: k2, from sleeve, k\nbo\n",
        "2:12: found 'sleeve', expected the name of held stitches (none are held)",
    ),
    ("co 10\nhold 12 as a\nbo\n", "2:1: found 10 stitches, expected the 12 to be held"),
    (
        "co 10\nhold 2 as a\nhold 2 as a\nbo\n",
        "3:1: found held stitches named 'a' already, expected another name",
    ),
    (
        "co 10\nhold 4 as a\nhold as b\ngraft a with b\n",
        "4:1: found 4 stitches of 'a' and 6 of 'b', expected as many of each",
    ),
    (
        "co 10\nhold 5 as a\nhold as b\ngraft a with b using c\n",
        "4:1: found 'c', expected the name of a tail (there are none)",
    ),
    (
        "co 10\nhold 5 as a\ngraft a with c\n",
        "3:1: found 'c', expected the name of held stitches (none are held)",
    ),
    ("tail t\nco 4\nbo\n", "1:1: found a tail where no yarn is, expected stitches before it"),
    (
        "piece a round\nco 8\nRnd: k\ntail t\ntail t\nbo\n",
        "5:1: found a second tail 't', expected another name",
    ),
    (
        "piece a flat\nco 4\npiece b flat\nco 4\nbo\n",
        "3:1: found 4 stitches still on the needles, expected bo, draw, hold or graft before this",
    ),
    (
        "piece a flat\nco 4\nbo\npiece a flat\nco 4\nbo\n",
        "4:1: found a second piece 'a', expected another name",
    ),
    ("piece a square\n", "1:9: found 'square', expected 'flat' or 'round'"),
    ("piece a flat at (0, 1)\n", "1:22: found ')', expected ','"),
    (
        "piece a flat toward (0, 0, 0)\nco 2\nbo\n",
        "1:1: found a toward of no direction, expected three numbers, not all 0",
    ),
    ("co 10\nRow 1: k\nRow 3: k\nbo\n", "3:1: found row 3 after row 1, expected row 2"),
    (
        "co 10\nRow 1: k\nRow 1, 2: p\nRow 2: k\nbo\n",
        "4:1: found row 2 a second time, expected each row once",
    ),
    ("co 10\nRow 1: k\nRow 2: as row 2\nbo\n", "3:1: found row 2 as itself, expected another row"),
    (
        "co 10\nRow 1: k\nrep rows 1-3 2 more times\nbo\n",
        "3:1: found rows 1 to 3, expected rows that were worked just before",
    ),
    (
        "co 10\nRow 1: k\nrep rows 1-1 until 0 rows\nbo\n",
        "3:1: found row 1 worked already, expected at most 0",
    ),
    (
        "for i = 1 to 3\nco 10\nbo\n",
        "1:1: found a 'for' without its end, expected 'end' on a line of its own",
    ),
    (
        "co 10\nend\n",
        "2:1: found 'end', expected a statement: title, gauge, let, size, color, chart, piece, co, join, row, round, rep, for, bo, draw, cut, tail, with, hold, from, graft or pick up",
    ),
    (
        "co 10\nRow 1: (k2, p2\nbo\n",
        "2:15: found the end of the line, expected a comma and the next instruction, or ')'",
    ),
    (
        "co 10\nRow 1: *k2, p2\nbo\n",
        "2:15: found the end of the line, expected a comma and the next instruction, or '; rep from *'",
    ),
    (
        "co 10\nRow 1: k2 p2\nbo\n",
        "2:11: found 'p2', expected a comma and the next instruction, or the end of the row",
    ),
    ("co 10\nRow 1 (LS): k\n", "2:8: found 'ls', expected RS or WS"),
    ("co 10\nRow 1 k\n", "2:7: found 'k', expected ':'"),
    ("title Hat\n", "1:7: found 'hat', expected a title in double quotes"),
    ("title \"Hat\n", "1:7: found text without an end, expected a closing '\"' on the same line"),
    (
        "gauge 0\nco 2\nbo\n",
        "1:1: found a gauge out of bounds, expected 0.1 to 1000 stitches and rows on 10 cm",
    ),
    ("co 10\nbo 5 now\n", "2:4: found 5, expected the end of the line"),
    (
        "purl 10\n",
        "1:1: found 'purl', expected a statement: title, gauge, let, size, color, chart, piece, co, join, row, round, rep, for, bo, draw, cut, tail, with, hold, from, graft or pick up",
    ),
    ("co 10\nRow 1: kä\n", "2:9: found 'ä', expected a word, a number or a sign"),
    ("co 10\nRow 1: dec 6 evenly\nbo\n", "2:8: found 6 decreases over 10 stitches, expected at most 5"),
    (
        "pick up e = right edge of front\n",
        "1:1: found 'front', expected the name of a piece (there are none)",
    ),
    (
        "piece a round\nco 8\nRnd: k\nbo\npick up e = right edge of a\n",
        "5:1: found no right edge of 'a' that is free, expected a flat piece, whose edges can be picked up once",
    ),
    ("pick up e = top edge of front\n", "1:13: found 'top', expected 'right' or 'left'"),
    ("co 10\nRow 1: chart lace\nbo\n", "2:8: found 'lace', expected the name of a chart (there are none)"),
    (
        "co 4\nRow 1: k\nbo\ndraw\n",
        "4:1: found nothing to draw the yarn through, expected stitches on the needles, a row ended",
    ),
    ("co 4\nRow 1: k2, sm\nbo\n", "2:12: found no marker here (none follows), expected a marker"),
    ("co 4\nRow 1: rm, k\nbo\n", "2:8: found no marker here (none follows), expected a marker"),
];

/// Seen red with the place of the pattern's begin instead of the stitch's.
#[test]
fn messages() {
    for (text, expected) in CASES {
        let error = from_text(text, &Settings::default()).err();
        let found = error.map_or("nothing is wrong".to_string(), |e| e.to_string());
        assert_eq!(found, format!("a.knit:{expected}"), "\n{text}");
    }
}
