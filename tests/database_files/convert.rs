//! `knotmesh convert` with sequences and models.

use crate::common::database::{model, moved, sheet};
use assert_cmd::Command;
use glam::DVec3;
use knotmesh::io::frames::Frames;
use knotmesh::io::{obj_mesh, sequence, yarn_model};
use std::path::Path;

/// Exit code and messages.
fn convert(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let mut command = Command::cargo_bin("knotmesh").unwrap();
    let output = command.current_dir(folder).arg("convert").args(arguments).output().unwrap();
    (output.status.code().expect("not killed"), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn sequences_become_positions_or_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mesh = sheet(4, 3);
    let frames: Vec<Vec<DVec3>> = (1..9).map(|frame| moved(&mesh, frame)).collect();
    sequence::write(&at("a.bin"), &mesh, frames.iter()).unwrap();
    let (code, text) = convert(folder.path(), &["a.bin", "a.npy", "-v"]);
    assert_eq!((code, &text[..]), (0, "knotmesh: 9 frames, 20 vertices -> a.npy\n"));
    let array = npyz::NpyFile::new(std::fs::File::open(at("a.npy")).unwrap()).unwrap();
    assert_eq!((array.shape(), array.dtype().descr()), (&[9, 20, 3][..], "'<f4'".into()));
    let mut read = Frames::open(at("a.npy").to_str().unwrap(), 20).unwrap();
    let mut positions = Vec::new();
    for frame in 0..9 {
        read.read(frame, &mut positions).unwrap();
        assert_eq!(positions, if frame == 0 { &mesh.positions } else { &frames[frame - 1] }[..], "{frame}");
    }
    assert_eq!(convert(folder.path(), &["a.bin", "a.obj"]), (0, String::new()));
    assert_eq!(obj_mesh::read_file(&at("a.obj")).unwrap().into_material_mesh().unwrap(), mesh);
}

#[test]
fn models_go_both_ways() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let model = model([4, 3, 5]);
    yarn_model::write_dir(&at("m"), &model).unwrap();
    let (code, text) = convert(folder.path(), &["m", "m.npz", "-v"]);
    assert_eq!((code, &text[..]), (0, "knotmesh: 12 vertices, 4 x 3 x 5 nodes -> m.npz\n"));
    assert_eq!(convert(folder.path(), &["m.npz", "again"]), (0, String::new()));
    assert_eq!(yarn_model::read(&at("again")).unwrap(), model);
    // Not over a folder that is there, and not into other formats.
    let (code, text) = convert(folder.path(), &["m.npz", "m"]);
    assert_eq!((code, &text[..]), (2, "knotmesh: m: is there already, expected a new name\n"));
}

#[test]
fn what_cannot_be_converted() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    sequence::write(&at("a.bin"), &sheet(1, 1), std::iter::empty::<Vec<DVec3>>()).unwrap();
    yarn_model::write_npz(&at("m.npz"), &model([3, 3, 3])).unwrap();
    std::fs::create_dir(at("empty")).unwrap();
    for (arguments, expected) in [
        (
            ["a.bin", "b.bcc"],
            "b.bcc: found the extension '.bcc', expected another: a sequence becomes a .npy",
        ),
        (["a.bin", "b"], "b: found no extension, expected another: a sequence becomes a .npy"),
        (["no.bin", "b.npy"], "no.bin: No such file"),
        (["no", "b.npz"], "no: No such file"),
        (["empty", "b.npz"], "empty/pyp: No such file"),
        (
            ["empty", "b.obj"],
            "b.obj: found the extension '.obj', expected another: a yarn model becomes an .npz",
        ),
        (["m.npz", "b.obj"], "m.npz:1:1: found no array 'yarn_offsets', expected a result file"),
        (["m.npz", "no/b"], "no/b: No such file"),
    ] {
        let (code, text) = convert(folder.path(), &arguments);
        assert_eq!(code, 2, "{arguments:?}: {text}");
        assert!(text.starts_with(&format!("knotmesh: {expected}")) && text.lines().count() == 1, "{text}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3, "nothing is left behind");
}
