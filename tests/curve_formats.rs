//! Curve files: what is written is read back, and real files hold what an independent parser found in them.

mod common;

use common::{MIXED, annotated, curves, data};
use glam::DVec3;
use knotmesh::io::convert::convert;
use knotmesh::io::curve_info::curve_info;
use knotmesh::io::curves::{
    CurveFormat, CurveReader, UpAxis, WriteOptions, open_frame_writer, read_curves, write_curves,
};
use knotmesh::io::npz::{Floats, FrameArrays, NpzPrecision, NpzWriter, StaticArrays};
use knotmesh::yarn::{CurveSource, Curves};
use std::path::Path;

const EXTENSIONS: [&str; 7] = ["yarns", "bcc", "obj", "npz", "usda", "txt", "pbrt"];

/// Compares yarns; points may differ by `tolerance`.
fn assert_same(found: &Curves, expected: &Curves, tolerance: f64, what: &str) {
    assert_eq!(found.offsets, expected.offsets, "{what}");
    assert_eq!(found.closed, expected.closed, "{what}");
    for (a, b) in found.points.iter().zip(&expected.points) {
        assert!(a.distance(*b) <= tolerance, "{what}: {a} {b}");
    }
    for (a, b) in found.radius.iter().zip(&expected.radius) {
        if let (Some(a), Some(b)) = (a, b) {
            assert!((a - b).abs() <= tolerance, "{what}: radius {a} {b}");
        }
    }
}

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
            assert_eq!(files, [path.clone()]);
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
    };
    let mut writer = NpzWriter::create(&path, NpzPrecision::F32 { origin }, 2, &arrays).unwrap();
    let frame = FrameArrays {
        knot_direction: Some(Floats::F64(&[1.0, 0.0, 0.0, 1.0])),
        knot_half_length: Some(Floats::F32(&[0.5, 0.25])),
        face_energy_start: Some(Floats::F64(&[2.0, 3.0])),
        face_energy: Some(Floats::F64(&[1.0, 1.5])),
        face_status: Some(&[0, 2]),
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
            "points [2, 7, 3]",
            "radius []",
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

#[test]
fn obj_variants() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let read = |text: &str| {
        std::fs::write(&path, text).unwrap();
        read_curves(&path).map(|mut frames| frames.remove(0)).map_err(|e| e.to_string())
    };
    let vertices = "v 0 0 0\nv 1 0 0\nv 2 0 0 1.0\nv 3 0 0 0.5 0.5 0.5\n";
    let xs = |c: &Curves| c.points.iter().map(|p| p.x as i32).collect::<Vec<_>>();
    // Two-point lines out of order and turned around; a loop; a branch.
    let c = read(&format!("{vertices}l 2 3\nl 1 2\nl 4 3\n")).unwrap();
    assert_eq!((xs(&c), &c.closed[..]), (vec![0, 1, 2, 3], &[false][..]));
    let c = read(&format!("{vertices}l 2 3\nl 1 2\nl 3 1\n")).unwrap();
    assert_eq!((xs(&c), &c.closed[..]), (vec![1, 2, 0], &[true][..]));
    let c = read(&format!("{vertices}l 1 2\nl 2 3\nl 2 4\n")).unwrap();
    assert_eq!((xs(&c), c.offsets.clone()), (vec![0, 1, 1, 2, 1, 3], vec![0, 2, 4, 6]));
    // Order of the file with whole curves and joined ones between each other.
    let c = read(&format!("{vertices}l 4 3 2 4\nl 1 2\nl 3 4 3\nl 2 3 # end\np 1\n")).unwrap();
    assert_eq!(xs(&c), [3, 2, 1, 0, 1, 2, 2, 3, 0]);
    assert_eq!(c.closed, [true, false, true, false]);
    // Continued lines, texture indices, negative indices, indices before their vertices.
    let c = read("l 1/1 2/2 \\\n 3 \\\r\n\t4\\\n1\nv 0 0 \\\n0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nl -1 -2 -4\n")
        .unwrap();
    assert_eq!((xs(&c), &c.closed[..]), (vec![0, 1, 2, 3, 3, 2, 0], &[true, false][..]));
    for (text, place) in [
        ("v 0 0 0\nl 1 2\n", "a.obj:2:5: found 2, expected an index up to 1"),
        ("v 0 0 0\nl 1 0\n", "a.obj:2:5: found '0'"),
        ("v 0 0 0\nl -1 -2\n", "a.obj:2:6: found -2"),
        ("v 0 0 0\nl 1\n", "a.obj:2:1: found a line of fewer than two points"),
        ("v 0 nan 0\n", "a.obj:1:5: found 'nan'"),
        ("v 0 1e999 0\n", "a.obj:1:5: found '1e999'"),
        ("v 0 0\n", "a.obj:1:6: found the end of the line"),
        ("line 0 0\n", "a.obj:1:1: found 'line'"),
        ("", "a.obj:1:1: found an empty file"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.contains(place), "{error}");
    }
}

