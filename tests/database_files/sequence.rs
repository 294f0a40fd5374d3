//! Sequences of cloth.

use super::message;
use crate::common::database::{moved, sheet};
use glam::{DVec2, DVec3};
use knotmesh::io::sequence::{Sequence, write};
use knotmesh::mesh::MaterialMesh;
use std::path::{Path, PathBuf};

/// A triangle of the test's own bytes.
fn matrix(rows: u32, columns: u32, words: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = [rows.to_le_bytes(), columns.to_le_bytes()].concat();
    bytes.extend(words.iter().flatten());
    bytes
}

fn floats(columns: u32, numbers: &[f32]) -> Vec<u8> {
    let words: Vec<_> = numbers.iter().map(|x| x.to_le_bytes()).collect();
    matrix(numbers.len() as u32 / columns, columns, &words)
}

fn whole(numbers: &[u32]) -> Vec<u8> {
    let words: Vec<_> = numbers.iter().map(|x| x.to_le_bytes()).collect();
    matrix(numbers.len() as u32 / 3, 3, &words)
}

const V: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.5];
const U: [f32; 8] = [9.0, 9.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];

/// The first frame of a triangle, without obstacles.
fn first() -> Vec<u8> {
    [floats(3, &V), whole(&[0, 1, 2]), floats(2, &U), whole(&[1, 2, 3])].concat()
}

fn none() -> Vec<u8> {
    matrix(0, 0, &[])
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }
    fn path(&self) -> PathBuf {
        self.0.path().join("a.bin")
    }
    fn open(&self, bytes: &[u8]) -> knotmesh::Result<Sequence> {
        std::fs::write(self.path(), bytes).unwrap();
        Sequence::open(&self.path())
    }
    fn message(&self, bytes: &[u8]) -> String {
        message(self.0.path(), self.open(bytes))
    }
}

#[test]
fn a_triangle_byte_by_byte() {
    let folder = Folder::new();
    let later: Vec<f32> = V.iter().map(|x| x + 1.0).collect();
    let bytes = [
        vec![4],
        first(),
        // Two obstacles with motions, one with vertices and faces.
        vec![2],
        [1f32.to_le_bytes().to_vec(), floats(1, &[1.0; 3]), floats(1, &[0.0; 4])].concat(),
        [1f32.to_le_bytes().to_vec(), floats(1, &[1.0; 3]), floats(1, &[0.0; 4])].concat(),
        vec![1],
        floats(3, &V),
        vec![1],
        whole(&[0, 1, 2]),
        // Nothing changes.
        [none(), none(), none(), none(), vec![0; 3]].concat(),
        // Positions, and the same faces once more.
        [floats(3, &later), whole(&[0, 1, 2]), none(), none(), vec![0; 3]].concat(),
        [none(), none(), floats(2, &U), none(), vec![0; 3]].concat(),
    ]
    .concat();
    let mut sequence = folder.open(&bytes).unwrap();
    let mesh = MaterialMesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::new(0.0, 1.0, 0.5)],
        uvs: vec![DVec2::splat(9.0), DVec2::ZERO, DVec2::X, DVec2::Y],
        faces: vec![[0, 1, 2]],
        face_uvs: vec![[1, 2, 3]],
        sources: Vec::new(),
    };
    assert_eq!(*sequence.mesh(), mesh);
    assert_eq!((sequence.len(), sequence.vertex_count()), (4, 3));
    let mut positions = vec![DVec3::NAN; 50];
    for (frame, x) in [(3, 1.0), (0, 0.0), (2, 1.0), (1, 0.0)] {
        sequence.read(frame, &mut positions).unwrap();
        assert_eq!(positions, mesh.positions.iter().map(|p| *p + x).collect::<Vec<_>>(), "{frame}");
    }
    let error = message(folder.0.path(), sequence.read(4, &mut positions));
    assert_eq!(error, "a.bin: there is no frame 4: frames are 0 to 3");
    // Cut off behind the reader's back.
    std::fs::write(folder.path(), &bytes[..40]).unwrap();
    assert!(sequence.read(3, &mut positions).is_err());
}

