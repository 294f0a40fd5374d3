//! Garbage in buffers: the next frame comes all the same, without an error, and what a frame finds anew is found right
//! whatever stood there. That no loop is as long as a buffer says is found in the text: `tests/gpu_loops.rs`.

use crate::case::Case;
use crate::common::Random;
use crate::common::fabric::{model, sheet, waved};
use crate::common::gpu::adapter;
use glam::DVec2;
use knotmesh::backend::gpu::{Adapter, GpuOptions};
use knotmesh::database::gpu::{Gpu, GpuYarn};
use knotmesh::database::{Settings, YarnFrame};

/// Buffers of what each frame finds anew where it does not go on from another.
const STATE: [&str; 7] =
    ["places", "face forms", "node forms", "face frames", "changes", "yarn places", "points"];
/// Buffers of what is never written again.
const FIXED: [&str; 7] = ["mesh", "nodes", "shares", "fits", "maps", "pattern", "homes"];

fn garbage() -> Vec<Vec<u32>> {
    let mut random = Random::new(5);
    let mut words = |most: u64| (0..997).map(|_| ((random.bits() >> 16) % most) as u32).collect::<Vec<_>>();
    vec![
        words(1 << 32),
        words(100),
        vec![u32::MAX],
        vec![f32::NAN.to_bits()],
        vec![f32::INFINITY.to_bits(), f32::NEG_INFINITY.to_bits()],
        vec![1 << 30],
    ]
}

/// How often a frame in a new output is not what it was, where what was found before is garbage.
fn wrong(adapter: &Adapter, fault: Option<(&'static str, &'static str)>) -> usize {
    let mesh = sheet([12, 9], DVec2::new(0.12, 0.1));
    let case = Case::new(&mesh, model(20, 5), Settings::default(), [waved(&mesh, 0.0)]);
    let device = GpuOptions { fault, ..GpuOptions::default() };
    let options = GpuYarn { device, ..GpuYarn::default() };
    let mut gpu = Gpu::new(case.fabric.clone(), &options, adapter).unwrap();
    let mut wrong = 0;
    let (still, moved) = (waved(&mesh, 0.0), waved(&mesh, 0.3));
    let mut right = YarnFrame::default();
    gpu.frame(&still, &mut right).unwrap();
    for words in garbage() {
        for name in STATE {
            // Where it goes on, points are anyone's guess.
            assert!(gpu.spoil(name, &words), "{name}");
            let mut output = right.clone();
            gpu.frame(&moved, &mut output).unwrap();
            // Where it begins anew, they are what they were.
            gpu.frame(&still, &mut YarnFrame::default()).unwrap();
            assert!(gpu.spoil(name, &words), "{name}");
            let mut output = YarnFrame::default();
            gpu.frame(&still, &mut output).unwrap();
            wrong += usize::from(output.points != right.points || output.twists != right.twists);
        }
    }
    wrong
}

#[test]
fn of_the_last_frame_is_forgotten() {
    let Some(adapter) = adapter() else { return };
    assert_eq!(wrong(&adapter, None), 0);
    // Each frame goes on from the one before.
    assert!(wrong(&adapter, Some(("let continued = settings.continued != 0u", "let continued = true"))) > 0);
}

#[test]
fn of_what_is_never_written_again_is_survived() {
    let Some(adapter) = adapter() else { return };
    let mesh = sheet([12, 9], DVec2::new(0.12, 0.1));
    let (still, moved) = (waved(&mesh, 0.0), waved(&mesh, 0.3));
    let case = Case::new(&mesh, model(20, 5), Settings::default(), [still.clone()]);
    for words in garbage() {
        for name in FIXED {
            let mut gpu = Gpu::new(case.fabric.clone(), &GpuYarn::default(), &adapter).unwrap();
            assert!(gpu.spoil(name, &words), "{name}");
            let mut output = YarnFrame::default();
            gpu.frame(&still, &mut output).unwrap();
            gpu.frame(&moved, &mut output).unwrap();
        }
    }
}
