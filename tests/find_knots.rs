//! The search for knots in polylines: geometry of our own, random polylines, and the real libraries.

use glam::{DVec2, DVec3, Vec3Swizzles};
use knotmesh::template::find_knots::find_knots;
use knotmesh::template::{Place, Strand, Template, TemplatePoint};
use proptest::prelude::*;

mod minimal_sf;

const R: f64 = 0.05;

fn corners() -> Vec<DVec2> {
    [(-0.5, -0.3), (0.5, -0.3), (0.5, 0.3), (-0.5, 0.3)].map(DVec2::from).to_vec()
}

fn edge(edge: u32, along: f64) -> TemplatePoint {
    TemplatePoint { place: Place::Boundary { edge, along }, z: 0.0 }
}

fn free(u: f64, v: f64, z: f64) -> TemplatePoint {
    TemplatePoint { place: Place::Free { at: DVec2::new(u, v) }, z }
}

fn line(points: &[(f64, f64, f64)]) -> Strand {
    points.iter().map(|&(u, v, z)| free(u, v, z)).collect()
}

fn find(strands: &[Strand]) -> Template {
    let t = find_knots("own", &[], &corners(), strands, R);
    check(&t);
    t
}

/// A loop from below whose points are lowered by `drop`.
fn loop_strand(drop: f64) -> Strand {
    vec![
        edge(0, 0.3),
        free(-0.26, -0.14, 0.06 - drop),
        free(-0.31, 0.06, -0.06 - drop),
        free(0.0, 0.16 - 0.3 * drop, -0.04 - drop),
        free(0.31, 0.06, -0.06 - drop),
        free(0.26, -0.14, 0.06 - drop),
        edge(0, 0.7),
    ]
}

/// A knit with any number of loops held together, the legs first.
fn knit(loops: usize) -> Vec<Strand> {
    let mut strands = vec![
        vec![edge(3, 0.75), free(-0.16, -0.1, -0.12), free(-0.15, 0.1, 0.08), edge(2, 0.7)],
        vec![edge(1, 0.25), free(0.16, -0.1, -0.12), free(0.15, 0.1, 0.08), edge(2, 0.3)],
    ];
    strands.extend((0..loops).map(|i| loop_strand(0.06 * i as f64)));
    strands
}

fn flip(strands: &[Strand], by: impl Fn(&mut TemplatePoint)) -> Vec<Strand> {
    let mut strands = strands.to_vec();
    strands.iter_mut().flatten().for_each(by);
    strands
}

fn place(t: &Template, p: &TemplatePoint) -> DVec3 {
    let knot = |k: u32| t.knots[k as usize];
    let at = match p.place {
        Place::Boundary { edge, along } => {
            let (a, b) = (edge as usize, (edge as usize + 1) % t.corners.len());
            t.corners[a] + along * (t.corners[b] - t.corners[a])
        }
        Place::Free { at } => at,
        Place::Contact { knot: k, sign } => knot(k).center + sign * knot(k).half_length * knot(k).direction,
        Place::Control { knot: k, sign } => {
            let d = knot(k).direction;
            knot(k).center + sign * t.yarn_radius * DVec2::new(d.y, -d.x)
        }
    };
    at.extend(p.z)
}

fn folds(points: &[DVec3], i: usize, limit: f64) -> bool {
    let (u, v) = (points[i] - points[i - 1], points[i + 1] - points[i]);
    u.dot(v) < limit * u.length() * v.length()
}

