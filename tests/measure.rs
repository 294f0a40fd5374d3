//! `knotmesh measure` and its library: what it calls an error is one, and the baseline really solves.
//!
//! The faults that each test was seen red with stand at the tests.

mod common;

use common::grid::{Wrap, grid};
use glam::DVec3;
use knotmesh::knot::{Settings, Solver, Status};
use knotmesh::measure::tradeoff::baseline::Baseline;
use knotmesh::measure::tradeoff::errors::{Meter, Summary};
use knotmesh::measure::tradeoff::pareto::front;
use knotmesh::measure::tradeoff::poses::standard;
use knotmesh::measure::tradeoff::reference::Reference;
use knotmesh::measure::tradeoff::variants::variants;
use knotmesh::measure::tradeoff::{Job, Tradeoff, run, table};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::sync::Arc;

fn swatch() -> StitchMesh {
    grid(5, 4, Wrap::Flat, true, |_, _| "knit+ -lX +yX +lX -yX".into())
}

fn scene(mesh: &StitchMesh) -> Arc<Scene> {
    let library = TemplateLibrary::embedded();
    Arc::new(Scene::compile(mesh, &library, SceneOptions::default()).expect("compiles"))
}

/// A swatch stretched, sheared and buckled, each face otherwise.
fn buckled(mesh: &StitchMesh) -> Vec<DVec3> {
    let place = |p: &DVec3| {
        DVec3::new(1.2 * p.x + 0.15 * p.y, 0.95 * p.y + 0.05 * p.x.sin(), 0.2 * (0.9 * p.x + p.y).sin())
    };
    mesh.positions.iter().map(place).collect()
}

fn measured(mesh: &StitchMesh, only: &[&str]) -> Tradeoff {
    let library = TemplateLibrary::embedded();
    let mut variants = variants(&Settings::default(), 1, false);
    variants.retain(|v| only.is_empty() || only.contains(&v.name.as_str()));
    let options = SceneOptions::default();
    let job = Job {
        mesh,
        library: &library,
        options,
        variants,
        poses: standard(&mesh.positions),
        repeats: 1,
        adapter: None,
    };
    run(&job, &mut |_, _, _| {}).expect("measures")
}

/// Seen red with one step more for fewer: 11 - n steps for n.
#[test]
fn more_steps_come_nearer() {
    let names = ["safeguarded 1 f64", "safeguarded 3 f64", "safeguarded 10 f64"];
    let tradeoff = measured(&swatch(), &names);
    assert_eq!(tradeoff.stitches, 20);
    let energy = |name: &str| {
        let row = tradeoff.rows.iter().find(|r| r.name == name).expect("measured");
        (row.errors.energy_mean.unwrap(), row.errors.distance_p95.unwrap())
    };
    let [one, three, ten] = names.map(energy);
    assert!(one.0 > 10.0 * three.0 && three.0 > ten.0 && ten.0 >= -1e-12, "{one:?} {three:?} {ten:?}");
    assert!(one.1 > 10.0 * three.1 && three.1 > ten.1, "{one:?} {three:?} {ten:?}");
}

/// Seen red with distances halved.
#[test]
fn a_moved_point_is_the_error() {
    let mesh = swatch();
    let scene = scene(&mesh);
    let positions = buckled(&mesh);
    let optimum = Reference::new(scene.clone(), &Settings::default()).unwrap().solve(&positions).unwrap();
    let meter = Meter::new(scene.clone(), &mesh.positions, &Settings::default()).unwrap();
    let own = Summary::new(&[meter.errors(&optimum, &optimum, true).unwrap()]);
    assert_eq!((own.distance_max, own.energy_mean), (Some(0.0), Some(0.0)));

    for point in [1, 17, 40] {
        let mut doctored = optimum.clone();
        doctored.points[point].y += scene.yarn_radius;
        let errors = meter.errors(&doctored, &optimum, false).unwrap();
        assert_eq!(errors.distances.len(), 20);
        assert_eq!(errors.distances.iter().filter(|d| **d > 0.0).count(), 1);
        let summary = Summary::new(&[errors]);
        assert!((summary.distance_max.unwrap() - 1.0).abs() < 1e-9, "{summary:?}");
        assert_eq!((summary.distance_median, summary.energy_mean), (Some(0.0), Some(0.0)));
    }
    // Not a number is no small error.
    let mut doctored = optimum.clone();
    doctored.points[17].x = f64::NAN;
    let summary = Summary::new(&[meter.errors(&doctored, &optimum, false).unwrap()]);
    assert_eq!(summary.distance_max, Some(f64::INFINITY));
}

