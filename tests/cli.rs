//! The command line: exit codes, messages, outputs.

mod common;
#[path = "../examples/make_stitches.rs"]
mod make_stitches;

use assert_cmd::Command;
use std::path::Path;

fn knotmesh(arguments: &[&str]) -> std::process::Output {
    Command::cargo_bin("knotmesh")
        .unwrap()
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .unwrap()
}

fn code(output: &std::process::Output) -> i32 {
    output.status.code().expect("not killed by a signal")
}

fn message(output: &std::process::Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn at(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_string_lossy().into_owned()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn every_sample_relaxes_into_every_format() {
    let out = folder();
    for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches")).unwrap() {
        let mesh = entry.unwrap().path();
        // Patterns, charts and scenes are not meshes.
        if !mesh.extension().is_some_and(|e| e == "smobj" || e == "obj") {
            continue;
        }
        let stem = mesh.file_stem().unwrap().to_string_lossy().into_owned();
        let mut arguments = vec!["relax".to_string(), mesh.to_string_lossy().into_owned()];
        for extension in ["yarns", "bcc", "obj", "npz", "usda", "txt", "pbrt"] {
            arguments.extend(["-o".into(), at(&out, &format!("{stem}.{extension}"))]);
        }
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let output = knotmesh(&arguments);
        let expected = i32::from(stem == "degenerate");
        assert_eq!(code(&output), expected, "{stem}: {}", message(&output));
        for extension in ["yarns", "bcc", "obj", "npz", "usda", "txt", "pbrt"] {
            let file = at(&out, &format!("{stem}.{extension}"));
            let info = knotmesh(&["info", &file]);
            assert_eq!(code(&info), 0, "{file}: {}", message(&info));
        }
    }
}

#[test]
fn samples_are_what_the_generator_makes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches");
    for (name, bytes) in make_stitches::samples() {
        let same = std::fs::read(folder.join(name)).unwrap() == bytes;
        assert!(same, "{name} is stale: cargo run --example make_stitches");
    }
}

#[test]
fn faces_that_fall_back_are_named_and_give_exit_1() {
    let out = folder();
    let report = at(&out, "report.json");
    let output =
        knotmesh(&["relax", "stitches/degenerate.smobj", "-o", &at(&out, "a.obj"), "--report", &report]);
    assert_eq!(code(&output), 1);
    assert!(
        message(&output).contains("3 faces have no frame and were interpolated: 8, 11, 21"),
        "{}",
        message(&output)
    );
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    assert_eq!(report["frames"][0]["fell_back"], serde_json::json!([7, 10, 20]));
    assert_eq!(report["frames"][0]["statuses"]["fell_back"], 3);
    let output = knotmesh(&[
        "relax",
        "stitches/degenerate.smobj",
        "--allow-degenerate",
        "-q",
        "-o",
        &at(&out, "b.obj"),
    ]);
    assert_eq!((code(&output), message(&output).as_str()), (0, ""));
}

#[test]
fn missing_stitches_are_listed_with_their_faces() {
    let out = folder();
    let mesh = at(&out, "mesh.smobj");
    let text = std::fs::read_to_string("stitches/rib.smobj").unwrap().replace("L purl+ ", "L pearl ");
    std::fs::write(&mesh, text).unwrap();
    let target = at(&out, "a.obj");
    let output = knotmesh(&["relax", &mesh, "-o", &target]);
    assert_eq!(code(&output), 2);
    assert!(
        message(&output).contains("lacks 1 stitch type: 'pearl -lX +yX +lX -yX' (36 faces)"),
        "{}",
        message(&output)
    );
    assert!(!Path::new(&target).exists());

    let output = knotmesh(&["relax", &mesh, "--skip-unknown", "-o", &target]);
    assert_eq!(code(&output), 0);
    assert!(message(&output).contains("36 of 195 faces left out"), "{}", message(&output));

    let output = knotmesh(&["relax", &mesh, "--map", "pearl=purl+", "-o", &target]);
    assert_eq!(code(&output), 0, "{}", message(&output));
    let full = "pearl -lX +yX +lX -yX=purl+ -lX +yX +lX -yX";
    assert_eq!(code(&knotmesh(&["relax", &mesh, "--map", full, "-o", &target])), 0);

    let output = knotmesh(&["relax", &mesh, "--map", "perl=purl+", "-o", &target]);
    assert_eq!(code(&output), 2);
    assert!(message(&output).contains("the mesh has no stitch type 'perl'"), "{}", message(&output));

    let all_unknown = std::fs::read_to_string("stitches/weave.smobj")
        .unwrap()
        .replace("L over", "L o")
        .replace("L under", "L u");
    std::fs::write(&mesh, all_unknown).unwrap();
    let output = knotmesh(&["relax", &mesh, "--skip-unknown", "-o", &target]);
    assert_eq!(code(&output), 2);
    assert!(message(&output).contains("nothing to do"), "{}", message(&output));
}

