//! `knotmesh drape`, and frames that go on to yarn.

use crate::common::command::knotmesh;
use crate::common::run::running;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput};
use knotmesh::drape::drape;
use knotmesh::io::frames::{Frames, FramesWriter};
use knotmesh::io::{scene_json, smobj};
use knotmesh::knot::Settings;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::Path;
use std::sync::Arc;

const MESH: &str = "stitches/swatch.smobj";
const SCENE: &str = "stitches/scenes/patch-stretch.json";

/// The ready scenes and the meshes that they are for.
const READY: [(&str, &str); 5] = [
    ("patch-stretch", MESH),
    ("patch-shear", MESH),
    ("sphere-drop", MESH),
    ("tube-bend", "stitches/tube.smobj"),
    ("tube-twist", "stitches/tube.smobj"),
];

#[test]
fn ready_scenes_ignore_nothing_and_run() {
    let folder = tempfile::tempdir().unwrap();
    for (name, mesh) in READY {
        let scene = format!("stitches/scenes/{name}.json");
        let (code, said, error) = knotmesh(&["drape", mesh, "--scene", &scene, "--check"]);
        assert_eq!((code, error.as_str()), (0, ""), "{name}");
        assert!(!said.contains("ignored"), "{name}: {said}");
        let out = folder.path().join(format!("{name}.npy")).display().to_string();
        let report = folder.path().join("r.json").display().to_string();
        let (code, _, error) = knotmesh(&["drape", mesh, "--scene", &scene, "-o", &out, "--report", &report]);
        assert_eq!((code, error.as_str()), (0, ""), "{name}");
        let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&report).unwrap()).unwrap();
        let frames = report["frames"].as_array().unwrap();
        assert_eq!(frames.len(), 61);
        assert!(frames.iter().all(|f| f["cut"] == 0 && f["damped"] == false), "{name}");
        assert!(frames[60]["time"].as_f64().unwrap() > 0.99, "{name}");
        assert!(frames[60]["elastic_energy"].as_f64().unwrap() > 0.0, "{name}");
    }
}

#[test]
fn yarn_relaxes_on_frames_without_the_disk_as_over_a_file() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mesh = smobj::read_file(&root.join(MESH)).unwrap();
    let library = TemplateLibrary::embedded();
    let mut scene = scene_json::read_file(&root.join(SCENE)).unwrap();
    scene.frames = 8;
    scene.fps = 6.0;
    let yarn = Arc::new(Scene::compile(&mesh, &library, SceneOptions::default()).unwrap());
    let backend =
        || CpuBackend::<f64>::new(yarn.clone(), &Settings::default(), &running(1)).expect("in range");

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frames.npy");
    let mut writer = FramesWriter::create(&file, scene.frames, &mesh).unwrap();
    let (mut direct, mut output) = (backend(), FrameOutput::default());
    let mut points = Vec::new();
    drape(&mesh, &library, &scene, |report, positions| {
        writer.frame(report.frame, positions)?;
        direct.frame(positions, &mut output)?;
        points.push((0..yarn.point_slots().len()).map(|p| output.world(p)).collect::<Vec<_>>());
        Ok(())
    })
    .unwrap();
    writer.finish().unwrap();

    let mut frames = Frames::open(file.to_str().unwrap(), mesh.positions.len()).unwrap();
    assert_eq!(frames.len(), 8);
    let (mut again, mut positions) = (backend(), Vec::new());
    for (frame, points) in points.iter().enumerate() {
        frames.read(frame, &mut positions).unwrap();
        again.frame(&positions, &mut output).unwrap();
        for (p, expected) in points.iter().enumerate() {
            // The file has f32: 12 stitches wide, a relative rounding of 6e-8, and what the solve makes of it.
            assert!(output.world(p).distance(*expected) < 1e-4, "frame {frame}, point {p}");
        }
    }
    let far = points[7].iter().zip(&points[0]).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    // So a frame late, or one for all, would be found.
    assert!(far > 1.0, "it moves: {far}");
}