/// The turn at a point between two faces, in degrees. Seen red with the turn at rest added.
#[test]
fn a_bent_joint_is_a_kink() {
    let mesh = swatch();
    let scene = scene(&mesh);
    let optimum =
        Reference::new(scene.clone(), &Settings::default()).unwrap().solve(&mesh.positions).unwrap();
    let meter = Meter::new(scene.clone(), &mesh.positions, &Settings::default()).unwrap();
    let kink = |output| meter.errors(output, &optimum, false).unwrap().kink;
    assert!(kink(&optimum) < 1e-6, "at rest: {}", kink(&optimum));
    let mut bent = optimum.clone();
    for point in &mut bent.points {
        point.z += 0.3 * point.x * point.x;
    }
    assert!(kink(&bent) > 1.0, "{}", kink(&bent));
}

/// Seen red with the Jacobian's columns for l left out.
#[test]
fn the_baseline_solves() {
    let mesh = swatch();
    let scene = scene(&mesh);
    let settings = Settings { beta: 0.7, weight_length: 50.0, ..Settings::default() };
    let positions = buckled(&mesh);
    let optimum = Reference::new(scene.clone(), &settings).unwrap().solve(&positions).unwrap();
    let mut output = Default::default();
    Baseline::new(scene.clone(), &settings, None).frame(&positions, &mut output).unwrap();
    // The optimum is polished from its own state, so how far off the start is, the baseline says.
    assert!(output.faces.iter().any(|f| f.energy_start > 1.2 * f.energy), "there is something to solve");
    for (found, best) in output.faces.iter().zip(&optimum.faces) {
        assert_eq!(found.status, Status::Converged);
        assert!((found.energy - best.energy).abs() < 1e-6 * best.energy, "{found:?} {best:?}");
        assert!(found.energy_start > best.energy);
    }
    let meter = Meter::new(scene, &mesh.positions, &settings).unwrap();
    let summary = Summary::new(&[meter.errors(&output, &optimum, false).unwrap()]);
    assert!(summary.distance_max.unwrap() < 1e-4, "{summary:?}");
    assert!(Baseline::new(self::scene(&mesh), &settings, None).frame(&positions[1..], &mut output).is_err());
}

#[test]
fn all_variants_have_a_row() {
    let tradeoff = measured(&swatch(), &[]);
    let all = variants(&Settings::default(), 1, false);
    let names: Vec<&str> = all.iter().map(|v| v.name.as_str()).collect();
    let mut unique = names.clone();
    unique.sort_unstable();
    unique.dedup();
    assert_eq!(unique.len(), names.len(), "names are unique");
    assert!(names.len() > 45);
    for solver in [Solver::GaussNewton, Solver::Safeguarded] {
        for iterations in 1..=10 {
            assert!(all.iter().any(|v| v.settings.solver == solver && v.settings.iterations == iterations));
        }
    }

    let csv = table::csv(&tradeoff.rows);
    let lines: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(lines.len(), 2 + names.len());
    assert!(lines.iter().all(|l| l.len() == lines[0].len()));
    assert_eq!(lines[1][0], table::REFERENCE);
    assert!(lines[2..].iter().map(|l| l[0]).eq(names.iter().copied()));
    let column = |name: &str| lines[0].iter().position(|c| *c == name).expect(name);
    for name in ["frame_ms", "stitch_ns", "distance_p95_r", "energy_above_mean", "kink_max_deg"] {
        for line in &lines[2..] {
            let value: f64 = line[column(name)].parse().unwrap_or_else(|_| panic!("{name}: {line:?}"));
            assert!(value.is_finite(), "{name}: {line:?}");
        }
    }
    assert!(lines[2..].iter().all(|l| l[column("stitch_ns")].parse::<f64>().unwrap() > 0.0));
    let frames = table::csv(&tradeoff.frame_rows);
    assert_eq!(frames.lines().count(), 1 + 5 * (1 + names.len()));
    let printed = table::printed(&tradeoff.rows);
    assert!(names.iter().all(|n| printed.lines().any(|l| l.starts_with(n))));
}

