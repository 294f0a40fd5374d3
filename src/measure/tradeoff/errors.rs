//! What is wrong with a frame, against the converged optimum of the same frame.

use super::layout::{Owner, owners};
use super::reference::to_the_end;
use crate::Result;
use crate::backend::{Backend, CpuBackend, FrameOutput, Running};
use crate::curve::FrameCurves;
use crate::knot::{Settings, Status};
use crate::measure::clearance::{Clearance, clearance};
use crate::measure::quantile;
use crate::scene::{Mode, Scene};
use glam::DVec3;
use std::sync::Arc;

/// Extra points a segment that distances between curves are measured on.
const DENSE: usize = 4;

/// A point where a yarn goes from face to face.
#[derive(Clone, Copy, Debug)]
struct Joint {
    before: u32,
    at: u32,
    after: u32,
    /// The turn there at rest, degrees.
    at_rest: f64,
}

/// Takes the errors of a scene's frames.
#[derive(Debug)]
pub struct Meter {
    scene: Arc<Scene>,
    owners: Vec<Owner>,
    /// `[face]` in batch order: whether it has knots to solve for.
    solved: Vec<bool>,
    joints: Vec<Joint>,
    /// Whether control points and energies mean the same as the reference's.
    comparable: bool,
}

/// The errors of one frame.
#[derive(Clone, Debug)]
pub struct FrameErrors {
    /// Of each face compared, the largest distance of a control point to its place in the reference, in yarn
    /// radii, in space; faces without knots are left out, and those without a frame. Empty where the points
    /// are others than the reference's.
    pub distances: Vec<f64>,
    /// Of the same faces (E - E*) / (1 + E*), E* the reference's energy; faces that fell back left out.
    pub energy_above: Vec<f64>,
    /// How near yarns come, where it was asked for.
    pub clearance: Option<Clearance>,
    /// The largest turn of the control polygon where a yarn goes from face to face, one of them with knots,
    /// beyond the turn there at rest, degrees.
    pub kink: f64,
    /// Faces that fell back to interpolation.
    pub fell_back: usize,
}

impl Meter {
    /// For a scene; `rest` are the positions at rest (`[vertex]`, world units), and the yarn's turns there are
    /// those with the weights and the knot spacing of `settings`.
    ///
    /// # Errors
    /// Those of [`Backend::frame`].
    pub fn new(scene: Arc<Scene>, rest: &[DVec3], settings: &Settings) -> Result<Self> {
        let settings = to_the_end(settings);
        let mut output = FrameOutput::default();
        CpuBackend::<f64>::new(scene.clone(), &settings, &Running::default())?.frame(rest, &mut output)?;
        let mut solved = vec![false; scene.face_count];
        for batch in &scene.batches {
            // `embed` has no knots of its own, but its points are those that knots would move.
            let knots = !scene.templates[batch.stencil].knots.is_empty();
            solved[batch.first_face..batch.first_face + batch.faces.len()].fill(knots);
        }
        let owners = owners(&scene);
        let solved_at = |point: u32| solved[owners[point as usize].face as usize];
        let mut joints = Vec::new();
        for yarn in 0..scene.yarns.len() {
            let (range, closed) = (scene.yarns.range(yarn), scene.yarns.closed[yarn]);
            let n = range.len();
            let inner = if closed { 0..n } else { 1..n.saturating_sub(1) };
            for i in inner.filter(|i| owners[range.start + i].shared) {
                let at = |i: usize| (range.start + i % n) as u32;
                let mut joint = Joint { before: at(i + n - 1), at: at(i), after: at(i + 1), at_rest: 0.0 };
                joint.at_rest = joint.turn(&output);
                // Where neither side is solved for, all variants are the same.
                if solved_at(joint.before) || solved_at(joint.after) {
                    joints.push(joint);
                }
            }
        }
        let other_points = scene.templates.iter().any(|t| t.polylines.is_some());
        let comparable = scene.mode != Mode::Embed || !other_points;
        Ok(Self { scene, owners, solved, joints, comparable })
    }

