//! A frame on the device: put to work, waited for.

use super::curves::CurvesOnDevice;
use super::{DevicePoints, GpuBackend, OnCpu, PASSES};
use crate::Result;
use crate::backend::rigid::Motion;
use crate::backend::{Backend, FrameOutput, GIVEN, STAMPS, Skipped, Tables, Wanted};
use crate::knot::{KnotState, Start};
use glam::DVec3;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Instant;

/// A frame that the device is at work on.
#[derive(Debug)]
pub(super) enum Pending {
    /// Nothing moved: nothing is done.
    Stays(Skipped),
    /// The mesh moved as one.
    Turned(Motion),
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
            self.submitted = Instant::now();
            self.turn(&motion);
            return Ok(Pending::Turned(motion));
        }
        self.send(into);
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.encode(&mut encoder);
        self.fetch(&mut encoder, false);
        self.submitted = Instant::now();
        self.device.queue.submit([encoder.finish()]);
        self.sight.anew = false;
        Ok(Pending::Solved)
    }

    /// Waits for a frame.
    fn finish(&mut self, pending: Pending, output: &mut FrameOutput<f32>) -> Result<()> {
        let worked = !matches!(pending, Pending::Stays(_));
        if matches!(pending, Pending::Solved) {
            self.knots_stayed = !self.wanted.knots;
        } else if self.wanted.knots && self.knots_stayed {
            self.fetch_knots(output)?;
            self.knots_stayed = false;
        }
        let keeps = self.keeps_points();
        if !worked && self.points_stayed && !keeps {
            self.fetch_points(output)?;
        }
        if keeps {
            output.points.clear();
        }
        self.points_stayed = keeps;
        match pending {
            Pending::Stays(skipped) => output.skipped = skipped,
            Pending::Turned(motion) => {
                self.collect_turned(&motion, output)?;
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
        self.times.clear();
        match &self.timer {
            _ if !worked || !self.options.timed => {}
            Some(timer) => self.times.extend(PASSES.into_iter().zip(timer.seconds(&self.device)?)),
            None => self.times.push(("submit to done", self.waited.as_secs_f64())),
        }
        self.device.check()
    }
}

impl GpuBackend {
    fn solve(&mut self, positions: &[DVec3], output: &mut FrameOutput<f32>) -> Result<()> {
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
}

impl Backend<f32> for GpuBackend {
    fn frame(&mut self, positions: &[DVec3], output: &mut FrameOutput<f32>) -> Result<()> {
        let result = self.solve(positions, output);
        if result.is_err() {
            // The positions are taken in already: the next frame must not take them for known.
            self.stamp = 0;
        }
        result
    }

    fn ahead(&mut self, positions: &[DVec3]) -> Result<()> {
        if self.stamp == 0 || self.ahead.is_some() {
            return Ok(());
        }
        let into = Into { knots: &[], own: true, continued: true, hidden: self.hidden };
        match self.submit(positions, into) {
            Ok(pending) => self.ahead = Some(pending),
            Err(e) => {
                // As in a frame: the positions may be taken in already.
                self.stamp = 0;
                return Err(e);
            }
        }
        Ok(())
    }

    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        if visible.is_some() {
            self.make_choosers()?;
        }
        self.sight.set(&self.scene, visible)
    }

    fn set_wanted(&mut self, wanted: Wanted) -> Result<()> {
        // What is under way brings back what was wanted when it began: it is of no use.
        if wanted != self.wanted && self.ahead.take().is_some() {
            self.stamp = 0;
        }
        let made = self.curves.as_ref().map_or(0, CurvesOnDevice::subdivide);
        if made != wanted.curves {
            self.curves = None;
            // The points of several parts come together on the CPU.
            let samples = wanted.curves > 0 && CurvesOnDevice::fits(&self.scene, wanted.curves);
            if let ([part], true) = (&self.parts[..], samples) {
                let points = &part.buffers.points;
                let options = &self.options;
                self.curves =
                    Some(CurvesOnDevice::new(&self.device, &self.scene, options, points, wanted.curves)?);
            }
        }
        self.wanted = wanted;
        Ok(())
    }

    fn device_points(&self) -> Option<DevicePoints<'_>> {
        match &self.parts[..] {
            [part] if self.stamp != 0 => Some(DevicePoints {
                device: &self.device,
                buffer: &part.buffers.points,
                origin: self.surface.origin(),
                unit: self.scene.gauge,
                count: self.scene.yarns.point_count(),
            }),
            _ => None,
        }
    }

    fn device_times(&self) -> &[(&'static str, f64)] {
        &self.times
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
