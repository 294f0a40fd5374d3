//! Which device is taken, and what becomes of frames when it fails.
//!
//! Seeded faults, each seen red here: a lost device taken for a finished frame, the state of the frame before not handed over,
//! hidden faces forgotten at the change; knots that nobody asked for not brought back all the same, though the CPU would have
//! to start from them.
#![cfg(feature = "gpu")]

mod common;

use common::command::knotmesh;
use common::grid::{Wrap, grid};
use glam::DVec3;
use knotmesh::backend::{Backend, DeviceBackend, DeviceKind, FrameOutput, Recipe, Running, Wanted};
use knotmesh::knot::{Settings, Start};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{NO_SECOND_SLOT, Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::sync::Arc;

fn mesh() -> StitchMesh {
    grid(12, 8, Wrap::Flat, true, |_, _| "knit+ -lX +yX +lX -yX".into())
}

fn recipe(mesh: &StitchMesh, start: Start, adapter: Option<String>) -> Recipe {
    let scene = Scene::compile(mesh, &TemplateLibrary::embedded(), SceneOptions::default()).unwrap();
    let settings = Settings { start, iterations: 1, ..Settings::default() };
    let running = Running { threads: 1, ..Running::default() };
    Recipe { scene: Arc::new(scene), settings, running, cache: None, adapter, timed: false }
}

fn frame(mesh: &StitchMesh, t: f64) -> Vec<DVec3> {
    mesh.positions
        .iter()
        .map(|p| *p + DVec3::new(0.02 * p.y * p.y, 0.1 * p.x, 0.05 * p.x * p.y) * t)
        .collect()
}

#[test]
fn frames_go_on_where_the_device_was_lost() {
    let Some(adapter) = common::gpu::adapter() else { return };
    let (mesh, name) = (mesh(), adapter.report().name);
    let less = Wanted { points: true, knots: false, curves: 3 };
    for (start, wanted) in
        [Start::Affine, Start::Previous].into_iter().flat_map(|s| [(s, None), (s, Some(less))])
    {
        let mut whole = DeviceBackend::<f32>::new(recipe(&mesh, start, None), DeviceKind::Cpu).unwrap();
        let mut broken =
            DeviceBackend::<f32>::new(recipe(&mesh, start, Some(name.clone())), DeviceKind::Auto).unwrap();
        assert!(broken.adapter().is_some(), "the adapter named is taken");
        broken.notes();
        if let Some(wanted) = wanted {
            broken.set_wanted(wanted).unwrap();
        }
        let [mut a, mut b] = [FrameOutput::default(), FrameOutput::default()];
        let seen: Vec<bool> = (0..mesh.face_count()).map(|f| f % 12 < 7).collect();
        for i in 0..6 {
            if i == 2 {
                whole.set_visible(Some(&seen)).unwrap();
                broken.set_visible(Some(&seen)).unwrap();
            }
            if i == 3 {
                broken.lose();
            }
            let positions = frame(&mesh, 0.2 * f64::from(i));
            whole.frame(&positions, &mut a).unwrap();
            broken.frame(&positions, &mut b).unwrap();
            let notes = broken.notes();
            assert_eq!(notes.len(), usize::from(i == 3), "frame {i}: {notes:?}");
            assert_eq!(broken.adapter().is_none(), i >= 3);
            let scene = recipe(&mesh, start, None).scene;
            let shown = |slot: u32| {
                let (batch, face, _) = scene.slot_place(slot);
                seen[batch.faces[face].index()]
            };
            // Points that hidden faces have a part in are nobody's business.
            let compared = scene
                .point_slots()
                .iter()
                .map(|[own, other]| i < 2 || shown(*own) && (*other == NO_SECOND_SLOT || shown(*other)));
            let points = a.points.iter().zip(&b.points).zip(compared);
            let off = points.filter(|((p, q), compared)| *compared && p != q).count();
            assert_eq!(off, 0, "{start:?} frame {i}: points that differ");
            if wanted.is_none() || start == Start::Previous {
                let off = a.knots.iter().zip(&b.knots).filter(|(p, q)| p != q).count();
                assert_eq!(
                    (a.knots.len(), off),
                    (b.knots.len(), 0),
                    "{start:?} frame {i}: knots that differ"
                );
            }
            let has_curves = wanted.is_some() && i < 3;
            assert_eq!(b.curves.subdivide, if has_curves { 3 } else { 0 }, "{start:?} frame {i}");
            assert_eq!(a.skipped.hidden, b.skipped.hidden, "{start:?} frame {i}");
        }
    }
}

#[test]
fn a_device_that_was_asked_for_must_not_fail() {
    let Some(_) = common::gpu::adapter() else { return };
    let mesh = mesh();
    let mut backend = DeviceBackend::<f32>::new(recipe(&mesh, Start::Affine, None), DeviceKind::Gpu).unwrap();
    let mut output = FrameOutput::default();
    backend.frame(&frame(&mesh, 0.5), &mut output).unwrap();
    let before = output.points.clone();
    backend.lose();
    let message = backend.frame(&frame(&mesh, 1.0), &mut output).unwrap_err().to_string();
    assert!(message.contains("lost") && !message.contains('\n'), "{message}");
    assert!(backend.frame(&frame(&mesh, 1.0), &mut output).is_err(), "and so it stays");
    assert!(output.points == before, "the last frame stays");
    // A frame that is at fault itself is an error on any device.
    let mut backend =
        DeviceBackend::<f32>::new(recipe(&mesh, Start::Affine, None), DeviceKind::Auto).unwrap();
    let message = backend.frame(&[DVec3::ZERO], &mut output).unwrap_err().to_string();
    assert!(message.contains("a frame of 1 positions"), "{message}");
}

#[test]
fn devices_from_the_command_line() {
    let Some(adapter) = common::gpu::adapter() else { return };
    let out = tempfile::tempdir().unwrap();
    let at = |name: &str| out.path().join(name).to_string_lossy().into_owned();
    let (code, listed, _) = knotmesh(&["info", "--adapters"]);
    assert_eq!(code, 0);
    assert!(listed.contains(&adapter.report().name), "{listed}");

    let relax = |more: &[&str]| knotmesh(&[&["relax", "stitches/lace.smobj"], more].concat());
    let (code, _, message) = relax(&["--device", "cpu", "-o", &at("cpu.npz"), "-q"]);
    assert_eq!(code, 0, "{message}");
    let report = at("report.json");
    let (code, _, message) = relax(&["--device", "gpu", "-o", &at("gpu.npz"), "--report", &report]);
    assert_eq!(code, 0, "{message}");
    assert_eq!(message.contains("a software adapter"), adapter.report().is_software(), "{message}");
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    assert!(report["adapter"].as_str().unwrap().contains(&adapter.report().name));
    if adapter.report().is_software() {
        let [a, b] = ["cpu.npz", "gpu.npz"].map(|name| std::fs::read(at(name)).unwrap());
        assert!(a == b, "the files differ");
    }

    for (arguments, expected) in [
        (&["--device", "gpu", "--adapter", "no such"][..], "--adapter 'no such': expected a part of"),
        (&["--device", "gpu", "--precision", "f64"], "expected --precision f32"),
        (&["--device", "abacus"], "auto, gpu, cpu"),
    ] {
        let (code, _, message) = relax(&[arguments, &["-o", &at("x.obj")]].concat());
        assert_eq!(code, 2, "{message}");
        assert!(message.contains(expected), "{message}");
        assert!(!out.path().join("x.obj").exists());
    }
}
