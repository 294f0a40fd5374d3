//! The kernels of fabrics, and the order in which a frame runs them.

use super::buffers::Buffers;
use super::layout::FabricSettings;
use super::{GpuYarn, shader};
use crate::Result;
use crate::backend::gpu::{
    Device, Kind, MOST_GROUPS, Timer, bind_group, bind_group_layout, compile, pipeline,
};

/// What a frame consists of, pass by pass.
pub const PASSES: [&str; 3] = ["forms", "frames", "yarn"];

/// A kernel and what it is dispatched over.
#[derive(Debug)]
struct Kernel {
    pipeline: wgpu::ComputePipeline,
    threads: u32,
}

/// Pass by pass.
#[derive(Debug)]
pub struct Kernels {
    passes: [(wgpu::BindGroup, Vec<Kernel>); PASSES.len()],
    workgroup: u32,
}

impl Kernels {
    pub fn new(
        device: &Device,
        running: &GpuYarn,
        buffers: &Buffers,
        settings: &FabricSettings,
    ) -> Result<Self> {
        use Kind::{Read, Uniform, Write};
        let size = running.device.workgroup;
        let pass = |i: usize, text: String, all: &[(Kind, &wgpu::Buffer)], entries: &[(&str, u32)]| {
            let name = PASSES[i];
            let module = compile(device, &running.device, name, text)?;
            let (kinds, buffers): (Vec<_>, Vec<_>) = all.iter().copied().unzip();
            let layout = bind_group_layout(device, name, &kinds);
            let kernel = |(entry, threads): &(&str, u32)| {
                Ok(Kernel { pipeline: pipeline(device, &layout, &module, entry)?, threads: *threads })
            };
            let kernels: Result<Vec<_>> = entries.iter().map(kernel).collect();
            Ok((bind_group(device, name, &layout, &buffers), kernels?))
        };
        let b = buffers;
        let forms = [
            (Uniform, &b.settings),
            (Read, &b.places),
            (Read, &b.mesh),
            (Write, &b.face_forms),
            (Write, &b.node_forms),
            (Read, &b.nodes),
            (Read, &b.shares),
            (Read, &b.fits),
        ];
        let frames = [
            (Uniform, &b.settings),
            (Read, &b.places),
            (Read, &b.mesh),
            (Read, &b.node_forms),
            (Write, &b.frames),
            (Write, &b.changes),
            (Read, &b.seen),
        ];
        let yarn = [
            (Uniform, &b.settings),
            (Read, &b.pattern),
            (Read, &b.maps),
            (Read, &b.frames),
            (Read, &b.changes),
            (Read, &b.homes),
            (Write, &b.yarn_places),
            (Write, &b.points),
            (Write, &b.counts),
        ];
        let FabricSettings { faces, nodes, homes, .. } = *settings;
        let passes = [
            pass(0, shader::forms(size), &forms, &[("of_faces", faces), ("of_nodes", nodes)])?,
            pass(1, shader::frames(size), &frames, &[("frames_of_faces", faces)])?,
            pass(2, shader::yarn(size), &yarn, &[("yarn", homes)])?,
        ];
        Ok(Self { passes, workgroup: size })
    }

    /// Everything from places to points.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, timer: Option<&Timer>) {
        for (i, (group, kernels)) in self.passes.iter().enumerate() {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(PASSES[i]),
                timestamp_writes: timer.map(|t| t.writes(i)),
            });
            pass.set_bind_group(0, group, &[]);
            for kernel in kernels.iter().filter(|k| k.threads > 0) {
                let groups = kernel.threads.div_ceil(self.workgroup);
                let across = groups.min(MOST_GROUPS);
                pass.set_pipeline(&kernel.pipeline);
                pass.dispatch_workgroups(across, groups.div_ceil(across), 1);
            }
        }
        if let Some(timer) = timer {
            timer.resolve(encoder);
        }
    }
}