#[test]
fn errors_are_one_line_exit_2_and_leave_nothing_behind() {
    let out = folder();
    let target = at(&out, "a.obj");
    std::fs::write(out.path().join("bad.smobj"), "L knit+ -lX +yX +lX -yX\nv 0 0\n").unwrap();
    std::fs::write(out.path().join("empty.smobj"), "").unwrap();
    std::fs::write(out.path().join("binary.smobj"), [0u8, 255, 1, 2, 10, 200]).unwrap();
    for (arguments, expected) in [
        (vec!["relax", "no/such.smobj", "-o", &target], "no/such.smobj: "),
        (
            vec!["relax", &at(&out, "bad.smobj"), "-o", &target],
            "bad.smobj:2:6: found the end of the line, expected",
        ),
        (vec!["relax", &at(&out, "empty.smobj"), "-o", &target], "empty.smobj:"),
        (vec!["relax", &at(&out, "binary.smobj"), "-o", &target], "binary.smobj:1:"),
        (vec!["relax", "README.md", "-o", &target], "expected a mesh: .smobj or .obj"),
        (vec!["relax", "stitches/tube.smobj", "-o", "a.xyz"], "a.xyz"),
        (
            vec!["relax", "stitches/tube.smobj", "-o", "/no/such/folder/a.obj"],
            "/no/such/folder/a.obj: its folder",
        ),
        (
            vec!["relax", "stitches/tube.smobj", "-o", &target, "--gauge", "0"],
            "gauge 0e0: expected a positive number",
        ),
        (vec!["relax", "stitches/tube.smobj", "-o", &target, "--beta", "NaN"], "--beta NaN: expected"),
        (vec!["relax", "stitches/tube.smobj", "-o", &target, "--frames", "no*.obj"], "no*.obj"),
        (
            vec!["relax", "stitches/tube.smobj", "-o", &target, "--rest", "stitches/rib.smobj"],
            "the rest mesh has",
        ),
        (
            vec!["relax", "stitches/tube.smobj", "-o", &target, "--templates", "src"],
            "found no template files",
        ),
        (vec!["relax", "stitches/tube.smobj", "-o", &target, "-o", &target], "named as an output twice"),
        (
            vec!["relax", "stitches/swatch.obj", "-o", "stitches/swatch.obj"],
            "an output would replace an input",
        ),
        (
            vec!["relax", "stitches/tube.smobj", "-o", &target, "--report", "/no/such/r.json"],
            "folder does not exist",
        ),
        (
            vec!["relax", "stitches/tube.smobj", "-o", &target, "--threads", "100000"],
            "--threads 100000: expected",
        ),
        (vec!["relax", "stitches/tube.smobj"], "--output <OUT>"),
        (vec!["relax", "stitches/tube.smobj", "-o", &target, "--mode", "melt"], "'melt'"),
        (vec!["unravel"], "'unravel'"),
        (vec![], "no command given"),
        (
            vec!["relax", "stitches/swatch.obj", "-o", &target, "--map", "kint+=purl+"],
            "no stitch of that name",
        ),
        (vec!["templates", "no.json"], "no.json: "),
        (vec!["convert", "no.bcc", &target], "no.bcc: "),
        (vec!["info", &at(&out, "bad.smobj")], "bad.smobj:2:6: "),
    ] {
        let output = knotmesh(&arguments);
        assert_eq!(code(&output), 2, "{arguments:?}");
        let text = message(&output);
        assert_eq!(text.trim_end().lines().count(), 1, "{arguments:?}: {text}");
        assert!(text.starts_with("knotmesh: ") && text.contains(expected), "{arguments:?}: {text}");
    }
    assert_eq!(names(out.path()), ["bad.smobj", "binary.smobj", "empty.smobj"]);
}

