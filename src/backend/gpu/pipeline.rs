//! Pipelines, and the buffers that are bound to them.

use super::adapter::Device;
use crate::Result;

/// What a shader does with a buffer.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Uniform,
    Read,
    Write,
}

pub(crate) fn bind_group_layout(device: &Device, name: &str, kinds: &[Kind]) -> wgpu::BindGroupLayout {
    let entry = |(binding, kind): (usize, &Kind)| wgpu::BindGroupLayoutEntry {
        binding: binding as u32,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: match kind {
                Kind::Uniform => wgpu::BufferBindingType::Uniform,
                Kind::Read => wgpu::BufferBindingType::Storage { read_only: true },
                Kind::Write => wgpu::BufferBindingType::Storage { read_only: false },
            },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let entries: Vec<_> = kinds.iter().enumerate().map(entry).collect();
    device
        .device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(name), entries: &entries })
}

pub(crate) fn bind_group(
    device: &Device,
    name: &str,
    layout: &wgpu::BindGroupLayout,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let resources = buffers.iter().enumerate().map(|(i, b)| (i as u32, b.as_entire_binding()));
    let entries: Vec<_> =
        resources.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    device.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(name),
        layout,
        entries: &entries,
    })
}

/// A pipeline; what is wrong with its shader is an error here, not later.
pub(crate) fn pipeline(
    device: &Device,
    layout: &wgpu::BindGroupLayout,
    module: &wgpu::ShaderModule,
    entry: &str,
) -> Result<wgpu::ComputePipeline> {
    let layout = device.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let scope = device.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let pipeline = device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&layout),
        module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions {
            zero_initialize_workgroup_memory: false,
            ..Default::default()
        },
        cache: None,
    });
    match pollster::block_on(scope.pop()) {
        Some(fault) => Err(device.fault(&fault.to_string())),
        None => Ok(pipeline),
    }
}
