//! Scenes larger than what a device's shaders see of a buffer, in parts.
//!
//! Seeded faults, each seen red: seams between parts not joined, normals without the last face around a corner, a part's
//! results put where the batch begins; in `gpu_skip`, seams between parts that are not turned along with the mesh.

use crate::case::{Case, JOINT, agree, agreement, compiled, told};
use crate::common::faces::motion;
use crate::common::gpu::adapter;
use crate::frames::{everything, tube};
use knotmesh::backend::gpu::{Adapter, GpuOptions};
use knotmesh::knot::{Settings, Start};
use knotmesh::scene::Mode;
use knotmesh::template::Coordinates;

/// Compares a case in so many parts at least with the same in one, and with the twin.
fn compare(case: &Case, adapter: &Adapter, most_bytes: u64, at_least: usize) {
    let options = GpuOptions { most_bytes: Some(most_bytes), ..JOINT };
    let count = case.device(adapter, &options).part_count();
    assert!(count >= at_least, "{most_bytes} bytes: {count} parts");
    let (whole, exact) = case.by_device(adapter, &JOINT);
    let (parts, _) = case.by_device(adapter, &options);
    let counts = agreement(&whole, &parts);
    println!("{count} parts: {}", told(&counts));
    assert!(agree(&counts), "{count} parts and one: {}", told(&counts));
    let counts = agreement(&case.by_twin(), &parts);
    assert!(agree(&counts) || !exact, "{count} parts and the twin: {}", told(&counts));
}

#[test]
fn joined_faces() {
    let Some(adapter) = adapter() else { return };
    let (mesh, motion) = tube();
    for coordinates in [Coordinates::MeanValue, Coordinates::Wachspress] {
        let scene = compiled(&mesh, Mode::Relax, coordinates);
        for start in [Start::Previous, Start::Affine] {
            let case = Case::new(&scene, &motion, Settings { start, ..Settings::default() });
            compare(&case, &adapter, 70_000, 2);
            compare(&case, &adapter, 4_000, 30);
        }
    }
}

#[test]
fn all_templates() {
    let Some(adapter) = adapter() else { return };
    let mesh = everything();
    let motion = motion(&mesh, 21);
    for mode in [Mode::Relax, Mode::Embed] {
        let scene = compiled(&mesh, mode, Coordinates::MeanValue);
        compare(&Case::new(&scene, &motion, Settings::default()), &adapter, 300_000, 4);
    }
}

/// A buffer that does not hold one stitch is refused.
#[test]
fn too_little_room() {
    let Some(adapter) = adapter() else { return };
    let (mesh, _) = tube();
    let scene = compiled(&mesh, Mode::Relax, Coordinates::MeanValue);
    let case = Case::new(&scene, &[], Settings::default());
    let options = GpuOptions { most_bytes: Some(64), ..JOINT };
    let made = case.try_device(&adapter, &options);
    let message = made.expect_err("64 bytes are too few").to_string();
    assert!(message.contains("64 bytes do not hold a stitch"), "{message}");
}
