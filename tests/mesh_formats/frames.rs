use crate::message;
use glam::DVec3;
use knotmesh::io::frames::Frames;
use std::path::{Path, PathBuf};

/// Frame, vertex and axis can all be told from the number.
fn value(frame: usize, vertex: usize, axis: usize) -> f64 {
    (frame * 1000 + vertex * 10 + axis) as f64 + 0.5
}

fn header(kind: &str, fortran: &str, shape: &str, version: u8) -> Vec<u8> {
    let text = format!("{{'descr': '{kind}', 'fortran_order': {fortran}, 'shape': {shape}, }}   \n");
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    match version {
        1 => bytes.extend((text.len() as u16).to_le_bytes()),
        _ => bytes.extend((text.len() as u32).to_le_bytes()),
    }
    bytes.extend(text.as_bytes());
    bytes
}

fn number(kind: &str, x: f64) -> Vec<u8> {
    match kind {
        "<f4" => (x as f32).to_le_bytes().to_vec(),
        ">f4" => (x as f32).to_be_bytes().to_vec(),
        "<f8" => x.to_le_bytes().to_vec(),
        _ => x.to_be_bytes().to_vec(),
    }
}

/// An array [frames, vertices, 3] of `value`.
fn array(kind: &str, fortran: bool, frames: usize, vertices: usize) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let mut bytes = header(kind, order, &format!("({frames}, {vertices}, 3)"), 1);
    for k in 0..frames * vertices * 3 {
        let (frame, vertex, axis) = if fortran {
            (k % frames, k / frames % vertices, k / frames / vertices)
        } else {
            (k / 3 / vertices, k / 3 % vertices, k % 3)
        };
        bytes.extend(number(kind, value(frame, vertex, axis)));
    }
    bytes
}

fn file(dir: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = dir.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn open(path: &Path, vertices: usize) -> knotmesh::Result<Frames> {
    Frames::open(path.to_str().unwrap(), vertices)
}

#[test]
fn arrays_of_either_order_size_and_byte_order_are_read() {
    let dir = tempfile::tempdir().unwrap();
    for kind in ["<f4", ">f4", "<f8", ">f8"] {
        // 1,100 frames make the stride of the Fortran order longer than what is read at once.
        for (fortran, frames, vertices) in [(false, 3, 50), (true, 3, 50), (true, 1100, 7), (false, 2, 4000)]
        {
            let path = file(dir.path(), "a.npy", &array(kind, fortran, frames, vertices));
            let mut sequence = open(&path, vertices).unwrap();
            assert_eq!((sequence.len(), sequence.vertex_count()), (frames, vertices));
            let mut positions = vec![DVec3::NAN; 5];
            for frame in [frames - 1, 0, frames / 2] {
                sequence.read(frame, &mut positions).unwrap();
                let expected: Vec<_> = (0..vertices)
                    .map(|v| DVec3::from_array([0, 1, 2].map(|k| value(frame, v, k) as f32 as f64)))
                    .collect();
                assert_eq!(positions, expected, "{kind} {fortran} {frame}");
            }
        }
    }
}

#[test]
fn one_frame_may_stand_alone_and_headers_vary() {
    let dir = tempfile::tempdir().unwrap();
    for (version, shape, fortran) in [(2, "(2, 3)", false), (3, "(2,3,)", true), (1, " ( 1 , 2 , 3 )", false)]
    {
        let mut bytes = header("<f8", if fortran { "True" } else { "False" }, shape, version);
        for k in 0..6 {
            let (vertex, axis) = if fortran { (k % 2, k / 2) } else { (k / 3, k % 3) };
            bytes.extend(value(0, vertex, axis).to_le_bytes());
        }
        bytes.extend(b"more than the array");
        let path = file(dir.path(), "one.NPY", &bytes);
        let mut sequence = open(&path, 2).unwrap();
        assert_eq!(sequence.len(), 1);
        let mut positions = Vec::new();
        sequence.read(0, &mut positions).unwrap();
        assert_eq!(positions, [DVec3::new(0.5, 1.5, 2.5), DVec3::new(10.5, 11.5, 12.5)]);
        let error = message(sequence.read(1, &mut positions));
        assert_eq!(error, "there is no frame 1: frames are 0 to 0");
    }
}

#[test]
fn faulty_arrays_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let good = array("<f8", false, 2, 4);
    let data = good.len() - 2 * 4 * 3 * 8;
    let mut not_finite = good.clone();
    not_finite[data + 8 * 19..data + 8 * 20].copy_from_slice(&f64::NAN.to_le_bytes());
    let cut = &good[..good.len() - 1];
    let shape = |shape: &str| header("<f8", "False", shape, 1);
    let shape_error =
        |shape: &str| format!("1: found an array of shape {shape}, expected [frame, 4, 3] or [4, 3]");
    const KINDS: &str = "floats of 4 or 8 bytes ('<f4', '<f8'), integers or booleans";
    for (bytes, expected) in [
        (b"".to_vec(), "1: found another kind of file, expected a NumPy array (.npy)".to_string()),
        (b"\x93NUMPY\x01".to_vec(), "8: found the end of the file, expected the length of the header".into()),
        (
            b"\x93NUMPY\x04\x00aaaaaaa".to_vec(),
            "7: found version 4.0, expected version 1.0, 2.0 or 3.0 of the .npy format".into(),
        ),
        (
            b"\x93NUMPY\x01\x00\x09\x00{".to_vec(),
            "12: found the end of the file, expected a header of 9 bytes".into(),
        ),
        (
            b"\x93NUMPY\x02\x00\xff\xff\xff\xff{".to_vec(),
            "9: found a header of 4294967295 bytes, expected a shorter header".into(),
        ),
        (header("<c8", "False", "(4, 3)", 1), format!("21: found '<c8', expected {KINDS}")),
        (header("<f2", "False", "(4, 3)", 1), format!("21: found '<f2', expected {KINDS}")),
        (header("<f8", "0", "(4, 3)", 1), "45: found '0, 'shape':', expected True or False".into()),
        (shape("4"), "61: found '4, }', expected '('".into()),
        (shape("(4, -3)"), "65: found '-3), }', expected a size of the array".into()),
        (
            shape("(99999999999999999999, 4, 3)"),
            "62: found '999999999999', expected a size of the array".into(),
        ),
        (shape("(2, 5, 3)"), shape_error("[2, 5, 3]")),
        (shape("(2, 4, 4)"), shape_error("[2, 4, 4]")),
        (shape("(4,)"), shape_error("[4]")),
        (shape("()"), shape_error("[]")),
        (shape("(0, 4, 3)"), "1: found no frames, expected at least one frame".into()),
        (
            shape("(18446744073709551615, 4, 3)"),
            format!(
                "{}: found the end of the file, expected 18446744073709551615 frames of 4 vertices",
                shape("(18446744073709551615, 4, 3)").len() + 1
            ),
        ),
        (cut.to_vec(), format!("{}: found the end of the file, expected 2 frames of 4 vertices", good.len())),
    ] {
        let path = file(dir.path(), "a.npy", &bytes);
        assert_eq!(message(open(&path, 4)), format!("{}:1:{expected}", path.display()));
    }
    let path = file(dir.path(), "a.npy", &not_finite);
    let mut sequence = open(&path, 4).unwrap();
    sequence.read(0, &mut Vec::new()).unwrap();
    let expected = format!(
        "{}:1:{}: found NaN at vertex 2 of frame 1 (both counted from 0), expected a finite coordinate",
        path.display(),
        data + 8 * 19 + 1
    );
    assert_eq!(message(sequence.read(1, &mut Vec::new())), expected);

    // A file that shrinks while it is open.
    let path = file(dir.path(), "a.npy", &good);
    let mut sequence = open(&path, 4).unwrap();
    std::fs::write(&path, &good[..data + 8]).unwrap();
    assert!(
        message(sequence.read(1, &mut Vec::new()))
            .contains("found the end of the file, expected more numbers")
    );
    let missing = dir.path().join("none.npy");
    assert!(message(open(&missing, 4)).starts_with(&format!("{}: ", missing.display())));
}

