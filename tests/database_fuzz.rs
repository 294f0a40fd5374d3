//! Broken models and sequences: every reader answers with data that holds together or with one line, never with a panic,
//! and never allocates much more than the file is long.

mod common;

use common::database::{model, moved, sheet};
use common::memory::{LARGEST, Watching};
use common::{Random, data};
use knotmesh::Result;
use knotmesh::io::sequence::{self, Sequence};
use knotmesh::io::{obj_mesh, pyp, strain_table, yarn_model};
use std::path::Path;
use std::sync::atomic::Ordering;

#[global_allocator]
static ALLOCATOR: Watching = Watching;

/// Far above the readers' buffers and far below what a believed count asks for.
const MOST: usize = 16 << 20;

type Read = fn(&Path, &[u8]) -> Result<()>;

/// Readers of files are given files.
fn file(path: &Path, bytes: &[u8]) {
    std::fs::write(path, bytes).unwrap();
}

fn read_pattern(path: &Path, bytes: &[u8]) -> Result<()> {
    let pattern = pyp::read(path, bytes)?;
    pattern.links()?;
    assert_eq!(pyp::read(path, pyp::write(&pattern).as_bytes())?, pattern);
    Ok(())
}

fn read_axes(path: &Path, bytes: &[u8]) -> Result<()> {
    strain_table::read_axes(path, bytes).map(|axes| assert!(axes.iter().all(|a| (1..=32).contains(&a.len()))))
}

fn read_values(path: &Path, bytes: &[u8]) -> Result<()> {
    file(path, bytes);
    let values = strain_table::read_values(path, &common::database::axes([3, 3, 3]))?;
    assert!(values.len() % 27 == 0 && values.iter().flatten().all(|x| x.is_finite()));
    Ok(())
}

fn read_model(path: &Path, bytes: &[u8]) -> Result<()> {
    file(path, bytes);
    let model = yarn_model::read(path)?;
    model.pattern.links()?;
    assert_eq!(model.pattern.vertex_count(), model.table.vertex_count());
    Ok(())
}

fn read_sequence(path: &Path, bytes: &[u8]) -> Result<()> {
    file(path, bytes);
    let mut sequence = Sequence::open(path)?;
    sequence.mesh().check()?;
    let mut positions = Vec::new();
    for frame in 0..sequence.len() {
        sequence.read(frame, &mut positions)?;
        assert_eq!(positions.len(), sequence.vertex_count());
        assert!(positions.iter().all(|p| p.is_finite()));
    }
    Ok(())
}

fn read_mesh(path: &Path, bytes: &[u8]) -> Result<()> {
    obj_mesh::read(path, bytes)?.into_material_mesh()?.check()
}

/// Whether it was read; what was refused was refused in one line that starts with the file.
fn accepted(path: &Path, bytes: &[u8], read: Read) -> bool {
    let Err(error) = read(path, bytes) else { return true };
    let message = error.to_string();
    assert!(!message.contains(char::is_control), "{message:?}");
    assert!(message.starts_with(&format!("{}:", path.display())), "{message}");
    assert!(message.contains(" found ") && message.contains(", expected "), "{message}");
    false
}

const POISON: [&[u8]; 9] = [
    &[255; 8],
    &[255, 255, 255, 127],
    &[255; 4],
    &[0; 8],
    &[0, 0, 0, 128],
    &f32::NAN.to_le_bytes(),
    &f32::INFINITY.to_le_bytes(),
    &[255; 2],
    &[0, 0, 0, 64],
];

const WORDS: [&[u8]; 14] = [
    b"99999999999999999999",
    b"4294967295",
    b"65536",
    b"-1",
    b"nan",
    b"1e999",
    b"1e39",
    b"0.5",
    b"",
    b"*E",
    b"*",
    b"#",
    b"\n",
    b"\xff",
];

