//! Results do not depend on how the work is cut up or in which order it is done.
//!
//! Seeded faults, each seen red: damping that depends on the first knot of all, which another batch may have written
//! already; faces counted from 1 where 256 threads work side by side; a second row that begins after 64 threads a
//! workgroup, whatever their number.

use crate::case::{Case, JOINT, agree, agreement, compiled, told};
use crate::common::gpu::adapter;
use crate::common::grid::{Wrap, grid};
use crate::frames::{everything, tube};
use glam::DVec3;
use knotmesh::backend::gpu::GpuOptions;
use knotmesh::knot::{Settings, Start};
use knotmesh::scene::Mode;
use knotmesh::template::Coordinates;

#[test]
fn workgroup_sizes() {
    let Some(adapter) = adapter() else { return };
    let (mesh, motion) = tube();
    let scene = compiled(&mesh, Mode::Relax, Coordinates::MeanValue);
    let settings = Settings { start: Start::Previous, ..Settings::default() };
    let case = Case::new(&scene, &motion, settings);
    let (first, _) = case.by_device(&adapter, &JOINT);
    for workgroup in [1, 32, 256] {
        let (other, _) = case.by_device(&adapter, &GpuOptions { workgroup, ..JOINT });
        let counts = agreement(&first, &other);
        assert!(agree(&counts), "{workgroup} threads side by side: {}", told(&counts));
    }
}

#[test]
fn dispatch_order() {
    let Some(adapter) = adapter() else { return };
    let mesh = everything();
    let scene = compiled(&mesh, Mode::Relax, Coordinates::MeanValue);
    let motion = crate::common::faces::motion(&mesh, 8);
    let settings = Settings { start: Start::Previous, ..Settings::default() };
    let case = Case::new(&scene, &motion, settings);
    let (first, _) = case.by_device(&adapter, &JOINT);
    for order in 1..=4 {
        let (other, _) = case.by_device(&adapter, &GpuOptions { order, ..JOINT });
        let counts = agreement(&first, &other);
        assert!(agree(&counts), "order {order}: {}", told(&counts));
    }
}

/// A dispatch has 65,535 workgroups on an axis at most; the rest goes on in a second row.
#[test]
fn more_workgroups_than_an_axis_has() {
    let Some(adapter) = adapter() else { return };
    let mesh = grid(300, 230, Wrap::Flat, true, |_, _| "knit+ -lX +yX +lX -yX".to_string());
    assert!(mesh.face_count() > 65_535);
    let scene = compiled(&mesh, Mode::Embed, Coordinates::MeanValue);
    let bent = |p: &DVec3| *p + DVec3::new(0.0, 0.1 * (p.x * 0.7).sin(), 0.3 * (p.x + p.y).cos());
    let motion = [mesh.positions.iter().map(bent).collect()];
    let case = Case::new(&scene, &motion, Settings::default());
    let (first, exact) = case.by_device(&adapter, &JOINT);
    let (other, _) = case.by_device(&adapter, &GpuOptions { workgroup: 1, ..JOINT });
    let counts = agreement(&first, &other);
    assert!(agree(&counts), "{}", told(&counts));
    let counts = agreement(&case.by_twin(), &first);
    assert!(agree(&counts) || !exact, "{}", told(&counts));
}