#[test]
fn sequences_round_trip_to_the_bit() {
    let folder = Folder::new();
    let mut mesh = sheet(3, 2);
    mesh.positions[0] = DVec3::new(-0.0, f32::MIN_POSITIVE as f64 / 2.0, f32::MAX as f64);
    let frames: Vec<_> = (1..5).map(|frame| moved(&mesh, frame)).collect();
    write(&folder.path(), &mesh, frames.iter()).unwrap();
    let mut sequence = Sequence::open(&folder.path()).unwrap();
    assert_eq!(*sequence.mesh(), mesh);
    assert!(sequence.mesh().positions[0].x.is_sign_negative());
    let mut positions = Vec::new();
    for (frame, expected) in frames.iter().enumerate().rev() {
        sequence.read(frame + 1, &mut positions).unwrap();
        assert_eq!(positions, *expected, "{frame}");
    }
    let again = folder.0.path().join("b.bin");
    write(&again, sequence.mesh(), frames.iter()).unwrap();
    assert_eq!(std::fs::read(folder.path()).unwrap(), std::fs::read(&again).unwrap());
}

/// The number of frames in one, two and four bytes. Seen red with its last two bytes exchanged.
#[test]
fn sizes_of_every_length() {
    let folder = Folder::new();
    let mesh = sheet(1, 1);
    for (count, start) in [
        (1, vec![1]),
        (127, vec![127]),
        (128, vec![0x80, 0x80]),
        (140, vec![0x80, 0x8c]),
        (16383, vec![0xbf, 0xff]),
        (16384, vec![0xc0, 0, 0, 0x40]),
        (16386, vec![0xc0, 0, 2, 0x40]),
    ] {
        write(&folder.path(), &mesh, vec![&mesh.positions; count - 1].into_iter()).unwrap();
        let bytes = std::fs::read(folder.path()).unwrap();
        assert_eq!(bytes[..start.len()], start);
        assert_eq!(Sequence::open(&folder.path()).unwrap().len(), count);
    }
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let folder = Folder::new();
    let frame =
        |v: Vec<u8>, f: Vec<u8>, u: Vec<u8>, fms: Vec<u8>| [vec![1], v, f, u, fms, vec![0; 3]].concat();
    let (v, f, u, fms) = (floats(3, &V), whole(&[0, 1, 2]), floats(2, &U), whole(&[1, 2, 3]));
    let mut bad = V;
    bad[4] = f32::NAN;
    let good = frame(v.clone(), f.clone(), u.clone(), fms.clone());
    assert!(folder.open(&good).is_ok());
    let then = |more: Vec<u8>| [vec![2], first(), vec![0; 3], more, vec![0; 3]].concat();
    let at = good.len() + 1;
    let later = |v: Vec<u8>, f: Vec<u8>, u: Vec<u8>| then([v, f, u, none()].concat());
    for (bytes, expected) in [
        (vec![], "a.bin:1:1: found the end of the file, expected the number of frames".to_string()),
        (vec![0], "a.bin:1:1: found 0 frames, expected 1 to 0 in a file of 1 bytes".into()),
        (vec![0xc0], "a.bin:1:2: found the end of the file, expected the number of frames".into()),
        (
            [vec![0xff, 0xff, 0xff, 0xff], first()].concat(),
            format!("a.bin:1:1: found 1073741823 frames, expected 1 to 3 in a file of {} bytes", first().len() + 4),
        ),
        (good[..good.len() - 1].into(), format!("a.bin:1:{}: found the end of the file, expected an obstacle's faces", at - 1)),
        (
            [&good[..], &[0]].concat(),
            format!("a.bin:1:{at}: found 1 bytes after the last of 1 frames, expected the end of the file"),
        ),
        (
            frame(matrix(u32::MAX, u32::MAX, &[]), f.clone(), u.clone(), fms.clone()),
            "a.bin:1:2: found positions of shape [4294967295, 4294967295], expected at most 83 bytes, which are left of the file".into(),
        ),
        (
            frame(floats(1, &V), f.clone(), u.clone(), fms.clone()),
            "a.bin:1:2: found positions of shape [9, 1], expected rows of 3".into(),
        ),
        (
            frame(v.clone(), none(), u.clone(), none()),
            "a.bin:1:46: found faces of shape [0, 0], expected rows of 3".into(),
        ),
        (
            frame(v.clone(), f.clone(), none(), fms.clone()),
            "a.bin:1:66: found material coordinates of shape [0, 0], expected rows of 2".into(),
        ),
        (
            frame(v.clone(), f.clone(), u.clone(), whole(&[0, 1, 2, 0, 1, 2])),
            "a.bin:1:106: found 2 material faces, expected 1 as there are faces".into(),
        ),
        (
            frame(floats(3, &bad), f.clone(), u.clone(), fms.clone()),
            "a.bin:1:26: found NaN in row 1, expected a finite number".into(),
        ),
        (
            frame(v.clone(), whole(&[0, 3, 2]), u.clone(), fms.clone()),
            "a.bin:1:58: found 3 in faces, expected a number below 3".into(),
        ),
        (
            frame(v.clone(), f.clone(), u.clone(), whole(&[0, 1, 4])),
            "a.bin:1:122: found 4 in material faces, expected a number below 4".into(),
        ),
        (
            later(floats(3, &V[..6]), none(), none()),
            format!("a.bin:1:{at}: found 2 vertices in frame 1, expected 3 as in frame 0"),
        ),
        (
            later(v.clone(), whole(&[0, 2, 1]), none()),
            format!("a.bin:1:{}: found other faces in frame 1, expected those of frame 0: only positions may change", at + 44),
        ),
        (
            later(v.clone(), whole(&[0, 1, 2, 0, 1, 2]), none()),
            format!("a.bin:1:{}: found other faces in frame 1, expected those of frame 0: only positions may change", at + 44),
        ),
        (
            later(none(), none(), floats(2, &[0.0; 8])),
            format!("a.bin:1:{}: found other material coordinates in frame 1, expected those of frame 0: only positions may change", at + 16),
        ),
    ] {
        assert_eq!(folder.message(&bytes), expected);
    }
    // Numbers of later frames are looked at when they are read.
    let mut sequence = folder.open(&later(floats(3, &bad), none(), none())).unwrap();
    let error = message(folder.0.path(), sequence.read(1, &mut Vec::new()));
    assert_eq!(error, format!("a.bin:1:{}: found NaN in row 1, expected a finite number", at + 24));
}

