//! A fabric's yarns as curves, for writers.

use super::{Fabric, YarnFrame};
use crate::Result;
use crate::knot::curve::{sample, sampled_len};
use crate::math::Scalar;
use crate::yarn::CurveSource;
use glam::DVec3;

/// Points handed to a sink at once, about.
const CHUNK: usize = 4096;

/// The yarns of a frame as curves with extra points a segment.
pub struct FabricCurves<'a, T> {
    fabric: &'a Fabric,
    frame: &'a YarnFrame<T>,
    subdivide: usize,
    unit: f64,
}

impl<'a, T: Scalar> FabricCurves<'a, T> {
    /// Curves of a frame with `subdivide` extra points a segment, in world units of so many metres.
    pub fn new(fabric: &'a Fabric, frame: &'a YarnFrame<T>, subdivide: usize, unit: f64) -> Self {
        Self { fabric, frame, subdivide, unit }
    }
}

impl<T: Scalar> CurveSource for FabricCurves<'_, T> {
    fn yarn_count(&self) -> usize {
        self.fabric.yarn_count()
    }
    fn yarn_closed(&self, yarn: usize) -> bool {
        self.fabric.yarn_closed[yarn]
    }
    fn yarn_len(&self, yarn: usize) -> usize {
        sampled_len(self.fabric.yarn(yarn).len(), self.yarn_closed(yarn), self.subdivide)
    }
    fn yarn_radius(&self, _yarn: usize) -> Option<f64> {
        Some(self.fabric.model.pattern.radius / self.unit)
    }
    fn visit(&self, yarn: usize, sink: &mut dyn FnMut(&[DVec3]) -> Result<()>) -> Result<()> {
        let mut chunk = Vec::with_capacity(CHUNK);
        let origin = self.frame.origin;
        let points = &self.frame.points[self.fabric.yarn(yarn)];
        sample(points, self.yarn_closed(yarn), self.subdivide, &mut |p| {
            chunk.push((origin + p.to_f64()) / self.unit);
            if chunk.len() == CHUNK {
                sink(&chunk)?;
                chunk.clear();
            }
            Ok(())
        })?;
        sink(&chunk)
    }
}