#[test]
fn usda_variants() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.usda");
    let read = |text: &str| {
        std::fs::write(&path, text).unwrap();
        read_curves(&path).map_err(|e| e.to_string())
    };
    let text = r#"#usda 1.0
(
    "a comment"
    doc = """long
    ( [ words"""
    upAxis = "Z"
    subLayers = [ @other.usda@ ]
)
def Scope "s" ( prepend references = @x.usda@</y> kind = "group" ) {
    double3 xformOp:translate = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel material:binding = </s/m>
    token visibility
    variantSet "v" = { "a" { def Mesh "m" {} } }
    def Mesh "m" { point3f[] points = [(9, 9, 9)] }
    def BasisCurves "c" ( customData = { string a = "}" } )
    {
        uniform token type = "linear"
        int[] curveVertexCounts = [2, 3,]
        float[] widths = [1, 1, 2, 2, 2] ( interpolation = "vertex" )
        point3f[] points = [(0, 0, 0), (1, 0, 0),
            (2, 0, 0), (3e0, -0.5, 0), (4, 0, 0)] # end
        color3f[] primvars:displayColor = [(1, 0, 0)]
    }
    def BasisCurves "d" {
        token type = "cubic"
        uniform token basis = "bezier"
        token wrap = "periodic"
        int[] curveVertexCounts = [6]
        point3f[] points.timeSamples = { 1: [(0,0,0),(1,0,0),(2,0,0),(3,0,0),(4,0,0),(5,0,0)],
            2.5 : [(9,0,0),(1,0,0),(2,0,0),(3,0,0),(4,0,0),(5,0,0)] }
    }
}
"#;
    let frames = read(text).unwrap();
    assert_eq!(frames.len(), 2);
    let xs: Vec<_> = frames[1].points.iter().map(|p| p.x).collect();
    assert_eq!(xs, [0.0, 1.0, 2.0, 3.0, 4.0, 9.0, 3.0]);
    assert_eq!(frames[0].points[5].x, 0.0);
    assert_eq!(frames[0].closed, [false, false, true]);
    assert_eq!(frames[0].radius, [Some(0.5), Some(1.0), None]);
    let reader = CurveReader::open(&path).unwrap();
    assert_eq!(reader.header.up, Some(UpAxis::Z));
    assert!(reader.header.notes.iter().any(|n| n.contains("transform")), "{:?}", reader.header.notes);
    let with = |body: &str| read(&format!("#usda 1.0\ndef BasisCurves \"c\" {{\n{body}\n}}\n")).unwrap_err();
    for (body, expected) in [
        ("int[] curveVertexCounts = [2]\npoint3f[] points = [(0,0,0)]", "2:17: found 1 points, expected 2"),
        ("int[] curveVertexCounts = [-1]", "a point count that is no count"),
        ("int[] curveVertexCounts = [1e18]", "a point count that is no count"),
        ("point3f[] points = [(0,0,inf)]", "3:26: found 'inf'"),
        ("point3f[] points = [(0,0)]", "3:25: found ')'"),
        ("uniform token wrap = \"round\"", "3:22: found \"round\""),
        ("point3f[] points = [", "4:1: found '}'"),
    ] {
        let error = with(body);
        assert!(error.contains(expected), "{error}");
    }
    let deep = format!("#usda 1.0\n{}", "def Scope \"s\" {".repeat(100_000));
    assert!(read(&deep).unwrap_err().contains("nested"));
    assert!(read("#usda 1.0\ndef \"s").unwrap_err().contains("2:5: found a string without an end"));
}