/// Frames of the tube, each turned a little further.
fn frames_file(folder: &tempfile::TempDir, count: usize) -> (String, Vec<Vec<[f64; 3]>>) {
    let mesh = knotmesh::io::smobj::read_file("stitches/tube.smobj".as_ref()).unwrap();
    let frames: Vec<Vec<[f64; 3]>> = (0..count)
        .map(|f| {
            let (sin, cos) = (0.1 * f as f64).sin_cos();
            mesh.positions.iter().map(|p| [cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z]).collect()
        })
        .collect();
    let data: Vec<u8> = frames.iter().flatten().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let bytes = common::npy::npy("<f8", false, &[count, mesh.positions.len(), 3], &data);
    let path = at(folder, "frames.npy");
    std::fs::write(&path, bytes).unwrap();
    (path, frames)
}

#[test]
fn frames_go_into_one_result_file_or_numbered_files() {
    let out = folder();
    let (frames, positions) = frames_file(&out, 5);
    let result = at(&out, "out.npz");
    let arguments = ["relax", "stitches/tube.smobj", "--frames", &frames, "-q", "--start", "previous"];
    let run = |more: &[&str]| {
        let output = knotmesh(&[&arguments[..], more].concat());
        assert_eq!(code(&output), 0, "{}", message(&output));
    };
    run(&["-o", &result, "-o", &at(&out, "out.%04d.bcc"), "-o", &at(&out, "plain.obj")]);
    let expected: Vec<String> =
        (0..5).flat_map(|f| [format!("out.{f:04}.bcc"), format!("plain.{f:04}.obj")]).collect();
    for name in expected {
        assert!(out.path().join(&name).exists(), "{name} is missing of {:?}", names(out.path()));
    }
    let solved = knotmesh::io::curves::read_curves(result.as_ref()).unwrap();
    assert_eq!(solved.len(), 5);
    // A turned tube gives turned yarn: the frames are read in order, and all of them.
    let (sin, cos) = 0.4f64.sin_cos();
    for (a, b) in solved[0].points.iter().zip(&solved[4].points) {
        let expected = glam::DVec3::new(cos * a.x - sin * a.y, sin * a.x + cos * a.y, a.z);
        assert!((expected - *b).length() < 1e-3, "{expected} {b}");
    }
    run(&["--frame-range", "1:3", "-o", &result]);
    assert_eq!(knotmesh::io::curves::read_curves(result.as_ref()).unwrap().len(), 2);

    // OBJ files by a glob pattern, in natural order, are the same frames.
    for (f, positions) in positions.iter().enumerate() {
        let text: String = positions.iter().map(|p| format!("v {} {} {}\n", p[0], p[1], p[2])).collect();
        std::fs::write(out.path().join(format!("pose{}.obj", f + 8)), text).unwrap();
    }
    let globbed = at(&out, "globbed.npz");
    let output = knotmesh(&[
        "relax",
        "stitches/tube.smobj",
        "--frames",
        &at(&out, "pose*.obj"),
        "-q",
        "--start",
        "previous",
        "-o",
        &globbed,
    ]);
    assert_eq!(code(&output), 0, "{}", message(&output));
    let globbed = knotmesh::io::curves::read_curves(globbed.as_ref()).unwrap();
    for (a, b) in solved[4].points.iter().zip(&globbed[4].points) {
        assert!((*a - *b).length() < 1e-6);
    }

    // Another number of vertices is refused.
    let output = knotmesh(&["relax", "stitches/rib.smobj", "--frames", &frames, "-o", &at(&out, "x.npz")]);
    assert_eq!(code(&output), 2);
    assert!(message(&output).contains("expected [frame, 225, 3]"), "{}", message(&output));
}

