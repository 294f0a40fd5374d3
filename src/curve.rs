//! Centripetal Catmull-Rom curves through control points (model section 7), sampled yarn by yarn.

use crate::Result;
use crate::backend::FrameOutput;
use crate::knot::curve::sample;
pub use crate::knot::curve::sampled_len;
use crate::math::{Scalar, V3};
use crate::mesh::StitchMesh;
use crate::scene::{NO_SECOND_SLOT, Scene};
use crate::yarn::{CurveCheckpoint, CurveSource};
use glam::DVec3;

/// Extra points a segment that uniform splines (`.bcc`, USD) need at least: drawn through these samples they
/// stay within 0.02 r of the curve, at rest and under strong strain.
pub const UNIFORM_SUBDIVISION: usize = 6;

/// Points handed to a sink at once, about.
const CHUNK: usize = 4096;

/// The yarns of a solved frame as curves with `subdivide` extra points a segment.
pub struct FrameCurves<'a, T> {
    scene: &'a Scene,
    output: &'a FrameOutput<T>,
    subdivide: usize,
    extras: Option<&'a CurveExtras>,
    /// Samples that a device made already.
    sampled: Option<&'a [V3<T>]>,
}

/// What a mesh says of its yarns beyond their shape, for formats that carry it.
#[derive(Clone, Debug, Default)]
pub struct CurveExtras {
    /// Yarn length units.
    pub units: Vec<(String, f64)>,
    /// Rest lengths; their points count control points.
    pub checkpoints: Vec<CurveCheckpoint>,
    /// `[face]` line of the pattern, or empty.
    pub face_source: Vec<u32>,
}

impl CurveExtras {
    /// Looks the mesh's checkpoints up among a scene's control points.
    pub fn new(mesh: &StitchMesh, scene: &Scene) -> Self {
        let mut extras = Self {
            units: mesh.units.iter().map(|u| (u.name.clone(), u.length)).collect(),
            checkpoints: Vec::new(),
            face_source: mesh.face_source.clone(),
        };
        if mesh.checkpoints.is_empty() {
            return extras;
        }
        let mut point_of_slot = std::collections::HashMap::new();
        for (point, slots) in scene.point_slots().iter().enumerate() {
            for slot in slots.iter().filter(|s| **s != NO_SECOND_SLOT) {
                point_of_slot.insert(*slot, point as u32);
            }
        }
        for checkpoint in &mesh.checkpoints {
            let slot = scene.crossing_slot(mesh, checkpoint.at, checkpoint.crossing);
            let Some(point) = slot.and_then(|s| point_of_slot.get(&s)) else { continue };
            for (length, unit) in &checkpoint.lengths {
                extras.checkpoints.push(CurveCheckpoint { point: *point, length: *length, unit: *unit });
            }
        }
        extras.checkpoints.sort_by_key(|c| c.point);
        extras
    }

    /// The same for curves with `subdivide` extra points a segment.
    pub fn subdivided(&self, scene: &Scene, subdivide: usize) -> Self {
        let mut extras = self.clone();
        for c in &mut extras.checkpoints {
            c.point = scene.yarns.sample_of(c.point, subdivide) as u32;
        }
        extras
    }
}

impl<'a, T: Scalar> FrameCurves<'a, T> {
    /// Curves of `output`, with `subdivide` extra points a segment.
    pub fn new(
        scene: &'a Scene,
        output: &'a FrameOutput<T>,
        subdivide: usize,
        extras: Option<&'a CurveExtras>,
    ) -> Self {
        let sampled = &output.curves;
        let sampled = (subdivide > 0 && sampled.subdivide == subdivide).then_some(&sampled.points[..]);
        Self { scene, output, subdivide, extras, sampled }
    }

    /// Calls `sink` with each sample of a yarn: its place relative to the origin in template units.
    fn samples(&self, yarn: usize, sink: &mut dyn FnMut(V3<T>) -> Result<()>) -> Result<()> {
        let range = self.scene.yarns.range(yarn);
        let (n, closed) = (range.len(), self.scene.yarns.closed[yarn]);
        if let Some(sampled) = self.sampled {
            let begin = self.scene.yarns.first_sample(yarn, self.subdivide);
            let count = sampled_len(n, closed, self.subdivide);
            return sampled[begin..begin + count].iter().try_for_each(|p| sink(*p));
        }
        sample(&self.output.points[range], closed, self.subdivide, sink)
    }
}

impl<T: Scalar> CurveSource for FrameCurves<'_, T> {
    fn yarn_count(&self) -> usize {
        self.scene.yarns.len()
    }
    fn yarn_closed(&self, yarn: usize) -> bool {
        self.scene.yarns.closed[yarn]
    }
    fn yarn_len(&self, yarn: usize) -> usize {
        sampled_len(self.scene.yarns.range(yarn).len(), self.yarn_closed(yarn), self.subdivide)
    }
    fn yarn_radius(&self, _yarn: usize) -> Option<f64> {
        Some(self.scene.yarn_radius * self.scene.gauge)
    }
    fn visit(&self, yarn: usize, sink: &mut dyn FnMut(&[DVec3]) -> Result<()>) -> Result<()> {
        let mut chunk = Vec::with_capacity(CHUNK);
        let (origin, gauge) = (self.output.origin, self.output.gauge);
        self.samples(yarn, &mut |p| {
            chunk.push(origin + p.to_f64() * gauge);
            if chunk.len() == CHUNK {
                sink(&chunk)?;
                chunk.clear();
            }
            Ok(())
        })?;
        sink(&chunk)
    }
    fn visit_sources(&self, yarn: usize, sink: &mut dyn FnMut(&[u32]) -> Result<()>) -> Result<()> {
        let lines = self.extras.map_or(&[][..], |e| &e.face_source);
        let len = self.yarn_len(yarn);
        let range = self.scene.yarns.range(yarn);
        let mut chunk = Vec::with_capacity(CHUNK);
        for i in 0..len {
            let point = range.start + i / (self.subdivide + 1);
            let line = if lines.is_empty() {
                0
            } else {
                let (batch, face, _) = self.scene.slot_place(self.scene.point_slots()[point][0]);
                lines[batch.faces[face].index()]
            };
            chunk.push(line);
            if chunk.len() == CHUNK {
                sink(&chunk)?;
                chunk.clear();
            }
        }
        sink(&chunk)
    }
    fn units(&self) -> &[(String, f64)] {
        self.extras.map_or(&[], |e| &e.units)
    }
    fn checkpoints(&self) -> &[CurveCheckpoint] {
        self.extras.map_or(&[], |e| &e.checkpoints)
    }
}
