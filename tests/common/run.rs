//! Running a mesh and finding points by face.

use glam::DVec3;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Precision, Running, Skip};
use knotmesh::knot::Settings;
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{NO_SECOND_SLOT, Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::collections::HashMap;
use std::sync::Arc;

/// A compiled scene and the result of one frame at the mesh's own positions.
pub struct Run<T: Precision> {
    pub scene: Arc<Scene>,
    pub backend: CpuBackend<T>,
    pub output: FrameOutput<T>,
}

pub fn run<T: Precision>(
    mesh: &StitchMesh,
    library: &TemplateLibrary,
    options: SceneOptions,
    settings: &Settings,
    threads: usize,
) -> Run<T> {
    let scene = Arc::new(Scene::compile(mesh, library, options).expect("compiles"));
    let mut backend =
        CpuBackend::new(scene.clone(), settings, &running(threads)).expect("settings are in range");
    let mut output = FrameOutput::default();
    backend.frame(&mesh.positions, &mut output).expect("positions are finite");
    Run { scene, backend, output }
}

/// Every face is solved, whatever is known of it.
pub fn running(threads: usize) -> Running {
    Running { threads, skip: Skip::NOTHING, ..Running::default() }
}

impl<T: Precision> Run<T> {
    /// World positions by (face, point within the face's template).
    pub fn by_face(&self) -> HashMap<(u32, usize), DVec3> {
        let mut map = HashMap::new();
        for (point, slots) in self.scene.point_slots().iter().enumerate() {
            for slot in slots.iter().filter(|s| **s != NO_SECOND_SLOT) {
                let (batch, index, local) = self.scene.slot_place(*slot);
                map.insert((batch.faces[index].0, local), self.output.world(point));
            }
        }
        map
    }
}
