//! Pipelines of all passes, and what is bound to them.

use super::colour::{DIVERGING, linear};
use super::fibre;
use super::targets::{COLOUR, DEPTH, SAMPLES};
use crate::Result;
use crate::backend::gpu::Device;
use std::cell::Cell;
use wgpu::{BufferBindingType, ShaderStages, TextureSampleType};

/// How finely a level is drawn: steps along a segment (or, at the first, along several that are one), sides of its tube.
pub const LEVELS: [[u32; 2]; 5] = [[1, 2], [2, 2], [3, 4], [4, 16], [8, 32]];
/// How many levels, from the first, are the halves of tubes that face the eye.
pub const HALVES: usize = 3;
/// The first level at which plies are seen.
pub const NEAR: usize = 2;

/// A text in the shaders, and what stands for it.
pub type Fault<'a> = [&'a str; 2];

#[derive(Debug)]
pub struct Passes {
    pub eye: wgpu::BindGroupLayout,
    pub preparing: wgpu::BindGroupLayout,
    pub culling: wgpu::BindGroupLayout,
    pub yarn: wgpu::BindGroupLayout,
    pub occlusion: wgpu::BindGroupLayout,
    pub lighting: wgpu::BindGroupLayout,
    pub developing: wgpu::BindGroupLayout,
    pub prepare: wgpu::ComputePipeline,
    pub twist: wgpu::ComputePipeline,
    pub cull: wgpu::ComputePipeline,
    pub shadow: wgpu::RenderPipeline,
    pub depth: wgpu::RenderPipeline,
    pub occlude: wgpu::ComputePipeline,
    pub smooth: wgpu::ComputePipeline,
    /// Of yarn of a pixel or less (the levels before [`NEAR`]), and of all other.
    pub shade: [wgpu::RenderPipeline; 2],
    pub develop: wgpu::ComputePipeline,
    pub fibres: wgpu::TextureView,
    pub compare: wgpu::Sampler,
    pub repeat: wgpu::Sampler,
    /// `[level]` indices of its triangles.
    pub indices: [wgpu::Buffer; LEVELS.len()],
}

/// What is bound: a binding's stages and kind.
type Entry = (ShaderStages, wgpu::BindingType);

fn uniform(stages: ShaderStages, dynamic: bool) -> Entry {
    let ty = BufferBindingType::Uniform;
    (stages, wgpu::BindingType::Buffer { ty, has_dynamic_offset: dynamic, min_binding_size: None })
}

fn storage(stages: ShaderStages, read_only: bool) -> Entry {
    let ty = BufferBindingType::Storage { read_only };
    (stages, wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None })
}

fn texture(stages: ShaderStages, sample_type: TextureSampleType, multisampled: bool) -> Entry {
    let view_dimension = wgpu::TextureViewDimension::D2;
    (stages, wgpu::BindingType::Texture { sample_type, view_dimension, multisampled })
}

fn written(format: wgpu::TextureFormat) -> Entry {
    let (access, view_dimension) = (wgpu::StorageTextureAccess::WriteOnly, wgpu::TextureViewDimension::D2);
    (ShaderStages::COMPUTE, wgpu::BindingType::StorageTexture { access, format, view_dimension })
}

/// Makes layouts and pipelines.
struct Maker<'a> {
    device: &'a Device,
    fault: Option<Fault<'a>>,
    /// Whether a shader had the fault's text.
    faulty: Cell<bool>,
}

