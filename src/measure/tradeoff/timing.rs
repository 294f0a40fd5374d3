//! Variants as things that run frames, and the timing of them.

use super::baseline::Baseline;
use super::poses::Pose;
use super::variants::{Engine, Precision, Variant};
use crate::Result;
use crate::backend::{Backend, CpuBackend, DeviceBackend, DeviceKind, FrameOutput, Recipe, Wanted};
use crate::knot::{FaceResult, KnotState};
use crate::math::{Scalar, V2, V3};
use crate::measure::quantile;
use crate::scene::Scene;
use glam::DVec3;
use std::sync::Arc;
use std::time::Instant;

/// A variant takes about this long in all its timed passes, seconds; but it makes at least one.
const LONGEST: f64 = 60.0;

/// A variant, ready to run.
pub(super) struct Runner {
    name: String,
    engine: Work,
}

enum Work {
    F32(Box<dyn Backend<f32>>, Box<FrameOutput<f32>>),
    F64(Box<(CpuBackend<f64>, FrameOutput<f64>)>),
    Baseline(Box<(Baseline, FrameOutput<f64>)>),
}

impl Runner {
    /// A variant on a scene; `adapter` names the GPU that variants on one take.
    pub fn new(scene: Arc<Scene>, variant: &Variant, adapter: Option<&str>) -> Result<Self> {
        let (settings, running) = (&variant.settings, &variant.running);
        let engine = match (variant.engine, variant.precision) {
            (Engine::LevenbergMarquardt { tolerance }, _) => {
                Work::Baseline(Box::new((Baseline::new(scene, settings, tolerance), FrameOutput::default())))
            }
            (Engine::Gpu, _) => {
                let (settings, running) = (*settings, *running);
                let adapter = adapter.map(str::to_string);
                let recipe = Recipe { scene, settings, running, cache: None, adapter, timed: true };
                let mut backend = DeviceBackend::new(recipe, DeviceKind::Gpu)?;
                backend.set_wanted(Wanted { points: true, knots: false, curves: 0 })?;
                Work::F32(Box::new(backend), Box::default())
            }
            (Engine::Cpu, Precision::F32) => {
                Work::F32(Box::new(CpuBackend::new(scene, settings, running)?), Box::default())
            }
            (Engine::Cpu, Precision::F64) => {
                Work::F64(Box::new((CpuBackend::new(scene, settings, running)?, FrameOutput::default())))
            }
        };
        Ok(Self { name: variant.name.clone(), engine })
    }

    /// Runs a frame; wall-clock seconds, and those that the device itself says it was at work, if there is one.
    pub fn timed(&mut self, positions: &[DVec3]) -> Result<[f64; 2]> {
        let began = Instant::now();
        match &mut self.engine {
            Work::F32(backend, output) => backend.frame(positions, output)?,
            Work::F64(run) => run.0.frame(positions, &mut run.1)?,
            Work::Baseline(run) => run.0.frame(positions, &mut run.1)?,
        }
        let seconds = began.elapsed().as_secs_f64();
        let device = match &self.engine {
            Work::F32(backend, _) => backend.device_times().iter().map(|(_, seconds)| seconds).sum(),
            _ => 0.0,
        };
        Ok([seconds, device])
    }

    /// The last frame.
    pub fn output(&self) -> FrameOutput<f64> {
        match &self.engine {
            Work::F32(_, output) => widened(output),
            Work::F64(run) => run.1.clone(),
            Work::Baseline(run) => run.1.clone(),
        }
    }
}

fn widened<T: Scalar>(output: &FrameOutput<T>) -> FrameOutput<f64> {
    let knot = |k: &KnotState<T>| KnotState {
        direction: V2::new(k.direction.u.to_f64(), k.direction.v.to_f64()),
        half_length: k.half_length.to_f64(),
    };
    let face = |f: &FaceResult<T>| FaceResult {
        energy_start: f.energy_start.to_f64(),
        energy: f.energy.to_f64(),
        status: f.status,
    };
    let mut wide = FrameOutput::default();
    (wide.origin, wide.gauge, wide.skipped) = (output.origin, output.gauge, output.skipped);
    wide.points = output.points.iter().map(|p| V3::of(p.to_f64())).collect();
    wide.knots = output.knots.iter().map(knot).collect();
    wide.faces = output.faces.iter().map(face).collect();
    wide
}

/// A variant's times.
#[derive(Clone, Debug, Default)]
pub(super) struct Clocked {
    /// Timed passes.
    pub repeats: usize,
    /// `[frame]` medians over the passes, seconds; empty if nothing was timed.
    pub frames: Vec<f64>,
    /// `[frame]` the same of the device's own times, 0 where there is none.
    pub on_device: Vec<f64>,
}

impl Clocked {
    /// Mean over the frames, seconds.
    pub fn mean(&self) -> Option<f64> {
        let sum: f64 = self.frames.iter().sum();
        (!self.frames.is_empty()).then(|| sum / self.frames.len() as f64)
    }

    /// Mean of the device's own times, seconds, where it is at work.
    pub fn mean_on_device(&self) -> Option<f64> {
        let sum: f64 = self.on_device.iter().sum();
        (sum > 0.0).then(|| sum / self.on_device.len() as f64)
    }

    /// That of one frame.
    pub fn frame(&self, frame: usize) -> Self {
        let one = |all: &[f64]| all.get(frame).copied().into_iter().collect();
        Self { repeats: self.repeats, frames: one(&self.frames), on_device: one(&self.on_device) }
    }
}

/// Times passes over the frames: `runners` with the seconds that a pass of theirs takes. Before each pass the
/// last frame is run untimed: it warms the caches, and stands in for the frame before the first.
pub(super) fn passes(
    runners: &mut [(Runner, f64)],
    poses: &[Pose],
    repeats: usize,
    progress: &mut dyn FnMut(f64, &str),
) -> Result<Vec<Clocked>> {
    let mut times = vec![vec![Vec::with_capacity(repeats); poses.len()]; runners.len()];
    for pass in 0..repeats {
        for (i, (runner, seconds)) in runners.iter_mut().enumerate() {
            if pass > 0 && *seconds * (pass + 1) as f64 > LONGEST {
                continue;
            }
            progress((pass as f64 + i as f64 / times.len() as f64) / repeats as f64, &runner.name);
            runner.timed(&poses.last().expect("checked by the caller").positions)?;
            for (pose, times) in poses.iter().zip(&mut times[i]) {
                times.push(runner.timed(&pose.positions)?);
            }
        }
    }
    let medians = |frames: &[Vec<[f64; 2]>], which: usize| {
        let median =
            |times: &Vec<[f64; 2]>| quantile(&mut times.iter().map(|t| t[which]).collect::<Vec<_>>(), 0.5);
        frames.iter().map(median).collect()
    };
    let clocked = |frames: Vec<Vec<[f64; 2]>>| Clocked {
        repeats: frames[0].len(),
        frames: medians(&frames, 0),
        on_device: medians(&frames, 1),
    };
    Ok(times.into_iter().map(clocked).collect())
}
