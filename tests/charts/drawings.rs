//! Symbols, colours and places.

use super::{chart, picture};
use knotmesh::design::stitch::Stitch::{self, *};

const RED: [u8; 3] = [0xc0, 0x39, 0x2b];

fn stitches(text: &str) -> Vec<Stitch> {
    chart("a.chart", text).unwrap().rows[0].squares.iter().map(|s| s.stitch).collect()
}

/// Seen red with `/` as ssk.
#[test]
fn standard_symbols() {
    let expected = [
        Knit,
        Knit,
        Purl,
        YarnOver,
        YarnOver,
        KnitTogether,
        SlipSlipKnit,
        SlipKnitTwoPass,
        SlipKnitTwoPass,
        KnitTwisted,
        MakeLeft,
        Slip,
    ];
    assert_eq!(stitches(r".|-oO/\^AQMVxX"), expected);
    assert_eq!(stitches(r". | - o O / \ ^ A Q M V x X"), expected);
}

/// Fault to be seeded (not yet seen red): names not looked up as whole words.
#[test]
fn stitches_by_name_and_by_key() {
    assert_eq!(
        stitches("k p2tog yo ssp .. K2tog"),
        [Knit, PurlTogether, YarnOver, SlipSlipPurl, Knit, Knit, KnitTogether]
    );
    // The key goes before the standard.
    assert_eq!(stitches("/ = p\n7 = tuck\n/77."), [Purl, Tuck, Tuck, Knit]);
}

/// Fault to be seeded (not yet seen red): rows left as they were read.
#[test]
fn rows_are_counted_from_the_bottom_and_numbered_at_either_side() {
    let drawing = chart("a.chart", "# top\n3 ...\n--- 2\n\n1 |||  # bottom\n").unwrap();
    let first: Vec<Stitch> = drawing.rows.iter().map(|r| r.squares[0].stitch).collect();
    assert_eq!(first, [Knit, Purl, Knit]);
    let place = drawing.rows[0].squares[2].place;
    assert_eq!((place.line, place.column), (5, 5));
}

/// Fault to be seeded (not yet seen red): every `#` taken as a comment.
#[test]
fn colours_of_the_key() {
    let text = "color red #c0392b  # rust\nr = red\ng = p #00ff00 # moss\n r g . # end\n";
    let drawing = chart("a.chart", text).unwrap();
    let found: Vec<_> = drawing.rows[0].squares.iter().map(|s| (s.stitch, s.colour)).collect();
    assert_eq!(found, [(Knit, Some(RED)), (Purl, Some([0, 255, 0])), (Knit, None)]);
}

/// Seen red with escapes counted as one byte.
#[test]
fn json_says_the_same_as_text() {
    let text = chart("a.chart", "color red #c0392b\nr = p red\n2 r./o\n1 \\o.-r\n").unwrap();
    let json = r##"{"format": "knotmesh-chart", "version": 1, "colors": {"red": "#c0392b"},
  "key": {"r": "p red"},
  "rows": ["r./o", "\\o.\u002dr"]}"##;
    let json = chart("a.json", json).unwrap();
    let plain = |d: &knotmesh::io::chart::Drawing| -> Vec<Vec<_>> {
        d.rows.iter().map(|r| r.squares.iter().map(|s| (s.stitch, s.colour)).collect()).collect()
    };
    assert_eq!(plain(&text), plain(&json));
    let columns: Vec<u32> = json.rows[0].squares.iter().map(|s| s.place.column).collect();
    assert_eq!(columns, [21, 23, 24, 25, 31]);
    assert!(json.rows[0].squares.iter().all(|s| s.place.line == 3));
}

/// Seen red with transparent pixels in their colour.
#[test]
fn every_kind_of_pixel() {
    use png::ColorType::*;
    let colours = |bytes: &[u8]| -> Vec<Vec<Option<[u8; 3]>>> {
        let rows = chart("a.png", bytes).unwrap().rows;
        rows.iter().map(|r| r.squares.iter().map(|s| s.colour).collect()).collect()
    };
    let (a, b) = (Some([1, 2, 3]), Some([9, 8, 7]));
    assert_eq!(colours(&picture(1, Rgb, &[1, 2, 3, 9, 8, 7])), [[b], [a]]);
    assert_eq!(colours(&picture(2, Rgba, &[1, 2, 3, 128, 9, 8, 7, 127])), [[a, None]]);
    assert_eq!(colours(&picture(2, Grayscale, &[7, 200])), [[Some([7; 3]), Some([200; 3])]]);
    assert_eq!(colours(&picture(2, GrayscaleAlpha, &[7, 255, 200, 0])), [[Some([7; 3]), None]]);
    // A palette of one bit, and sixteen bits a sample.
    let encode = |colour, depth, palette: Option<Vec<u8>>, data: &[u8]| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 3, 1);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if let Some(palette) = palette {
            encoder.set_palette(palette);
        }
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        bytes
    };
    let one = encode(Indexed, png::BitDepth::One, Some(vec![1, 2, 3, 9, 8, 7]), &[0b0110_0000]);
    assert_eq!(colours(&one), [[a, b, b]]);
    let wide = encode(Grayscale, png::BitDepth::Sixteen, None, &[5, 0, 6, 0, 7, 0]);
    assert_eq!(colours(&wide), [[Some([5; 3]), Some([6; 3]), Some([7; 3])]]);
}