#[test]
fn bcc_variants() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bcc");
    write_curves(&path, &curves(1, &[(4, false), (3, true)], None), &WriteOptions::default()).unwrap();
    let good = std::fs::read(&path).unwrap();
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        CurveReader::open(&path).map_err(|e| e.to_string())
    };
    let changed = |at: usize, new: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        bytes
    };
    for letters in [b"C1", b"BS", b"BZ"] {
        assert!(read(&changed(4, letters)).unwrap().header.notes[0].contains("curve type"));
    }
    assert!(read(&changed(4, b"PL")).unwrap().header.notes.is_empty());
    assert_eq!(read(&changed(7, &[0])).unwrap().header.up, None);
    for (at, new, expected) in [
        (0, &b"B"[..], ""),
        (0, b"BBC", "a.bcc:1:1: found other bytes"),
        (3, &[0x22], "a.bcc:1:4: found the size byte 0x22 (2-byte integers, 2-byte floats), expected 0x44"),
        (4, b"XX", "a.bcc:1:5: found the curve type 'XX'"),
        (6, &[2], "a.bcc:1:7: found 2 dimensions, expected 3"),
        (8, &[255; 8], "a.bcc:1:9: found 18446744073709551615 curves"),
        (8, &[1, 0], "a.bcc:1:17: found 7 control points, expected the 4 of the curves"),
        (8, &[3, 0], "found the end of the file after 2 of 3 curves"),
        (16, &[255; 8], "a.bcc:1:17: found 18446744073709551615 control points"),
        (64, &[255, 255, 255, 127], "a.bcc:1:65: found a curve of 2147483647 points, expected at most 7"),
        (64, &[0, 0, 0, 128], "a.bcc:1:65: found a curve of 2147483648 points"),
        (72, &f32::NAN.to_le_bytes(), "a.bcc:1:69: found ["),
    ] {
        match read(&changed(at, new)) {
            Ok(_) => assert!(expected.is_empty(), "{expected}"),
            Err(error) => assert!(!expected.is_empty() && error.contains(expected), "{error}"),
        }
    }
    // A repeated first point, and 8-byte numbers.
    let mut bytes = good[..8].to_vec();
    bytes[3] = 0x88;
    bytes.extend([1, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0]);
    bytes.extend([0; 40]);
    bytes.extend((-3i64).to_le_bytes());
    for x in [0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 0.0, 0.0f64] {
        bytes.extend(x.to_le_bytes());
    }
    let mut reader = read(&bytes).unwrap();
    assert!(reader.header.notes[0].contains("repeated"));
    let found = reader.next_frame().unwrap().unwrap();
    assert_eq!((found.points, found.closed), (vec![DVec3::X * 0.5, DVec3::X], vec![true]));
    bytes.push(0);
    assert!(read(&bytes).is_err());
}

/// Curves, closed ones, points, length, box and a word of the notes, computed by a separate script.
type Facts = (&'static str, usize, usize, usize, f64, [f64; 3], [f64; 3], &'static str);

#[rustfmt::skip]
const REAL: [Facts; 11] = [
    ("bcc/glove.bcc", 70, 70, 58537, 13925.146478, [-13.90100, -17.32785, -12.99660], [13.90100, 17.32785, 12.99660], "8 closed curves repeated"),
    ("bcc/openwork_trellis_pattern.bcc", 1, 0, 19730, 2734.712151, [-10.84405, -7.30163, -0.56954], [10.84405, 7.30163, 0.56954], ""),
    ("bcc/tea_cozy.bcc", 22, 22, 184151, 37418.499392, [-19.71785, -11.54141, -20.38320], [19.71785, 11.54141, 20.38320], "2 closed curves end far"),
    ("smobj/decrease.yarns", 1, 0, 103, 69.029053, [-4.38247, -0.30500, -0.34487], [4.07771, 4.43015, 0.40318], ""),
    ("smobj/k.yarns", 1, 0, 5745, 1421.319790, [-0.75000, 0.25000, -1.08444], [21.87500, 21.62732, 1.08444], ""),
    ("smobj/twill.yarns", 10, 0, 160, 23.538702, [-0.20000, -0.20000, -0.10939], [1.80000, 1.80000, 0.10939], ""),
    ("yarns/knit-4x4.yarns", 1, 0, 225, 72.032023, [-0.37500, 0.25000, -0.11875], [4.37500, 4.75232, 0.09310], ""),
    ("yarns/short-row.yarns", 1, 0, 304, 165.657006, [-5.75440, -3.34900, -0.19413], [6.97005, 3.42372, 0.15220], ""),
    ("yarns/sock.yarns", 1, 0, 29280, 8510.994575, [-0.67188, 0.25000, -1.10072], [25.04690, 107.75232, 1.10072], ""),
    ("obj-lines/blenderobj.obj", 2, 2, 9600, 152.953317, [-1.01, -1.00514, -1.00514], [1.01, 1.00514, 1.00514], "2 curves of two-point lines"),
    ("obj-lines/houdiniobj.obj", 2, 2, 9600, 150.940816, [-1.0, -0.99518, -0.99518], [1.0, 0.99518, 0.99518], ""),
];

