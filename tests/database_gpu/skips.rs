//! What is skipped, frame by frame, and what points come of it.
//!
//! Seeded faults: `faults.rs`.

use crate::case::{Case, Motion, rolled, tube};
use crate::common::fabric::{PERIOD, model, sheet, waved};
use crate::common::gpu::adapter;
use glam::{DQuat, DVec2, DVec3};
use knotmesh::database::{Settings, SkipYarn};
use knotmesh::mesh::MaterialMesh;

/// Frames that stay, move as one, move in part, creep, hide and come back.
pub fn sequence(mesh: &MaterialMesh, at: &dyn Fn(f64) -> Vec<DVec3>) -> Vec<Motion> {
    let first = at(0.0);
    let turn = DQuat::from_rotation_y(0.3);
    let turned: Vec<DVec3> = first.iter().map(|p| turn * *p + DVec3::new(0.01, 0.2, 0.0)).collect();
    let partly = |by: f64| -> Vec<DVec3> {
        let far = |p: &DVec3| *p + DVec3::new(0.0, 0.0, by) * f64::from(u8::from(p.y > 0.05));
        turned.iter().map(far).collect()
    };
    let faces = mesh.faces.len();
    let seen = |every: usize| Some(Some((0..faces).map(|f| f % every < every / 2).collect()));
    let mut motions: Vec<Motion> = vec![
        first.clone().into(),
        first.clone().into(),
        // Exact in f32: not a bit of an edge changes.
        first.iter().map(|p| *p + DVec3::new(0.0, 0.0, 0.25)).collect::<Vec<_>>().into(),
        turned.clone().into(),
        partly(0.003).into(),
        partly(0.003).into(),
    ];
    motions.extend((1..8).map(|i| Motion::from(at(0.0004 * f64::from(i)))));
    motions.extend([
        Motion { visible: seen(7), ..at(0.1).into() },
        at(0.2).into(),
        at(0.2).into(),
        Motion { visible: seen(3), ..at(0.2).into() },
        // In an output that knows nothing of it, all is worked on.
        Motion { anew: true, ..at(0.3).into() },
        at(0.4).into(),
        Motion { visible: Some(None), ..at(0.4).into() },
        at(0.4).into(),
        Motion { anew: true, ..at(0.4).into() },
        at(0.4).into(),
    ]);
    motions
}

fn agree(mesh: &MaterialMesh, at: &dyn Fn(f64) -> Vec<DVec3>, name: &str) {
    let Some(adapter) = adapter() else { return };
    let mut case = Case::new(mesh, model(20, 5), Settings::default(), sequence(mesh, at));
    let skips = [
        SkipYarn::NOTHING,
        SkipYarn { unmoved: true, rigid: false, tolerance: 0.0 },
        SkipYarn { unmoved: false, rigid: true, tolerance: 1e-3 },
        SkipYarn { unmoved: true, rigid: true, tolerance: 0.0 },
        SkipYarn::default(),
        SkipYarn { tolerance: 0.1, ..SkipYarn::default() },
    ];
    for skip in skips {
        case.skip = skip;
        case.agrees(&adapter, &format!("{name}, {skip:?}"));
        let all = case.by_cpu();
        let sum = |count: fn(&knotmesh::database::SkippedYarn) -> usize| {
            all.iter().map(|found| count(&found.skipped)).sum::<usize>()
        };
        assert!(sum(|s| s.hidden) > 0, "some are hidden");
        assert_eq!(sum(|s| s.unmoved) > 0, skip.unmoved, "{skip:?}: some stay");
        if skip.rigid && skip.tolerance > 0.0 {
            assert!(sum(|s| s.rigid) > 0, "{skip:?}: some are carried");
        }
    }
}

#[test]
fn of_a_sheet() {
    let mesh = sheet([12, 9], DVec2::new(0.12, 0.1));
    agree(&mesh, &|time| waved(&mesh, time), "sheet");
}

/// Yarn lies on other faces than it started on: what is hidden or moved there counts.
#[test]
fn of_a_tube() {
    let size = DVec2::new(6.0, 10.0) * PERIOD;
    let mesh = tube([48, 60], size);
    agree(&mesh, &|time| rolled(&mesh, size, time), "tube");
}
