//! `--frame-range` cuts a run into shards whose files are those of the whole run, to the byte.
//!
//! Seeded faults, each seen red here: places of a shard relative to the middle of its own first frame; a shard of one frame
//! taken for a run of one.

mod common;

use assert_cmd::Command;
use common::Random;
use common::npy::npy;
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

const MESH: &str = "stitches/lace.smobj";
const FRAMES: usize = 7;
/// One in the middle is of a single frame, and so is the last.
const SHARDS: [&str; 4] = ["0:3", "3:4", "4:6", "6"];
const FILES: [&str; 6] = ["b.%04d.bcc", "o.obj", "y.yarns", "m.%d.txt", "p.pbrt", "z.%03d.obj"];

/// A walk: the left of it turns as one and then stands, the right is shaken, all of it goes far.
fn walk(folder: &Path) -> String {
    let mesh = knotmesh::io::smobj::read_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join(MESH)).unwrap();
    let middle = mesh.positions.iter().map(|p| p.x).sum::<f64>() / mesh.positions.len() as f64;
    let mut random = Random::new(11);
    let mut place = |p: &DVec3, frame: usize| {
        let t = frame.min(4) as f64;
        let turned = DMat3::from_rotation_y(0.1 * t) * *p + DVec3::new(70.0, 30.0, 0.7) * t;
        let shake = DVec3::new(random.unit(), random.unit(), random.unit()) * 0.1;
        // A little at a time, so that within the tolerance much is what it was.
        let creep = DVec3::new(p.y, p.x, 0.0) * 1e-5 * frame as f64;
        if p.x < middle { turned + creep } else { turned + shake }
    };
    let frames = (0..FRAMES).flat_map(|f| mesh.positions.iter().map(move |p| (p, f)));
    let data: Vec<u8> = frames.flat_map(|(p, f)| place(p, f).to_array()).flat_map(f64::to_le_bytes).collect();
    let path = folder.join("walk.npy");
    std::fs::write(&path, npy("<f8", false, &[FRAMES, mesh.positions.len(), 3], &data)).unwrap();
    path.to_string_lossy().into_owned()
}

/// Relaxes into all formats in a folder of its own.
fn relax(folder: &Path, frames: &str, more: &[&str]) {
    std::fs::create_dir(folder).unwrap();
    let mut command = Command::cargo_bin("knotmesh").unwrap();
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(["relax", MESH, "--frames", frames, "-q"]);
    for file in FILES.iter().chain(&["all.npz", "all.usda"]) {
        command.arg("-o").arg(folder.join(file));
    }
    let output = command.args(more).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The frames of a shard.
fn frames_of(shard: &str) -> std::ops::Range<usize> {
    let number = |text: &str| text.parse::<usize>().unwrap();
    match shard.split_once(':') {
        Some((begin, end)) => number(begin)..number(end),
        None => number(shard)..number(shard) + 1,
    }
}

/// Names and contents, but for those of all frames.
fn numbered(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let name = |p: &Path| p.file_name().unwrap().to_string_lossy().into_owned();
    files.map(|p| (name(&p), std::fs::read(&p).unwrap())).filter(|(n, _)| !n.starts_with("all.")).collect()
}

/// `[array]` its kind, how many frames it has (none: the same for all) and its bytes.
fn arrays(path: &Path) -> BTreeMap<String, (String, Option<usize>, Vec<u8>)> {
    const OVER_TIME: [&str; 6] =
        ["points", "knot_direction", "knot_half_length", "face_energy_start", "face_energy", "face_status"];
    let mut archive = zip::ZipArchive::new(std::fs::File::open(path).unwrap()).unwrap();
    let mut arrays = BTreeMap::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).unwrap();
        let name = entry.name().unwrap().trim_end_matches(".npy").to_string();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        let begin = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let header = String::from_utf8_lossy(&bytes[10..begin]).into_owned();
        let (kind, shape) = header.split_once("'shape': (").unwrap();
        let frames = shape.split(',').next().unwrap().parse().ok();
        let frames = frames.filter(|_| OVER_TIME.contains(&name.as_str()));
        arrays.insert(name, (kind.to_string(), frames, bytes.split_off(begin)));
    }
    assert!(OVER_TIME.iter().all(|name| arrays.contains_key(*name)));
    arrays
}

