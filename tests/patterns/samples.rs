//! The patterns of `stitches/`. Counts are worked out here from the patterns' own words, row by row.

use super::{folder, sample, yarns};

/// Stitches that measure so many centimetres.
fn stitches(cm: f64, gauge: f64) -> f64 {
    cm * gauge / 10.0
}

/// The nearest number of the form `m k + plus`.
fn multiple(x: f64, m: f64, plus: f64) -> usize {
    (((x - plus) / m).round() * m + plus) as usize
}

/// Flat swatches: `n` stitches cast on, `rows` rows, bound off; 22 x 30 and the like on 10 cm, and another gauge.
/// Seen red with rows that a repeat forgets, and with bound-off stitches counted twice.
#[test]
fn swatches_count_as_on_paper() {
    for (gauge, rows) in [(20.0, 28.0), (33.0, 41.0)] {
        let n10 = stitches(10.0, gauge);
        let even = multiple(rows, 2.0, 0.0);
        let eighths = |cm: f64, by: f64| ((stitches(cm, rows) / by).round() as usize).max(1);
        let cases = [
            ("stockinette", n10.round() as usize, even),
            ("garter", n10.round() as usize, even),
            ("rib-1x1", multiple(n10, 2.0, 1.0), even),
            ("rib-2x2", multiple(n10, 4.0, 2.0), even),
            ("seed", multiple(n10, 2.0, 1.0), even),
            ("tuck", multiple(n10, 2.0, 1.0), 8 * eighths(10.0, 8.0) + 2),
            (
                "feather-and-fan",
                18 * (((stitches(20.0, gauge) - 4.0) / 18.0).round() as usize).max(1) + 4,
                4 * eighths(12.0, 4.0),
            ),
            (
                "flame-chevron",
                7 * (((stitches(16.0, gauge) - 4.0) / 7.0).round() as usize).max(1) + 4,
                20 * eighths(16.0, 20.0),
            ),
            (
                "openwork-lace",
                8 * (((stitches(16.0, gauge) - 5.0) / 8.0).round() as usize).max(1) + 5,
                8 * eighths(14.0, 8.0),
            ),
        ];
        for (name, n, rows_worked) in cases {
            let knitted = sample(name, gauge, Some(rows), None);
            let made = knitted.made;
            assert_eq!(
                (made.cast_on, made.worked, made.bound_off),
                (n, n * rows_worked, n),
                "{name} at {gauge}"
            );
            assert_eq!(made.total(), n * (rows_worked + 2), "{name}");
        }
    }
}

/// Seen red with a decrease that leaves two loops.
#[test]
fn hats_count_as_on_paper() {
    for (size, around, tall) in [("adult", 52.0, 15.0), ("child", 46.0, 12.0), ("large", 58.0, 17.0)] {
        let (gauge, rows) = (20.0, 28.0);
        let w = (stitches(around, gauge) / 8.0).round() as usize;
        let n = 8 * w;
        let rounds = stitches(tall, rows).round() as usize;
        // Crown: after the i-th decrease round n - 8 i, and a plain one; then 8 by k2tog.
        let crown: usize = (1..=w - 2).map(|i| 2 * (n - 8 * i)).sum::<usize>() + 8;
        let made = sample("hat", gauge, Some(rows), Some(size)).made;
        assert_eq!((made.cast_on, made.worked, made.drawn), (n, n * rounds + crown, 8), "{size}");
    }
}

