//! The precomputed method on made-up models: what its mends mend, invariants, stability. `tests/database_reference.rs`
//! compares with the authors' program.

#[path = "../common/mod.rs"]
mod common;

mod bending;
mod command;
mod folder;
mod frames;
mod invariants;
mod mends;
mod seams;
mod stitches;

use glam::{DVec3, IVec2};
use knotmesh::database::{Cpu, Fabric, RunningYarn, Settings, SkipYarn, Woven, YarnFrame};
use knotmesh::mesh::MaterialMesh;
use knotmesh::pattern::YarnModel;
use std::collections::HashMap;
use std::sync::Arc;

/// A fabric and one frame of it.
struct Laid<T: Woven> {
    fabric: Arc<Fabric>,
    cpu: Cpu<T>,
    frame: YarnFrame<T>,
}

fn laid<T: Woven>(mesh: &MaterialMesh, model: YarnModel, settings: Settings, positions: &[DVec3]) -> Laid<T> {
    let fabric = Arc::new(Fabric::new(mesh, model, settings).unwrap());
    let running = RunningYarn { skip: SkipYarn::NOTHING, ..RunningYarn::default() };
    let mut cpu = Cpu::<T>::new(fabric.clone(), running).unwrap();
    let mut frame = YarnFrame::default();
    cpu.frame(positions, &mut frame).unwrap();
    assert!(frame.points.iter().all(|p| p.to_f64().is_finite()));
    assert!(frame.twists.iter().all(|t| t.to_f64().is_finite()));
    Laid { fabric, cpu, frame }
}

impl<T: Woven> Laid<T> {
    /// World places by period and pattern vertex.
    fn places(&self) -> HashMap<(IVec2, u32), DVec3> {
        let vertices = self.fabric.point_vertices();
        let key = |p: usize| (self.fabric.tiles[self.fabric.point_tiles[p] as usize], vertices[p]);
        let all: HashMap<_, _> =
            (0..self.fabric.point_count()).map(|p| (key(p), self.frame.world(p))).collect();
        assert_eq!(all.len(), self.fabric.point_count(), "each once");
        all
    }
}
