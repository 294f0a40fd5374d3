//! The precomputed method on a GPU: a thread a face, a node, a yarn vertex. [`Cpu<f32>`](super::Cpu) is its twin, stage by
//! stage and, where shaders run as they are written, bit by bit.
//!
//! Each frame only the places of the mesh's vertices go up; points with their twists come down. The strain table is a
//! buffer, not a three-dimensional texture: filters of textures work with fractions of eight bits, that is steps of 1/256
//! of a cell, and in an order of their own; and a texture holds one vertex of the pattern, or needs layers of 3D that there
//! are none of.

mod buffers;
mod director;
mod kernels;
pub mod layout;
pub mod shader;

use super::cpu::STAMPS;
use super::{Compat, Fabric, SkipYarn, SkippedYarn, YarnFrame, forms};
use crate::backend::gpu::{Adapter, Device, GpuOptions, Maker, Readback, Timer, read};
use crate::backend::middle;
use crate::math::V3;
use crate::{Error, Result};
use buffers::{Buffers, COUNTS};
use glam::DVec3;
use kernels::{Kernels, PASSES};
use layout::{FabricSettings, YarnPoint};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

const CHUNK: usize = 4096;

/// How a device works; results do not depend on it but for what is skipped.
#[derive(Clone, Copy, Debug, Default)]
pub struct GpuYarn {
    /// What is left undone.
    pub skip: SkipYarn,
    /// How the device is used: `workgroup`, `exact`, `timed`, `most_bytes`, `free` and `fault`; no other option concerns
    /// fabrics.
    pub device: GpuOptions,
}

/// Turns the mesh of a frame into yarn on a GPU, in f32.
pub struct Gpu {
    fabric: Arc<Fabric>,
    device: Device,
    options: GpuOptions,
    settings: FabricSettings,
    buffers: Buffers,
    kernels: Kernels,
    points_back: Readback,
    counts_back: Readback,
    timer: Option<Timer>,
    times: Vec<(&'static str, f64)>,
    /// `[vertex]` on their way up.
    places: Vec<[f32; 3]>,
    /// `[face]` a bit each, where some are hidden.
    seen: Option<Vec<u32>>,
    origin: Option<DVec3>,
    begun: bool,
    backend: u64,
    stamp: u64,
}

impl Gpu {
    /// A backend for a fabric on an adapter.
    ///
    /// # Errors
    /// A fabric that repeats MADYPG, which only the CPU does; a device that cannot be opened, lacks room or refuses a
    /// shader.
    pub fn new(fabric: Arc<Fabric>, options: &GpuYarn, adapter: &Adapter) -> Result<Self> {
        if fabric.settings.compat == Compat::Madypg {
            return Err(Error::invalid(
                "compat madypg on a GPU: expected --device cpu, for its angles are worked out in f64",
            ));
        }
        let device = adapter.open()?;
        let (buffers, settings) = Buffers::new(&fabric, options, &device)?;
        let kernels = Kernels::new(&device, options, &buffers, &settings)?;
        let maker = Maker(&device);
        let points_back = Readback::new(&maker, buffers.points.size());
        let counts_back = Readback::new(&maker, COUNTS);
        let timer = options.device.timed.then(|| Timer::new(&device, PASSES.len())).flatten();
        device.check()?;
        Ok(Self {
            places: vec![[0.0; 3]; fabric.vertex_count],
            fabric,
            options: options.device,
            settings,
            buffers,
            kernels,
            points_back,
            counts_back,
            timer,
            times: Vec::new(),
            seen: None,
            origin: None,
            begun: false,
            backend: STAMPS.fetch_add(1, Relaxed),
            stamp: 0,
            device,
        })
    }

    /// The fabric.
    pub fn fabric(&self) -> &Arc<Fabric> {
        &self.fabric
    }

    /// Whether shaders run with their sums as they are written.
    pub fn is_exact(&self) -> bool {
        self.options.exact && self.device.exact && self.options.free.is_none()
    }

    /// Says what places are relative to, before the first frame; without, that is the middle of the first frame.
    pub fn set_origin(&mut self, origin: DVec3) {
        if !self.begun {
            self.origin = Some(origin);
        }
    }

    /// Names the faces whose yarn needs to be right from the next frame on; `None` for all. Other points stay where they
    /// were, and in an output that is new to this backend are worked out once.
    ///
    /// # Errors
    /// Another number of faces than the mesh has.
    pub fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        self.fabric.check_visible(visible)?;
        let bits = |faces: &[bool]| faces.iter().enumerate().map(|(i, seen)| u32::from(*seen) << i).sum();
        self.seen = visible.map(|faces| faces.chunks(32).map(bits).collect());
        if let Some(seen) = &self.seen {
            self.device.queue.write_buffer(&self.buffers.seen, 0, bytemuck::cast_slice(seen));
        }
        Ok(())
    }

