//! Every pattern of `stitches/`, in every size and at several gauges.

use super::counts::{Count, PATTERNS, Paper, on_paper};
use super::mesh::check;
use super::{from_stitches, from_text, settings, stitches, yarns};
use knotmesh::design::Knitted;

const GAUGES: &[Option<(f64, f64)>] = &[None, Some((9.1, 11.4)), Some((13.3, 21.1)), Some((31.0, 43.0))];

fn counted(knitted: &Knitted) -> Count {
    let made = knitted.made;
    Count {
        cast_on: made.cast_on,
        worked: made.worked,
        bound_off: made.bound_off,
        grafted: made.grafted,
        drawn: made.drawn,
        yarns: yarns(knitted),
    }
}

/// Works patterns in all sizes at all gauges.
fn each(mut then: impl FnMut(&str, &Knitted, Count)) {
    for (name, own, sizes) in PATTERNS {
        let sizes: Vec<Option<&str>> = std::iter::once(None).chain(sizes.iter().map(|s| Some(*s))).collect();
        for size in sizes {
            for gauge in GAUGES {
                let knitted = from_stitches(name, &settings(*gauge, size));
                let (stitches, rows) = gauge.unwrap_or(*own);
                then(name, &knitted, on_paper(name, size, Paper { stitches, rows }));
            }
        }
    }
}

/// Seen red with a loop of the bare yarn and the stitch beside it counted as one, with a tail that its graft does not use (a yarn
/// more), and with a round's bind-off counted twice.
#[test]
fn stitches_are_as_many_as_on_paper_and_every_loop_is_held() {
    each(|name, knitted, expected| {
        let place = format!("{name} {:?} {:?}", knitted.size, knitted.gauge);
        assert_eq!(counted(knitted), expected, "{place}");
        assert_eq!(knitted.loose_loops, 0, "{place}");
        // Every loop that is made is an edge: joined to what holds it.
        assert_eq!(
            knitted.made.total(),
            expected.cast_on + expected.worked + expected.bound_off + expected.grafted + expected.drawn
        );
    });
}

/// Seen red with joined edges' ends changed over, and with a tail that its graft does not use.
#[test]
fn meshes_are_welded_and_come_back_from_files() {
    each(|name, knitted, _| check(&knitted.mesh, &format!("{name} {:?}", knitted.size)));
}

/// What knitters write for a piece in the round, instead of declaring it.
#[test]
fn joined_in_the_round() {
    let rest = "Rnds 1-4: *k1, p1; rep from *\nbo\n";
    let knit = |begin: &str| from_text(&format!("{begin}\n{rest}"), &settings(None, None)).unwrap();
    let declared = knit("piece fabric round\nco 12");
    for begin in [
        "co 12, join in the round",
        "co12, join",
        "co 12 sts and join for working in the round.",
        "co 12\njoin to work in the round",
        "piece fabric round\nco 12\nJoin.",
    ] {
        let joined = knit(begin);
        assert_eq!(joined.mesh.positions, declared.mesh.positions, "{begin}");
        assert_eq!(joined.mesh.face_vertices, declared.mesh.face_vertices, "{begin}");
        assert!(joined.pieces[0].round, "{begin}");
    }
}

#[test]
fn every_pattern_is_counted() {
    let mut found: Vec<String> = std::fs::read_dir(stitches())
        .unwrap()
        .filter_map(|entry| {
            let path = entry.unwrap().path();
            let knit = path.extension().is_some_and(|e| e == "knit");
            knit.then(|| path.file_stem().unwrap().to_string_lossy().into_owned())
        })
        .collect();
    found.sort();
    let mut known: Vec<&str> = PATTERNS.iter().map(|(name, ..)| *name).collect();
    known.sort_unstable();
    assert_eq!(found, known);
}

/// By hand from the patterns' text at their own gauges. Seen red with the plain round between the decreases of the hat left out.
#[test]
fn totals_by_hand() {
    for (name, total) in [
        // 22 stitches, 30 rows, cast on and bound off.
        ("stockinette", 22 * 32),
        // 2 repeats of 18 and 4 edge stitches, 9 repeats of 4 rows.
        ("feather-and-fan", 40 * 38),
        // 4 repeats of 7 and 4; 2 repeats of 20 rows.
        ("flame-chevron", 32 * 42),
        // 13 stitches a wedge; 14 and 28 rounds; 12 to 2 a wedge, two rounds each; 8; drawn.
        ("hat", 104 + 104 * 42 + 8 * 2 * 77 + 8 + 8),
    ] {
        assert_eq!(from_stitches(name, &settings(None, None)).made.total(), total, "{name}");
    }
    assert!(from_stitches("raglan-sweater", &settings(None, None)).made.total() >= 22_800);
}
