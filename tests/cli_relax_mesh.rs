//! `knotmesh relax-mesh`: exit codes, messages, what is kept.

#[path = "common/command.rs"]
mod command;

use command::knotmesh;
use knotmesh::io::smobj;
use std::path::Path;

fn in_folder(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_string_lossy().into_owned()
}

/// All but positions is kept, and the result is narrower.
#[test]
fn all_but_positions_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (out, report) = (in_folder(&folder, "rib.smobj"), in_folder(&folder, "rib.json"));
    let (code, _, message) = knotmesh(&["relax-mesh", "stitches/rib.smobj", "-o", &out, "--report", &report]);
    assert_eq!((code, message.as_str()), (0, ""));
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let before = smobj::read_file(&here.join("stitches/rib.smobj")).unwrap();
    let mut after = smobj::read_file(out.as_ref()).unwrap();
    let width = |mesh: &knotmesh::mesh::StitchMesh| mesh.positions.iter().map(|p| p.x).fold(0.0, f64::max);
    assert!(width(&after) < 0.9 * width(&before));
    after.positions.clone_from(&before.positions);
    assert_eq!(after, before);
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    assert!(report["residual"].as_f64().unwrap() <= 1e-4 && report["converged"] == true);
    assert_eq!(report["folded_faces"], 0);
}

/// A mesh folded over says how many faces lie at the fold. Seen red with a count of 0.
#[test]
fn folded_faces_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut mesh = smobj::read_file(&here.join("stitches/swatch.smobj")).unwrap();
    let middle = mesh.face(4.into()).iter().map(|v| mesh.positions[v.index()].x).fold(0.0, f64::max);
    for p in mesh.positions.iter_mut().filter(|p| p.x > middle + 1e-6) {
        p.x = 2.0 * middle - p.x;
    }
    let [start, out, report] = ["fold.smobj", "out.smobj", "out.json"].map(|name| in_folder(&folder, name));
    let mut bytes = Vec::new();
    smobj::write(&mesh, &mut bytes).unwrap();
    std::fs::write(&start, bytes).unwrap();
    let (code, said, message) =
        knotmesh(&["-v", "relax-mesh", &start, "-o", &out, "--report", &report, "--iterations", "0"]);
    assert_eq!(code, 1, "{message}");
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    let folded = report["folded_faces"].as_u64().unwrap();
    assert!(folded > 4, "{report}");
    assert!(format!("{said}{message}").contains(&format!("{folded} folded faces")), "{said}{message}");
}

/// A gauge is in metres.
#[test]
fn a_gauge_is_per_10_cm() {
    let folder = tempfile::tempdir().unwrap();
    let out = in_folder(&folder, "swatch.smobj");
    let (code, ..) = knotmesh(&["relax-mesh", "stitches/swatch.smobj", "-o", &out, "--gauge", "20x25"]);
    assert_eq!(code, 0);
    let mesh = smobj::read_file(out.as_ref()).unwrap();
    let corners = mesh.face(80.into()).iter().map(|v| mesh.positions[v.index()]).collect::<Vec<_>>();
    let (width, height) = (corners[0].distance(corners[1]), corners[1].distance(corners[2]));
    assert!((width - 0.005).abs() < 1e-5 && (height - 0.004).abs() < 1e-5, "{width} {height}");
}

/// Exit 1 with one line where the residual stays above the bound; 2 for errors, with line and column; nothing half written.
#[test]
fn codes_and_messages() {
    let folder = tempfile::tempdir().unwrap();
    let out = in_folder(&folder, "out.smobj");
    let (code, _, message) =
        knotmesh(&["relax-mesh", "stitches/degenerate.smobj", "-o", &out, "--iterations", "1"]);
    assert_eq!(code, 1, "{message}");
    assert!(
        message.lines().count() == 1 && message.contains("after 1 iterations, expected 1.00e-4"),
        "{message}"
    );

    let sizes = in_folder(&folder, "sizes.json");
    let nothing = in_folder(&folder, "nothing.smobj");
    for (text, want) in [
        ("{\"a\": {\"course\": -1}}", ":1:20: found factor -1, expected a number from 0.01 to 100"),
        ("{\"a\": {},\n \"a\": {}}", ":2:4: found 'a' a second time, expected each name once"),
        ("{\"a\": {\"corse\": 1}}", ":1:14: found unknown field `corse`, expected `course` or `wale`"),
        ("{\"a\": {", "found the end of the file"),
        ("", "found the end of the file"),
        ("[]", ":1:"),
    ] {
        std::fs::write(&sizes, text).unwrap();
        let (code, _, message) =
            knotmesh(&["relax-mesh", "stitches/rib.smobj", "-o", &nothing, "--sizes", &sizes]);
        assert!(code == 2 && message.contains(want) && message.lines().count() == 1, "{text}: {message}");
        assert!(!Path::new(&nothing).exists());
    }
    std::fs::write(&sizes, "{\"knit+\": {\"course\": 1.1}, \"nix+\": {\"wale\": 0.5}}").unwrap();
    let (code, said, message) = knotmesh(&["relax-mesh", "stitches/rib.smobj", "--check", "--sizes", &sizes]);
    assert!(
        code == 0 && said.contains("195 faces, 225 nodes") && message.contains("'nix+'"),
        "{said} {message}"
    );

    for wrong in [
        &["relax-mesh", "stitches/rib.smobj", "-o", "out.obj"][..],
        &["relax-mesh", "stitches/rib.smobj", "-o", "stitches/rib.smobj"],
        &["relax-mesh", "stitches/rib.smobj", "-o", &nothing, "--gauge", "22"],
        &["relax-mesh", "stitches/rib.smobj", "-o", &nothing, "--unit", "0"],
        &["relax-mesh", "stitches/rib.smobj", "-o", &nothing, "--residual", "nan"],
        &["relax-mesh", "stitches/rib.smobj"],
    ] {
        let (code, _, message) = knotmesh(wrong);
        assert!(code == 2 && message.lines().count() == 1, "{wrong:?}: {message}");
        assert!(!Path::new(&nothing).exists());
    }
}