#[test]
fn the_result_file_keeps_its_promised_arrays() {
    let out = folder();
    let result = at(&out, "out.npz");
    for (precision, descr) in [("f32", "<f4"), ("f64", "<f8")] {
        let output = knotmesh(&[
            "relax",
            "stitches/lace.smobj",
            "--precision",
            precision,
            "--subdivide",
            "0",
            "-o",
            &result,
        ]);
        assert_eq!(code(&output), 0, "{}", message(&output));
        let bytes = std::fs::read(&result).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        for name in [
            "points",
            "yarn_offsets",
            "yarn_closed",
            "radius",
            "gauge",
            "point_face",
            "point_knot",
            "point_role",
            "face_knot_offsets",
            "knot_direction",
            "knot_half_length",
            "face_energy_start",
            "face_energy",
            "face_status",
        ] {
            assert!(text.contains(&format!("{name}.npy")), "{name} is missing");
        }
        assert_eq!(text.contains("origin.npy"), precision == "f32");
        assert!(text.contains(&format!("'descr': '{descr}'")));
    }
}

#[test]
fn an_obj_mesh_is_the_smobj_mesh_by_its_materials_and_texture_coordinates() {
    let out = folder();
    // The same swatch, its corners turned at random in the OBJ file: texture coordinates put them right.
    let (_, bytes) = make_stitches::samples().into_iter().find(|(n, _)| *n == "swatch.obj").unwrap();
    let info = knotmesh(&["info", "stitches/swatch.obj"]);
    let text = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(text.contains("yarns: 1 (0 closed)") && text.contains("nothing would go wrong"), "{text}");
    // Without texture coordinates the corners are taken as they come, and the yarn falls to pieces.
    let plain: String = String::from_utf8(bytes)
        .unwrap()
        .lines()
        .filter(|l| !l.starts_with("vt "))
        .map(|l| if l.starts_with("f ") { l.split(' ').map(|w| w.split('/').next().unwrap()).collect::<Vec<_>>().join(" ") } else { l.into() } + "\n")
        .collect();
    let path = at(&out, "plain.obj");
    std::fs::write(&path, plain).unwrap();
    let text = String::from_utf8_lossy(&knotmesh(&["info", &path]).stdout).into_owned();
    assert!(!text.contains("yarns: 1 (0 closed)"), "{text}");
}

#[test]
fn unknown_materials_are_listed_and_can_be_left_out_or_renamed() {
    let out = folder();
    let mesh = at(&out, "mesh.obj");
    let text = std::fs::read_to_string("stitches/swatch.obj").unwrap();
    std::fs::write(&mesh, text.replace("usemtl knit+", "usemtl Tricot.002")).unwrap();
    let target = at(&out, "a.npz");
    let output = knotmesh(&["relax", &mesh, "-o", &target]);
    assert_eq!(code(&output), 2);
    assert!(message(&output).contains("'Tricot ? ? ? ?' (24 faces)"), "{}", message(&output));
    let output = knotmesh(&["relax", &mesh, "--skip-unknown", "-q", "-o", &target]);
    assert_eq!((code(&output), message(&output).as_str()), (0, ""));
    let output = knotmesh(&["relax", &mesh, "--map", "Tricot=knit+", "-q", "-o", &target]);
    assert_eq!((code(&output), message(&output).as_str()), (0, ""));
}

