//! Which faces a camera sees: a mask for [`set_visible`](crate::backend::CpuBackend::set_visible).

use super::Scene;
use crate::{Error, Result};
use glam::{DMat4, DVec3, DVec4};
use rayon::prelude::*;

/// Faces that one task looks at.
const CHUNK: usize = 4096;
/// Yarn swings out of its face: by less than this share of the face's bounding sphere, chosen with room to spare.
const SWING: f64 = 0.5;

/// A camera, and what of its picture is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// World to clip space, column vectors. A point is in the picture where |x|, |y| and |z| are at most w, so that
    /// depths from 0 to w, from -w to w and reversed ones will do.
    pub view_projection: DMat4,
    /// Where it stands, world units; for a parallel projection a point far behind the picture.
    pub eye: DVec3,
    /// Height of the picture, pixels.
    pub height: f64,
    /// Leave out faces that are seen from behind. Through open fabric their yarn is seen all the same.
    pub hide_backs: bool,
    /// Leave out faces smaller than this across, pixels; 0 for none.
    pub least_pixels: f64,
}

impl Camera {
    /// The frustum's planes: a point is inside where normal . point + w is not negative. One without a normal (a far
    /// plane that is infinitely far) is left out by its length of 0.
    fn planes(&self) -> [DVec4; 6] {
        let row = |i| self.view_projection.row(i);
        let w = row(3);
        [0, 1, 2].map(|i| [w + row(i), w - row(i)]).concat().try_into().unwrap_or([DVec4::ZERO; 6])
    }
}

/// Fills `visible` with a yes or no for each face of the mesh, for corners at `positions` (`[vertex]`, world units).
///
/// A face stays unless the sphere around its corners, grown by the yarn's thickness and by how far loops swing out
/// of their face, is outside of the frustum or, where that is asked for, behind all its corners or too small. A face
/// with a corner that is not finite stays.
///
/// # Errors
/// Another number of positions than the scene has vertices.
pub fn visible_faces(
    scene: &Scene,
    positions: &[DVec3],
    camera: &Camera,
    visible: &mut Vec<bool>,
) -> Result<()> {
    if positions.len() != scene.vertex_count {
        return Err(Error::invalid(format_args!(
            "{} positions, expected {} as the mesh has vertices",
            positions.len(),
            scene.vertex_count
        )));
    }
    // How far the yarn's surface is off the face, world units.
    let points = scene.stencils.iter().flat_map(|s| &s.points);
    let high = points.map(|p| p.z.abs()).fold(0.0, f64::max);
    let thick = (high + 2.0 * scene.yarn_radius) * scene.gauge;
    let planes = camera.planes();
    visible.resize(scene.face_places.len(), true);
    visible.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, visible)| {
        for (i, visible) in visible.iter_mut().enumerate() {
            let face = chunk * CHUNK + i;
            let range = scene.face_offsets[face] as usize..scene.face_offsets[face + 1] as usize;
            *visible = sees(camera, &planes, &scene.face_vertices[range], positions, thick);
        }
    });
    Ok(())
}

/// Comparisons are such that what is not a number stays visible.
fn sees(camera: &Camera, planes: &[DVec4; 6], vertices: &[u32], positions: &[DVec3], thick: f64) -> bool {
    let at = |i: usize| positions[vertices[i % vertices.len()] as usize];
    let n = vertices.len();
    let middle = (0..n).map(at).sum::<DVec3>() / n as f64;
    let mut radius = 0.0f64;
    for i in 0..n {
        let distance = (at(i) - middle).length();
        if !distance.is_finite() {
            return true;
        }
        radius = radius.max(distance);
    }
    let radius = radius * (1.0 + SWING) + thick;
    let centre = middle.extend(1.0);
    if planes.iter().any(|p| p.dot(centre) < -radius * p.truncate().length()) {
        return false;
    }
    if camera.hide_backs {
        // Away from the eye at every corner, and the yarn in front of it as well.
        let behind = |i: usize| {
            let normal = (at(i + 1) - at(i)).cross(at(i + n - 1) - at(i));
            normal.dot(camera.eye - at(i)) < -thick * normal.length()
        };
        if (0..n).all(behind) {
            return false;
        }
    }
    if camera.least_pixels > 0.0 {
        let (up, depth) = (camera.view_projection.row(1), camera.view_projection.row(3));
        let nearest = depth.dot(centre) - radius * depth.truncate().length();
        let across = radius * up.truncate().length() * camera.height;
        return !(nearest > 0.0 && across < camera.least_pixels * nearest);
    }
    true
}
