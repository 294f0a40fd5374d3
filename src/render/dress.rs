//! What is drawn of a solved frame, of a fabric's frame or of a curve file: places, lengths at rest, colours of yarn.

use super::colour::YARNS;
use super::strands::Strands;
use crate::Result;
use crate::backend::FrameOutput;
use crate::math::Scalar;
use crate::measure::stretch::RestLengths;
use crate::mesh::StitchMesh;
use crate::scene::Scene;
use crate::yarn::CurveSource;
use glam::DVec3;
use rayon::prelude::*;

impl Strands {
    /// The yarns of a solved frame, each of a colour of its own, or of the stitches' where the mesh has any.
    pub fn of_frame<T: Scalar>(mesh: &StitchMesh, scene: &Scene, output: &FrameOutput<T>) -> Self {
        let yarns = &scene.yarns;
        let (slots, lengths) = (scene.point_slots(), RestLengths::new(scene));
        let mut rest = vec![0.0; yarns.point_count()];
        let mut colours = vec![YARNS[0]; yarns.point_count()];
        for yarn in 0..yarns.len() {
            let range = yarns.range(yarn);
            colours[range.clone()].fill(YARNS[yarn % YARNS.len()]);
            // Fabric is often of one yarn.
            rest[range.clone()].par_iter_mut().zip(range.clone()).with_min_len(4096).for_each(|(rest, i)| {
                let next = if i + 1 < range.end { i + 1 } else { range.start };
                if i + 1 < range.end || yarns.closed[yarn] {
                    *rest = lengths.between(slots[i], slots[next]).unwrap_or(0.0) as f32;
                }
            });
        }
        if mesh.face_origins.iter().any(|o| o.colour.is_some()) {
            for (colour, slots) in colours.iter_mut().zip(slots) {
                let (batch, face, _) = scene.slot_place(slots[0]);
                let origin = mesh.face_origins.get(batch.faces[face].index());
                *colour = origin.and_then(|o| o.colour).unwrap_or(*colour);
            }
        }
        let mut strands = Self {
            offsets: yarns.offsets.clone(),
            closed: yarns.closed.clone(),
            radius: vec![scene.yarn_radius as f32; yarns.len()],
            rest,
            colours,
            ..Self::default()
        };
        strands.move_to(output);
        strands
    }

    /// Takes the places of another frame of the same scene.
    pub fn move_to<T: Scalar>(&mut self, output: &FrameOutput<T>) {
        (self.origin, self.unit) = (output.origin, output.gauge);
        self.points.clear();
        self.points.extend(output.points.iter().map(|p| p.to_f64().as_vec3().to_array()));
    }

    /// Curves, each yarn of a colour of its own; `radius` is that of yarns that have none of their own, world units: where it is not
    /// given either, a third of the mean distance of a point from the next but one.
    ///
    /// # Errors
    /// Those of the source.
    pub fn of_curves(curves: &dyn CurveSource, radius: Option<f64>) -> Result<Self> {
        let mut places = Vec::new();
        let mut strands = Self { offsets: vec![0], unit: 1.0, ..Self::default() };
        for yarn in 0..curves.yarn_count() {
            let begin = places.len();
            curves.visit(yarn, &mut |points| {
                places.extend_from_slice(points);
                Ok(())
            })?;
            let points = &places[begin..];
            let guess = || {
                let steps = points.windows(3).map(|p| (p[2] - p[0]).length());
                steps.sum::<f64>() / points.len().saturating_sub(2).max(1) as f64 / 3.0
            };
            let radius = curves.yarn_radius(yarn).or(radius).unwrap_or_else(guess);
            strands.radius.push(radius.max(f64::from(f32::MIN_POSITIVE)) as f32);
            strands.closed.push(curves.yarn_closed(yarn));
            strands.offsets.push(places.len() as u32);
            strands.colours.resize(places.len(), YARNS[yarn % YARNS.len()]);
        }
        let low = places.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = places.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let middle = (low + high) / 2.0;
        strands.origin = if middle.is_finite() { middle } else { DVec3::ZERO };
        strands.rest = vec![0.0; places.len()];
        strands.points = places.iter().map(|p| (*p - strands.origin).as_vec3().to_array()).collect();
        Ok(strands)
    }
}
