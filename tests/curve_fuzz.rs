//! Broken curve files: every reader answers with curves or with one line, never with a panic, and never allocates
//! much more than the file is long.

mod common;

use common::curves::{annotated, curves};
use common::memory::{LARGEST, Watching};
use common::{Random, data};
use knotmesh::io::curves::{CurveReader, WriteOptions, open_frame_writer, write_curves};
use npyz::WriterBuilder;
use std::path::Path;
use std::sync::atomic::Ordering;

#[global_allocator]
static ALLOCATOR: Watching = Watching;

/// Far above the readers' buffers and far below what a believed count asks for.
const MOST: usize = 16 << 20;

/// Reads a file's content to the end. Returns whether it was well-formed.
fn try_bytes(path: &Path, bytes: &[u8]) -> bool {
    // Only .npz is read from the file system, piece by piece.
    let reader = if path.extension().is_some_and(|e| e == "npz") {
        std::fs::write(path, bytes).unwrap();
        CurveReader::open(path)
    } else {
        CurveReader::from_bytes(path, bytes)
    };
    let result = reader.and_then(|mut reader| {
        while let Some(curves) = reader.next_frame()? {
            assert_eq!(curves.offsets.len(), curves.closed.len() + 1);
            assert_eq!(curves.radius.len(), curves.closed.len());
            assert_eq!(curves.offsets.last(), Some(&curves.points.len()));
            assert!(curves.offsets.is_sorted());
            assert!(curves.points.iter().all(|p| p.is_finite()));
            assert!(curves.sources.is_empty() || curves.sources.len() == curves.points.len());
            assert!(curves.checkpoints.iter().all(|c| (c.unit as usize) < curves.units.len()));
        }
        Ok(())
    });
    let Err(error) = result else { return true };
    let message = error.to_string();
    assert_eq!(message.lines().count(), 1, "{message}");
    let place = message.strip_prefix(&format!("{}:", path.display())).unwrap_or_else(|| panic!("{message}"));
    let numbers: Vec<_> = place.splitn(3, ':').collect();
    assert!(numbers[0].parse::<usize>().is_ok() && numbers[1].parse::<usize>().is_ok(), "{message}");
    assert!(numbers[2].starts_with(" found ") && numbers[2].contains(", expected "), "{message}");
    false
}

/// Small files of every format; those with time have two frames.
fn samples(folder: &Path) -> Vec<(std::path::PathBuf, Vec<u8>)> {
    let mut samples = Vec::new();
    for extension in ["yarns", "bcc", "obj", "npz", "usda", "txt", "pbrt"] {
        let path = folder.join(format!("a.{extension}"));
        write_curves(&path, &annotated(), &WriteOptions::default()).unwrap();
        samples.push((path.clone(), std::fs::read(&path).unwrap()));
        if matches!(extension, "npz" | "usda") {
            let mut writer = open_frame_writer(&path, 2, &WriteOptions::default()).unwrap();
            writer.frame(0, &curves(1, &[(3, false), (3, true)], Some(0.5))).unwrap();
            writer.frame(1, &curves(2, &[(3, false), (3, true)], Some(0.5))).unwrap();
            writer.finish().unwrap();
            samples.push((path.clone(), std::fs::read(&path).unwrap()));
        }
    }
    // Deflated entries, as NumPy's compressed archives have them.
    let path = folder.join("a.npz");
    let mut writer = npyz::npz::NpzWriter::create(&path).unwrap();
    let points = (0..60).map(|i| (i % 7) as f64);
    let builder = writer.array("points", Default::default()).unwrap().default_dtype().shape(&[2, 10, 3]);
    let mut array = builder.begin_nd().unwrap();
    array.extend(points).unwrap();
    array.finish().unwrap();
    let builder = writer.array("yarn_offsets", Default::default()).unwrap().default_dtype().shape(&[3]);
    let mut array = builder.begin_nd().unwrap();
    array.extend([0i64, 4, 10]).unwrap();
    array.finish().unwrap();
    drop(writer);
    samples.push((path.clone(), std::fs::read(&path).unwrap()));
    samples
}

