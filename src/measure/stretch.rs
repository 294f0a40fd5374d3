//! How far the yarn's segments are from their rest lengths after a frame.

use super::quantile;
use crate::backend::FrameOutput;
use crate::math::Scalar;
use crate::scene::{NO_SECOND_SLOT, Scene, Stencil};
use serde::Serialize;

/// Relative errors |length / rest - 1| of the segments between control points of one face.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Stretch {
    /// Half of the segments are within this.
    pub median: f64,
    /// 95 % of them are within this.
    pub p95: f64,
    /// The greatest.
    pub max: f64,
    /// Total length over total rest length, minus 1: negative for slack.
    pub total: f64,
}

/// Measures a frame's control points, in space.
pub fn stretch<T: Scalar>(scene: &Scene, output: &FrameOutput<T>) -> Stretch {
    let mut errors = Vec::new();
    let (mut total, mut rest_total) = (0.0, 0.0);
    let (yarns, slots, lengths) = (&scene.yarns, scene.point_slots(), RestLengths::new(scene));
    for yarn in 0..yarns.len() {
        let range = yarns.range(yarn);
        let n = range.len();
        let segments = if yarns.closed[yarn] { n } else { n.saturating_sub(1) };
        for i in 0..segments {
            let (a, b) = (range.start + i, range.start + (i + 1) % n);
            let Some(rest) = lengths.between(slots[a], slots[b]) else { continue };
            let length = (output.points[b] - output.points[a]).to_f64().length();
            total += length;
            rest_total += rest;
            if rest > 0.0 {
                errors.push((length / rest - 1.0).abs());
            }
        }
    }
    let max = errors.iter().copied().fold(0.0, f64::max);
    Stretch {
        median: quantile(&mut errors, 0.5),
        p95: quantile(&mut errors, 0.95),
        max,
        total: if rest_total > 0.0 { total / rest_total - 1.0 } else { f64::NAN },
    }
}

/// Rest lengths of the segments between control points, found by their slots.
pub(crate) struct RestLengths<'a> {
    scene: &'a Scene,
    /// `[stencil][point]` of the segment from there to the next point; NaN where a strand ends.
    from: Vec<Vec<f64>>,
}

impl<'a> RestLengths<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let from = |stencil: &Stencil<f64>| {
            let mut from = vec![f64::NAN; stencil.points.len()];
            stencil.terms.lengths.iter().for_each(|term| from[term.point as usize] = term.rest);
            from
        };
        Self { scene, from: scene.stencils.iter().map(from).collect() }
    }

    /// Between points with these slots: they share a face, where their slots are neighbours.
    pub(crate) fn between(&self, a: [u32; 2], b: [u32; 2]) -> Option<f64> {
        for x in a.into_iter().filter(|s| *s != NO_SECOND_SLOT) {
            for y in b.into_iter().filter(|s| *s != NO_SECOND_SLOT && s.abs_diff(x) == 1) {
                // What begins here ends in the same face.
                let (batch, _, point) = self.scene.slot_place(x.min(y));
                let rest = self.from[batch.stencil][point];
                if !rest.is_nan() {
                    return Some(rest);
                }
            }
        }
        None
    }
}
