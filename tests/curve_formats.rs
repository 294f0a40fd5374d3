//! Curve files: what is written is read back, and real files hold what an independent parser found in them.

mod common;

use common::curves::{EXTENSIONS, MIXED, annotated, assert_same, curves};
use glam::DVec3;
use knotmesh::io::convert::convert;
use knotmesh::io::curve_info::curve_info;
use knotmesh::io::curves::{
    CurveFormat, CurveReader, UpAxis, WriteOptions, open_frame_writer, read_curves, write_curves,
};
use knotmesh::io::npz::{Floats, FrameArrays, NpzPrecision, NpzWriter, StaticArrays};
use knotmesh::yarn::{CurveSource, Curves};
use std::path::Path;

/// Without the yarns that a format cannot hold.
fn without_empty(curves: &Curves) -> Curves {
    let mut kept = Curves::empty();
    for yarn in 0..curves.yarn_count() {
        if curves.yarn_len(yarn) > 0 {
            kept.points.extend(&curves.points[curves.offsets[yarn]..curves.offsets[yarn + 1]]);
            kept.end_yarn(curves.closed[yarn], curves.radius[yarn]);
        }
    }
    kept
}

fn tolerance(extension: &str) -> f64 {
    match extension {
        "npz" => 0.0,
        "obj" => 1e-11,
        // Nine digits, or f32, of numbers up to 10.
        _ => 1e-6,
    }
}

#[test]
fn round_trips() {
    let folder = tempfile::tempdir().unwrap();
    let shapes: [&[(usize, bool)]; 8] = [
        &[],
        &[(1, false)],
        &[(2, false)],
        &[(7, false)],
        &[(7, true)],
        &MIXED,
        &[(0, false), (4, true), (0, false), (3, false)],
        &[(5000, true), (3, false), (20000, false)],
    ];
    for extension in EXTENSIONS {
        let format = CurveFormat::from_path(Path::new(&format!("a.{}", extension.to_uppercase()))).unwrap();
        assert_eq!(format.extension(), extension);
        for (i, shape) in shapes.iter().enumerate() {
            let what = format!("{extension}, shape {i}");
            let path = folder.path().join(format!("{i}.{extension}"));
            let mut expected = curves(i as u64 + 1, shape, Some(0.125));
            write_curves(&path, &expected, &WriteOptions::default()).unwrap();
            let found = read_curves(&path).unwrap();
            assert_eq!(found.len(), 1, "{what}");
            if matches!(extension, "obj" | "txt" | "pbrt") {
                expected = without_empty(&expected);
            }
            assert_same(&found[0], &expected, tolerance(extension), &what);
            let keeps_radius = !matches!(extension, "obj" | "bcc");
            assert!(found[0].radius.iter().all(|r| r.is_some() == keeps_radius), "{what}");
            let info = curve_info(&path).unwrap();
            assert_eq!((info.curves, info.points), (expected.yarn_count(), expected.points.len()), "{what}");
            assert!(info.to_string().lines().count() >= 6 && serde_json::to_string(&info).is_ok());
        }
    }
    // Nothing but the files themselves is left.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), EXTENSIONS.len() * shapes.len());
}

#[test]
fn yarns_keep_everything() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.yarns");
    let mut expected = annotated();
    expected.radius[1] = Some(0.5);
    write_curves(&path, &expected, &WriteOptions::default()).unwrap();
    let found = read_curves(&path).unwrap().remove(0);
    assert_same(&found, &expected, 1e-6, "yarns");
    assert_eq!(found.sources, expected.sources);
    assert_eq!(found.units, expected.units);
    assert_eq!(found.checkpoints, expected.checkpoints);
    assert_eq!(found.radius, expected.radius);
}

