//! What the stages of a frame come to, by name, as their twins have it.

use crate::case::{Case, rolled, tube, uneven};
use crate::common::fabric::PERIOD;
use crate::common::gpu::adapter;
use glam::DVec2;
use knotmesh::backend::gpu::GpuOptions;
use knotmesh::database::gpu::layout::{FaceForm, NodeForm, Place};
use knotmesh::database::gpu::{Gpu, GpuYarn};
use knotmesh::database::{Cpu, Form, RunningYarn, Settings, YarnFrame};
use knotmesh::math::V3;

fn words(v: V3<f32>) -> [f32; 3] {
    [v.x, v.y, v.z]
}

fn bits<T: bytemuck::Pod>(all: &[T]) -> &[u32] {
    bytemuck::cast_slice(all)
}

/// Names of stages that differ, with a fault in the shaders if one is given; of devices whose bits may differ, none.
fn differing(fault: Option<(&'static str, &'static str)>) -> Option<Vec<&'static str>> {
    let adapter = adapter().filter(|a| a.report().exact && a.report().is_software())?;
    let size = DVec2::new(6.0, 5.0) * PERIOD;
    let mesh = tube([24, 16], size);
    let model = uneven(20, [4, 3, 3], 5e-3);
    let case = Case::new(&mesh, model, Settings::default(), [rolled(&mesh, size, 0.7)]);
    let device = GpuOptions { fault, ..GpuOptions::default() };
    let options = GpuYarn { device, ..GpuYarn::default() };
    let mut cpu = Cpu::<f32>::new(case.fabric.clone(), RunningYarn::default()).unwrap();
    let mut gpu = Gpu::new(case.fabric.clone(), &options, &adapter).unwrap();
    let mut output = YarnFrame::default();
    cpu.frame(&case.motions[0].positions, &mut output).unwrap();
    gpu.frame(&case.motions[0].positions, &mut output).unwrap();

    let face = |f: &Form<f32>| FaceForm {
        normal: words(f.normal),
        u: words(f.gradient[0]),
        v: words(f.gradient[1]),
        first: f.first,
    };
    let faces: Vec<FaceForm> = cpu.face_forms().iter().map(face).collect();
    let node = |f: &Form<f32>| {
        let FaceForm { normal, u, v, first } = face(f);
        NodeForm { normal, u, v, first, second: f.second }
    };
    let nodes: Vec<NodeForm> = cpu.node_forms().iter().map(node).collect();
    let places: Vec<Place> = cpu
        .trace()
        .iter()
        .map(|(_, trace)| {
            let [b, c] = trace.place.barycentric;
            Place { face: trace.place.face, b, c, height: trace.place.height }
        })
        .collect();
    let stage = |name: &str| gpu.stage(name).unwrap();
    let left = cpu.trace().iter().filter(|(_, t)| t.place.face != t.face).count();
    assert!(left > 100, "{left} yarn vertices left their faces");
    // The highest bit says what the table does not hold.
    let mut found: Vec<Place> = bytemuck::cast_vec(stage("yarn places"));
    found.iter_mut().for_each(|place| place.face &= !(1 << 31));
    assert!(gpu.stage("nothing").is_err());
    let differ = [
        ("face forms", stage("face forms")[..bits(&faces).len()] != *bits(&faces)),
        ("node forms", stage("node forms")[..bits(&nodes).len()] != *bits(&nodes)),
        ("yarn places", *bits(&found[..places.len()]) != *bits(&places)),
    ];
    Some(differ.into_iter().filter(|(_, differ)| *differ).map(|(name, _)| name).collect())
}

#[test]
fn agree() {
    if let Some(stages) = differing(None) {
        assert!(stages.is_empty(), "{stages:?}");
    }
}

/// A fault shows in its stage first.
#[test]
fn name_the_fault() {
    for (from, to, first) in [
        ("words(u),", "words(v),", "face forms"),
        ("second = second + vec3<f32>(", "second = second - vec3<f32>(", "node forms"),
        ("= Place(face |", "= Place(at_rest.face |", "yarn places"),
    ] {
        if let Some(stages) = differing(Some((from, to))) {
            assert_eq!(stages.first(), Some(&first), "{to}");
        }
    }
}
