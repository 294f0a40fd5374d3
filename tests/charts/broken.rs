//! Charts that are not right: messages with the place, and never a panic.

use super::{chart, picture};
use knotmesh::design::Settings;
use knotmesh::io::chart::swatch::{self, Swatch};
use proptest::prelude::*;
use std::path::Path;

fn message(name: &str, text: &str) -> String {
    let swatch = Swatch { columns: 1, rows: 2, border: 0 };
    let knitted = chart(name, text)
        .and_then(|drawing| swatch::knit(Path::new(name), &drawing, &Settings::default(), swatch));
    knitted.unwrap_err().to_string()
}

/// Seen red with JSON's escapes counted as one byte.
#[test]
fn messages_say_where() {
    let head = r#"{"format": "knotmesh-chart", "version": 1, "#;
    let json = |rest: &str| format!("{head}\n{rest}");
    let cases = [
        ("a.chart", "".into(), "1:1: found the end of the file"),
        ("a.chart", "...\n..q\n".into(), "2:3: found 'q' (row 1, square 3 from the left)"),
        ("a.chart", "3 ...\n1 ...".into(), "1:1: found row number 3, expected 2"),
        ("a.chart", "...\n  xxx".into(), "2:3: found row 1 without stitches"),
        ("a.chart", "..\n...".into(), "1:1: found row 2 that uses 2 stitches, expected 3, as row 1 makes"),
        ("a.chart", "  /./\n  /.o".into(), "1:3: found row 2 that uses 5 stitches, expected 3"),
        (
            "a.chart",
            " ...\n ./o\n ./.".into(),
            "3:2: found row 1 that uses 4 stitches, expected 3, as row 3 makes",
        ),
        ("a.chart", "ooo".into(), "1:1: found row 1 that uses 0 stitches, expected 3, as row 1 makes"),
        ("a.chart", "a = frog\naa".into(), "1:5: found 'frog'"),
        ("a.chart", "a = k\na = p\na".into(), "2:1: found 'a' a second time"),
        ("a.chart", "color red\n.".into(), "1:1: found a colour that is not whole"),
        ("a.chart", "color red blue\n.".into(), "1:7: found 'blue'"),
        ("a.json", "".into(), "1:1: found the end of the file"),
        ("a.json", json(r#""rows": []}"#), "1:1: found a chart without rows"),
        ("a.json", json(r#""rows": [".\\q"]}"#), "2:14: found 'q' (row 1, square 3"),
        ("a.json", json(r#""rows": ["."], "rows": []}"#), "2:21: found duplicate field"),
        ("a.json", json(r#""rows": ["."], "more": 1}"#), "2:21: found unknown field"),
        ("a.json", json(r#""rows": [5]}"#), "2:10: found 5, expected a row as text"),
        ("a.json", json(r#""rows": [" "]}"#), "2:10: found row 1 without stitches"),
        ("a.json", json(r#""key": {"a": "k", "a": "p"}, "rows": []}"#), "2:24: found 'a' a second time"),
        ("a.json", r#"{"format": "x", "version": 1, "rows": []}"#.into(), "1:12: found \"x\""),
        ("a.json", r#"{"format": "knotmesh-chart", "version": 2, "rows": []}"#.into(), "1:41: found 2"),
        ("a.png", "no picture".into(), "1:1: found"),
    ];
    for (name, text, expected) in cases {
        let found = message(name, &text);
        let wanted = format!("{name}:{expected}");
        assert!(found.starts_with(&wanted), "{text:?}\n  {found}\n  {wanted}");
        assert!(!found.contains('\n'), "{found}");
    }
}

/// Seen red with twice the limit of pixels.
#[test]
fn pictures_are_not_too_large_and_not_too_colourful() {
    let wide = picture(4_001, png::ColorType::Grayscale, &vec![0; 4_001 * 1_000]);
    assert!(chart("a.png", wide).unwrap_err().to_string().contains("4001 x 1000 pixels"));
    let colours: Vec<u8> = (0u32..65_536).flat_map(|k| [0, (k >> 8) as u8, k as u8]).collect();
    let many = chart("a.png", picture(256, png::ColorType::Rgb, &colours)).unwrap();
    let error = many.chart(Path::new("a.png"), &mut |_| 0).unwrap_err().to_string();
    // Rows from the bottom: the last colour stands at the end of the top row.
    assert!(error.starts_with("a.png:1:256: found one more colour, #0000ff"), "{error}");
}

proptest! {
    /// Fault to be seeded (not yet seen red): a slice of a row's text past its end.
    #[test]
    fn bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), kind in 0..3usize) {
        let _ = chart(["a.chart", "a.json", "a.png"][kind], bytes);
    }

    #[test]
    fn nearly_charts_never_panic(text in r"([-.|oO/\\^AQMVx =#0-9a-f\n]|yo|color|é|none){0,80}") {
        if let Ok(drawing) = chart("a.chart", &text) {
            let swatch = Swatch { columns: 2, rows: 2, border: 1 };
            let _ = swatch::knit(Path::new("a.chart"), &drawing, &Settings::default(), swatch);
        }
    }

    #[test]
    fn nearly_json_never_panics(at in 0usize..400, byte in any::<u8>()) {
        let mut bytes = include_bytes!("../../stitches/motif.json").to_vec();
        let at = at % bytes.len();
        bytes[at] = byte;
        let _ = chart("a.json", bytes);
    }

    #[test]
    fn nearly_pictures_never_panic(at in 0usize..10_000, byte in any::<u8>()) {
        let mut bytes = include_bytes!("../../stitches/fair-isle.png").to_vec();
        let at = at % bytes.len();
        bytes[at] = byte;
        let _ = chart("a.png", bytes);
    }
}