impl Maker<'_> {
    fn layout(&self, name: &str, entries: &[Entry]) -> wgpu::BindGroupLayout {
        let entry = |(binding, (visibility, ty)): (usize, &Entry)| wgpu::BindGroupLayoutEntry {
            binding: binding as u32,
            visibility: *visibility,
            ty: *ty,
            count: None,
        };
        let entries: Vec<_> = entries.iter().enumerate().map(entry).collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(name), entries: &entries };
        self.device.device.create_bind_group_layout(&descriptor)
    }

    fn module(&self, name: &str, parts: &[&str]) -> wgpu::ShaderModule {
        let mut text = parts.concat();
        if let Some([from, to]) = self.fault.filter(|[from, _]| text.contains(from)) {
            text = text.replace(from, to);
            self.faulty.set(true);
        }
        let source = wgpu::ShaderSource::Wgsl(text.into());
        self.device.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(name), source })
    }

    fn pipeline_layout(&self, groups: &[&wgpu::BindGroupLayout]) -> wgpu::PipelineLayout {
        let groups: Vec<_> = groups.iter().map(|g| Some(*g)).collect();
        let descriptor =
            wgpu::PipelineLayoutDescriptor { label: None, bind_group_layouts: &groups, immediate_size: 0 };
        self.device.device.create_pipeline_layout(&descriptor)
    }

    fn compute(
        &self,
        module: &wgpu::ShaderModule,
        entry: &str,
        groups: &[&wgpu::BindGroupLayout],
    ) -> wgpu::ComputePipeline {
        self.device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: Some(&self.pipeline_layout(groups)),
            module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            cache: None,
        })
    }

    /// Draws tubes: depth alone, or colours where depth is what it was.
    fn draw(
        &self,
        module: &wgpu::ShaderModule,
        [vertex, fragment]: [Option<&str>; 2],
        groups: &[&wgpu::BindGroupLayout],
        samples: u32,
    ) -> wgpu::RenderPipeline {
        let target = [Some(wgpu::ColorTargetState {
            format: COLOUR,
            blend: None,
            write_mask: wgpu::ColorWrites::ALL,
        })];
        self.device.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: vertex,
            layout: Some(&self.pipeline_layout(groups)),
            vertex: wgpu::VertexState {
                module,
                entry_point: vertex,
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { cull_mode: Some(wgpu::Face::Back), ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(fragment.is_none()),
                depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
            fragment: fragment.map(|entry| wgpu::FragmentState {
                module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                targets: &target,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

impl Passes {
    /// # Errors
    /// What is wrong with a shader; a fault whose text none of them has.
    pub fn new(device: &Device, fault: Option<Fault>) -> Result<Self> {
        let scope = device.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let maker = Maker { device, fault, faulty: Cell::new(fault.is_none()) };
        let made = Self::make(&maker);
        match pollster::block_on(scope.pop()) {
            Some(fault) => Err(device.fault(&fault.to_string())),
            None if !maker.faulty.get() => Err(device.fault("no shader has the text of the fault")),
            None => Ok(made),
        }
    }

    fn make(maker: &Maker) -> Self {
        let device = maker.device;
        let (compute, vertex, fragment) =
            (ShaderStages::COMPUTE, ShaderStages::VERTEX, ShaderStages::FRAGMENT);
        let float = TextureSampleType::Float { filterable: true };
        let unfiltered = TextureSampleType::Float { filterable: false };
        let read = |stages| storage(stages, true);
        let write = storage(compute, false);
        let eye = maker.layout("eye", &[uniform(compute | vertex | fragment, false)]);
        let preparing = maker.layout(
            "prepare",
            &[
                uniform(compute, false),
                read(compute),
                read(compute),
                read(compute),
                write,
                write,
                write,
                write,
            ],
        );
        let culling = maker.layout(
            "cull",
            &[
                uniform(compute, false),
                read(compute),
                read(compute),
                read(compute),
                read(compute),
                write,
                write,
            ],
        );
        let mut entries = vec![uniform(vertex, true)];
        entries.extend([read(vertex); 8]);
        let yarn = maker.layout("yarn", &entries);
        let depths = |stages, many| texture(stages, TextureSampleType::Depth, many);
        let occlusion = maker.layout(
            "occlusion",
            &[
                uniform(compute, false),
                depths(compute, true),
                written(wgpu::TextureFormat::R32Float),
                texture(compute, unfiltered, false),
            ],
        );
        let sampler = |ty| (fragment, wgpu::BindingType::Sampler(ty));
        let lighting = maker.layout(
            "lighting",
            &[
                uniform(fragment, false),
                depths(fragment, false),
                sampler(wgpu::SamplerBindingType::Comparison),
                texture(fragment, unfiltered, false),
                texture(fragment, float, false),
                sampler(wgpu::SamplerBindingType::Filtering),
            ],
        );
        let developing = maker.layout(
            "develop",
            &[
                uniform(compute, false),
                uniform(compute, false),
                texture(compute, unfiltered, false),
                write,
                written(wgpu::TextureFormat::Rgba8Unorm),
            ],
        );

        let eye_text = include_str!("../../shaders/yarn_eye.wgsl");
        let light_text = include_str!("../../shaders/yarn_light.wgsl");
        let tube_text = include_str!("../../shaders/yarn_tube.wgsl");
        let prepare = maker.module("prepare", &[include_str!("../../shaders/yarn_prepare.wgsl")]);
        let cull = maker.module("cull", &[eye_text, include_str!("../../shaders/yarn_cull.wgsl")]);
        let depth =
            maker.module("depth", &[eye_text, tube_text, include_str!("../../shaders/yarn_depth.wgsl")]);
        let occlusion_text = include_str!("../../shaders/yarn_occlusion.wgsl")
            .replace("DEPTH", "texture_depth_multisampled_2d");
        let occlude = maker.module("occlusion", &[light_text, &occlusion_text]);
        let fibre_levels = fibre::levels();
        let shade_text = include_str!("../../shaders/yarn_shade.wgsl")
            .replace("DIVERGING", &diverging())
            .replace("MEAN", &mean(&fibre_levels));
        let shade = maker.module("shade", &[eye_text, light_text, tube_text, &shade_text]);
        let develop = maker.module("develop", &[light_text, include_str!("../../shaders/yarn_develop.wgsl")]);

        let by_linear = wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        };
        let repeat = device.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("fibres"),
            address_mode_u: wgpu::AddressMode::Repeat,
            address_mode_v: wgpu::AddressMode::Repeat,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            ..by_linear.clone()
        });
        let compare = device.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow"),
            compare: Some(wgpu::CompareFunction::GreaterEqual),
            ..by_linear
        });
        Self {
            prepare: maker.compute(&prepare, "prepare", &[&preparing]),
            twist: maker.compute(&prepare, "twist", &[&preparing]),
            cull: maker.compute(&cull, "cull", &[&eye, &culling]),
            shadow: maker.draw(&depth, [Some("depth_vertex"), None], &[&eye, &yarn], 1),
            depth: maker.draw(&depth, [Some("depth_vertex"), None], &[&eye, &yarn], SAMPLES),
            occlude: maker.compute(&occlude, "occlude", &[&occlusion]),
            smooth: maker.compute(&occlude, "smooth_out", &[&occlusion]),
            shade: ["shade_far", "shade"].map(|fragment| {
                let groups = [&eye, &yarn, &lighting];
                maker.draw(&shade, [Some("shade_vertex"), Some(fragment)], &groups, SAMPLES)
            }),
            develop: maker.compute(&develop, "develop_picture", &[&developing]),
            fibres: fibres(device, &fibre_levels),
            compare,
            repeat,
            indices: LEVELS.map(|level| indices(device, level)),
            eye,
            preparing,
            culling,
            yarn,
            occlusion,
            lighting,
            developing,
        }
    }

    pub fn group(
        &self,
        device: &Device,
        name: &str,
        layout: &wgpu::BindGroupLayout,
        resources: &[wgpu::BindingResource],
    ) -> wgpu::BindGroup {
        let numbered = (0..).zip(resources.iter().cloned());
        let entries: Vec<_> =
            numbered.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some(name), layout, entries: &entries };
        device.device.create_bind_group(&descriptor)
    }
}

