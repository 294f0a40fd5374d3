//! What threads count: the shaders that have it, the buffers that hold it, and how it is read; see
//! [`counters`].

use super::buffers::Maker;
use super::counters::{self, Counted, KERNEL_COUNTERS, Segment};
use super::layout::Variant;
use super::{GpuBackend, GpuOptions, readback, shader};
use crate::Result;
use wgpu::BufferUsages;

fn counted(text: String, options: &GpuOptions, binding: usize) -> String {
    if options.count { shader::counted(text, binding) } else { text }
}

/// The shader of surfaces and seams, with counters where they are asked for.
pub(super) fn surface(options: &GpuOptions) -> String {
    counted(shader::surface(options.workgroup), options, 5)
}

/// The shader that chooses, likewise.
pub(super) fn select(variant: &Variant, options: &GpuOptions) -> String {
    counted(shader::select(variant, options.workgroup), options, 9)
}

/// The shader of curves, likewise.
pub(super) fn curve(options: &GpuOptions) -> String {
    counted(shader::curve(options.workgroup), options, 4)
}

/// Room for the counters of so many threads, where they are asked for.
pub(super) fn buffer(maker: &Maker, options: &GpuOptions, threads: u32) -> Result<Option<wgpu::Buffer>> {
    let bytes = 4 * KERNEL_COUNTERS as u64 * u64::from(threads);
    let made = || maker.storage("counters", bytes, BufferUsages::COPY_SRC | BufferUsages::COPY_DST);
    options.count.then(made).transpose()
}

impl GpuBackend {
    /// What a batch's stitches did in the last frame, a face each, if [`GpuOptions::count`] asked for it and shaders run as
    /// they are written.
    ///
    /// # Errors
    /// A device that fails.
    #[doc(hidden)]
    pub fn counted(&self, batch: usize) -> Result<Vec<counters::Counted>> {
        let of_type = self.types[batch].as_ref().filter(|_| self.is_exact());
        let Some(segments) = of_type.and_then(|t| t.segments.as_ref()) else { return Ok(Vec::new()) };
        let mut all = Vec::new();
        for part in &self.parts {
            if let Some(buffer) = part.batches[batch].as_ref().and_then(|b| b.trace.as_ref()) {
                let count = counters::COUNTERS * part.slice.batches[batch].len();
                all.extend(counters::read(
                    segments,
                    &readback::read(&self.device, buffer)?[..count],
                    counters::COUNTERS,
                ));
            }
        }
        Ok(all)
    }

    /// What the threads of a kernel did since they were asked last, if [`GpuOptions::count`] asked for it and shaders run as
    /// they are written: a face of the mesh each of `areas`, a corner group, a seam, a point or side, and for `curve` a
    /// control point. With a batch, what choosing its faces took, a face each. Asking begins anew for all kernels that
    /// share the buffer: `areas`, `corner_normals`, `join` and `carry` are told apart, and told together.
    ///
    /// # Errors
    /// A device that fails.
    #[doc(hidden)]
    pub fn counted_since(&self, kernel: Counting) -> Result<Vec<Counted>> {
        if !self.is_exact() {
            return Ok(Vec::new());
        }
        let text = match kernel {
            Counting::Surface => surface(&self.options),
            Counting::Curve => curve(&self.options),
            Counting::Choose(batch) => self.shaders.chooser(&self.kernels[batch]),
        };
        let segments = counters::segments(&self.options.faulty(text));
        let segments: Vec<Segment> = segments.map_err(|fault| self.device.fault(&fault.0))?;
        let buffers: Vec<Option<&wgpu::Buffer>> = match kernel {
            Counting::Surface => self.parts.iter().map(|p| p.counts.as_ref()).collect(),
            Counting::Curve => {
                self.curves.iter().flat_map(|c| &c.windows).map(|w| w.counts.as_ref()).collect()
            }
            Counting::Choose(batch) => {
                let batches = self.parts.iter().filter_map(|p| p.batches[batch].as_ref());
                batches.map(|b| b.chosen.as_ref()).collect()
            }
        };
        let mut all = Vec::new();
        for buffer in buffers.into_iter().flatten() {
            let words = readback::read(&self.device, buffer)?;
            all.extend(counters::read(&segments, &words, KERNEL_COUNTERS));
            let mut encoder = self.device.device.create_command_encoder(&Default::default());
            encoder.clear_buffer(buffer, 0, None);
            self.device.queue.submit([encoder.finish()]);
        }
        Ok(all)
    }
}

/// Kernels whose counts are read together.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub enum Counting {
    /// Areas, normals, seams, points turned along.
    Surface,
    /// Curves.
    Curve,
    /// What chooses the faces of a batch.
    Choose(usize),
}