/// `[frame]` its time samples, and the other lines but for the range of times.
fn samples(path: &Path) -> (BTreeMap<usize, Vec<String>>, Vec<String>) {
    let (mut samples, mut others) = (BTreeMap::<usize, Vec<String>>::new(), Vec::new());
    for line in std::fs::read_to_string(path).unwrap().lines() {
        match line.split_once(": [").and_then(|(time, _)| time.trim().parse().ok()) {
            Some(frame) => samples.entry(frame).or_default().push(line.into()),
            None if line.contains("startTimeCode") || line.contains("endTimeCode") => {}
            None => others.push(line.into()),
        }
    }
    (samples, others)
}

/// Runs all frames and the shards; says what differs.
fn compare(more: &[&str]) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let frames = walk(folder.path());
    relax(&at("whole"), &frames, more);
    for (i, shard) in SHARDS.iter().enumerate() {
        relax(&at(&i.to_string()), &frames, &[more, &["--frame-range", shard]].concat());
    }
    let shards: Vec<_> = (0..SHARDS.len()).map(|i| at(&i.to_string())).collect();

    let mut together = BTreeMap::new();
    shards.iter().for_each(|shard| together.append(&mut numbered(shard)));
    let whole = numbered(&at("whole"));
    assert_eq!(whole.len(), FILES.len() * FRAMES);
    assert!(whole.keys().eq(together.keys()), "{:?}", together.keys());
    if let Some((name, _)) = whole.iter().find(|(name, bytes)| together[*name] != **bytes) {
        return Err(format!("{name} differs"));
    }

    let of_shards: Vec<_> = shards.iter().map(|shard| arrays(&shard.join("all.npz"))).collect();
    for (name, (kind, frames, bytes)) in arrays(&at("whole").join("all.npz")) {
        let mut joined = Vec::new();
        for (shard, range) in of_shards.iter().zip(SHARDS.map(frames_of)) {
            let (its_kind, its_frames, part) = &shard[&name];
            assert_eq!((its_kind, *its_frames), (&kind, frames.map(|_| range.len())), "{name}");
            match frames {
                Some(_) => joined.extend_from_slice(part),
                None => joined.clone_from(part),
            }
            if frames.is_none() && *part != bytes {
                return Err(format!("{name} of {range:?} differs"));
            }
        }
        if joined != bytes {
            return Err(format!("{name} differs"));
        }
    }

    let (whole, lines) = samples(&at("whole").join("all.usda"));
    assert_eq!(whole.len(), FRAMES);
    for (shard, range) in shards.iter().zip(SHARDS.map(frames_of)) {
        let (part, its_lines) = samples(&shard.join("all.usda"));
        assert!(part.keys().copied().eq(range.clone()), "time samples of {range:?}: {:?}", part.keys());
        if its_lines != lines || part.iter().any(|(frame, samples)| whole[frame] != *samples) {
            return Err(format!("the .usda of {range:?} differs"));
        }
    }
    Ok(())
}

#[test]
fn shards_are_parts_of_the_whole() {
    for start in ["affine", "table"] {
        for skip in ["none", "unmoved,rest", "rest,shared"] {
            compare(&["--start", start, "--skip", skip, "--device", "cpu"])
                .unwrap_or_else(|e| panic!("--start {start} --skip {skip}: {e}"));
        }
    }
    let f64 = compare(&["--precision", "f64", "--skip", "unmoved,rest"]);
    assert_eq!(f64, Ok(()), "f64");
}

/// What is kept from frame to frame is not in a shard: the comparison sees that.
#[test]
fn what_depends_on_frames_before_is_seen() {
    for more in [["--skip", "all"], ["--skip", "rigid"], ["--start", "previous"]] {
        assert!(compare(&[&more[..], &["--device", "cpu"]].concat()).is_err(), "{more:?}: no difference");
    }
}

#[cfg(feature = "gpu")]
#[test]
fn shards_on_a_gpu_are_parts_of_the_whole() {
    if common::gpu::adapter().is_some() {
        assert_eq!(compare(&["--skip", "unmoved,rest", "--device", "gpu"]), Ok(()));
    }
}