/// What every result must satisfy, whatever the input.
fn check(t: &Template) {
    let (r, key) = (t.yarn_radius, t.key());
    let old = t.polylines.as_ref().expect("originals are kept");
    assert_eq!(old.len(), t.strands.len(), "{key}");
    assert!(!t.notes.is_empty(), "{key}");
    for (i, k) in t.knots.iter().enumerate() {
        assert!(k.center.is_finite() && k.half_length >= 0.5 * r, "{key}: {k:?}");
        assert!((k.direction.length() - 1.0).abs() < 1e-12 && k.direction.y >= 0.0, "{key}: {k:?}");
        for o in &t.knots[..i] {
            let apart = o.center.distance(k.center);
            assert!(apart == 0.0 || apart >= r * (1.0 - 1e-9), "{key}: centres {apart} apart");
        }
    }
    // Control sign and z at c- and c+ of each passage.
    let mut passages: Vec<Vec<(f64, [f64; 2])>> = vec![Vec::new(); t.knots.len()];
    for (new, old) in t.strands.iter().zip(old) {
        let mut originals = old.iter();
        let mut i = 0;
        while i < new.len() {
            if let Place::Contact { knot, sign } = new[i].place {
                let [_, p, c] = &new[i..i + 3] else { panic!("{key}: a run is cut short") };
                let Place::Control { knot: k, sign: side } = p.place else { panic!("{key}: no control") };
                assert_eq!((k, p.z), (knot, 0.5 * (new[i].z + c.z)), "{key}");
                assert_eq!(c.place, Place::Contact { knot, sign: -sign }, "{key}");
                let z = if sign < 0.0 { [new[i].z, c.z] } else { [c.z, new[i].z] };
                assert!(z[0] * z[1] < 0.0, "{key}: no change of side");
                for z in z {
                    let layer = (z.abs() / r - 1.0) / 2.0;
                    assert!((layer - layer.round()).abs() < 1e-9 && layer > -0.5, "{key}: z = {z}");
                }
                passages[knot as usize].push((side, z));
                i += 3;
            } else {
                assert!(originals.any(|p| format!("{p:?}") == format!("{:?}", new[i])), "{key}: order");
                i += 1;
            }
        }
        let boundary = |s: &Strand| s.iter().filter(|p| matches!(p.place, Place::Boundary { .. })).count();
        assert_eq!(boundary(new), boundary(old), "{key}");
        let points = |s: &Strand| s.iter().map(|p| place(t, p)).collect::<Vec<_>>();
        let (points, before) = (points(new), points(old));
        for i in 1..points.len().saturating_sub(1) {
            // Limits on either side of the search's own, so that rounding decides nothing.
            let original = (1..before.len() - 1).any(|j| before[j] == points[i] && folds(&before, j, -0.865));
            assert!(!folds(&points, i, -0.867) || original, "{key}: a new fold at {}", points[i]);
        }
    }
    for (k, passages) in passages.iter().enumerate() {
        match passages[..] {
            [_] => assert!(t.notes.iter().any(|n| n.starts_with(&format!("knot {k} ")))),
            [(side_a, a), (side_b, b)] => {
                assert_eq!(side_a, -side_b, "{key}: knot {k}");
                assert!(a[0] * b[0] < 0.0 && a[1] * b[1] < 0.0, "{key}: knot {k}");
            }
            _ => panic!("{key}: knot {k} is passed {} times", passages.len()),
        }
    }
}

#[test]
fn a_knit_has_two_knots_and_keeps_the_top_of_its_loop() {
    let t = find(&knit(1));
    assert_eq!(t.notes[0], "2 knots: strand 0 x strand 2, strand 1 x strand 2");
    assert_eq!(t.strands[0].len(), 5, "boundary, contact, control, contact, boundary");
    assert_eq!(t.strands[2].len(), 9, "as the legs, twice, and the top of the loop");
    assert!(t.strands[2].contains(&free(0.0, 0.16, -0.04)));
    // By hand: leg and loop cross near (-0.27, -0.116) and (-0.153, 0.111).
    assert!(t.knots[0].center.distance(DVec2::new(-0.21, -0.003)) < 0.01, "{:?}", t.knots[0]);
    assert!((t.knots[0].half_length - 0.127).abs() < 0.01);
    // The leg comes from behind and runs on the inner side, the loop on the outer.
    assert_eq!(t.strands[0][1], TemplatePoint { place: Place::Contact { knot: 0, sign: -1.0 }, z: -R });
    assert_eq!(t.strands[0][2].place, Place::Control { knot: 0, sign: 1.0 });
    assert_eq!(t.strands[1][2].place, Place::Control { knot: 1, sign: -1.0 });
    assert_eq!(t.polylines.as_deref(), Some(&knit(1)[..]));
}

