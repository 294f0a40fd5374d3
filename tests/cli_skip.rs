//! `--skip`, `--skip-tolerance`, `--visible` and `--lanes` from the command line.
//!
//! Seeded faults, each seen red here: a mask read from its first frame only, a column-major mask read as if row-major,
//! `--skip none` taken for all.

mod common;

use assert_cmd::Command;
use common::npy::npy;
use serde_json::Value;
use std::path::{Path, PathBuf};

const MESH: &str = "stitches/tube.smobj";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> String {
        std::fs::write(self.at(name), bytes).unwrap();
        self.at(name).to_string_lossy().into_owned()
    }

    /// Relaxes the tube through three frames: as it stands, the same again, turned.
    fn relax(&self, more: &[&str]) -> std::result::Result<(Vec<u8>, Value), String> {
        let positions = mesh().positions;
        let turned = positions.iter().map(|p| glam::DVec3::new(-p.y, p.x, p.z + 1.0));
        let values: Vec<f64> =
            positions.iter().chain(&positions).copied().chain(turned).flat_map(|p| p.to_array()).collect();
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let frames = self.write("frames.npy", &npy("<f8", false, &[3, positions.len(), 3], &bytes));
        let [out, report] = ["out.npz", "report.json"].map(|name| self.at(name));
        let output = Command::cargo_bin("knotmesh")
            .unwrap()
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .args(["relax", MESH, "--frames", &frames, "-q", "--subdivide", "0"])
            .args(more)
            .arg("-o")
            .arg(&out)
            .arg("--report")
            .arg(&report)
            .output()
            .unwrap();
        if output.status.code() != Some(0) {
            assert_eq!(output.status.code(), Some(2));
            let message = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(!out.exists(), "an output beside the error: {message}");
            return Err(message);
        }
        let report = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
        Ok((std::fs::read(out).unwrap(), report))
    }
}

fn mesh() -> knotmesh::mesh::StitchMesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(MESH);
    knotmesh::io::smobj::read_file(&path).unwrap()
}

fn skipped(report: &Value, frame: usize) -> &Value {
    &report["frames"][frame]["skipped"]
}

#[test]
fn each_skip_is_switched_and_reported() {
    let folder = Folder::new();
    let faces = mesh().face_count();
    let (_, all) = folder.relax(&[]).unwrap();
    assert_eq!(skipped(&all, 1)["unmoved"], faces);
    // Some faces of the tube's edge have no knots.
    let bare = skipped(&all, 0)["without_knots"].as_u64().unwrap() as usize;
    assert!(bare > 0 && bare < faces / 4);
    assert_eq!(skipped(&all, 2)["rigid"], faces - bare);
    assert_eq!(all["skip"]["unmoved"], true);
    let (_, none) = folder.relax(&["--skip", "none"]).unwrap();
    for frame in 0..3 {
        let counts = skipped(&none, frame).as_object().unwrap();
        assert!(counts.iter().all(|(name, n)| name == "without_knots" || n == 0), "{counts:?}");
    }
    let (_, rigid) = folder.relax(&["--skip", "rigid", "--skip-tolerance", "1e-2"]).unwrap();
    assert_eq!(skipped(&rigid, 1)["unmoved"], 0);
    assert_eq!(skipped(&rigid, 1)["rigid"], faces - bare);
    assert_eq!(rigid["skip"]["tolerance"], 1e-2);
    assert_eq!(rigid["skip"]["shared"], false);
}

#[test]
fn lanes_do_not_change_the_file() {
    let folder = Folder::new();
    let [one, eight, sixteen, auto] =
        ["1", "8", "16", "auto"].map(|lanes| folder.relax(&["--skip", "none", "--lanes", lanes]).unwrap());
    assert!(one.0 == eight.0 && one.0 == sixteen.0 && one.0 == auto.0);
}

/// Masks for one frame and for each, in either order of the axes, as bytes and booleans.
#[test]
fn masks_name_the_faces_of_each_frame() {
    let folder = Folder::new();
    let faces = mesh().face_count();
    // Face 0 alone, all faces, every second face.
    let wanted = |frame: usize, face: usize| match frame {
        0 => face == 0,
        1 => true,
        _ => face.is_multiple_of(2),
    };
    let rows: Vec<u8> = (0..3 * faces).map(|i| u8::from(wanted(i / faces, i % faces))).collect();
    let columns: Vec<u8> = (0..3 * faces).map(|i| u8::from(wanted(i % 3, i / 3))).collect();
    let rows = folder.write("rows.npy", &npy("|b1", false, &[3, faces], &rows));
    let columns = folder.write("columns.npy", &npy("|u1", true, &[3, faces], &columns));
    let (a, report) = folder.relax(&["--visible", &rows]).unwrap();
    let (b, _) = folder.relax(&["--visible", &columns]).unwrap();
    assert!(a == b, "the order of the axes changes the result");
    let hidden = |frame| skipped(&report, frame)["hidden"].as_u64().unwrap();
    // The face and those around it are worked on.
    assert!(hidden(0) > faces as u64 - 8 && hidden(0) < faces as u64, "{}", hidden(0));
    assert_eq!(hidden(1), 0);
    assert_eq!(report["skip"]["visible"], rows.as_str());

    let all = folder.write("all.npy", &npy("|b1", false, &[faces], &vec![1; faces]));
    let (with, _) = folder.relax(&["--visible", &all, "--skip", "none"]).unwrap();
    let (without, _) = folder.relax(&["--skip", "none"]).unwrap();
    assert!(with == without, "a mask of all faces changes the result");
}

#[test]
fn bad_lists_and_masks_are_refused_in_one_line() {
    let folder = Folder::new();
    let faces = mesh().face_count();
    let file = |name: &str, bytes: &[u8]| folder.write(name, bytes);
    let few = file("few.npy", &npy("|b1", false, &[7], &[1; 7]));
    let numbers = file("numbers.npy", &npy("<f4", false, &[faces], &vec![0; 4 * faces]));
    let frames = file("frames2.npy", &npy("|b1", false, &[2, faces], &vec![1; 2 * faces]));
    let short = file("short.npy", &npy("|b1", false, &[3, faces], &vec![1; faces]));
    let huge = file("huge.npy", &npy("|b1", false, &[usize::MAX / 2, faces], &[]));
    let cases: [(&[&str], String); 9] = [
        (&["--visible", &few], format!("expected [{faces}] or [frame, {faces}]")),
        (&["--visible", &numbers], "expected booleans or bytes".into()),
        (&["--visible", &frames], "expected 3 as there are frames".into()),
        (&["--visible", &short], format!("3 frames of {faces} faces")),
        (&["--visible", &huge], "expected".into()),
        (&["--visible", "nowhere.npy"], "nowhere.npy".into()),
        (&["--skip", "all,some"], "expected all, none, or a list".into()),
        (&["--skip-tolerance", "-1"], "-1".into()),
        (&["--lanes", "7"], "16".into()),
    ];
    for (arguments, expected) in cases {
        let message = folder.relax(arguments).expect_err("it is refused");
        assert!(message.contains(&expected), "{arguments:?}: {message}");
        assert!(!message.contains("panicked"), "{message}");
    }
}
