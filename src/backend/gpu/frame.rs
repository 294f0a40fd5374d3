//! A frame on the device: put to work, waited for.

use super::buffers::SKIP_COUNTS;
use super::{Buffers, GpuBackend, OnCpu};
use crate::Result;
use crate::backend::{Backend, FrameOutput, GIVEN, STAMPS, Skipped, Tables};
use crate::knot::{KnotState, Start};
use glam::DVec3;
use std::sync::atomic::Ordering::Relaxed;

/// A frame that the device is at work on.
#[derive(Debug)]
pub(super) enum Pending {
    /// Nothing moved: nothing is done.
    Stays(Skipped),
    /// The mesh moved as one.
    Turned,
    /// Faces were worked on.
    Solved,
}

/// What is known of the output that a frame will go into.
#[derive(Clone, Copy)]
pub(super) struct Into<'a> {
    /// Its knots, where they may be starts.
    pub knots: &'a [KnotState<f32>],
    /// Whether it holds a frame of this backend, or starts that somebody gave; and whether that is the last frame.
    pub own: bool,
    pub continued: bool,
    /// Faces that are hidden in it.
    pub hidden: usize,
}

impl GpuBackend {
    /// Puts the device to work on a frame.
    fn submit(&mut self, positions: &[DVec3], into: Into) -> Result<Pending> {
        let known = into.continued && !self.sight.anew && self.start != Start::Previous;
        let may_stay = known && self.running.skip.unmoved;
        let unmoved = self.scene.face_count.saturating_sub(into.hidden);
        let stays = Pending::Stays(Skipped { hidden: into.hidden, unmoved, ..Skipped::default() });
        if may_stay && self.surface.rests(positions) {
            return Ok(stays);
        }
        let looks = known && self.sight.faces.is_none() && self.options.on_cpu == OnCpu::Nothing;
        let motion = if looks {
            self.surface.motion(&self.scene, &self.running.skip, positions, self.turned)
        } else {
            None
        };
        let moved = match self.options.on_cpu {
            OnCpu::Surface => self.surface.update(&self.scene, positions)?,
            _ => self.surface.take(&self.scene, positions)?,
        };
        if !moved && may_stay {
            return Ok(stays);
        }
        if let Some(twin) = &mut self.twin {
            let (backend, output) = &mut **twin;
            backend.frame(positions, output)?;
        }
        self.turned = if motion.is_some() { self.turned + 1 } else { 0 };
        if let Some(motion) = motion {
            self.turn(&motion);
            return Ok(Pending::Turned);
        }
        self.send(into);
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.encode(&mut encoder);
        let Buffers { points, knots, results, lists, .. } = &self.buffers;
        let counts = (lists, Some(4 * SKIP_COUNTS as u64));
        self.readback.copy(&mut encoder, &[(points, None), (knots, None), (results, None), counts]);
        self.device.queue.submit([encoder.finish()]);
        self.sight.anew = false;
        Ok(Pending::Solved)
    }

    /// Waits for a frame.
    fn finish(&mut self, pending: Pending, output: &mut FrameOutput<f32>) -> Result<()> {
        match pending {
            Pending::Stays(skipped) => output.skipped = skipped,
            Pending::Turned => {
                let bytes = self.buffers.points.size() as usize;
                self.readback.wait(&self.device, |all| {
                    super::exchange::take_points(&all[..bytes], &self.scene, output)
                })?;
                output.skipped = Skipped::turned(&self.scene, &self.kernels);
            }
            Pending::Solved => {
                self.collect(output)?;
                output.origin = self.surface.origin();
                output.gauge = self.scene.gauge;
                self.stamp = STAMPS.fetch_add(1, Relaxed);
                (output.stamp, output.backend) = (self.stamp, self.name);
            }
        }
        self.hidden = output.skipped.hidden;
        self.device.check()
    }
}

impl Backend<f32> for GpuBackend {
    fn frame(&mut self, positions: &[DVec3], output: &mut FrameOutput<f32>) -> Result<()> {
        let mut continued = self.stamp != 0 && output.stamp == self.stamp;
        if let Some(pending) = self.ahead.take() {
            if continued && !self.sight.anew && self.surface.holds(positions) {
                return self.finish(pending, output);
            }
            // Another frame than the one told ahead: what the device holds is of no use.
            continued = false;
        }
        let own = output.backend == self.name || output.backend == GIVEN;
        let into = Into { knots: &output.knots, own, continued, hidden: output.skipped.hidden };
        let pending = self.submit(positions, into)?;
        self.finish(pending, output)
    }

    fn ahead(&mut self, positions: &[DVec3]) -> Result<()> {
        if self.stamp == 0 || self.ahead.is_some() {
            return Ok(());
        }
        let into = Into { knots: &[], own: true, continued: true, hidden: self.hidden };
        self.ahead = Some(self.submit(positions, into)?);
        Ok(())
    }

    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        self.sight.set(&self.scene, visible)
    }

    fn set_origin(&mut self, origin: DVec3) {
        self.surface.set_origin(origin);
        if let Some(twin) = &mut self.twin {
            twin.0.set_origin(origin);
        }
    }

    fn tables(&self) -> &Tables {
        &self.tables
    }

    fn lose(&mut self) {
        self.device.device.destroy();
    }
}