    /// Works a frame out. `positions`: `[vertex]` of the mesh, in the world. The result replaces what is in `output`, whose
    /// memory is reused. All numbers are finite if the positions are.
    ///
    /// # Errors
    /// Another number of positions than the mesh has vertices; a device that fails, and then `output` is as it was.
    pub fn frame(&mut self, positions: &[DVec3], output: &mut YarnFrame<f32>) -> Result<()> {
        self.fabric.check_positions(positions)?;
        let result = self.work(positions, output);
        if result.is_err() {
            // What the device holds is nobody's frame.
            self.stamp = 0;
        }
        result
    }

    fn work(&mut self, positions: &[DVec3], output: &mut YarnFrame<f32>) -> Result<()> {
        let origin = *self.origin.get_or_insert_with(|| middle(positions));
        self.begun = true;
        let continued = self.stamp != 0
            && output.stamp == self.stamp
            && output.points.len() == self.settings.homes as usize;
        self.send(positions, origin, continued);
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.buffers.counts, 0, None);
        self.kernels.encode(&mut encoder, self.timer.as_ref());
        let count = self.settings.homes as usize;
        let bytes = (count * size_of::<YarnPoint>()) as u64;
        self.points_back.copy(&mut encoder, &[(&self.buffers.points, 0, bytes)]);
        self.counts_back.copy(&mut encoder, &[(&self.buffers.counts, 0, COUNTS)]);
        self.device.queue.submit([encoder.finish()]);
        let mut counts = [0u32; 4];
        self.counts_back.wait(&self.device, |words| {
            counts.copy_from_slice(bytemuck::cast_slice(&words[..COUNTS as usize]));
        })?;
        self.times.clear();
        if let Some(timer) = &self.timer {
            self.times.extend(PASSES.into_iter().zip(timer.seconds(&self.device)?));
        }
        // Last: whatever fails before leaves the output as it was.
        self.points_back.wait(&self.device, |words| {
            take(bytemuck::cast_slice(&words[..bytes as usize]), output);
        })?;
        let [unmoved, rigid, hidden, outside] = counts.map(|count| count as usize);
        output.skipped = SkippedYarn { unmoved, rigid, hidden };
        output.outside = outside;
        output.origin = origin;
        self.stamp = STAMPS.fetch_add(1, Relaxed);
        (output.backend, output.stamp) = (self.backend, self.stamp);
        Ok(())
    }

    /// Sends what is new of a frame.
    fn send(&mut self, positions: &[DVec3], origin: DVec3, continued: bool) {
        self.places.par_iter_mut().zip(positions).with_min_len(CHUNK).for_each(|(place, position)| {
            let near = forms::near::<f32>(*position, origin);
            *place = [near.x, near.y, near.z];
        });
        self.settings.continued = u32::from(continued);
        self.settings.hides = u32::from(self.seen.is_some());
        let queue = &self.device.queue;
        queue.write_buffer(&self.buffers.places, 0, bytemuck::cast_slice(&self.places));
        queue.write_buffer(&self.buffers.settings, 0, bytemuck::bytes_of(&self.settings));
    }

    /// What the device took for each pass of the last frame, seconds, if [`GpuOptions::timed`] asked for it and it can tell.
    pub fn device_times(&self) -> &[(&'static str, f64)] {
        &self.times
    }

    /// What the last frame left behind: the words of `places`, `face forms`, `node forms`, `face frames`, `changes`, `yarn
    /// places` or `points`, as in [`layout`]; whole buffers, which may end in a few words of nothing.
    ///
    /// # Errors
    /// Another name; a device that fails.
    pub fn stage(&self, name: &str) -> Result<Vec<u32>> {
        let buffer = self.buffers.named(name).ok_or_else(|| {
            Error::invalid(format_args!("stage '{name}': expected places, face forms and the like"))
        })?;
        Ok(read(&self.device, buffer)?.into_iter().map(f32::to_bits).collect())
    }

    /// Fills the buffer of that name with some words, over and over, before the next frame; says whether there is one.
    #[doc(hidden)]
    pub fn spoil(&self, name: &str, words: &[u32]) -> bool {
        let buffer = self.buffers.named(name).or_else(|| self.buffers.fixed(name));
        if let Some(buffer) = buffer {
            let all: Vec<u32> = words.iter().copied().cycle().take(buffer.size() as usize / 4).collect();
            self.device.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&all));
        }
        buffer.is_some()
    }

    /// Loses the device, to see what becomes of frames.
    #[doc(hidden)]
    pub fn lose(&mut self) {
        self.device.device.destroy();
    }
}

/// Puts points and twists where outputs have them.
fn take(points: &[YarnPoint], output: &mut YarnFrame<f32>) {
    output.points.resize(points.len(), V3::zero());
    output.twists.resize(points.len(), 0.0);
    let all = output.points.par_iter_mut().zip(&mut output.twists);
    all.zip(points).with_min_len(CHUNK).for_each(|((point, twist), given)| {
        *point = V3::new(given.x, given.y, given.z);
        *twist = given.twist;
    });
}