#[test]
fn real_files() {
    let Some(data) = data() else { return };
    let folder = tempfile::tempdir().unwrap();
    for (name, curves, closed, points, length, low, high, note) in REAL {
        let info = curve_info(&data.join(name)).unwrap();
        assert_eq!(
            (info.frames, info.curves, info.closed, info.points),
            (1, curves, closed, points),
            "{name}"
        );
        assert!((info.length - length).abs() < 1e-5, "{name}: {}", info.length);
        let bounds = info.bounds.unwrap();
        for k in 0..3 {
            assert!(
                (bounds[0][k] - low[k]).abs() < 6e-6 && (bounds[1][k] - high[k]).abs() < 6e-6,
                "{name}: {bounds:?}"
            );
        }
        assert_eq!(info.notes.is_empty(), note.is_empty(), "{name}: {:?}", info.notes);
        assert!(
            note.is_empty() || info.notes.iter().any(|n| n.starts_with(note)),
            "{name}: {:?}",
            info.notes
        );
        // Through every other format and back.
        let original = read_curves(&data.join(name)).unwrap().remove(0);
        for extension in EXTENSIONS {
            let path = folder.path().join(format!("a.{extension}"));
            convert(&data.join(name), &path, &WriteOptions { radius: Some(0.1), ..Default::default() })
                .unwrap();
            let found = read_curves(&path).unwrap().remove(0);
            assert_same(&found, &Curves { radius: found.radius.clone(), ..original.clone() }, 1e-5, name);
        }
    }
    let up = |name: &str| CurveReader::open(&data.join(name)).unwrap().header.up;
    assert_eq!(up("bcc/glove.bcc"), Some(UpAxis::Y));
    assert_eq!(up("bcc/openwork_trellis_pattern.bcc"), Some(UpAxis::Z));
    let cozy = curve_info(&data.join("bcc/tea_cozy.bcc")).unwrap();
    assert!(cozy.notes.iter().any(|n| n.contains("36.236782, of curve 2")), "{:?}", cozy.notes);
}

#[test]
fn real_yarns() {
    let Some(data) = data() else { return };
    let sock = read_curves(&data.join("yarns/sock.yarns")).unwrap().remove(0);
    assert_eq!(sock.radius, [Some(0.0657692551612854)]);
    let names: Vec<_> = sock.units.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["1", "in", "na", "nb", "l67", "g", "l78", "h78", "out"]);
    assert_eq!(sock.units[2].1, 0.1f32 as f64);
    assert_eq!(sock.checkpoints.len(), 3100);
    let first: Vec<_> = sock.checkpoints[..3].iter().map(|c| (c.point, c.length, c.unit)).collect();
    assert_eq!(first, [(0, 1.0, 1), (0, 56.0, 2), (0, 28.0, 3)]);
    assert_eq!((sock.sources[0], sock.sources[12], sock.sources.len()), (5, 27, 29280));
    let twill = read_curves(&data.join("smobj/twill.yarns")).unwrap().remove(0);
    assert!(twill.radius.iter().all(|r| *r == Some(0.09999999403953552)));
    // What is written again is the same but for colours.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.yarns");
    for name in ["yarns/sock.yarns", "smobj/twill.yarns", "smobj/k.yarns"] {
        convert(&data.join(name), &path, &WriteOptions::default()).unwrap();
        let mut expected = std::fs::read(data.join(name)).unwrap();
        let found = std::fs::read(&path).unwrap();
        let yarn = expected.windows(4).position(|w| w == b"yarn").unwrap();
        let size = u32::from_le_bytes(expected[yarn + 4..yarn + 8].try_into().unwrap()) as usize;
        for at in (yarn + 8..yarn + 8 + size).step_by(16) {
            expected[at + 12..at + 16].copy_from_slice(&found[at + 12..at + 16]);
        }
        assert!(found == expected, "{name}");
    }
}
