//! The kernels that know no stitch type: surfaces, seams, sizes of dispatches.

use super::adapter::Device;
use super::pipeline::{Kind, bind_group_layout, pipeline};
use super::{GpuOptions, shader};
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
        let module = compile(device, options, "surface", shader::surface(options.workgroup))?;
        let surface_layout = bind_group_layout(device, "surface", &[Uniform, Write, Read, Write, Uniform]);
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
pub(super) fn compile(
    device: &Device,
    options: &GpuOptions,
    name: &str,
    text: String,
) -> Result<wgpu::ShaderModule> {
    let rolled = !options.own_shaders || device.software;
    shader::compile(&device.device, options.exact && device.exact, rolled, name, &options.faulty(text))
        .map_err(|fault| device.fault(&fault.0))
}