#[test]
fn obj_files_come_in_natural_order() {
    let dir = tempfile::tempdir().unwrap();
    for frame in [10, 9, 2, 1, 100] {
        let text = format!("# frame\nv {frame} 0 0\nv 0 {frame} 0\nf 1 2 2\n");
        file(dir.path(), &format!("frame{frame}.obj"), text.as_bytes());
    }
    std::fs::create_dir(dir.path().join("frame5.obj")).unwrap();
    let mut sequence = open(&dir.path().join("frame*.obj"), 2).unwrap();
    let mut positions = Vec::new();
    let order: Vec<_> = (0..sequence.len())
        .map(|frame| {
            sequence.read(frame, &mut positions).unwrap();
            positions[0].x
        })
        .collect();
    assert_eq!(order, [1.0, 2.0, 9.0, 10.0, 100.0]);

    let mut wrong = open(&dir.path().join("frame?.obj"), 3).unwrap();
    let expected = format!(
        "{}:1:1: found 2 vertices in frame 1, expected 3 as in the mesh",
        dir.path().join("frame2.obj").display()
    );
    assert_eq!(message(wrong.read(1, &mut positions)), expected);
    file(dir.path(), "frame2.obj", b"v 0 0 0\nv 0 inf 0\n");
    let expected =
        format!("{}:2:5: found 'inf', expected the vertex's y", dir.path().join("frame2.obj").display());
    assert_eq!(message(wrong.read(1, &mut positions)), expected);

    let none = dir.path().join("no*.obj");
    assert_eq!(message(open(&none, 2)), format!("no file matches '{}'", none.display()));
    assert!(message(Frames::open("a***", 2)).starts_with("the pattern 'a***' is wrong at character "));
    // A file whose name looks like a pattern is meant itself.
    let path = file(dir.path(), "f[1].obj", b"v 7 0 0\n");
    let mut sequence = open(&path, 1).unwrap();
    sequence.read(0, &mut positions).unwrap();
    assert_eq!(positions, [DVec3::new(7.0, 0.0, 0.0)]);
}