#[test]
fn a_purl_is_the_knit_from_behind() {
    let (knit, purl) = (find(&knit(1)), find(&flip(&knit(1), |p| p.z = -p.z)));
    assert_eq!(knit.knots, purl.knots);
    for (a, b) in knit.strands.iter().flatten().zip(purl.strands.iter().flatten()) {
        assert_eq!((a.place, a.z), (b.place, -b.z));
    }
}

#[test]
fn mirrored_lines_give_mirrored_knots() {
    // Without edges, which would have to be renumbered.
    let knit = find(&knit(2));
    let open = flip(knit.polylines.as_deref().unwrap(), |p| {
        let at = place(&knit, p);
        *p = free(at.x, at.y, at.z);
    });
    let mirrored = flip(&open, |p| {
        if let Place::Free { at } = &mut p.place {
            at.x = -at.x;
        }
    });
    let (a, b) = (find(&open), find(&mirrored));
    assert!(!a.knots.is_empty() && a.knots.len() == b.knots.len());
    for (k, m) in a.knots.iter().zip(&b.knots) {
        assert!(k.center.distance(m.center * DVec2::new(-1.0, 1.0)) < 1e-7);
        assert!(k.direction.distance(m.direction * DVec2::new(-1.0, 1.0)) < 1e-6);
    }
    for (p, q) in a.strands.iter().flatten().zip(b.strands.iter().flatten()) {
        match (p.place, q.place) {
            (Place::Control { knot, sign }, m) => assert_eq!(m, Place::Control { knot, sign: -sign }),
            (Place::Contact { .. }, m) => assert_eq!((p.place, p.z), (m, q.z)),
            _ => assert_eq!(p.z, q.z),
        }
    }
}

#[test]
fn stacked_loops_have_one_knot_per_pair_in_layers() {
    let t = find(&knit(2));
    assert_eq!(t.knots.len(), 4, "{:#?}", t.notes);
    assert_eq!(t.knots[0].center, t.knots[1].center, "nearer than r");
    // The legs pass the first loop's knots; the other loop passes its own.
    let passed = |s: usize| -> Vec<(u32, f64)> {
        let contact = |p: &TemplatePoint| match p.place {
            Place::Contact { knot, .. } => Some((knot, (p.z / R).round())),
            _ => None,
        };
        t.strands[s].iter().filter_map(contact).collect()
    };
    assert_eq!(passed(0), [(0, -1.0), (0, 1.0)]);
    assert_eq!(passed(2), [(0, 3.0), (0, -1.0), (2, -1.0), (2, 3.0)]);
    assert_eq!(passed(3), [(1, 1.0), (1, -3.0), (3, -3.0), (3, 1.0)]);
    assert!(t.notes.iter().any(|n| n.contains("only strand 3 passes it, strand 0 passes knot 0 there")));
}

#[test]
fn crossings_that_clasp_nothing_stay_free() {
    let across = line(&[(-0.4, 0.0, 0.1), (0.4, 0.0, 0.1)]);
    let single = find(&[across.clone(), line(&[(0.0, -0.2, 0.0), (0.0, 0.2, 0.0)])]);
    assert_eq!(single.strands, *single.polylines.as_ref().unwrap());
    assert_eq!(
        single.notes,
        ["no knots", "1 crossing of strand 0 x strand 1 stays free: they cross only once"]
    );
    // Woven: over and under, but different strands each time.
    let weft = line(&[(-0.4, 0.0, 0.0), (-0.1, 0.0, 0.1), (0.1, 0.0, -0.1), (0.4, 0.0, 0.0)]);
    let warp = |u: f64| line(&[(u, -0.2, 0.0), (u, 0.2, 0.0)]);
    assert!(find(&[weft, warp(-0.15), warp(0.15)]).knots.is_empty());
    // A float: twice, but never underneath.
    let arch = line(&[(-0.2, -0.2, 0.0), (-0.1, 0.2, 0.0), (0.1, 0.2, 0.0), (0.2, -0.2, 0.0)]);
    let float = find(&[across.clone(), arch.clone()]);
    assert!(float.notes[1].contains("2 crossings") && float.notes[1].contains("same strand is on top"));
    // The same arch, once above, is a clasp.
    let mut clasp = arch;
    (clasp[2].z, clasp[3].z) = (0.3, 0.3);
    assert_eq!(find(&[across, clasp]).knots.len(), 1);
}

