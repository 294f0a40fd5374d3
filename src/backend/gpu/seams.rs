//! Seams whose two sides are in different parts: the CPU joins them.

use super::part::Part;
use crate::backend::rigid::Motion;
use crate::math::V3;
use crate::scene::Scene;
use glam::DVec3;

/// Such seams.
#[derive(Debug, Default)]
pub(super) struct CrossSeams {
    /// Their control points.
    points: Vec<u32>,
    /// `[seam][side]` what the two faces say of them.
    sides: Vec<[V3<f32>; 2]>,
    /// `[part][open side]` 2 x seam + side, seams counted as here.
    places: Vec<Vec<usize>>,
}

impl CrossSeams {
    /// Those between parts.
    pub fn between(scene: &Scene, parts: &[Part]) -> Self {
        let mut seams: Vec<u32> = parts.iter().flat_map(|p| &p.slice.open).map(|side| side / 2).collect();
        seams.sort_unstable();
        seams.dedup();
        let place = |side: &u32| {
            let seam = seams.binary_search(&(side / 2)).expect("all are here");
            2 * seam + *side as usize % 2
        };
        Self {
            points: seams.iter().map(|seam| scene.yarns.seams[*seam as usize]).collect(),
            sides: vec![[V3::zero(); 2]; seams.len()],
            places: parts.iter().map(|p| p.slice.open.iter().map(place).collect()).collect(),
        }
    }

    /// Takes in what a part says.
    pub fn take(&mut self, part: usize, sides: impl Iterator<Item = V3<f32>>) {
        for (place, side) in self.places[part].iter().zip(sides) {
            self.sides[place / 2][place % 2] = side;
        }
    }

    /// Takes in where points were, and where a motion of the whole mesh carries them.
    pub fn take_turned(&mut self, points: &[V3<f32>], motion: &Motion, origin: DVec3, gauge: f64) {
        let mut carried: Vec<V3<f32>> = self.points.iter().map(|p| points[*p as usize]).collect();
        motion.carry(origin, gauge, &mut carried);
        for (sides, point) in self.sides.iter_mut().zip(carried) {
            // The mean of a number and itself is that number.
            *sides = [point; 2];
        }
    }

    /// Shared points are the mean of what both faces say.
    pub fn join(&self, points: &mut [V3<f32>]) {
        for (point, [a, b]) in self.points.iter().zip(&self.sides) {
            points[*point as usize] = (*a + *b) * 0.5;
        }
    }
}
