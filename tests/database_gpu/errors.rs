//! What is refused, in one line, and devices that fail.
//!
//! Seeded faults, each seen red: room not asked for, an origin that can be moved after the first frame.

use crate::case::Case;
use crate::common::fabric::{model, sheet, waved};
use crate::common::gpu::adapter;
use glam::{DVec2, DVec3};
use knotmesh::backend::gpu::GpuOptions;
use knotmesh::database::gpu::{Gpu, GpuYarn};
use knotmesh::database::{Compat, Settings, YarnFrame};
use knotmesh::mesh::MaterialMesh;

fn mesh() -> MaterialMesh {
    sheet([12, 9], DVec2::new(0.12, 0.1))
}

fn case(settings: Settings) -> Case {
    let mesh = mesh();
    let positions = waved(&mesh, 0.0);
    Case::new(&mesh, model(20, 5), settings, [positions])
}

fn one_line(error: impl ToString, part: &str) {
    let text = error.to_string();
    assert!(text.contains(part) && !text.contains('\n'), "{text}");
}

#[test]
fn madypg_is_the_cpus() {
    let Some(adapter) = adapter() else { return };
    let case = case(Settings { compat: Compat::Madypg, ..Settings::default() });
    let error = Gpu::new(case.fabric, &GpuYarn::default(), &adapter).err().unwrap();
    one_line(error, "compat madypg");
}

#[test]
fn a_device_without_room() {
    let Some(adapter) = adapter() else { return };
    let case = case(Settings::default());
    for (most, part) in [(1 << 10, "yarn vertices take"), (79_000, "strain table take")] {
        let device = GpuOptions { most_bytes: Some(most), ..GpuOptions::default() };
        let options = GpuYarn { device, ..GpuYarn::default() };
        one_line(Gpu::new(case.fabric.clone(), &options, &adapter).err().unwrap(), part);
    }
}

#[test]
fn other_meshes() {
    let Some(adapter) = adapter() else { return };
    let case = case(Settings::default());
    let mut gpu = Gpu::new(case.fabric.clone(), &GpuYarn::default(), &adapter).unwrap();
    let mut output = YarnFrame::default();
    one_line(gpu.frame(&[DVec3::ZERO; 3], &mut output).unwrap_err(), "found 3 positions");
    one_line(gpu.set_visible(Some(&[true; 5])).err().unwrap(), "found 5 visible or hidden faces");
    gpu.set_origin(DVec3::new(1.0, 2.0, 3.0));
    gpu.frame(&case.motions[0].positions, &mut output).unwrap();
    assert_eq!(output.origin, DVec3::new(1.0, 2.0, 3.0));
    // It stays where it is.
    gpu.set_origin(DVec3::ZERO);
    gpu.frame(&case.motions[0].positions, &mut output).unwrap();
    assert_eq!(output.origin, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(output.skipped.unmoved, output.points.len());
}

#[test]
fn a_lost_device_leaves_the_output_alone() {
    let Some(adapter) = adapter() else { return };
    let case = case(Settings::default());
    let mut gpu = Gpu::new(case.fabric.clone(), &GpuYarn::default(), &adapter).unwrap();
    let mut output = YarnFrame::default();
    gpu.frame(&case.motions[0].positions, &mut output).unwrap();
    let before = output.clone();
    gpu.lose();
    for _ in 0..2 {
        let error = gpu.frame(&waved(&mesh(), 0.5), &mut output).err().unwrap();
        one_line(error, "lost");
        assert!(output.points == before.points && output.twists == before.twists);
    }
}
