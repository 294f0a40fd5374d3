//! The device that was asked for: a GPU and the CPU write the same, and frames go on where a GPU fails.

use crate::common::fabric::{model, sheet, waved};
use crate::common::gpu::adapter;
use glam::DVec2;
use knotmesh::backend::DeviceKind;
use knotmesh::database::{
    Compat, Fabric, FabricDevice, FabricRecipe, RunningYarn, Settings, Weaver, YarnFrame,
};
use std::sync::Arc;

fn recipe(settings: Settings) -> (FabricRecipe, Vec<Vec<glam::DVec3>>) {
    let mesh = sheet([12, 9], DVec2::new(0.12, 0.1));
    let fabric = Arc::new(Fabric::new(&mesh, model(20, 5), settings).unwrap());
    // The last one is stretched beyond the table.
    let far =
        |i: i32| waved(&mesh, 0.2 * f64::from(i)).iter().map(|p| *p * (1.0 + 0.7 * f64::from(i))).collect();
    let frames = (0..3).map(far).collect();
    (FabricRecipe { fabric, running: RunningYarn::default(), adapter: None }, frames)
}

/// Directors too, for which the GPU says where points lie. Seen red with the bit of strains outside left in.
#[test]
fn a_gpu_writes_what_the_cpu_writes() {
    let Some(adapter) = adapter() else { return };
    if !adapter.report().is_software() {
        return;
    }
    let (recipe, frames) = recipe(Settings::default());
    let mut gpu = FabricDevice::<f32>::new(recipe.clone(), DeviceKind::Gpu).unwrap();
    assert!(gpu.adapter().is_some());
    let mut cpu = FabricDevice::<f32>::new(recipe, DeviceKind::Cpu).unwrap();
    assert_eq!(cpu.adapter(), None);
    let (mut one, mut other) = (YarnFrame::default(), YarnFrame::default());
    for positions in &frames {
        gpu.frame(positions, &mut one).unwrap();
        cpu.frame(positions, &mut other).unwrap();
        assert!(one.points == other.points && one.twists == other.twists);
        let directors = gpu.directors(positions, &one).unwrap();
        assert!(directors == cpu.directors(positions, &other).unwrap());
    }
    assert!(other.outside > 0);
}

/// What a GPU does not do, `auto` does on the CPU, `gpu` refuses.
#[test]
fn compat_is_left_to_the_cpu() {
    if adapter().is_none() {
        return;
    }
    let (recipe, frames) = recipe(Settings { compat: Compat::Madypg, ..Settings::default() });
    assert!(FabricDevice::<f32>::new(recipe.clone(), DeviceKind::Gpu).is_err());
    let mut auto = FabricDevice::<f32>::new(recipe.clone(), DeviceKind::Auto).unwrap();
    assert_eq!(auto.adapter(), None);
    let mut frame = YarnFrame::default();
    auto.frame(&frames[0], &mut frame).unwrap();
    assert!(auto.frame(&frames[0][1..], &mut frame).is_err());
    // f64 is the CPU's alone.
    assert!(FabricDevice::<f64>::new(recipe, DeviceKind::Gpu).is_err());
}
