//! Centripetal Catmull-Rom curves through control points (model section 7), sampled yarn by yarn.

use crate::Result;
use crate::backend::FrameOutput;
use crate::math::Scalar;
use crate::mesh::StitchMesh;
use crate::scene::{NO_SECOND_SLOT, Scene};
use crate::yarn::{CurveCheckpoint, CurveSource};
use glam::DVec3;

/// Extra points a segment that uniform splines (`.bcc`, USD) need at least: drawn through these samples they
/// stay within 0.02 r of the curve, at rest and under strong strain.
pub const UNIFORM_SUBDIVISION: usize = 6;

/// Points handed to a sink at once, about.
const CHUNK: usize = 4096;

/// The tangents at both ends of the middle segment of four consecutive points, for a parameter from 0 to 1
/// on that segment: centripetal parametrisation (knot spacing the square root of the distance).
fn tangents(p: [DVec3; 4]) -> (DVec3, DVec3) {
    let spacing = |a: DVec3, b: DVec3| (b - a).length().sqrt();
    let (d0, d1, d2) = (spacing(p[0], p[1]), spacing(p[1], p[2]), spacing(p[2], p[3]));
    let chord = p[2] - p[1];
    // Where two points coincide there is no spacing to divide by: the chord stands in.
    let start = if d0 > 0.0 && d1 > 0.0 {
        chord + ((p[1] - p[0]) / d0 - (p[2] - p[0]) / (d0 + d1)) * d1
    } else {
        chord
    };
    let end = if d1 > 0.0 && d2 > 0.0 {
        chord + ((p[3] - p[2]) / d2 - (p[3] - p[1]) / (d1 + d2)) * d1
    } else {
        chord
    };
    (start, end)
}

/// The point at parameter `t` in 0..1 of the segment from `p[1]` to `p[2]`.
pub fn centripetal(p: [DVec3; 4], t: f64) -> DVec3 {
    hermite(p, tangents(p), t)
}

fn hermite(p: [DVec3; 4], (m0, m1): (DVec3, DVec3), t: f64) -> DVec3 {
    let (t2, t3) = (t * t, t * t * t);
    p[1] * (2.0 * t3 - 3.0 * t2 + 1.0)
        + m0 * (t3 - 2.0 * t2 + t)
        + p[2] * (3.0 * t2 - 2.0 * t3)
        + m1 * (t3 - t2)
}

/// The point at parameter `t` of a uniform Catmull-Rom segment, as `.bcc` and USD define their curves.
pub fn uniform(p: [DVec3; 4], t: f64) -> DVec3 {
    hermite(p, ((p[2] - p[0]) * 0.5, (p[3] - p[1]) * 0.5), t)
}

/// Point `i` of a run of `n` (`i` may be one before or after): closed runs wrap, open ends mirror their
/// neighbour.
pub fn neighbour(i: isize, n: usize, closed: bool, point: impl Fn(usize) -> DVec3) -> DVec3 {
    let last = n as isize - 1;
    if closed {
        point(i.rem_euclid(n as isize) as usize)
    } else if i < 0 {
        point(0) * 2.0 - point(last.min(1) as usize)
    } else if i > last {
        point(last as usize) * 2.0 - point((last - 1).max(0) as usize)
    } else {
        point(i as usize)
    }
}

/// The yarns of a solved frame as curves with `subdivide` extra points a segment.
pub struct FrameCurves<'a, T> {
    scene: &'a Scene,
    output: &'a FrameOutput<T>,
    subdivide: usize,
    extras: Option<&'a CurveExtras>,
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
        let step = subdivide as u32 + 1;
        let yarns = &scene.yarns;
        let mut first = vec![0u32];
        for yarn in 0..yarns.len() {
            let n = yarns.range(yarn).len();
            first.push(first[yarn] + sampled_len(n, yarns.closed[yarn], subdivide) as u32);
        }
        for c in &mut extras.checkpoints {
            let yarn = yarns.offsets.partition_point(|o| *o <= c.point) - 1;
            c.point = first[yarn] + (c.point - yarns.offsets[yarn]) * step;
        }
        extras
    }
}

/// Points of a curve of `n` control points with `subdivide` extra ones a segment.
pub fn sampled_len(n: usize, closed: bool, subdivide: usize) -> usize {
    match (n, closed) {
        (0, _) => 0,
        (_, true) => n * (subdivide + 1),
        (_, false) => (n - 1) * (subdivide + 1) + 1,
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
        Self { scene, output, subdivide, extras }
    }

    /// Calls `sink` with each sample of a yarn: its place relative to the origin in template units.
    fn samples(&self, yarn: usize, sink: &mut dyn FnMut(DVec3) -> Result<()>) -> Result<()> {
        let range = self.scene.yarns.range(yarn);
        let (n, closed) = (range.len(), self.scene.yarns.closed[yarn]);
        let points = &self.output.points[range];
        let at = |i: usize| points[i].to_f64();
        if self.subdivide == 0 {
            return (0..n).try_for_each(|i| sink(at(i)));
        }
        let segments = if closed { n } else { n.saturating_sub(1) };
        let step = 1.0 / (self.subdivide + 1) as f64;
        for i in 0..segments {
            let p = [-1, 0, 1, 2].map(|k| neighbour(i as isize + k, n, closed, at));
            let m = tangents(p);
            sink(p[1])?;
            for k in 1..=self.subdivide {
                sink(hermite(p, m, k as f64 * step))?;
            }
        }
        if !closed && n > 0 { sink(at(n - 1)) } else { Ok(()) }
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
            chunk.push(origin + p * gauge);
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
