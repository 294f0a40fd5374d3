//! Directors of a frame on a GPU: where points lie comes down, the mesh is worked out once more beside it, and the rest is the
//! CPU's. Few ask for them.

use super::Gpu;
use crate::Result;
use crate::database::YarnFrame;
use crate::database::device::Weaver;
use crate::database::director::{Shell, directors};
use crate::database::forms::Forms;
use crate::database::shell::Place;
use crate::math::V3;
use glam::DVec3;

impl Weaver<f32> for Gpu {
    fn frame(&mut self, positions: &[DVec3], output: &mut YarnFrame<f32>) -> Result<()> {
        Gpu::frame(self, positions, output)
    }
    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        Gpu::set_visible(self, visible)
    }
    fn set_origin(&mut self, origin: DVec3) {
        Gpu::set_origin(self, origin);
    }
    fn directors(&mut self, positions: &[DVec3], frame: &YarnFrame<f32>) -> Result<Vec<V3<f32>>> {
        let fabric = &self.fabric;
        let mut forms =
            Forms::<f32>::new(&fabric.surface, fabric.nodes.clone(), fabric.vertex_count, &fabric.settings);
        forms.update(positions, frame.origin);
        let frames: Vec<_> = (0..fabric.face_count()).map(|face| forms.face_frame(face)).collect();
        let words = self.stage("yarn places")?;
        let place = |[face, b, c, height]: &[u32; 4]| Place {
            // The highest bit says something else.
            face: *face & (u32::MAX >> 1),
            barycentric: [f32::from_bits(*b), f32::from_bits(*c)],
            height: f32::from_bits(*height),
        };
        let places: Vec<Place<f32>> =
            words.as_chunks::<4>().0.iter().take(fabric.point_count()).map(place).collect();
        let shell = Shell { forms: &forms.face_forms, frames: &frames, places: &places };
        Ok(directors(fabric, &shell, frame))
    }
}