#[test]
fn radius_per_yarn() {
    let folder = tempfile::tempdir().unwrap();
    for extension in ["yarns", "usda", "txt", "pbrt"] {
        let path = folder.path().join(format!("a.{extension}"));
        let mut expected = curves(3, &MIXED, Some(0.5));
        expected.radius[2] = Some(0.25);
        expected.radius[4] = None;
        let error = write_curves(&path, &expected, &WriteOptions::default()).unwrap_err().to_string();
        assert!(error.contains("yarn 5") && error.contains("--radius"), "{error}");
        assert!(!path.exists());
        write_curves(&path, &expected, &WriteOptions { radius: Some(2.0), ..Default::default() }).unwrap();
        let found = read_curves(&path).unwrap().remove(0);
        expected.radius[4] = Some(2.0);
        assert_eq!(found.radius, expected.radius, "{extension}");
    }
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = WriteOptions { radius: Some(radius), ..Default::default() };
        assert!(write_curves(&folder.path().join("b.yarns"), &annotated(), &options).is_err());
    }
}

#[test]
fn frames() {
    let folder = tempfile::tempdir().unwrap();
    let frames: Vec<_> = (0..3).map(|i| curves(i + 1, &MIXED, Some(0.1))).collect();
    for extension in EXTENSIONS {
        let path = folder.path().join(format!("out.{extension}"));
        let mut writer = open_frame_writer(&path, 3, &WriteOptions::default()).unwrap();
        for (i, frame) in frames.iter().enumerate() {
            writer.frame(i * 2 + 9, frame).unwrap();
        }
        let files = writer.finish().unwrap();
        if CurveFormat::from_path(&path).unwrap().holds_time() {
            assert_eq!(files, std::slice::from_ref(&path));
            let found = read_curves(&path).unwrap();
            assert_eq!(found.len(), 3);
            for (a, b) in found.iter().zip(&frames) {
                assert_same(a, b, tolerance(extension), extension);
            }
            assert_eq!(curve_info(&path).unwrap().frames, 3);
        } else {
            let names = ["0009", "0011", "0013"].map(|n| folder.path().join(format!("out.{n}.{extension}")));
            assert_eq!(files, names);
            for (file, b) in files.iter().zip(&frames) {
                assert_same(&read_curves(file).unwrap()[0], b, tolerance(extension), extension);
            }
        }
    }
    let usda = std::fs::read_to_string(folder.path().join("out.usda")).unwrap();
    assert!(usda.contains("startTimeCode = 9\n") && usda.contains("endTimeCode = 13 "));

    // Too few, too many, and changed frames leave no file.
    for extension in EXTENSIONS {
        let path = folder.path().join(format!("few.{extension}"));
        let mut writer = open_frame_writer(&path, 2, &WriteOptions::default()).unwrap();
        writer.frame(0, &frames[0]).unwrap();
        assert!(writer.finish().is_err());
        let mut writer = open_frame_writer(&path, 1, &WriteOptions::default()).unwrap();
        writer.frame(0, &frames[0]).unwrap();
        assert!(writer.frame(1, &frames[0]).is_err());
        if CurveFormat::from_path(&path).unwrap().holds_time() {
            let mut writer = open_frame_writer(&path, 2, &WriteOptions::default()).unwrap();
            writer.frame(0, &frames[0]).unwrap();
            assert!(writer.frame(1, &curves(1, &[(4, false)], Some(0.1))).is_err());
            drop(writer);
            assert!(!path.exists());
        }
        assert!(open_frame_writer(&path, 0, &WriteOptions::default()).is_err());
    }
}

