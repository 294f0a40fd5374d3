//! The knot model beside a table, on a plain knit made up so that the right answers are known.

mod common;

use assert_cmd::Command;
use glam::{DVec2, DVec3, IVec2};
use knotmesh::io::yarn_model;
use knotmesh::measure::database::fitted::Cells;
use knotmesh::measure::database::poses::{Pose, Series};
use knotmesh::measure::database::swatch::Method;
use knotmesh::measure::database::{Comparison, Figure, plot, run, table};
use knotmesh::pattern::{Pattern, PatternEdge, StrainTable, YarnModel};
use knotmesh::template::TemplateLibrary;
use std::f64::consts::TAU;

const STITCH: DVec2 = DVec2::new(0.008, 0.005);
const RADIUS: f64 = 0.0008;
const COLUMNS: usize = 2;
const POINTS: usize = 40;
/// Where a loop's middle is along u.
const MIDDLE: f64 = 0.0013;

/// Two columns and two rows of loops whose legs lie in front.
fn knit() -> Pattern {
    let n = COLUMNS * POINTS;
    let size = STITCH * DVec2::new(COLUMNS as f64, 2.0);
    let mut pattern = Pattern { size, radius: RADIUS, ..Pattern::default() };
    for row in 0..2 {
        for i in 0..n {
            // The head of a loop is at half a turn.
            let t = i as f64 / POINTS as f64;
            let angle = TAU * t;
            pattern.places.push(DVec3::new(
                STITCH.x * (t - 0.5 + 0.26 * (2.0 * angle).sin() / 2.0) + MIDDLE,
                STITCH.y * (f64::from(row) - 0.82 * angle.cos()),
                -RADIUS * 1.05 * (2.0 * angle).cos(),
            ));
            let last = i + 1 == n;
            let from = row as usize * n + i;
            pattern.edges.push(PatternEdge {
                from: from as u32,
                to: if last { row as usize * n } else { from + 1 } as u32,
                tile: IVec2::new(last.into(), 0),
            });
        }
    }
    let count = pattern.places.len();
    pattern.twists = vec![0.0; count];
    for i in 0..count {
        let edge = pattern.edges[i];
        let tile = (edge.tile.as_dvec2() * size).extend(0.0);
        let way = pattern.places[edge.to as usize] + tile - pattern.places[i];
        pattern.rest_lengths.push(way.length());
        pattern.directors.push(way.cross(DVec3::Z).normalize());
    }
    pattern
}

/// The knit with displacements along u, by the strain along u and the place of a vertex.
fn model(along: impl Fn(f64, DVec3) -> f64) -> YarnModel {
    let pattern = knit();
    let axes = [vec![-0.1f32, 0.0, 0.2, 0.5, 1.0], vec![-0.6, 0.0, 0.6], vec![-0.1, 0.0, 1.0]];
    let mut values = Vec::new();
    for place in &pattern.places {
        for _ in 0..axes[1].len() * axes[2].len() {
            values.extend(axes[0].iter().map(|sx| [along(f64::from(*sx), *place) as f32, 0.0, 0.0, 0.0]));
        }
    }
    YarnModel::new(pattern, StrainTable::new(axes, values).unwrap()).unwrap()
}

fn compared(model: &YarnModel) -> Comparison {
    let comparison = run(model, &TemplateLibrary::embedded(), &mut |_, _| {}).unwrap();
    for f in &comparison.figures {
        // At the last node rounding decides.
        let inside = f.outside == 0 || f.pose.amount == 1.0 || f.pose.amount == -0.1;
        assert!(f.lost == 0 && inside, "{:?} {:?}", f.pose, f.method);
    }
    comparison
}

const EMBED: Method = Method::Knots { fitted: true, beta: None };
const BETA_1: Method = Method::Knots { fitted: true, beta: Some(1.0) };
const BETA_0: Method = Method::Knots { fitted: true, beta: Some(0.0) };

fn at(comparison: &Comparison, series: Option<Series>, amount: f64, method: Method) -> &Figure {
    let same =
        |f: &&Figure| f.pose.series == series && (f.pose.amount - amount).abs() < 1e-9 && f.method == method;
    comparison.figures.iter().find(same).unwrap()
}

/// Half the distance of a head's knots, metres.
fn reach(comparison: &Comparison) -> f64 {
    at(comparison, None, 0.0, EMBED).shape.head * RADIUS / 2.0
}

