//! Broken input: whatever the bytes, readers return a result or an error of one line. Deterministic.

mod common;

use common::Random;
use knotmesh::Error;
use knotmesh::io::frames::Frames;
use knotmesh::io::{obj_mesh, sf, smobj};
use knotmesh::mesh::StitchType;
use std::path::Path;

const SMOBJ: &[u8] = b"L k a b c d\nL t x y z # tri\nv 0 0 0\nv 1 0 -.5\nv 1 1e0 0\nv 0 1 0\nv 2 0 0\n\
f 1 2 3 4\nT 1\nN 1\nf 2/1 -1/2 -3/3\nT 2\nN 1\ne 1/2 2/-3\nU 1 1.0\nU na 0.1\nc 1/2/1 1 2 3 1\n\
h 1/1 f0.5 i\no 0/1 2/1 u\nt 1 front h\nl 1 0 1 u\nI 1/1\nxfer f0 b0\nci 1/1\nvt 1 1\n";

const SF: &[u8] = b"derive e -l2 -l1 -y +l +y by mirror-x from d -l1 -l2 +y +l -y\nface d\nedge (-2,0) -l1\n\
edge (0, -1) -l2\nedge (3,0) +y\nedge (1,1) +l\nedge (-1,1) -y\nyarn [0:0.25,1] (0,0.5,.1) [4:0.5,2]\n\
yarn [1:0,0] (1,2,3) [1:1,0] # both ends inside\nderive r by reverse-yarn mirror-z from e -l2 -l1 -y +l +y\n";

const OBJ: &[u8] = b"o a\nv 0 0 0\nv 1 0 0 1\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nusemtl m\n\
f 1/1 2/2 3/1 4/2\ng b\nf 1//1 4//1 \\\n -2//1\ns off\nl 1 2\nf 1 2 3 # same way\n";

/// Words that break careless arithmetic.
const POISON: [&[u8]; 18] = [
    b"0",
    b"-1",
    b"99999999999999999999",
    b"4294967295",
    b"4294967296",
    b"9223372036854775807",
    b"-9223372036854775808",
    b"1e308",
    b"-1e-320",
    b"nan",
    b"-inf",
    b"1/4294967295",
    b"4294967295/1/1",
    b"1/-9223372036854775808",
    b"\xff\xfe",
    b"#",
    b"\\",
    b"",
];

/// The sample with one to four changes.
fn mutate(dice: &mut Random, sample: &[u8]) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for _ in 0..1 + dice.below(4) {
        let at = dice.below(bytes.len());
        match dice.below(7) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << dice.below(8),
            1 => bytes.insert(at, dice.below(256) as u8),
            2 => bytes.insert(at, b" \n\t#/-.()[]:,"[dice.below(13)]),
            3 => {
                let end = (at + dice.below(9)).min(bytes.len());
                bytes.drain(at..end);
            }
            4 => swap_lines(dice, &mut bytes),
            5 => bytes.truncate(at),
            _ => poison(dice, &mut bytes, at),
        }
    }
    bytes
}

fn swap_lines(dice: &mut Random, bytes: &mut Vec<u8>) {
    let mut lines: Vec<_> = bytes.split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
    let (a, b) = (dice.below(lines.len()), dice.below(lines.len()));
    lines.swap(a, b);
    *bytes = lines.join(&b'\n');
}

/// Puts a poisonous word in place of the word at `at`.
fn poison(dice: &mut Random, bytes: &mut Vec<u8>, at: usize) {
    let is_word = |b: &u8| !b.is_ascii_whitespace() && !b"()[]:,".contains(b);
    let begin = at - bytes[..at].iter().rev().take_while(|b| is_word(b)).count();
    let end = at + bytes[at..].iter().take_while(|b| is_word(b)).count();
    bytes.splice(begin..end, POISON[dice.below(POISON.len())].iter().copied());
}

/// Runs `read` on every truncation and on many mutations; says how many were accepted.
fn shake<T>(sample: &[u8], rounds: usize, read: impl Fn(&[u8]) -> Result<T, Error>) {
    let check = |bytes: &[u8]| match read(bytes) {
        Ok(_) => 1,
        Err(error) => {
            let message = error.to_string();
            assert!(!message.contains(char::is_control), "{message:?}");
            assert!(message.contains(" found ") && message.contains(", expected "), "{message:?}");
            0
        }
    };
    assert_eq!(check(sample), 1, "the sample itself must be right");
    for end in 0..sample.len() {
        check(&sample[..end]);
    }
    let mut dice = Random(0x9e37_79b9_7f4a_7c15);
    let accepted: usize = (0..rounds).map(|_| check(&mutate(&mut dice, sample))).sum();
    // Both outcomes must be common, or the mutations say little.
    assert!(accepted > rounds / 50 && accepted < rounds - rounds / 50, "{accepted} of {rounds} accepted");
}