/// The sample with a few changes.
fn mutate(random: &mut Random, sample: &[u8], round: usize) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for _ in 0..=random.below(3) {
        if bytes.is_empty() {
            break;
        }
        let at = random.below(bytes.len());
        match round % 5 {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.bits() as u8,
            2 => drop(bytes.drain(at..(at + random.below(40)).min(bytes.len()))),
            3 => {
                let blank = bytes[at..].iter().position(u8::is_ascii_whitespace);
                let end = (at + blank.unwrap_or(0)).min(at + 30);
                bytes.splice(at..end, WORDS[random.below(WORDS.len())].iter().copied());
            }
            _ => {
                let end = (at + random.below(100)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, piece);
            }
        }
    }
    bytes
}

/// Everything in one test, for the allocations are watched across threads.
#[test]
fn broken_files() {
    // Thousands of small files are quicker in memory.
    let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap();
    let at = |name: &str| folder.path().join(name);
    let model = model([3, 3, 3]);
    let mesh = sheet(2, 1);
    let [axes, values] = strain_table::write(&model.table);
    yarn_model::write_npz(&at("m.npz"), &model).unwrap();
    sequence::write(&at("a.bin"), &mesh, (1..4).map(|frame| moved(&mesh, frame)).collect::<Vec<_>>().iter())
        .unwrap();
    obj_mesh::write(&at("a.obj"), &mesh).unwrap();
    let content = |name: &str| std::fs::read(at(name)).unwrap();
    // Name, content, reader, whether a part of it is never whole.
    let samples: [(&str, Vec<u8>, Read, bool); 6] = [
        ("pyp", pyp::write(&model.pattern).into_bytes(), read_pattern, false),
        ("axes.txt", axes, read_axes, false),
        ("data.npy", values[..128 + 2 * 27 * 16].to_vec(), read_values, true),
        ("m.npz", content("m.npz"), read_model, true),
        ("a.bin", content("a.bin"), read_sequence, true),
        ("a.obj", content("a.obj"), read_mesh, false),
    ];
    for (name, mut good, read, binary) in samples {
        let path = at(name);
        if name == "data.npy" {
            // Two vertices are enough.
            let numbers = good.split_off(128);
            good = common::npy::npy("<f4", false, &[54, 4], &numbers);
        }
        assert!(accepted(&path, &good, read), "{name}");
        LARGEST.store(0, Ordering::Relaxed);
        let mut refused = 0;
        let step = good.len().div_ceil(3000);
        for length in (0..good.len()).step_by(step) {
            let whole = accepted(&path, &good[..length], read);
            refused += usize::from(!whole);
            assert!(!(whole && binary), "{name}: {length} of {} bytes are taken as whole", good.len());
        }
        assert!(refused > 0, "{name}");
        let mut random = Random(0x1234_5678_9abc_def1);
        let mut bytes = good.clone();
        for begin in (0..good.len()).step_by(step) {
            for piece in POISON {
                let end = (begin + piece.len()).min(good.len());
                bytes[begin..end].copy_from_slice(&piece[..end - begin]);
                accepted(&path, &bytes, read);
                bytes[begin..end].copy_from_slice(&good[begin..end]);
            }
        }
        let rounds = 6000;
        let good =
            (0..rounds).filter(|&round| accepted(&path, &mutate(&mut random, &good, round), read)).count();
        // Both outcomes must be common, or the mutations say little; a checksum lets little pass.
        assert!(good < rounds - rounds / 20 && (good > rounds / 50 || name == "m.npz"), "{name}: {good}");
        let largest = LARGEST.load(Ordering::Relaxed);
        assert!(largest < MOST, "{name}: {largest} bytes were allocated for a small file");
    }

    // Real files cut off anywhere.
    let Some(data) = data() else { return };
    let mut random = Random(77);
    let data = data.join("madypg");
    for (name, read) in [
        ("sequences/sx.bin", read_sequence as Read),
        ("sequences/shear_grid_x.bin", read_sequence),
        ("models/model_stocktiniest_9/pyp", read_pattern),
    ] {
        let good = std::fs::read(data.join(name)).unwrap();
        let path = at(Path::new(name).file_name().unwrap().to_str().unwrap());
        assert!(accepted(&path, &good, read), "{name}");
        for _ in 0..50 {
            let whole = accepted(&path, &good[..random.below(good.len())], read);
            assert!(!whole || name.ends_with("pyp"), "{name}");
        }
    }
}
