//! How far the rest mesh's faces are from their templates' shapes: a mesh that does not fit its library
//! cannot look right.

use super::quantile;
use crate::ids::FaceId;
use crate::knot::frame::face_frame;
use crate::math::V3;
use crate::scene::Scene;
use glam::DVec3;
use serde::Serialize;

/// The strains of a face at rest.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FaceStrain {
    /// The face, counted from 0.
    pub face: u32,
    /// F11 - 1.
    pub course: f64,
    /// sqrt(F12^2 + F22^2) - 1.
    pub wale: f64,
}

/// Misfit of a mesh to its templates.
#[derive(Clone, Debug, Serialize)]
pub struct Misfit {
    /// Median over the faces of the course strain.
    pub median_course_strain: f64,
    /// Median over the faces of the wale strain.
    pub median_wale_strain: f64,
    /// Faces without a frame at rest.
    pub faces_without_frame: usize,
    /// Share of the faces strained by more than `LARGE` along course or wale.
    pub share_large: f64,
    /// The faces with the greatest strains, worst first.
    pub worst: Vec<FaceStrain>,
}

/// Strains beyond this do not look like the stitch any more.
pub const LARGE: f64 = 0.5;
const WORST: usize = 5;

/// Measures the misfit of a scene at its rest positions (world units).
pub fn misfit(scene: &Scene, positions: &[DVec3]) -> Misfit {
    let mut strains = Vec::new();
    let mut without = 0;
    for batch in &scene.batches {
        let stencil = &scene.stencils[batch.stencil];
        if stencil.points.is_empty() {
            continue;
        }
        let n = stencil.corner_count;
        for (i, face) in batch.faces.iter().enumerate() {
            let vertices = &batch.corners[i * n..(i + 1) * n];
            let first = positions[vertices[0] as usize];
            let corners: Vec<V3<f64>> =
                vertices.iter().map(|v| V3::of((positions[*v as usize] - first) / scene.gauge)).collect();
            let (frame, usable) = face_frame(&stencil.frame_gradients, &corners);
            if usable {
                let wale = (frame.f12 * frame.f12 + frame.f22 * frame.f22).sqrt() - 1.0;
                strains.push(FaceStrain { face: face.0, course: frame.f11 - 1.0, wale });
            } else {
                without += 1;
            }
        }
    }
    let size = |s: &FaceStrain| s.course.abs().max(s.wale.abs());
    let large = strains.iter().filter(|s| size(s) > LARGE).count();
    let mut course: Vec<f64> = strains.iter().map(|s| s.course).collect();
    let mut wale: Vec<f64> = strains.iter().map(|s| s.wale).collect();
    let share_large = large as f64 / strains.len().max(1) as f64;
    strains.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.face.cmp(&b.face)));
    strains.truncate(WORST);
    Misfit {
        median_course_strain: quantile(&mut course, 0.5),
        median_wale_strain: quantile(&mut wale, 0.5),
        faces_without_frame: without,
        share_large,
        worst: strains,
    }
}

impl Misfit {
    /// A warning where the mesh does not fit, with its gauge in world units per course.
    pub fn warning(&self, scene: &Scene, key_of: impl Fn(FaceId) -> String) -> Option<String> {
        let median = self.median_course_strain.abs().max(self.median_wale_strain.abs());
        if median <= 0.25 && self.share_large <= 0.05 {
            return None;
        }
        let percent = |x: f64| format!("{:+.0} %", 100.0 * x);
        let worst = self.worst.first().map_or(String::new(), |w| {
            format!(
                "; worst: face {} ('{}') {} along the course, {} along the wale",
                w.face + 1,
                key_of(FaceId(w.face)),
                percent(w.course),
                percent(w.wale)
            )
        });
        Some(format!(
            "the rest mesh does not fit its templates: at gauge {:.6} the median strain is {} along the course \
             and {} along the wale, {:.0} % of the faces are strained by more than {:.0} %{worst}",
            scene.gauge,
            percent(self.median_course_strain),
            percent(self.median_wale_strain),
            100.0 * self.share_large,
            100.0 * LARGE,
        ))
    }
}