#[test]
fn what_cannot_be_written() {
    let folder = Folder::new();
    let mesh = sheet(1, 1);
    let none: [Vec<DVec3>; 0] = [];
    let write = |mesh: &MaterialMesh, frames: &[Vec<DVec3>]| {
        message(folder.0.path(), write(&folder.path(), mesh, frames.iter()))
    };
    let mut far = mesh.clone();
    far.positions[1].x = 1e39;
    let mut out = mesh.clone();
    out.faces[0][0] = 4;
    for (error, expected) in [
        (write(&MaterialMesh::default(), &none), "a.bin: found a mesh without faces, expected at least one"),
        (write(&far, &none), "a.bin: found a position in frame 0 beyond f32, expected finite numbers"),
        (write(&out, &none), "a.bin: face 0: found vertex 4, expected one below 4"),
        (write(&mesh, &[vec![DVec3::ZERO; 3]]), "a.bin: found 3 vertices in frame 1, expected 4"),
        (
            write(&mesh, &[mesh.positions.clone(), vec![DVec3::NAN; 4]]),
            "a.bin: found a position in frame 2 beyond f32, expected finite numbers",
        ),
    ] {
        assert_eq!(error, expected);
    }
    assert_eq!(std::fs::read_dir(folder.0.path()).unwrap().count(), 0, "nothing is left behind");
    assert!(Sequence::open(Path::new("no.bin")).is_err());
}
