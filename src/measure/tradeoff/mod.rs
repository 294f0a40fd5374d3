//! Run time against error: every way of placing the yarn, timed, beside its distance to the converged
//! optimum. `knotmesh measure` prints and draws what [`run`] returns.
//!
//! All variants see the same frames in the same order. A first pass takes the errors and warms up; then
//! passes are timed, variants in turn within each, so that whatever else the machine does hits all alike.

pub mod baseline;
pub mod errors;
mod face_geometry;
mod labels;
mod layout;
pub mod pareto;
pub mod plot;
pub mod poses;
pub mod reference;
pub mod table;
mod timing;
pub mod variants;

use crate::knot::Settings;
use crate::mesh::StitchMesh;
use crate::scene::{Mode, Scene, SceneOptions};
use crate::template::TemplateLibrary;
use crate::{Error, Result};
use errors::{Meter, Tally};
use poses::Pose;
use reference::Reference;
use std::sync::Arc;
use table::Row;
use timing::{Clocked, Runner};
use variants::Variant;

/// Stitches of a variant that distances of yarns are taken for.
const MOST_NEAR: usize = 50_000;

/// What is to be measured.
#[derive(Clone, Debug)]
pub struct Job<'a> {
    /// The stitch mesh.
    pub mesh: &'a StitchMesh,
    /// The templates.
    pub library: &'a TemplateLibrary,
    /// How scenes are compiled; each variant brings its own mode.
    pub options: SceneOptions,
    /// What is compared; weights and knot spacing are the same in all.
    pub variants: Vec<Variant>,
    /// The frames, in order.
    pub poses: Vec<Pose>,
    /// Timed passes over the frames; slow variants make fewer, at least one.
    pub repeats: usize,
    /// The GPU that variants on one take, by a part of its name; the best one where not given.
    pub adapter: Option<&'a str>,
}

/// All figures of a run.
#[derive(Clone, Debug)]
pub struct Tradeoff {
    /// The reference first, then one row a variant, over all frames.
    pub rows: Vec<Row>,
    /// The same for each frame on its own: all rows of the first frame, then of the next.
    pub frame_rows: Vec<Row>,
    /// Stitches a frame: faces that are not left out.
    pub stitches: usize,
    /// Faces that errors are taken of: those with knots, and with a frame.
    pub compared: usize,
}

/// Where a run is, for a progress display: done, of how many, and what is being worked on.
pub type Progress<'a> = dyn FnMut(usize, usize, &str) + 'a;

/// A mode's scene and the measures taken of its frames.
struct Stage {
    scene: Arc<Scene>,
    meter: Meter,
}

/// Runs all variants over all frames.
///
/// # Errors
/// Those of compiling and of frames; nothing to compare.
pub fn run(job: &Job, progress: &mut Progress) -> Result<Tradeoff> {
    if job.poses.is_empty() || job.repeats == 0 {
        return Err(Error::invalid("no frames or no repeats: nothing to measure"));
    }
    let settings = job.variants.first().map_or_else(Default::default, |v| v.settings);
    let modes = job.variants.iter().map(|v| v.mode);
    let stages = compile(job, modes.chain([Mode::Relax]), &settings)?;
    let stage = |mode: Mode| stages.iter().find(|s| s.scene.mode == mode).expect("compiled above");
    let truth = stage(Mode::Relax);

    let total = job.poses.len() + 2 * job.variants.len();
    let mut references = Vec::with_capacity(job.poses.len());
    let mut solver = Reference::new(truth.scene.clone(), &settings)?;
    for (i, pose) in job.poses.iter().enumerate() {
        progress(i, total, "converging");
        references.push(solver.solve(&pose.positions)?);
    }
    let mut compared = 0;
    let mut tallies = Vec::new();
    let mut own = Vec::new();
    let near = looked_at(job.poses.len(), truth.scene.face_count);
    for (reference, near) in references.iter().zip(&near) {
        let errors = truth.meter.errors(reference, reference, *near)?;
        compared += errors.distances.len();
        own.push(errors);
    }
    tallies.push(Tally::new(own));
    if compared == 0 {
        return Err(Error::invalid(
            "no face has both knots and a shape, so there is no error to measure: give a mesh with knits",
        ));
    }

    // The first pass: errors, and how long a pass takes.
    let mut runners = Vec::with_capacity(job.variants.len());
    for (i, variant) in job.variants.iter().enumerate() {
        progress(job.poses.len() + i, total, &variant.name);
        let stage = stage(variant.mode);
        let mut runner = Runner::new(stage.scene.clone(), variant, job.adapter)?;
        let mut errors = Vec::with_capacity(job.poses.len());
        let mut seconds = 0.0;
        for ((pose, reference), near) in job.poses.iter().zip(&references).zip(&near) {
            seconds += runner.timed(&pose.positions)?[0];
            errors.push(stage.meter.errors(&runner.output(), reference, *near)?);
        }
        tallies.push(Tally::new(errors));
        runners.push((runner, seconds));
    }
    let done = job.poses.len() + job.variants.len();
    let clocked = timing::passes(&mut runners, &job.poses, job.repeats, &mut |share, name| {
        progress(done + (share * job.variants.len() as f64) as usize, total, name);
    })?;

    let stitches = truth.scene.face_count;
    let mut clocks = vec![Clocked::default()];
    clocks.extend(clocked);
    let variants = || [None].into_iter().chain(job.variants.iter().map(Some));
    let rows = variants().zip(&clocks).zip(&tallies);
    let rows = rows.map(|((v, clock), tally)| Row::new(v, None, stitches, clock, &tally.all)).collect();
    let mut frame_rows = Vec::new();
    for (i, pose) in job.poses.iter().enumerate() {
        for ((variant, clock), tally) in variants().zip(&clocks).zip(&tallies) {
            let clock = clock.frame(i);
            frame_rows.push(Row::new(variant, Some(&pose.name), stitches, &clock, &tally.frames[i]));
        }
    }
    Ok(Tradeoff { rows, frame_rows, stitches, compared: compared / job.poses.len() })
}

/// `[frame]` whether distances of yarns are taken: in all frames, or in as many, evenly spread and the last among
/// them, as hold about `MOST_NEAR` stitches.
fn looked_at(frames: usize, stitches: usize) -> Vec<bool> {
    let some = (MOST_NEAR / stitches.max(1)).clamp(1, frames);
    (0..frames).map(|i| (i + 1) * some / frames > i * some / frames).collect()
}

/// One stage for each mode among `modes`.
fn compile(job: &Job, modes: impl Iterator<Item = Mode>, settings: &Settings) -> Result<Vec<Stage>> {
    let mut stages: Vec<Stage> = Vec::new();
    for mode in modes {
        if stages.iter().any(|s| s.scene.mode == mode) {
            continue;
        }
        let options = SceneOptions { mode, ..job.options.clone() };
        let scene = Arc::new(Scene::compile(job.mesh, job.library, options)?);
        let rest = job.options.rest.as_deref().unwrap_or(&job.mesh.positions);
        let meter = Meter::new(scene.clone(), rest, settings)?;
        stages.push(Stage { scene, meter });
    }
    Ok(stages)
}
