//! Which faces need to be right, because somebody sees them.

use crate::scene::{Scene, StrandEnd};
use crate::{Error, Result};

/// Faces that are worked on.
#[derive(Debug, Default)]
pub struct Sight {
    /// `[face of the mesh]` which faces are worked on, if not all.
    pub faces: Option<Vec<bool>>,
    /// Whether that changed since the last frame.
    pub anew: bool,
    /// `[seam][side]` faces of the mesh; made when first needed.
    seam_faces: Vec<[u32; 2]>,
}

impl Sight {
    /// Names the faces of the mesh that somebody sees; those that share a yarn point with one of them are worked on too.
    pub fn set(&mut self, scene: &Scene, visible: Option<&[bool]>) -> Result<()> {
        let Some(visible) = visible else {
            self.anew |= self.faces.is_some();
            self.faces = None;
            return Ok(());
        };
        let count = scene.face_places.len();
        if visible.len() != count {
            return Err(Error::invalid(format_args!(
                "visibility of {} faces, expected {count} as the mesh has",
                visible.len()
            )));
        }
        if self.seam_faces.is_empty() {
            self.seam_faces = seam_faces(scene);
        }
        let mut worked = visible.to_vec();
        for [a, b] in &self.seam_faces {
            worked[*a as usize] |= visible[*b as usize];
            worked[*b as usize] |= visible[*a as usize];
        }
        self.anew |= self.faces.as_ref() != Some(&worked);
        self.faces = Some(worked);
        Ok(())
    }
}

/// `[seam][side]` faces of the mesh.
fn seam_faces(scene: &Scene) -> Vec<[u32; 2]> {
    let mut faces = vec![[0; 2]; scene.yarns.seams.len()];
    for batch in &scene.batches {
        let count = scene.stencils[batch.stencil].strand_offsets.len() - 1;
        for (i, face) in batch.faces.iter().enumerate() {
            let first = batch.first_strand + i * count;
            for place in &scene.yarns.strands[first..first + count] {
                for end in [0, 1] {
                    if let StrandEnd::Seam(side) = place.end(end) {
                        faces[side as usize / 2][side as usize % 2] = face.0;
                    }
                }
            }
        }
    }
    faces
}
