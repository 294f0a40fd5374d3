//! Curve files as other programs write them, and the words for what is wrong in them.

mod common;

use common::curves::curves;
use glam::DVec3;
use knotmesh::io::curves::{CurveReader, UpAxis, WriteOptions, read_curves, write_curves};
use knotmesh::yarn::Curves;

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
        (8, &[3, 0], "a.bcc:1:17: found 7 control points, expected at most 6"),
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