#[test]
fn poison_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    for extension in EXTENSIONS {
        let path = folder.path().join(format!("a.{extension}"));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut poisoned = curves(1, &MIXED, Some(0.1));
            poisoned.points[7].y = bad;
            let error = write_curves(&path, &poisoned, &WriteOptions::default()).unwrap_err().to_string();
            assert!(error.contains("yarn 2, point 3"), "{error}");
        }
        // Finite for f64, but not for f32.
        let mut huge = curves(1, &MIXED, Some(0.1));
        huge.points[7].y = 1e300;
        let single = matches!(extension, "yarns" | "bcc" | "usda");
        let result = write_curves(&path, &huge, &WriteOptions::default());
        assert_eq!(result.is_err(), single, "{extension}");
        assert_eq!(path.exists(), !single);
        if !single {
            assert!(read_curves(&path).is_ok(), "{extension}");
            std::fs::remove_file(&path).unwrap();
        }
        for extreme in [1e-30, 1e30, 5e-324] {
            let mut odd = curves(1, &MIXED, Some(0.1));
            odd.points[7].y = extreme;
            write_curves(&path, &odd, &WriteOptions::default()).unwrap();
            let back = read_curves(&path).unwrap()[0].points[7].y;
            assert!((back - extreme).abs() <= 1e-6 * extreme.max(1e-37), "{extension}: {back} {extreme}");
            std::fs::remove_file(&path).unwrap();
        }
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn conversions() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let plain = WriteOptions::default();
    write_curves(&at("a.bcc"), &annotated(), &WriteOptions { up: UpAxis::Z, ..plain }).unwrap();
    let error = convert(&at("a.bcc"), &at("b.usda"), &plain).unwrap_err().to_string();
    assert!(error.contains("--radius"), "{error}");
    let summary = convert(&at("a.bcc"), &at("b.usda"), &WriteOptions { radius: Some(0.5), ..plain }).unwrap();
    assert_eq!((summary.frames, summary.yarns, summary.points), (1, 6, 26));
    // The up axis is kept, and the radius is no diameter.
    assert_eq!(CurveReader::open(&at("b.usda")).unwrap().header.up, Some(UpAxis::Z));
    assert!(std::fs::read_to_string(at("b.usda")).unwrap().contains("widths = [1]"));
    convert(&at("b.usda"), &at("c.npz"), &plain).unwrap();
    convert(&at("c.npz"), &at("d.yarns"), &plain).unwrap();
    assert_same(
        &read_curves(&at("d.yarns")).unwrap()[0],
        &{
            let mut expected = annotated();
            expected.radius.fill(Some(0.5));
            expected
        },
        2e-6,
        "bcc to yarns",
    );
    // Frames become files.
    let mut writer = open_frame_writer(&at("f.npz"), 2, &plain).unwrap();
    writer.frame(0, &annotated()).unwrap();
    writer.frame(1, &annotated()).unwrap();
    writer.finish().unwrap();
    let summary = convert(&at("f.npz"), &at("g%02d.obj"), &plain).unwrap();
    assert_eq!(summary.files, [at("g00.obj"), at("g01.obj")]);
    for wrong in ["x", "x.ply", "x.", "x.bccx"] {
        let error = convert(&at("a.bcc"), &at(wrong), &plain).unwrap_err().to_string();
        assert!(error.contains(".yarns") && error.contains(".npz"), "{error}");
    }
}