/// A stopped run leaves neither a half file nor a temporary one.
#[cfg(unix)]
#[test]
fn a_stopped_run_leaves_nothing_behind() {
    let out = folder();
    let (frames, _) = frames_file(&out, 400);
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_knotmesh"))
        .args(["relax", "stitches/tube.smobj", "--frames", &frames, "--iterations", "2000", "-q"])
        .args(["--precision", "f64", "--subdivide", "50", "-o", &at(&out, "out.npz")])
        .spawn()
        .unwrap();
    let began = std::time::Instant::now();
    while names(out.path()).len() < 2 && began.elapsed().as_secs() < 20 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert!(names(out.path()).iter().any(|n| n.ends_with(".tmp")), "{:?}", names(out.path()));
    let stopped = std::process::Command::new("kill").arg(child.id().to_string()).status().unwrap();
    assert!(stopped.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(names(out.path()), ["frames.npy"]);
}

#[test]
fn info_says_what_would_go_wrong() {
    let text = |file: &str| String::from_utf8(knotmesh(&["info", file]).stdout).unwrap();
    assert!(text("stitches/rib.smobj").contains("nothing would go wrong"));
    let degenerate = text("stitches/degenerate.smobj");
    assert!(
        degenerate.contains("3 faces are degenerate") && degenerate.contains("do not coincide"),
        "{degenerate}"
    );
    assert!(text("templates/knit.json").contains("knit+ -lX +yX +lX -yX"));
}

#[test]
fn templates_are_printed_fully_expanded() {
    let out = folder();
    let output = knotmesh(&["templates", "--json"]);
    let list: Vec<serde_json::Value> = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(list.len(), knotmesh::template::TemplateLibrary::embedded().templates().len());
    assert!(list.iter().all(|t| t.get("derive").is_none() && t["format"] == "knotmesh-template"));
    // What was printed is a library again, and the same one.
    let file = at(&out, "all.json");
    std::fs::write(&file, &output.stdout).unwrap();
    let again = knotmesh(&["templates", "--json", &file]);
    let again: Vec<serde_json::Value> = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(list.len(), again.len());
}

#[test]
fn reports_hold_counts_times_and_errors() {
    let out = folder();
    let report = at(&out, "report.json");
    let output = knotmesh(&["relax", "stitches/lace.smobj", "-o", &at(&out, "a.bcc"), "--report", &report]);
    assert_eq!(code(&output), 0, "{}", message(&output));
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    assert_eq!(report["faces"], 328);
    assert_eq!(report["yarns"], 1);
    let frame = &report["frames"][0];
    assert!(frame["energy"]["sum"].as_f64().unwrap() < frame["energy_start"]["sum"].as_f64().unwrap());
    assert!(frame["clearance"]["smallest"].as_f64().unwrap() > 1.0);
    assert!(frame["segment_error"]["median"].as_f64().unwrap() < 0.1);
    for stage in ["parse", "compile", "solve", "write", "total"] {
        assert!(report["seconds"][stage].as_f64().unwrap() > 0.0, "{stage}");
    }
    let statuses: u64 = frame["statuses"].as_object().unwrap().values().map(|v| v.as_u64().unwrap()).sum();
    assert_eq!(statuses, 328);
    assert_eq!(report["status_values"]["5"], "fell_back");
}

#[test]
fn modes_differ_as_they_should() {
    let out = folder();
    let (frames, _) = {
        // The tube stretched to 1.5 of its height.
        let mesh = knotmesh::io::smobj::read_file("stitches/tube.smobj".as_ref()).unwrap();
        let text: String =
            mesh.positions.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, 1.5 * p.z)).collect();
        let path = at(&out, "stretched.obj");
        std::fs::write(&path, text).unwrap();
        (path, ())
    };
    let energy = |more: &[&str]| {
        let report = at(&out, "report.json");
        let target = at(&out, "a.npz");
        let base = ["relax", "stitches/tube.smobj", "--frames", &frames, "--report", &report, "-o", &target];
        let output = knotmesh(&[&base[..], more].concat());
        assert_eq!(code(&output), 0, "{}", message(&output));
        let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&report).unwrap()).unwrap();
        report["frames"][0]["energy"]["sum"].as_f64().unwrap()
    };
    let relax = energy(&["--iterations", "20"]);
    let (knots, embed) = (energy(&["--mode", "knots"]), energy(&["--mode", "embed"]));
    assert!(relax < 0.9 * knots && relax < 0.9 * embed, "{relax} {knots} {embed}");
    let plain = energy(&["--solver", "gauss-newton", "--iterations", "20"]);
    assert!(plain > 0.99 * relax);
    assert!(energy(&["--weight-length", "10", "--iterations", "20"]) < relax);
    assert!((energy(&["--precision", "f64", "--iterations", "20"]) / relax - 1.0).abs() < 1e-3);
    assert!((energy(&["--beta", "0.5", "--iterations", "20"]) / relax - 1.0).abs() > 1e-6);
}

#[test]
fn convert_goes_between_formats() {
    let out = folder();
    let (bcc, obj) = (at(&out, "a.bcc"), at(&out, "a.obj"));
    assert_eq!(code(&knotmesh(&["relax", "stitches/weave.smobj", "-o", &bcc])), 0);
    assert_eq!(code(&knotmesh(&["convert", &bcc, &obj])), 0);
    let output = knotmesh(&["convert", &bcc, &at(&out, "a.txt")]);
    assert_eq!(code(&output), 2);
    assert!(message(&output).contains("--radius"), "{}", message(&output));
    assert_eq!(code(&knotmesh(&["convert", &bcc, &at(&out, "a.txt"), "--radius", "0.1"])), 0);
}