fn path() -> &'static Path {
    Path::new("in")
}

#[test]
fn stitch_meshes() {
    shake(SMOBJ, 60_000, |bytes| {
        let mut mesh = smobj::read(path(), bytes)?;
        // Whatever is accepted holds together and survives writing.
        let mut used = std::collections::HashSet::new();
        for side in mesh.joins.iter().flat_map(|join| [join.a, join.b]) {
            assert!((side.edge as usize) < mesh.face(side.face).len() && used.insert(side));
        }
        for face in 0..mesh.face_count() {
            assert_eq!(mesh.face_type(face.into()).labels.len(), mesh.face(face.into()).len());
        }
        assert!(mesh.face_vertices.iter().all(|v| v.index() < mesh.positions.len()));
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        mesh.ignored.clear();
        let mut text = Vec::new();
        smobj::write(&mesh, &mut text).unwrap();
        assert_eq!(smobj::read(path(), &text)?, mesh);
        Ok(())
    });
}

#[test]
fn face_libraries() {
    shake(SF, 60_000, |bytes| {
        let faces = sf::read(path(), bytes)?;
        for face in &faces {
            assert!(face.labels.len() >= 3 && face.labels.len() == face.corners.len());
            for point in face.strands.iter().flatten() {
                if let sf::PlainPoint::Boundary { edge, along, .. } = *point {
                    assert!((edge as usize) < face.labels.len() && along > 0.0 && along < 1.0);
                }
            }
            assert!(face.strands.iter().all(|strand| !strand.is_empty()));
        }
        Ok(())
    });
}

#[test]
fn polygons() {
    shake(OBJ, 60_000, |bytes| {
        // Frame files are read by the same rules, less the faces.
        let mut positions = Vec::new();
        let only_positions = obj_mesh::read_positions(path(), bytes, &mut positions);
        let mesh = obj_mesh::read(path(), bytes)?;
        only_positions?;
        assert_eq!(positions, mesh.positions);
        let joins = mesh.joins.len();
        let made = mesh.into_stitch_mesh(&mut |name, uvs, count| {
            assert!(uvs.is_none_or(|uvs| uvs.len() == count));
            Ok((StitchType { name: name.into(), labels: vec!["x".into(); count] }, count / 2))
        })?;
        assert_eq!(made.joins.len(), joins);
        for side in made.joins.iter().flat_map(|join| [join.a, join.b]) {
            assert!((side.edge as usize) < made.face(side.face).len());
        }
        Ok(())
    });
}

#[test]
fn lines_in_any_order() {
    let mut dice = Random(7);
    for sample in [SMOBJ, SF, OBJ] {
        for _ in 0..2000 {
            let mut bytes = sample.to_vec();
            for _ in 0..10 {
                swap_lines(&mut dice, &mut bytes);
            }
            for error in [
                smobj::read(path(), &bytes).err(),
                sf::read(path(), &bytes).err(),
                obj_mesh::read(path(), &bytes).err(),
            ] {
                assert!(error.is_none_or(|e| !e.to_string().contains('\n')));
            }
        }
    }
    // Types before faces, joins before both: allowed.
    let text = b"e 1/1 1/-3\nN 4\nT 1\nf 1 2 3 4\nL k a b c d\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0";
    assert_eq!(smobj::read(path(), text).unwrap().joins.len(), 1);
}

#[test]
fn frames() {
    let text = b"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 3), }\n";
    let mut sample = b"\x93NUMPY\x01\x00".to_vec();
    sample.extend((text.len() as u16).to_le_bytes());
    sample.extend(text);
    for k in 0..18 {
        sample.extend((k as f32 - 4.5).to_le_bytes());
    }
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a.npy");
    shake(&sample, 2000, |bytes| {
        std::fs::write(&file, bytes).unwrap();
        let mut frames = Frames::open(file.to_str().unwrap(), 3)?;
        let mut positions = Vec::new();
        for frame in 0..frames.len() {
            frames.read(frame, &mut positions)?;
            assert!(positions.len() == 3 && positions.iter().all(|p| p.is_finite()));
        }
        Ok(())
    });
    let mut nested = b"\x93NUMPY\x01\x00\xff\xff{'shape': ".to_vec();
    nested.resize(10 + 0xffff, b'(');
    std::fs::write(&file, nested).unwrap();
    assert!(Frames::open(file.to_str().unwrap(), 3).is_err());
}
