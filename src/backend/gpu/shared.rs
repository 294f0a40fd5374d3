//! The kernels that know no stitch type: surfaces, seams, sizes of dispatches.

use super::adapter::Device;
use super::pipeline::{Kind, bind_group_layout, pipeline};
use super::shader::{self, How};
use super::{GpuOptions, counting};
use crate::Result;

/// Their pipelines.
#[derive(Debug)]
pub(super) struct SharedKernels {
    pub surface_layout: wgpu::BindGroupLayout,
    pub areas: wgpu::ComputePipeline,
    pub normals: wgpu::ComputePipeline,
    pub join: wgpu::ComputePipeline,
    pub carry: wgpu::ComputePipeline,
    pub arguments_layout: wgpu::BindGroupLayout,
    pub arguments: wgpu::ComputePipeline,
}

impl SharedKernels {
    pub fn new(device: &Device, options: &GpuOptions) -> Result<Self> {
        use Kind::{Read, Uniform, Write};
        let module = compile(device, options, "surface", counting::surface(options))?;
        let mut kinds = vec![Uniform, Write, Read, Write, Uniform];
        kinds.extend(options.count.then_some(Write));
        let surface_layout = bind_group_layout(device, "surface", &kinds);
        let [areas, normals, join, carry] = ["areas", "corner_normals", "join", "carry"]
            .map(|entry| pipeline(device, &surface_layout, &module, entry));
        let module = compile(device, options, "arguments", shader::arguments(options.workgroup))?;
        let arguments_layout = bind_group_layout(device, "arguments", &[Uniform, Read, Write]);
        Ok(Self {
            areas: areas?,
            normals: normals?,
            join: join?,
            carry: carry?,
            surface_layout,
            arguments: pipeline(device, &arguments_layout, &module, "arguments")?,
            arguments_layout,
        })
    }
}

/// A module of such kernels.
pub(crate) fn compile(
    device: &Device,
    options: &GpuOptions,
    name: &str,
    text: String,
) -> Result<wgpu::ShaderModule> {
    shader::compile(&device.device, how(device, options), name, &options.faulty(text))
        .map_err(|fault| device.fault(&fault.0))
}

/// How shaders are compiled for a device.
pub(super) fn how(device: &Device, options: &GpuOptions) -> How {
    How {
        exact: options.exact && device.exact,
        // Software would take minutes to unroll loops.
        rolled: !options.own_shaders || device.software,
        free: options.free,
    }
}
