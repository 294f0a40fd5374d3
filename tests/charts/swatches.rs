//! A chart alone is the swatch of its rows.

use super::chart;
use knotmesh::design::{Knitted, Settings, knit};
use knotmesh::io::chart::swatch::{self, Swatch};
use knotmesh::io::pattern::Beside;
use knotmesh::io::smobj;
use std::path::Path;

fn worked(name: &str, text: &str, swatch: Swatch) -> Knitted {
    swatch::knit(Path::new(name), &chart(name, text).unwrap(), &Settings::default(), swatch).unwrap()
}

fn pattern(text: &str) -> Knitted {
    let path = Path::new("a.knit");
    knit(path, text, &Settings::default(), &Beside::new(path)).unwrap()
}

/// The mesh without the lines that say where faces come from.
fn mesh(knitted: &Knitted) -> String {
    let mut bytes = Vec::new();
    smobj::write(&knitted.mesh, &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    text.lines().filter(|l| !l.starts_with("N ") && !l.starts_with('#')).collect::<Vec<_>>().join("\n")
}

/// Seen red with `/` as ssk.
#[test]
fn a_chart_equals_its_rows_written_out() {
    let text = "4 ./o-..\n3 \\o...-\n2 /o.-..\n1 .o\\..- \n";
    let rows = "co 6\nRow 1: p1, k2, ssk, yo, k1\nRow 2: p2tog, yo, p1, k1, p2\nRow 3: p1, k3, yo, ssk\n\
                Row 4: p1, p2tog, yo, k1, p2\nbo\n";
    assert_eq!(mesh(&worked("a.chart", text, Swatch::default())), mesh(&pattern(rows)));
}

/// Seen red with borders on one side alone.
#[test]
fn repeats_and_borders() {
    let swatch = Swatch { columns: 3, rows: 2, border: 2 };
    let rows = "co 10\nRow 1: k\nRow 2: k\nRow 3: k2, (p1, k1) x 3, k2\nRow 4: k\nRow 5: k2, (p1, k1) x 3, k2\n\
                Row 6: k\nRow 7: k\nRow 8: k\nbo\n";
    assert_eq!(mesh(&worked("a.chart", "--\n.-", swatch)), mesh(&pattern(rows)));
}

/// Seen red with faces at the place of their row.
#[test]
fn faces_come_from_squares_and_have_their_colours() {
    let knitted = worked("a.chart", "a = #0000ff\nb = #ff0000\n  aab\n", Swatch::default());
    let mesh = &knitted.mesh;
    let blue = [0, 0, 255];
    let mut found = Vec::new();
    for origin in &mesh.face_origins {
        if let Some(colour) = origin.colour {
            found.push((origin.column, colour == blue));
        }
    }
    for square in [(5, false), (4, true), (3, true)] {
        assert!(found.contains(&square), "{square:?} in {found:?}");
    }
}

/// Seen red with borders on one side alone.
#[test]
fn samples_are_knit() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches");
    for (name, wide, tall) in [("lace.chart", 13, 8), ("motif.json", 9, 7), ("fair-isle.png", 12, 20)] {
        let path = folder.join(name);
        let once = swatch::knit_file(&path, &Settings::default(), Swatch::default()).unwrap();
        assert_eq!(once.pieces[0].widest, wide, "{name}");
        assert_eq!(once.made.worked, wide * tall, "{name}");
        assert_eq!(once.loose_loops, 0, "{name}");
        let four = Swatch { columns: 2, rows: 2, border: 3 };
        let four = swatch::knit_file(&path, &Settings::default(), four).unwrap();
        assert_eq!(four.pieces[0].widest, 2 * wide + 6, "{name}");
        assert_eq!(four.loose_loops, 0, "{name}");
    }
}