/// The knit that is made after a pattern has its knots where the pattern's yarns cross. Seen red with the cell's middle at
/// the sinkers, and with left and right mixed up.
#[test]
fn a_knit_made_after_a_pattern() {
    let cells = Cells::new(&knit()).unwrap();
    assert_eq!(cells.count.to_array(), [2, 2]);
    assert!((cells.stitch - STITCH).length() < 1e-12);
    // Loops stand around u = MIDDLE + k STITCH.x.
    let off = (cells.origin.x + STITCH.x / 2.0 - MIDDLE) / STITCH.x;
    assert!((off - off.round()).abs() < 1e-6, "{off}");
    let knit = &cells.template;
    assert_eq!(knit.key(), "knit+ -lX +yX +lX -yX");
    assert!((knit.yarn_radius - RADIUS / STITCH.x).abs() < 1e-12);
    let [left, right] = [knit.knots[0], knit.knots[1]];
    assert!(left.center.x < 0.0 && (left.center.x + right.center.x).abs() < 1e-12);
    assert!(left.direction.y > 0.0 && (left.direction.x + right.direction.x).abs() < 1e-12);
    // Contacts are points of the curves of both rows, wherever those repeat.
    let pattern = self::knit();
    for sign in [-1.0, 1.0] {
        let contact = (left.center + left.direction * (sign * left.half_length)) * STITCH.x;
        let contact = contact + cells.origin + STITCH / 2.0;
        for row in pattern.places.chunks(COLUMNS * POINTS) {
            let off = |p: &DVec3| {
                let periods = (p.truncate() - contact) / pattern.size;
                ((periods - periods.round()) * pattern.size).length()
            };
            let nearest = row.iter().map(off).fold(1.0, f64::min);
            assert!(nearest < 0.4 * RADIUS, "{nearest}");
        }
    }
}

/// A table that displaces nothing is interpolation: so says the measure of all that interpolate, and with loops that keep
/// their width, knots are off by what they would have moved. Seen red with places compared as they are.
#[test]
fn interpolation_has_no_error_against_itself() {
    let comparison = compared(&model(|_, _| 0.0));
    for f in comparison.figures.iter().filter(|f| f.pose.series.is_some()) {
        let bent = matches!(f.pose.series, Some(Series::BendCourse | Series::BendWale));
        match f.method {
            Method::Table | Method::Pattern => assert!(f.distances.loops[1] < 1e-9, "{f:?}"),
            Method::Knots { beta: None, .. } if !bent => assert!(f.distances.knots[1] < 1e-3, "{f:?}"),
            _ => {}
        }
    }
    let expected = 0.5 * reach(&comparison) / RADIUS;
    let found = at(&comparison, Some(Series::Course), 0.5, BETA_0).distances.knots;
    assert!(
        (found[0] - expected).abs() < 0.02 * expected && found[1] < 1.03 * expected,
        "{found:?} {expected}"
    );
    assert!(at(&comparison, Some(Series::Course), 0.5, BETA_1).distances.knots[1] < 1e-3);
}

/// A table by which heads keep their width: `beta` 0 places knots alike, and 1 as far off as they move.
#[test]
fn heads_that_keep_their_width() {
    let half = reach(&compared(&model(|_, _| 0.0)));
    let comparison = compared(&model(|sx, place| {
        // At the knots, half away from the middle, it takes the stretch back.
        (half / (1.0 + sx) - half) * (TAU * (place.x - MIDDLE) / STITCH.x).sin()
            / (TAU * half / STITCH.x).sin()
    }));
    for sx in [0.2, 0.5, 1.0] {
        let head = |method| at(&comparison, Some(Series::Course), sx, method).shape.head;
        let rest = at(&comparison, None, 0.0, Method::Table).shape.head;
        assert!((head(Method::Table) / rest - 1.0).abs() < 0.02, "{} {rest}", head(Method::Table));
        assert!((head(BETA_1) / rest - 1.0 - sx).abs() < 0.02);
        let knots = |method| at(&comparison, Some(Series::Course), sx, method).distances.knots[0];
        let moved = sx * half / RADIUS;
        assert!(knots(BETA_0) < 0.05, "{}", knots(BETA_0));
        assert!((knots(BETA_1) / moved - 1.0).abs() < 0.05, "{} {moved}", knots(BETA_1));
    }
    // What is told of it.
    let csv = table::csv(&comparison);
    assert_eq!(csv.lines().count(), 1 + comparison.figures.len());
    let columns = |line: &str| line.replace(", ", " ").split(',').count();
    assert!(csv.lines().all(|l| columns(l) == columns(csv.lines().next().unwrap())));
    let text = table::printed(&comparison);
    assert!(text.contains("fitted knit, relax beta 0") && !text.contains("NaN"), "{text}");
    for page in [plot::distances(&comparison, "a", &[]), plot::shapes(&comparison, "b", &[])] {
        assert!(page.svg().unwrap().contains("library knit, relax beta 1"));
        let png = page.png().unwrap();
        let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
        assert_eq!((number(16), number(20)), page.size());
    }
}