#[test]
fn touches_and_shared_vertices_count_as_they_should() {
    let across = line(&[(-0.4, 0.0, 0.1), (0.0, 0.0, 0.1), (0.4, 0.0, 0.1)]);
    let through = line(&[(0.0, -0.2, 0.0), (0.0, 0.0, 0.0), (0.0, 0.2, 0.0)]);
    let t = find(&[across.clone(), through]);
    assert_eq!(t.notes[1..], ["1 crossing of strand 0 x strand 1 stays free: they cross only once"]);
    let touch = line(&[(-0.1, -0.2, 0.0), (0.0, 0.0, 0.0), (0.1, -0.2, 0.0)]);
    assert_eq!(find(&[across.clone(), touch]).notes, ["no knots"]);
    // A touch along the way does not part the two crossings of a clasp, wherever on the other strand it is.
    let touched = line(&[
        (-0.1, -0.1, -0.1),
        (-0.1, 0.06, 0.0),
        (0.2, -0.001, 0.0),
        (0.1, 0.06, 0.2),
        (0.05, -0.1, 0.3),
    ]);
    assert_eq!(find(&[across, touched]).knots.len(), 1);
}

#[test]
fn a_strand_may_clasp_itself() {
    let own = line(&[
        (-0.4, 0.0, 0.0),
        (0.1, 0.0, 0.0),
        (0.4, 0.2, 0.0),
        (0.0, 0.25, 0.1),
        (-0.1, -0.1, 0.1),
        (0.1, -0.1, -0.1),
        (0.15, 0.2, -0.1),
    ]);
    let t = find(&[own]);
    assert_eq!(t.notes[0], "1 knot: strand 0 x strand 0", "{:?}", t.notes);
}

#[test]
fn short_clasps_are_raised_and_wide_ones_left() {
    let across = line(&[(-0.4, 0.0, 0.0), (0.4, 0.0, 0.0)]);
    let short = line(&[(-0.01, -0.2, -0.1), (-0.01, 0.09, -0.1), (0.01, 0.09, 0.1), (0.01, -0.2, 0.1)]);
    let t = find(&[across.clone(), short]);
    assert_eq!(t.knots[0].half_length, 0.5 * R);
    assert!(t.notes.iter().any(|n| n.contains("raised")), "{:?}", t.notes);
    let wide = line(&[(-0.05, -0.2, -0.1), (-0.05, 0.9, -0.1), (0.05, 0.9, 0.1), (0.05, -0.2, 0.1)]);
    let t = find(&[across, wide]);
    assert!(t.knots.is_empty() && t.notes[1].contains("too far away"), "{:?}", t.notes);
}

#[test]
fn nonsense_has_no_knots_and_does_not_panic() {
    let bad = [f64::NAN, f64::INFINITY, 1e300, -1e300, 1e-300, 0.0];
    for x in bad {
        for r in [R, 0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e300] {
            let strands = flip(&knit(2), |p| match &mut p.place {
                Place::Free { at } => at.x *= x,
                _ => p.z = x,
            });
            let t = find_knots("bad", &[], &corners(), &strands, r);
            assert!(
                t.knots.iter().all(|k| k.center.is_finite() && k.half_length.is_finite()),
                "{:?}",
                t.knots
            );
            find_knots("bad", &[], &[], &strands, r);
            find_knots("bad", &[], &[DVec2::splat(x); 3], &knit(1), r);
        }
    }
    let repeated: Vec<Strand> = knit(1).iter().map(|s| s.iter().flat_map(|p| [*p; 3]).collect()).collect();
    assert_eq!(find(&repeated).knots.len(), 2);
    let stray = TemplatePoint { place: Place::Contact { knot: 7, sign: 1.0 }, z: 0.0 };
    assert_eq!(find_knots("stray", &[], &corners(), &[vec![stray]], R).strands, [vec![]]);
    find(&[vec![], vec![free(0.0, 0.0, 0.0)], vec![free(0.0, 0.0, 0.0); 4]]);
}