#[test]
fn the_front_is_what_nothing_beats() {
    let points = [
        (3.0, 1.0),
        (1.0, 5.0),
        (2.0, 5.0),
        (2.0, 2.0),
        (2.5, 2.0),
        (3.0, 1.0),
        (f64::NAN, 0.0),
        (0.0, f64::INFINITY),
        (4.0, 0.5),
    ];
    assert_eq!(front(&points), [1, 3, 0, 8]);
    assert_eq!(front(&[]), [0usize; 0]);
    // None on the front is beaten; all others are.
    let mut random = common::Random::new(3);
    let points: Vec<(f64, f64)> =
        (0..200).map(|_| (random.below(20) as f64, random.below(20) as f64)).collect();
    let front = front(&points);
    let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    for i in 0..points.len() {
        let beaten = points.iter().any(|p| beats(*p, points[i]));
        let twin = front.iter().any(|j| points[*j] == points[i]);
        assert_eq!(beaten, !twin, "{:?}", points[i]);
    }
}

#[test]
fn the_command_writes_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/run");
    let command = || {
        let mut command = assert_cmd::Command::cargo_bin("knotmesh").unwrap();
        command.args(["measure", "stitches/swatch.smobj", "--quick", "--repeats", "1"]);
        command
    };
    let done =
        command().args(["--only", "safeguarded", "--only", "embed", "-o"]).arg(&out).assert().success();
    let table = String::from_utf8(done.get_output().stdout.clone()).unwrap();
    assert!(table.contains("safeguarded 3 f32") && !table.contains("Gauss-Newton"), "{table}");
    for file in ["measure.csv", "frames.csv", "measure.txt", "measure.svg", "measure.png"] {
        assert!(std::fs::metadata(out.join(file)).unwrap().len() > 500, "{file}");
    }
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 5);
    assert!(std::fs::read(out.join("measure.png")).unwrap().starts_with(b"\x89PNG"));
    let svg = std::fs::read_to_string(out.join("measure.svg")).unwrap();
    // Which variants are named depends on their times; families always are.
    assert!(svg.contains("Pareto front") && svg.contains("safeguarded f64"));

    // A mesh without knots has no error.
    let mut weave = assert_cmd::Command::cargo_bin("knotmesh").unwrap();
    weave.args(["measure", "stitches/weave.smobj"]).assert().code(2);

    // A line each, and no panic.
    let error = |arguments: &[&str]| {
        let done = command().args(arguments).assert().code(2);
        String::from_utf8(done.get_output().stderr.clone()).unwrap()
    };
    for arguments in [
        &["--only", "nothing"][..],
        &["--repeats", "0"],
        &["--beta", "nan"],
        &["--frames", "none.npy"],
        &["-o", "Cargo.toml"],
        &["--gauge", "-1"],
    ] {
        let text = error(arguments);
        assert!(
            text.starts_with("knotmesh: ") && text.trim_end().lines().count() == 1,
            "{arguments:?}: {text}"
        );
    }
}
