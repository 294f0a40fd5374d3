//! Curves on the device: sampled from control points where they lie, in as many buffers as shaders need to see them all.

use super::adapter::Device;
use super::buffers::Maker;
use super::layout::CurveSizes;
use super::pipeline::{Kind, bind_group, bind_group_layout, pipeline};
use super::readback::Readback;
use super::{GpuOptions, counting, shared};
use crate::Result;
use crate::backend::FrameOutput;
use crate::backend::gpu::exchange::vectors;
use crate::math::V3;
use crate::scene::Scene;
use std::ops::Range;
use wgpu::BufferUsages;

/// The samples of all yarns.
#[derive(Debug)]
pub(super) struct CurvesOnDevice {
    subdivide: usize,
    pub pipeline: wgpu::ComputePipeline,
    pub windows: Vec<Window>,
}

/// Those of some control points that follow each other.
#[derive(Debug)]
pub(super) struct Window {
    pub points: Range<u32>,
    pub group: wgpu::BindGroup,
    /// What is counted.
    pub counts: Option<wgpu::Buffer>,
    bytes: u64,
    buffer: wgpu::Buffer,
    back: Readback,
}

/// Bytes of samples at most: beyond, the CPU samples curves as they are written, which takes no memory.
const MOST_BYTES: u64 = 256 << 20;

impl CurvesOnDevice {
    /// Whether a scene's samples are few enough.
    pub fn fits(scene: &Scene, subdivide: usize) -> bool {
        12 * scene.yarns.first_sample(scene.yarns.len(), subdivide) as u64 <= MOST_BYTES
    }

    /// Room for a scene's curves; `points` holds its control points.
    pub fn new(
        device: &Device,
        scene: &Scene,
        options: &GpuOptions,
        points: &wgpu::Buffer,
        subdivide: usize,
    ) -> Result<Self> {
        let maker = Maker(device);
        let yarns = &scene.yarns;
        let words = [&yarns.offsets[..], &yarns.with_ends].concat();
        let topology = maker.words("yarns", &words)?;
        let module = shared::compile(device, options, "curve", counting::curve(options))?;
        let mut kinds = vec![Kind::Uniform, Kind::Read, Kind::Read, Kind::Write];
        kinds.extend(options.count.then_some(Kind::Write));
        let layout = bind_group_layout(device, "curve", &kinds);
        let count = yarns.point_count() as u32;
        let each = 12 * (subdivide as u64 + 1);
        let room = (maker.most(options) / each).clamp(1, u64::from(u32::MAX)) as u32;
        let mut windows = Vec::new();
        for begin in (0..count).step_by(room as usize) {
            let end = count.min(begin.saturating_add(room));
            let samples = yarns.sample_of(begin, subdivide)..yarns.sample_of(end, subdivide);
            let sizes = CurveSizes {
                yarns: yarns.len() as u32,
                begin,
                end,
                subdivide: subdivide as u32,
                step: (1.0 / (subdivide + 1) as f64) as f32,
                // Shaders' numbers wrap, so that only what is in the window need be below their limit.
                first_sample: samples.start as u32,
            };
            let bytes = 12 * samples.len() as u64;
            let buffer = maker.storage("curves", bytes, BufferUsages::COPY_SRC)?;
            let uniform = maker.uniform("curves", &sizes);
            let counts = counting::buffer(&maker, options, end - begin)?;
            let mut bound = vec![&uniform, &topology, points, &buffer];
            bound.extend(&counts);
            windows.push(Window {
                points: begin..end,
                group: bind_group(device, "curve", &layout, &bound),
                counts,
                back: Readback::new(&maker, bytes),
                bytes,
                buffer,
            });
        }
        let pipeline = pipeline(device, &layout, &module, "curve")?;
        device.check()?;
        Ok(Self { subdivide, pipeline, windows })
    }

    /// Extra points a segment.
    pub fn subdivide(&self) -> usize {
        self.subdivide
    }

    /// Has samples copied to where they come back.
    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder) {
        for window in &self.windows {
            window.back.copy(encoder, &[(&window.buffer, 0, window.bytes)]);
        }
    }

    /// Waits for a frame's samples.
    pub fn ready(&self, device: &Device) -> Result<()> {
        self.windows.iter().try_for_each(|window| window.back.ready(device))
    }

    /// Takes a frame's samples, which are ready; control points are among them.
    pub fn collect(&self, device: &Device, scene: &Scene, output: &mut FrameOutput<f32>) -> Result<()> {
        let samples = &mut output.curves.points;
        samples.clear();
        for window in &self.windows {
            window.back.take(device, |bytes| {
                let floats: &[f32] = bytemuck::cast_slice(&bytes[..window.bytes as usize]);
                samples.extend(vectors(floats));
            })?;
        }
        output.curves.subdivide = self.subdivide;
        let yarns = &scene.yarns;
        output.points.resize(yarns.point_count(), V3::zero());
        for yarn in 0..yarns.len() {
            let points = &mut output.points[yarns.range(yarn)];
            let sampled = samples[yarns.first_sample(yarn, self.subdivide)..].iter();
            for (point, sample) in points.iter_mut().zip(sampled.step_by(self.subdivide + 1)) {
                *point = *sample;
            }
        }
        Ok(())
    }
}