fn strands(coordinate: impl Strategy<Value = f64> + Clone) -> impl Strategy<Value = Vec<Strand>> {
    let point =
        (coordinate.clone(), coordinate, -4i32..=4).prop_map(|(u, v, z)| free(u, v, f64::from(z) * R));
    let strand = (0u32..4, prop::collection::vec(point, 2..9), 0u32..4)
        .prop_map(|(from, points, to)| [vec![edge(from, 0.3)], points, vec![edge(to, 0.6)]].concat());
    prop::collection::vec(strand, 1..5)
}

proptest! {
    #[test]
    fn random_strands_give_valid_templates(strands in strands(-0.5..0.5)) {
        find(&strands);
    }

    /// On a grid, vertices meet, segments overlap and points repeat.
    #[test]
    fn strands_on_a_grid_give_valid_templates(strands in strands((-4i32..=4).prop_map(|x| f64::from(x) * 0.08))) {
        find(&strands);
    }
}

/// Run with `KNOTMESH_DATA=... cargo test --test find_knots -- --nocapture` to read what was found.
#[test]
fn real_libraries() {
    let Ok(data) = std::env::var("KNOTMESH_DATA") else {
        println!("skipped: KNOTMESH_DATA is not set");
        return;
    };
    // Knots, and pairs of leg and loop that clasp without room for a knot of their own.
    let expected = [
        ("knit+ ", 2, 0),
        ("purl+ ", 2, 0),
        ("knittuck+ ", 4, 0),
        ("decrease-right+ ", 4, 0),
        ("make-left-tuck+ ", 2, 0),
        ("make-left-tuck-twist+ ", 2, 0),
        ("make-left-split+ ", 1, 0),
        ("start> ", 2, 0),
        ("end< ", 2, 0),
        ("tuck-twist+ ", 0, 0),
        ("turn-tuck)(( ", 0, 0),
        ("spacer4+ ", 0, 0),
        ("knit-plating-1+ ", 4, 0),
        ("knit-to-left -l2 -y1", 4, 0),
        ("knit-to-left -l2 -y2", 4, 4),
        ("knit-to-left -l4 -y2", 8, 8),
        ("over ", 0, 0),
    ];
    let mut seen = 0;
    for library in ["illustration.sf", "knitout.sf", "weave.sf"] {
        let path = std::path::Path::new(&data).join("smobj").join(library);
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        for face in minimal_sf::faces(&text) {
            // Their plain knit is 2 wide.
            let corners: Vec<DVec2> = face.corners.iter().map(|c| 0.5 * c).collect();
            let strands = flip(&face.strands, |p| {
                p.z *= 0.5;
                if let Place::Free { at } = &mut p.place {
                    *at *= 0.5;
                }
            });
            let t = find_knots(&face.name, &face.labels, &corners, &strands, R);
            println!("{}\n    {}", t.key(), t.notes.join("\n    "));
            check(&t);
            let crowded = t.notes.iter().filter(|n| n.contains("already pass other knots")).count();
            let key = format!("{} ", t.key());
            if let Some(&(_, knots, rest)) = expected.iter().find(|e| key.starts_with(e.0)) {
                assert_eq!((t.knots.len(), crowded), (knots, rest), "{key}");
                seen += 1;
            }
            // Each of 2 y legs clasps each of l loops.
            if let ("knit-to-left", [l, y, ..]) = (face.name.as_str(), &face.labels[..]) {
                let count = |label: &str| label[2..].parse::<usize>().expect("a number of yarns");
                assert_eq!(t.knots.len() + crowded, 2 * count(l) * count(y), "{key}");
            }
            for s in &t.strands {
                assert!(s.iter().all(|p| place(&t, p).xy().is_finite()), "{key}");
            }
        }
    }
    assert_eq!(seen, expected.len());
}
