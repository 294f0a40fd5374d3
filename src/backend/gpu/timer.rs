//! How long the device takes for what, by timestamps that it takes itself.

use super::adapter::Device;
use super::buffers::Maker;
use super::readback::Readback;
use crate::Result;

/// What a frame consists of, pass by pass.
pub(super) const PASSES: [&str; 5] = ["surface", "choose", "stitches", "seams", "curves"];

/// Timestamps at the beginning and the end of each pass.
#[derive(Debug)]
pub(crate) struct Timer {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    back: Readback,
    /// Nanoseconds a tick.
    period: f32,
    passes: usize,
}

/// Of the timestamps of so many passes.
fn bytes(passes: usize) -> u64 {
    16 * passes as u64
}

impl Timer {
    /// A timer of so many passes, where the device takes timestamps.
    pub fn new(device: &Device, passes: usize) -> Option<Self> {
        if !device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let maker = Maker(device);
        let set = device.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("timestamps"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * passes as u32,
        });
        Some(Self {
            set,
            resolved: maker.timestamps(bytes(passes)),
            back: Readback::new(&maker, bytes(passes)),
            period: device.queue.get_timestamp_period(),
            passes,
        })
    }

    /// What is to be told of a pass.
    pub fn writes(&self, pass: usize) -> wgpu::ComputePassTimestampWrites<'_> {
        let first = 2 * pass as u32;
        wgpu::ComputePassTimestampWrites {
            query_set: &self.set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        }
    }

    /// Puts the timestamps of the passes into words.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.set, 0..2 * self.passes as u32, &self.resolved, 0);
        self.back.copy(encoder, &[(&self.resolved, 0, bytes(self.passes))]);
    }

    /// Seconds of each pass.
    pub fn seconds(&self, device: &Device) -> Result<Vec<f64>> {
        let mut seconds = vec![0.0; self.passes];
        self.back.wait(device, |words| {
            let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&words[..bytes(self.passes) as usize]);
            for (seconds, ends) in seconds.iter_mut().zip(ticks.chunks_exact(2)) {
                // A clock that was set back in between says nothing.
                *seconds = ends[1].saturating_sub(ends[0]) as f64 * f64::from(self.period) * 1e-9;
            }
        })?;
        Ok(seconds)
    }
}