    /// The errors of `output`; `reference` is the optimum of the same frame, of the same mesh in mode `relax`.
    /// Distances of yarns take far longer than all else: they are taken `with_clearance` only.
    ///
    /// # Errors
    /// None in practice: those of [`clearance`].
    pub fn errors(
        &self,
        output: &FrameOutput<f64>,
        reference: &FrameOutput<f64>,
        with_clearance: bool,
    ) -> Result<FrameErrors> {
        let fell = |output: &FrameOutput<f64>, face: usize| output.faces[face].status == Status::FellBack;
        let counts = |face: &usize| self.comparable && self.solved[*face] && !fell(reference, *face);
        let faces: Vec<usize> = (0..self.scene.face_count).filter(counts).collect();

        let mut largest = vec![0.0f64; self.scene.face_count];
        if self.comparable {
            let r = reference.gauge * self.scene.yarn_radius;
            for (point, owner) in self.owners.iter().enumerate() {
                let distance = (output.world(point) - reference.world(point)).length() / r;
                let face = &mut largest[owner.face as usize];
                // A NaN is infinitely far.
                *face = face.max(if distance.is_nan() { f64::INFINITY } else { distance });
            }
        }
        let above = |face: &usize| {
            let (e, best) = (output.faces[*face].energy, reference.faces[*face].energy);
            (!fell(output, *face)).then_some((e - best) / (1.0 + best))
        };
        let curves = FrameCurves::new(&self.scene, output, DENSE, None);
        let radius = self.scene.yarn_radius * self.scene.gauge;
        let near = if with_clearance { Some(clearance(&curves, radius)?) } else { None };
        let kinks = self.joints.iter().map(|joint| joint.turn(output) - joint.at_rest);
        Ok(FrameErrors {
            distances: faces.iter().map(|face| largest[*face]).collect(),
            energy_above: faces.iter().filter_map(above).collect(),
            clearance: near,
            kink: kinks.fold(0.0, f64::max),
            fell_back: (0..self.scene.face_count).filter(|face| fell(output, *face)).count(),
        })
    }
}

impl Joint {
    /// The angle between the segments before and after, degrees; 0 where one has no length.
    fn turn(&self, output: &FrameOutput<f64>) -> f64 {
        let [before, at, after] = [self.before, self.at, self.after].map(|i| output.points[i as usize]);
        let (into, out) = ((at - before).to_f64(), (after - at).to_f64());
        // atan2 keeps small angles, which a cosine loses.
        let angle = into.cross(out).length().atan2(into.dot(out)).to_degrees();
        if angle.is_nan() { 0.0 } else { angle }
    }
}

/// Errors of faces or frames taken together; `None` where the variant has no such error.
#[derive(Clone, Copy, Debug, Default)]
pub struct Summary {
    /// Over faces: half of the distances are below this, r.
    pub distance_median: Option<f64>,
    /// 95 % of the distances are below this, r.
    pub distance_p95: Option<f64>,
    /// The largest distance, r.
    pub distance_max: Option<f64>,
    /// Mean over faces of (E - E*) / (1 + E*).
    pub energy_mean: Option<f64>,
    /// 95 % of them are below this.
    pub energy_p95: Option<f64>,
    /// Mean over the frames looked at of the share of the curve's samples nearer than 1.5 r to another
    /// centreline.
    pub interpenetration: Option<f64>,
    /// The smallest distance of centrelines in those frames, r, at most 2.5.
    pub smallest: Option<f64>,
    /// The largest kink, degrees.
    pub kink: f64,
    /// Faces that fell back, all frames together.
    pub fell_back: usize,
}

impl Summary {
    /// Of some frames.
    pub fn new(frames: &[FrameErrors]) -> Self {
        let mut distances: Vec<f64> = frames.iter().flat_map(|f| f.distances.iter().copied()).collect();
        let mut above: Vec<f64> = frames.iter().flat_map(|f| f.energy_above.iter().copied()).collect();
        let some = |values: &Vec<f64>| !values.is_empty();
        let largest = distances.iter().copied().fold(0.0, f64::max);
        let mean = above.iter().sum::<f64>() / above.len() as f64;
        let near: Vec<&Clearance> = frames.iter().filter_map(|f| f.clearance.as_ref()).collect();
        let shares = near.iter().map(|c| c.share_below_1_5r).sum::<f64>();
        Self {
            distance_median: some(&distances).then(|| quantile(&mut distances, 0.5)),
            distance_p95: some(&distances).then(|| quantile(&mut distances, 0.95)),
            distance_max: some(&distances).then_some(largest),
            energy_mean: some(&above).then_some(mean),
            energy_p95: some(&above).then(|| quantile(&mut above, 0.95)),
            interpenetration: (!near.is_empty()).then(|| shares / near.len() as f64),
            smallest: near.iter().map(|c| c.smallest).reduce(f64::min),
            kink: frames.iter().map(|f| f.kink).fold(0.0, f64::max),
            fell_back: frames.iter().map(|f| f.fell_back).sum(),
        }
    }
}

/// A variant's errors, over all frames and frame by frame.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    pub all: Summary,
    pub frames: Vec<Summary>,
}

impl Tally {
    pub fn new(frames: Vec<FrameErrors>) -> Self {
        let each = frames.chunks(1).map(Summary::new).collect();
        Self { all: Summary::new(&frames), frames: each }
    }
}