#[test]
fn npz_results() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let expected = curves(5, &[(4, false), (3, true)], None);
    let origin = DVec3::new(1e6, -2e6, 0.5);
    let mut moved = expected.clone();
    moved.points.iter_mut().for_each(|p| *p += origin);
    let arrays = StaticArrays {
        yarn_offsets: &[0, 4, 7],
        yarn_closed: &[false, true],
        radius: Some(0.125),
        gauge: Some(2.0),
        point_face: &[0, 0, 0, 1, 1, 1, 1],
        point_knot: &[-1, 0, 0, -1, -1, 0, -1],
        point_role: &[0, 1, 2, 0, 0, 1, 0],
        face_knot_offsets: &[0, 1, 2],
        arclength: &[0.0, 0.5, 1.0, 1.5, 0.0, 0.25, 0.5],
        point_tile: &[[0, 1], [0, 1], [0, 2], [0, 2], [-3, 4], [-3, 4], [-3, 4]],
        point_vertex: &[0, 1, 0, 1, 5, 6, 7],
    };
    let mut writer = NpzWriter::create(&path, NpzPrecision::F32 { origin }, 2, &arrays).unwrap();
    let frame = FrameArrays {
        knot_direction: Some(Floats::F64(&[1.0, 0.0, 0.0, 1.0])),
        knot_half_length: Some(Floats::F32(&[0.5, 0.25])),
        face_energy_start: Some(Floats::F64(&[2.0, 3.0])),
        face_energy: Some(Floats::F64(&[1.0, 1.5])),
        face_status: Some(&[0, 2]),
        twist: Some(Floats::F64(&[0.5; 7])),
        director: Some(Floats::F64(&[0.25; 21])),
    };
    writer.frame(&moved, &frame).unwrap();
    let error =
        writer.frame(&moved, &FrameArrays { face_status: Some(&[0]), ..frame }).unwrap_err().to_string();
    assert!(error.contains("face_status"), "{error}");
    drop(writer);
    assert!(!path.exists());

    let mut writer = NpzWriter::create(&path, NpzPrecision::F32 { origin }, 2, &arrays).unwrap();
    writer.frame(&moved, &frame).unwrap();
    writer.frame(&moved, &frame).unwrap();
    writer.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let mut writer = NpzWriter::create(&path, NpzPrecision::F32 { origin }, 2, &arrays).unwrap();
    writer.frame(&moved, &frame).unwrap();
    writer.frame(&moved, &frame).unwrap();
    writer.finish().unwrap();
    assert!(bytes == std::fs::read(&path).unwrap(), "equal input gives equal files");
    let found = read_curves(&path).unwrap();
    assert_eq!(found.len(), 2);
    assert_same(&found[1], &moved, 1e-6, "npz with origin");
    assert_eq!(found[0].radius, [Some(0.125); 2]);

    // Read by another implementation of the format.
    let mut archive = npyz::npz::NpzArchive::open(&path).unwrap();
    let mut shapes: Vec<_> = archive.array_names().map(str::to_string).collect::<Vec<_>>();
    shapes.sort();
    let shapes: Vec<_> = shapes
        .iter()
        .map(|name| format!("{name} {:?}", archive.by_name(name).unwrap().unwrap().shape()))
        .collect();
    assert_eq!(
        shapes,
        [
            "arclength [7]",
            "director [2, 7, 3]",
            "face_energy [2, 2]",
            "face_energy_start [2, 2]",
            "face_knot_offsets [3]",
            "face_status [2, 2]",
            "gauge []",
            "knot_direction [2, 2, 2]",
            "knot_half_length [2, 2]",
            "origin [3]",
            "point_face [7]",
            "point_knot [7]",
            "point_role [7]",
            "point_tile [7, 2]",
            "point_vertex [7]",
            "points [2, 7, 3]",
            "radius []",
            "twist [2, 7]",
            "yarn_closed [2]",
            "yarn_offsets [3]",
        ]
    );
    let energies: Vec<f32> = archive.by_name("face_energy").unwrap().unwrap().into_vec().unwrap();
    assert_eq!(energies, [1.0, 1.5, 1.0, 1.5]);
    let closed: Vec<bool> = archive.by_name("yarn_closed").unwrap().unwrap().into_vec().unwrap();
    assert_eq!(closed, [false, true]);
    let points: Vec<f32> = archive.by_name("points").unwrap().unwrap().into_vec().unwrap();
    assert!((points[0] as f64 - expected.points[0].x).abs() < 1e-6);
}

#[test]
fn npz_by_another_writer() {
    use npyz::WriterBuilder;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    // Its default is deflate; 64-bit offsets, no yarn_closed, a point array without frames.
    let mut writer = npyz::npz::NpzWriter::create(&path).unwrap();
    let mut points = writer
        .array("points", Default::default())
        .unwrap()
        .default_dtype()
        .shape(&[5, 3])
        .begin_nd()
        .unwrap();
    points.extend((0..15).map(|i| i as f64)).unwrap();
    points.finish().unwrap();
    let mut offsets = writer
        .array("yarn_offsets", Default::default())
        .unwrap()
        .default_dtype()
        .shape(&[3])
        .begin_nd()
        .unwrap();
    offsets.extend([0i64, 2, 5]).unwrap();
    offsets.finish().unwrap();
    drop(writer);
    let found = read_curves(&path).unwrap().remove(0);
    assert_eq!(found.offsets, [0, 2, 5]);
    assert_eq!(found.points[4], DVec3::new(12.0, 13.0, 14.0));
    assert_eq!(found.radius, [None, None]);
}

#[cfg(unix)]
#[test]
fn npz_needs_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    std::os::unix::fs::symlink("/dev/full", &path).unwrap();
    let error = write_curves(&path, &curves(1, &[(2, false)], None), &WriteOptions::default()).unwrap_err();
    let expected = format!("{}: found a device or a pipe, expected a file", path.display());
    assert_eq!(error.to_string(), expected);
}