/// The stops of the map of stretch to colours, as light.
fn diverging() -> String {
    let stop = |c: &[u8; 3]| {
        let [r, g, b] = c.map(linear);
        format!("vec3<f32>({r:?}, {g:?}, {b:?})")
    };
    DIVERGING.iter().map(stop).collect::<Vec<_>>().join(", ")
}

/// How open and how light the periodic map is in the mean.
fn mean(levels: &[Vec<[u8; 4]>]) -> String {
    let [_, _, open, tone] =
        levels.last().and_then(|l| l.first()).copied().unwrap_or([255; 4]).map(|v| f32::from(v) / 255.0);
    format!("{open:?}, {tone:?}")
}

/// Triangles of rings, looking outwards.
fn indices(device: &Device, [steps, around]: [u32; 2]) -> wgpu::Buffer {
    let mut indices = Vec::new();
    for ring in 0..steps {
        for spoke in 0..around {
            let a = ring * (around + 1) + spoke;
            let c = a + around + 1;
            indices.extend([a, a + 1, c, a + 1, c + 1, c]);
        }
    }
    let buffer = device.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("indices"),
        size: 4 * indices.len() as u64,
        usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    device.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&indices));
    buffer
}

/// The periodic map, with its halvings.
fn fibres(device: &Device, levels: &[Vec<[u8; 4]>]) -> wgpu::TextureView {
    let [width, height] = fibre::SIZE;
    let texture = device.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("fibres"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (mip_level, texels) in levels.iter().enumerate() {
        let [width, height] = [width, height].map(|n| (n >> mip_level).max(1));
        let to = wgpu::TexelCopyTextureInfo { mip_level: mip_level as u32, ..texture.as_image_copy() };
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None };
        let extent = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        device.queue.write_texture(to, texels.as_flattened(), layout, extent);
    }
    texture.create_view(&Default::default())
}