/// The sweater as its pattern reads, in all sizes. Seen red with an `m1r` that makes none.
#[test]
fn sweaters_count_as_on_paper() {
    let sizes = [
        ("m", [104.0, 40.0, 46.0, 37.0, 23.0, 23.0]),
        ("s", [94.0, 38.0, 44.0, 34.0, 21.0, 21.0]),
        ("l", [114.0, 42.0, 47.0, 41.0, 24.0, 25.0]),
        ("xl", [126.0, 43.0, 48.0, 46.0, 25.0, 27.0]),
    ];
    for (gauge, per) in [(16.0, 22.0), (24.0, 33.0)] {
        for (size, [chest, length, sleeve, upper, wrist, yoke]) in sizes {
            let (st, ro) = (|cm| stitches(cm, gauge), |cm: f64| stitches(cm, per).round() as usize);
            let body = multiple(st(chest), 4.0, 0.0).max(32);
            let u = multiple(st(chest / 13.0), 2.0, 0.0).max(2);
            let b = body / 2 - u;
            let cuff = multiple(st(wrist), 4.0, 0.0).max(12);
            let inc = ((f64::max(st(upper) - cuff as f64, (u + 10) as f64 - cuff as f64) / 2.0) - 1e-9)
                .ceil()
                .max(0.0) as usize;
            let arm = cuff + 2 * inc;
            let s = arm - u;
            let first = 2 * b + 2 * s;
            let wanted = ((first as f64 - st(48.0)) / 8.0).round() as usize;
            let dec = wanted.min(((s - 4) / 2).min((b - 6) / 2)).max(1);
            let hem = ro(6.0).max(2);
            let straight = (ro(sleeve) - hem).max(2);
            let apart = (straight / inc.max(1)).max(1);
            let over = straight.saturating_sub(apart * inc);
            let one_sleeve =
                hem * cuff + (1..=inc).map(|i| (cuff + 2 * i) * apart).sum::<usize>() + over * arm;
            let tube = body * (hem + (ro(length) - hem).max(2));
            let plain = (ro(yoke) as f64 - 2.0 * dec as f64 - (hem as f64 / 2.0).round()).max(1.0) as usize;
            let neck = first - 8 * dec;
            let top = first * (1 + plain)
                + (1..=dec).map(|i| 2 * (first - 8 * i)).sum::<usize>()
                + neck * ro(3.0).max(2);
            let made = sample("raglan-sweater", gauge, Some(per), Some(size)).made;
            assert_eq!(made.cast_on, 2 * cuff + body, "{size}");
            assert_eq!(made.worked, 2 * one_sleeve + tube + top, "{size} at {gauge}");
            assert_eq!((made.bound_off, made.grafted), (neck, 2 * u), "{size}");
            assert!(made.total() >= 22_800, "{size}: {}", made.total());
        }
    }
}

/// Patterns scale by gauge: the sweater to a million stitches.
#[test]
fn sweaters_scale_to_a_million() {
    let knitted = sample("raglan-sweater", 90.0, Some(124.0), None);
    assert!(knitted.made.total() > 1_000_000, "{}", knitted.made.total());
    assert_eq!(knitted.loose_loops, 0);
    assert!(knitted.mesh.positions.iter().all(|p| p.is_finite()));
}

/// All patterns at their own, a coarse and a fine gauge: every loop is held, each piece is as many yarns as it says.
/// Seen red with the loops of a row in the wrong order, and with a yarn that does not go around the edge.
#[test]
fn yarns_are_whole_and_loops_held() {
    let mut seen = 0;
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "knit") {
            continue;
        }
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        for gauge in [0.0, 10.0, 27.0] {
            let knitted = sample(&name, gauge, None, None);
            assert_eq!(knitted.loose_loops, 0, "{name}");
            let wanted = match name.as_str() {
                // A band of its own yarn, a seam's, a thumb's; sleeves and body.
                "button-band" | "cowl" | "mitten" => 2,
                "raglan-sweater" => 3,
                // Cut at each change of colour: four of a repeat, and the first.
                "slip-stitch" => {
                    1 + knitted
                        .mesh
                        .types
                        .iter()
                        .position(|t| t.name == "in-")
                        .map_or(0, |_| 4 * knitted.pieces[0].rows.saturating_sub(4) / 8)
                }
                _ => 1,
            };
            assert_eq!(yarns(&knitted), wanted, "{name} at {gauge}");
        }
        seen += 1;
    }
    assert!(seen >= 17, "{seen} patterns");
}
