//! What a picture is painted on: textures and buffers of its size.

use super::passes::Passes;
use super::uniforms::{Eye, Light};
use crate::Result;
use crate::backend::gpu::Device;
use wgpu::{BufferUsages, TextureFormat, TextureUsages};

/// Samples a pixel of one pass.
pub const SAMPLES: u32 = 4;
pub const COLOUR: TextureFormat = TextureFormat::Rgba16Float;
pub const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// Something to paint on.
#[derive(Debug)]
pub struct Canvas {
    pub(super) size: [u32; 2],
    pub(super) colour: wgpu::TextureView,
    pub(super) resolved: wgpu::TextureView,
    pub(super) depth: wgpu::TextureView,
    pub(super) shadow: wgpu::TextureView,
    pub(super) shadow_size: u32,
    pub(super) picture: wgpu::Texture,
    pub(super) eye: wgpu::Buffer,
    pub(super) from_light: wgpu::Buffer,
    pub(super) light: wgpu::Buffer,
    pub(super) developing: wgpu::Buffer,
    pub(super) eye_group: wgpu::BindGroup,
    pub(super) light_group: wgpu::BindGroup,
    pub(super) occlude_group: wgpu::BindGroup,
    pub(super) smooth_group: wgpu::BindGroup,
    pub(super) shade_group: wgpu::BindGroup,
    pub(super) develop_group: wgpu::BindGroup,
}

impl Canvas {
    pub(super) fn new(device: &Device, passes: &Passes, size: [u32; 2]) -> Result<Self> {
        let most = device.limits.max_texture_dimension_2d;
        if size.contains(&0) || size.iter().any(|n| *n > most) {
            return Err(device.fault(&format!(
                "found a picture of {} x {} pixels, expected 1 to {most} each way",
                size[0], size[1]
            )));
        }
        // Finer where the picture is.
        let shadow_size = (2 * size[0].max(size[1])).next_power_of_two().clamp(1024, 4096).min(most);
        let texture = |name, size: [u32; 2], samples, format, usage| {
            device.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(name),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: samples,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: if format == TextureFormat::Rgba8Unorm {
                    &[TextureFormat::Rgba8UnormSrgb]
                } else {
                    &[]
                },
            })
        };
        let view = |t: &wgpu::Texture| t.create_view(&Default::default());
        let attachment = TextureUsages::RENDER_ATTACHMENT;
        let bound = TextureUsages::TEXTURE_BINDING;
        let stored = TextureUsages::STORAGE_BINDING;
        let colour = view(&texture("colour", size, SAMPLES, COLOUR, attachment));
        let resolved = view(&texture("resolved", size, 1, COLOUR, attachment | bound));
        let depth = view(&texture("depth", size, SAMPLES, DEPTH, attachment | bound));
        let shadow = view(&texture("shadow", [shadow_size; 2], 1, DEPTH, attachment | bound));
        let [rough, smooth] = ["rough occlusion", "occlusion"]
            .map(|name| view(&texture(name, size, 1, TextureFormat::R32Float, bound | stored)));
        let picture =
            texture("picture", size, 1, TextureFormat::Rgba8Unorm, stored | bound | TextureUsages::COPY_SRC);
        let buffer = |name, bytes: usize, usage| {
            device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(name),
                size: bytes as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let uniform = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let eye = buffer("eye", size_of::<Eye>(), uniform);
        let from_light = buffer("from the light", size_of::<Eye>(), uniform);
        let light = buffer("light", size_of::<Light>(), uniform);
        let developing = buffer("developing", 16, uniform);
        let pixels = size[0] as usize * size[1] as usize;
        let sums = buffer("sums", 16 * pixels, BufferUsages::STORAGE);
        let whole = |b: &'_ wgpu::Buffer| b.clone();
        let group = |name: &str, layout: &wgpu::BindGroupLayout, entries: &[wgpu::BindingResource]| {
            passes.group(device, name, layout, entries)
        };
        let (eye_whole, from_light_whole, light_whole) = (whole(&eye), whole(&from_light), whole(&light));
        let texture_of = wgpu::BindingResource::TextureView;
        let picture_view = view(&picture);
        let made = Self {
            size,
            eye_group: group("eye", &passes.eye, &[eye_whole.as_entire_binding()]),
            light_group: group("from the light", &passes.eye, &[from_light_whole.as_entire_binding()]),
            occlude_group: group(
                "occlude",
                &passes.occlusion,
                &[
                    light_whole.as_entire_binding(),
                    texture_of(&depth),
                    texture_of(&rough),
                    // Not read in this pass: any other texture will do.
                    texture_of(&resolved),
                ],
            ),
            smooth_group: group(
                "smooth",
                &passes.occlusion,
                &[
                    light_whole.as_entire_binding(),
                    texture_of(&depth),
                    texture_of(&smooth),
                    texture_of(&rough),
                ],
            ),
            shade_group: group(
                "shade",
                &passes.lighting,
                &[
                    light_whole.as_entire_binding(),
                    texture_of(&shadow),
                    wgpu::BindingResource::Sampler(&passes.compare),
                    texture_of(&smooth),
                    texture_of(&passes.fibres),
                    wgpu::BindingResource::Sampler(&passes.repeat),
                ],
            ),
            develop_group: group(
                "develop",
                &passes.developing,
                &[
                    light_whole.as_entire_binding(),
                    developing.as_entire_binding(),
                    texture_of(&resolved),
                    sums.as_entire_binding(),
                    texture_of(&picture_view),
                ],
            ),
            colour,
            resolved,
            depth,
            shadow,
            shadow_size,
            picture,
            eye,
            from_light,
            light,
            developing,
        };
        device.check()?;
        Ok(made)
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The texture with the last picture: 8 bits a channel, sRGB (as a view of that format shows it).
    pub fn texture(&self) -> &wgpu::Texture {
        &self.picture
    }
}