/// Rolling up and flat again; strains are those that a table is asked for.
#[test]
fn poses() {
    for series in Series::ALL {
        for amount in [-0.05, 0.04] {
            let pose = Pose::new(series, amount, RADIUS);
            for p in [DVec2::new(0.007, -0.004), DVec2::new(-0.01, 0.012)] {
                let e = 1e-6;
                let [u, v] =
                    [DVec2::X, DVec2::Y].map(|d| (pose.place(p + d * e) - pose.place(p - d * e)) / (2.0 * e));
                let flat = pose.flatten(pose.place(p) + u.cross(v).normalize() * RADIUS);
                assert!(
                    (flat.truncate() - pose.gradient * p).length() < 1e-9 && (flat.z - RADIUS).abs() < 1e-12
                );
                assert!((pose.undone(flat).truncate() - p).length() < 1e-9);
                let (sx, sy) = (u.length() - 1.0, v.length() - 1.0);
                let sa = u.dot(v) / (u.length() * v.length());
                let expected = match series {
                    Series::Course => [amount, 0.0, 0.0],
                    Series::Wale => [0.0, 0.0, amount],
                    Series::Both => [amount, 0.0, amount],
                    Series::Shear => [0.0, amount, 0.0],
                    Series::ShearStretched => [0.3, amount, 0.3],
                    Series::BendCourse | Series::BendWale => [0.0; 3],
                };
                for (found, expected) in [sx, sa, sy].into_iter().zip(expected) {
                    assert!((found - expected).abs() < 1e-6, "{series:?} {found} {expected}");
                }
            }
        }
    }
}

/// What is no plain knit is refused: a purl side, a woven, loops that hold nothing.
#[test]
fn other_patterns_are_refused() {
    let mut purl = knit();
    purl.places.iter_mut().for_each(|p| p.z = -p.z);
    let mut loose = knit();
    loose.places.iter_mut().for_each(|p| p.y *= 0.3);
    let mut woven = knit();
    woven.edges[POINTS * COLUMNS - 1].tile.y = 1;
    for pattern in [purl, loose, woven, Pattern::default()] {
        let error = Cells::new(&pattern).unwrap_err().to_string();
        assert!(error.contains("expected a plain knit") && error.lines().count() == 1, "{error}");
    }
}

#[test]
fn command() {
    let folder = tempfile::tempdir().unwrap();
    let [good, bad] = ["good.npz", "bad.npz"].map(|name| folder.path().join(name));
    yarn_model::write_npz(&good, &model(|_, _| 0.0)).unwrap();
    yarn_model::write_npz(&bad, &common::fabric::model(20, 3)).unwrap();
    let run = |arguments: &[&std::ffi::OsStr]| {
        Command::cargo_bin("knotmesh").unwrap().arg("measure").args(arguments).output().unwrap()
    };
    let out = folder.path().join("out");
    let done = run(&["--against-database".as_ref(), good.as_ref(), "-o".as_ref(), out.as_ref()]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(String::from_utf8(done.stdout).unwrap().contains("pattern embedded"));
    for name in
        ["comparison.csv", "comparison.txt", "distances.svg", "distances.png", "shapes.svg", "shapes.png"]
    {
        assert!(out.join(name).metadata().unwrap().len() > 1000, "{name}");
    }
    let refused = run(&["--against-database".as_ref(), bad.as_ref()]);
    let error = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(error.contains("bad.npz") && error.trim_end().lines().count() == 1, "{error}");
    assert_eq!(run(&[]).status.code(), Some(2), "neither mesh nor model");
    let both = run(&["mesh.smobj".as_ref(), "--against-database".as_ref(), good.as_ref()]);
    assert_eq!(both.status.code(), Some(2));
}

/// The published stockinette: no stitch is lost within its table, and under stretch along courses heads keep their width,
/// where yarn slides without friction.
#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn published_stockinette() {
    let Some(data) = common::data() else { return };
    let model = yarn_model::read(&data.join("madypg/models/model_stock_9")).unwrap();
    let comparison = compared(&model);
    let half = |method| at(&comparison, Some(Series::Course), 0.5, method);
    let rest = at(&comparison, None, 0.0, Method::Table).shape;
    assert!((half(Method::Table).shape.head / rest.head - 1.0).abs() < 0.1);
    assert!(half(Method::Table).shape.lengths[3] / rest.lengths[3] < 1.1);
    assert!(half(BETA_0).distances.contacts[0] < 0.6 * half(BETA_1).distances.contacts[0]);
    assert!(at(&comparison, None, 0.0, EMBED).distances.contacts[0] < 0.3);
}
