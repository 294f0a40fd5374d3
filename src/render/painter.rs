//! Paints yarn: passes put to work in order.

use super::camera::Camera;
use super::look::Look;
use super::passes::{Fault, Passes};
use super::picture::Picture;
use super::strands::Strands;
use super::targets::{Canvas, SAMPLES};
use super::uniforms::{Geometry, Setting};
use super::yarn::{Counts, Viewpoint, Yarn};
use crate::Result;
use crate::backend::gpu::{Adapter, Device, DevicePoints, Maker, Readback};
use bytemuck::Pod;
use glam::DVec3;

/// A device that paints.
#[derive(Debug)]
pub struct Painter {
    device: Device,
    passes: Passes,
    most_points: usize,
}

impl Painter {
    /// Opens an adapter for painting.
    ///
    /// # Errors
    /// A device that cannot be opened or refuses a shader.
    pub fn open(adapter: &Adapter) -> Result<Self> {
        Self::on(adapter.open()?)
    }

    /// Paints on a device that is open.
    pub(crate) fn on(device: Device) -> Result<Self> {
        Self::new(device, None)
    }

    /// The same with a text in the shaders exchanged for another, to see that tests find what is wrong with it.
    #[doc(hidden)]
    pub fn with_fault(adapter: &Adapter, fault: Fault) -> Result<Self> {
        Self::new(adapter.open()?, Some(fault))
    }

    fn new(device: Device, fault: Option<Fault>) -> Result<Self> {
        let passes = Passes::new(&device, fault)?;
        let limits = &device.limits;
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        // 16 bytes a point in the largest buffers; a little less for neighbours' points. Lists have 28 bits for a point.
        let most_points = usize::try_from(most / 16).unwrap_or(usize::MAX).min(1 << 28) - 16;
        Ok(Self { device, passes, most_points })
    }

    /// The same with parts of so many points at most, to test them.
    #[doc(hidden)]
    pub fn with_parts_of(mut self, points: usize) -> Self {
        self.most_points = points.min(self.most_points);
        self
    }

    /// Something to paint on, of so many pixels across and down.
    ///
    /// # Errors
    /// More pixels than the adapter's textures have; a device without room.
    pub fn canvas(&self, width: u32, height: u32) -> Result<Canvas> {
        Canvas::new(&self.device, &self.passes, [width, height])
    }

    /// Brings yarn onto the device.
    ///
    /// # Errors
    /// Strands whose parts do not fit each other ([`Strands::check`]), without points, or more than the device has room for.
    pub fn yarn(&self, strands: &Strands) -> Result<Yarn> {
        Yarn::new(&self.device, &self.passes, strands, self.most_points)
    }

    /// Paints on the device on which a backend solves, so that its control points need not leave it.
    ///
    /// # Errors
    /// A device that refuses a shader.
    pub fn beside(points: &DevicePoints) -> Result<Self> {
        Self::on(points.device.clone())
    }

    /// Gives yarn the places of a backend's last frame, from device to device. `bounds` is a box (world units) around all of it.
    ///
    /// # Errors
    /// Points on another device than this painter's, or of other yarn; yarn that is in several parts.
    pub fn take(&self, yarn: &mut Yarn, points: &DevicePoints, bounds: [DVec3; 2]) -> Result<()> {
        yarn.take(&self.device, points, bounds)
    }

    /// Gives yarn other places and colours: strands of the same yarns and radii.
    ///
    /// # Errors
    /// Another number of points; places that are not finite.
    pub fn update(&self, yarn: &mut Yarn, strands: &Strands) -> Result<()> {
        yarn.update(&self.device, strands)
    }