/// Everything in one test, for the allocations are watched across threads.
#[test]
fn broken_files() {
    // Thousands of small files are quicker in memory.
    let memory = Path::new("/dev/shm");
    let folder = tempfile::tempdir_in(memory).or_else(|_| tempfile::tempdir()).unwrap();
    for (path, good) in samples(folder.path()) {
        assert!(try_bytes(&path, &good));
        LARGEST.store(0, Ordering::Relaxed);
        let extension = path.extension().unwrap().to_str().unwrap().to_string();
        let binary = matches!(extension.as_str(), "yarns" | "bcc" | "npz");

        let mut refused = 0;
        for length in 0..good.len() {
            let whole = try_bytes(&path, &good[..length]);
            refused += usize::from(!whole);
            assert!(!(whole && binary), "{extension}: {length} of {} bytes are taken as whole", good.len());
        }
        assert!(refused > 0, "{extension}");
        for garbage in [
            &[0u8; 300][..],
            &[255; 300],
            b"PK\x03\x04",
            b"PK\x05\x06",
            b"\n\n\0\n",
            b"(((((((",
            b"[[\"",
            b"\\",
        ] {
            try_bytes(&path, garbage);
        }

        let mut bytes = good.clone();
        let mut random = Random(0x1234_5678_9abc_def1);
        let poison: [&[u8]; 9] = [
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
        for at in 0..good.len() {
            for piece in poison {
                let end = (at + piece.len()).min(good.len());
                bytes[at..end].copy_from_slice(&piece[..end - at]);
                if binary || random.below(4) == 0 {
                    try_bytes(&path, &bytes);
                }
                bytes[at..end].copy_from_slice(&good[at..end]);
            }
        }
        let words: [&[u8]; 14] = [
            b"99999999999999999999",
            b"4294967295",
            b"-1",
            b"nan",
            b"1e999",
            b"",
            b"\"",
            b"[",
            b"}",
            b"(",
            b" \\\n",
            b"#",
            b"None",
            b"\n",
        ];
        for round in 0..4000 {
            bytes.clone_from(&good);
            for _ in 0..=random.below(3) {
                let at = random.below(bytes.len());
                match round % 5 {
                    0 => bytes[at] ^= 1 << random.below(8),
                    1 => bytes[at] = random.bits() as u8,
                    2 => drop(bytes.drain(at..(at + random.below(40)).min(good.len()).min(at.max(1) + 1))),
                    3 => {
                        // A word, or whatever stands here, becomes something else.
                        let end =
                            bytes[at..].iter().position(|b| b.is_ascii_whitespace()).map_or(at, |n| at + n);
                        let word = words[random.below(words.len())];
                        bytes.splice(at..end.min(at + 30), word.iter().copied());
                    }
                    _ => {
                        // A piece is repeated somewhere else: chunks in the wrong order, lines twice.
                        let end = (at + random.below(100)).min(bytes.len());
                        let piece = bytes[at..end].to_vec();
                        let to = random.below(bytes.len());
                        bytes.splice(to..to, piece);
                    }
                }
                if bytes.is_empty() {
                    break;
                }
            }
            try_bytes(&path, &bytes);
        }
        let largest = LARGEST.load(Ordering::Relaxed);
        assert!(largest < MOST, "{extension}: {largest} bytes were allocated for a file of {}", good.len());
    }

    // Real files cut off anywhere.
    let Some(data) = data() else { return };
    let mut random = Random(77);
    for name in ["bcc/glove.bcc", "yarns/short-row.yarns", "smobj/k.yarns", "obj-lines/houdiniobj.obj"] {
        let good = std::fs::read(data.join(name)).unwrap();
        let path = folder.path().join(Path::new(name).file_name().unwrap());
        for _ in 0..50 {
            let whole = try_bytes(&path, &good[..random.below(good.len())]);
            assert!(!whole || name.ends_with("obj"), "{name}");
        }
    }
}