#[test]
fn a_range_is_part_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (all, part) = (path("all.npy"), path("part.npy"));
    let scene = "stitches/scenes/tube-twist.json";
    let tube = "stitches/tube.smobj";
    assert_eq!(knotmesh(&["drape", tube, "--scene", scene, "-o", &all, "--threads", "1"]).0, 0);
    let ranged = ["drape", tube, "--scene", scene, "-o", &part, "--threads", "2", "--frame-range", "5:9"];
    assert_eq!(knotmesh(&ranged).0, 0);
    let vertices =
        smobj::read_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join(tube)).unwrap().positions.len();
    let [mut all, mut part] = [all, part].map(|p| Frames::open(&p, vertices).unwrap());
    assert_eq!((all.len(), part.len()), (61, 4));
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for frame in 0..4 {
        all.read(5 + frame, &mut a).unwrap();
        part.read(frame, &mut b).unwrap();
        assert_eq!(a, b);
    }
    let objs = path("f.%02d.obj");
    let (code, _, error) = knotmesh(&["drape", tube, "--scene", scene, "-o", &objs, "--frame-range", "0:2"]);
    assert_eq!((code, error.as_str()), (0, ""));
    let mut frames = Frames::open(&path("f.*.obj"), vertices).unwrap();
    assert_eq!(frames.len(), 2);
    frames.read(1, &mut a).unwrap();
    all.read(1, &mut b).unwrap();
    assert!(a.iter().zip(&b).all(|(a, b)| a.distance(*b) < 1e-6));
}

#[test]
fn errors_are_one_line_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(path("bad.json"), "{\"frames\": 2,\n \"pins\": [{\"select\": {\"vertices\": [9999]}}]}")
        .unwrap();
    std::fs::write(path("worse.json"), "{\"frames\": 2,\n \"wind\": 3}").unwrap();
    let out = path("out.npy");
    for (scene, output, more, expected) in [
        (path("bad.json"), out.as_str(), None, "pins[0]: found vertex 9999, expected one below 225"),
        (path("worse.json"), &out, None, "worse.json:2:10: found integer `3`, expected struct FileWind"),
        (path("none.json"), &out, None, "none.json: No such file"),
        (SCENE.into(), &path("out.bcc"), None, "expected .npy (all frames) or .obj (a file a frame)"),
        (SCENE.into(), &path("no/out.npy"), None, "its folder does not exist"),
        (SCENE.into(), SCENE, None, "an output would replace an input"),
        (SCENE.into(), &out, Some("70:80"), "70 is out of range"),
    ] {
        let mut arguments = vec!["drape", MESH, "--scene", &scene, "-o", output];
        arguments.extend(more.iter().flat_map(|range| ["--frame-range", range]));
        let (code, _, error) = knotmesh(&arguments);
        assert_eq!(code, 2, "{error}");
        assert!(error.contains(expected) && error.trim_end().lines().count() == 1, "{error}");
    }
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
    // A writer that is not finished leaves nothing either, and one that lacks frames cannot be.
    let mesh = smobj::read_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join(MESH)).unwrap();
    let mut writer = FramesWriter::create(out.as_ref(), 2, &mesh).unwrap();
    writer.frame(0, &mesh.positions).unwrap();
    assert!(writer.finish().unwrap_err().to_string().contains("1 frames are missing"));
    assert!(!Path::new(&out).exists());
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("long.json");
    let text =
        "{\"frames\": 1000000, \"gravity\": [0,0,0], \"pins\": [{\"select\": {\"border\": \"left\"}}]}";
    std::fs::write(&scene, text).unwrap();
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_knotmesh"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["drape", MESH, "-q", "--scene"])
        .arg(&scene)
        .arg("-o")
        .arg(folder.path().join("out.npy"))
        .spawn()
        .unwrap();
    let began = std::time::Instant::now();
    while std::fs::read_dir(folder.path()).unwrap().count() < 2 {
        assert!(began.elapsed().as_secs() < 60, "it begins to write");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let pid = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