    /// Paints yarn; the picture stays on the device.
    ///
    /// # Errors
    /// A device that fails.
    pub fn paint(&self, canvas: &Canvas, yarn: &mut Yarn, camera: &Camera, look: &Look) -> Result<()> {
        let passes = look.samples.div_ceil(SAMPLES).max(1);
        for pass in 0..passes {
            let setting = Setting {
                camera,
                look,
                size: canvas.size,
                origin: yarn.origin,
                unit: yarn.unit,
                bounds: yarn.box_in_units,
                radius: yarn.radius,
                shadow_size: canvas.shadow_size,
                pass: [pass, passes],
            };
            let geometry = Geometry::new(&setting);
            self.write(&canvas.eye, &geometry.eye);
            self.write(&canvas.from_light, &geometry.from_light);
            self.write(&canvas.light, &geometry.light);
            self.write(&canvas.developing, &[pass, passes, 0, 0]);
            let mut encoder = self.device.device.create_command_encoder(&Default::default());
            yarn.prepare(&self.device, &self.passes, &mut encoder, look.keep_volume);
            yarn.cull(&self.device, &self.passes, &mut encoder, canvas);
            if look.shadows {
                self.depths(&mut encoder, canvas, yarn, Viewpoint::Light);
            }
            self.depths(&mut encoder, canvas, yarn, Viewpoint::Camera);
            self.finish(&mut encoder, canvas, yarn);
            self.device.queue.submit([encoder.finish()]);
        }
        self.device.check()
    }

    fn write<T: Pod>(&self, buffer: &wgpu::Buffer, value: &T) {
        self.device.queue.write_buffer(buffer, 0, bytemuck::bytes_of(value));
    }

    /// Depths of yarn as seen from somewhere.
    fn depths(&self, encoder: &mut wgpu::CommandEncoder, canvas: &Canvas, yarn: &Yarn, from: Viewpoint) {
        let (view, pipeline, eye) = match from {
            Viewpoint::Camera => (&canvas.depth, &self.passes.depth, &canvas.eye_group),
            Viewpoint::Light => (&canvas.shadow, &self.passes.shadow, &canvas.light_group),
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("depths"),
            depth_stencil_attachment: Some(depth_attachment(view, wgpu::LoadOp::Clear(0.0))),
            ..Default::default()
        });
        pass.set_bind_group(0, eye, &[]);
        yarn.draw(&self.passes, &mut pass, [pipeline; 2], from);
    }

    /// Occlusion, shading, development.
    fn finish(&self, encoder: &mut wgpu::CommandEncoder, canvas: &Canvas, yarn: &Yarn) {
        let groups = canvas.size.map(|n| n.div_ceil(8));
        let over_pixels = |encoder: &mut wgpu::CommandEncoder, pipeline, group: &wgpu::BindGroup| {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        };
        over_pixels(encoder, &self.passes.occlude, &canvas.occlude_group);
        over_pixels(encoder, &self.passes.smooth, &canvas.smooth_group);
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shade"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &canvas.colour,
                    depth_slice: None,
                    resolve_target: Some(&canvas.resolved),
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Discard,
                    },
                })],
                depth_stencil_attachment: Some(depth_attachment(&canvas.depth, wgpu::LoadOp::Load)),
                ..Default::default()
            });
            pass.set_bind_group(0, &canvas.eye_group, &[]);
            pass.set_bind_group(2, &canvas.shade_group, &[]);
            yarn.draw(&self.passes, &mut pass, self.passes.shade.each_ref(), Viewpoint::Camera);
        }
        over_pixels(encoder, &self.passes.develop, &canvas.develop_group);
    }

    /// The picture that was painted last.
    ///
    /// # Errors
    /// A device that fails.
    pub fn picture(&self, canvas: &Canvas) -> Result<Picture> {
        let [width, height] = canvas.size;
        let row = (4 * width).next_multiple_of(256);
        let back = Readback::new(&Maker(&self.device), u64::from(row) * u64::from(height));
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        back.copy_picture(&mut encoder, &canvas.picture, row);
        self.device.queue.submit([encoder.finish()]);
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        back.wait(&self.device, |bytes| {
            for line in bytes.chunks_exact(row as usize).take(height as usize) {
                pixels.extend_from_slice(bytemuck::cast_slice(&line[..4 * width as usize]));
            }
        })?;
        Ok(Picture { width, height, pixels })
    }

    /// How much the last picture drew.
    ///
    /// # Errors
    /// A device that fails.
    pub fn counts(&self, yarn: &Yarn) -> Result<Counts> {
        yarn.counts(&self.device)
    }
}

fn depth_attachment(
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<f32>,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}
