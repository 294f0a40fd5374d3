//! Paints yarn: passes put to work in order.

use super::camera::Camera;
use super::look::Look;
use super::parts::{self, NONE, Part};
use super::passes::{HALVES, LEVELS, Passes};
use super::picture::Picture;
use super::strands::Strands;
pub use super::targets::Canvas;
use super::uniforms::{Geometry, Setting};
use crate::Result;
use crate::backend::gpu::{Adapter, Device, DevicePoints, Maker, Readback};
use bytemuck::Pod;
use glam::DVec3;
use wgpu::BufferUsages;

/// Workgroups on an axis at most, whatever the adapter.
const MOST_GROUPS: u32 = 65_535;
/// Bytes between the settings of two levels, as adapters want dynamic offsets aligned.
const LEVEL_BYTES: u64 = 256;

/// A device that paints.
#[derive(Debug)]
pub struct Painter {
    device: Device,
    passes: Passes,
    most_points: usize,
}

/// Yarn on the device.
#[derive(Debug)]
pub struct Yarn {
    parts: Vec<OnDevice>,
    origin: DVec3,
    unit: f64,
    /// Box around it in units, and the largest radius.
    bounds: [DVec3; 2],
    radius: f64,
    points: usize,
    keep_volume: Option<bool>,
}

/// How much of a picture was drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// `[level]` segments (and ends) drawn, from the coarsest level to the finest.
    pub drawn: [u32; 4],
    /// The same for the shadow map.
    pub shadow: [u32; 4],
    /// Control points there are.
    pub points: usize,
}

/// A part, with its buffers.
#[derive(Debug)]
struct OnDevice {
    own: std::ops::Range<usize>,
    ghosts: Vec<u32>,
    points: u32,
    raw: wgpu::Buffer,
    colours: wgpu::Buffer,
    preparing: wgpu::Buffer,
    prepare: wgpu::BindGroup,
    /// From the camera and from the light.
    seen: [Seen; 2],
}

/// What of a part is seen from somewhere.
#[derive(Debug)]
struct Seen {
    draws: wgpu::Buffer,
    places: wgpu::Buffer,
    leaves: wgpu::Buffer,
    arrives: wgpu::Buffer,
    links: wgpu::Buffer,
    list: wgpu::Buffer,
    culling: wgpu::Buffer,
    yarn: wgpu::BindGroup,
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Level {
    steps: u32,
    around: u32,
    list: u32,
    backwards: u32,
    room: u32,
    faces: u32,
    unused: [u32; 58],
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
        let passes = Passes::new(&device)?;
        let limits = &device.limits;
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        // 16 bytes a point in the largest buffers; a little less for neighbours' points.
        let most_points = usize::try_from(most / 16).unwrap_or(usize::MAX).min(1 << 29) - 16;
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
        strands.check()?;
        let Some(bounds) = strands.bounds() else {
            return Err(crate::Error::invalid("found no yarn to draw, expected at least a point"));
        };
        let fixed = parts::fixed(strands);
        let sides = parts::sides(strands);
        let parts = parts::parts(strands, self.most_points);
        let parts = parts.iter().map(|p| self.part(p, &fixed, &sides)).collect::<Result<_>>()?;
        let radius = strands.radius.iter().copied().fold(0.0, f32::max);
        let mut yarn = Yarn {
            parts,
            origin: strands.origin,
            unit: strands.unit,
            bounds,
            radius: f64::from(radius),
            points: strands.points.len(),
            keep_volume: None,
        };
        self.put(&mut yarn, strands)?;
        Ok(yarn)
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
        let ([part], true) = (&yarn.parts[..], points.count == yarn.points) else {
            return Err(self.device.fault("found yarn in parts, or other yarn, expected that of the points"));
        };
        if points.device.device != self.device.device {
            return Err(self.device.fault("found points on another device"));
        }
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(points.buffer, 0, &part.raw, 0, Some(12 * points.count as u64));
        self.device.queue.submit([encoder.finish()]);
        (yarn.origin, yarn.unit) = (points.origin, points.unit);
        yarn.bounds = bounds.map(|p| (p - points.origin) / points.unit);
        yarn.keep_volume = None;
        self.device.check()
    }

    /// Gives yarn other places and colours: strands of the same yarns and radii.
    ///
    /// # Errors
    /// Another number of points; places that are not finite.
    pub fn update(&self, yarn: &mut Yarn, strands: &Strands) -> Result<()> {
        strands.check()?;
        if strands.points.len() != yarn.points {
            return Err(crate::Error::invalid(format_args!(
                "found {} points, expected the {} there are",
                strands.points.len(),
                yarn.points
            )));
        }
        (yarn.origin, yarn.unit) = (strands.origin, strands.unit);
        self.put(yarn, strands)
    }

    fn put(&self, yarn: &mut Yarn, strands: &Strands) -> Result<()> {
        let world = strands.bounds().unwrap_or([strands.origin; 2]);
        yarn.bounds = world.map(|p| (p - strands.origin) / strands.unit);
        for part in &yarn.parts {
            let queue = &self.device.queue;
            let own = &strands.points[part.own.clone()];
            queue.write_buffer(&part.raw, 0, bytemuck::cast_slice(own));
            let ghosts: Vec<[f32; 3]> = part.ghosts.iter().map(|g| strands.points[*g as usize]).collect();
            queue.write_buffer(&part.raw, 12 * own.len() as u64, bytemuck::cast_slice(&ghosts));
            let word = |c: &[u8; 3]| u32::from_le_bytes([c[0], c[1], c[2], 255]);
            let mut words: Vec<u32> = strands.colours[part.own.clone()].iter().map(word).collect();
            words.extend(part.ghosts.iter().map(|g| word(&strands.colours[*g as usize])));
            queue.write_buffer(&part.colours, 0, bytemuck::cast_slice(&words));
        }
        yarn.keep_volume = None;
        self.device.check()
    }

    fn part(&self, part: &Part, fixed: &[[f32; 4]], sides: &[[f32; 4]]) -> Result<OnDevice> {
        let maker = Maker(&self.device);
        let points = part.len();
        let empty = |name, bytes: usize| maker.storage(name, bytes as u64, BufferUsages::COPY_SRC);
        let raw = empty("control points", 12 * points)?;
        let links = maker.words("links", &part.links)?;
        let fixed = maker.words("yarn at rest", &part.gather(fixed))?;
        let places = empty("places", 16 * points)?;
        let leaves = empty("tangents", 16 * points)?;
        let arrives = empty("tangents", 16 * points)?;
        let sides = maker.words("sides", &part.gather(sides))?;
        let colours = empty("colours", 4 * points)?;
        let preparing = maker.uniform("preparing", &[0u32; 4]);
        let buffers = [&preparing, &raw, &links, &fixed, &places, &leaves, &arrives, &sides];
        let prepare = self.group("prepare", &self.passes.preparing, &buffers);
        let room = part.own.len() + part.ends;
        let seen = || -> Result<Seen> {
            let list = empty("list", 8 * room)?;
            let draws = maker.storage("draws", 80, BufferUsages::INDIRECT | BufferUsages::COPY_SRC)?;
            let level = |(i, [steps, around]): (usize, &[u32; 2])| Level {
                steps: *steps,
                around: *around,
                list: i as u32 / 2,
                backwards: i as u32 % 2,
                room: room as u32,
                faces: u32::from(i < HALVES),
                unused: [0; 58],
            };
            let levels: Vec<Level> = LEVELS.iter().enumerate().map(level).collect();
            let levels = maker.uniform::<[Level; 4]>(
                "levels",
                &levels.try_into().unwrap_or([bytemuck::Zeroable::zeroed(); 4]),
            );
            let binding = wgpu::BufferBinding { buffer: &levels, offset: 0, size: wgpu::BufferSize::new(24) };
            let mut resources = vec![wgpu::BindingResource::Buffer(binding)];
            let all = [&places, &leaves, &arrives, &sides, &links, &fixed, &colours, &list];
            resources.extend(all.map(|b| b.as_entire_binding()));
            let yarn = self.passes.group(&self.device, "yarn", &self.passes.yarn, &resources);
            let culling = [points as u32, part.own.len() as u32, room as u32, 4];
            Ok(Seen {
                draws,
                places: places.clone(),
                leaves: leaves.clone(),
                arrives: arrives.clone(),
                links: links.clone(),
                list,
                culling: maker.uniform("culling", &culling),
                yarn,
            })
        };
        Ok(OnDevice {
            own: part.own.clone(),
            ghosts: part.ghosts.clone(),
            points: points as u32,
            seen: [seen()?, seen()?],
            raw,
            colours,
            preparing,
            prepare,
        })
    }

    fn group(
        &self,
        name: &str,
        layout: &wgpu::BindGroupLayout,
        buffers: &[&wgpu::Buffer],
    ) -> wgpu::BindGroup {
        let resources: Vec<_> = buffers.iter().map(|b| b.as_entire_binding()).collect();
        self.passes.group(&self.device, name, layout, &resources)
    }

    /// Paints yarn; the picture stays on the device.
    ///
    /// # Errors
    /// A device that fails.
    pub fn paint(&self, canvas: &Canvas, yarn: &mut Yarn, camera: &Camera, look: &Look) -> Result<()> {
        let passes = look.samples.div_ceil(super::targets::SAMPLES).max(1);
        for pass in 0..passes {
            let setting = Setting {
                camera,
                look,
                size: canvas.size,
                origin: yarn.origin,
                unit: yarn.unit,
                bounds: yarn.bounds,
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
            self.prepare(&mut encoder, yarn, look.keep_volume);
            self.cull(&mut encoder, canvas, yarn);
            if look.shadows {
                self.depths(&mut encoder, &canvas.shadow, &self.passes.shadow, &canvas.light_group, yarn, 1);
            }
            self.depths(&mut encoder, &canvas.depth, &self.passes.depth, &canvas.eye_group, yarn, 0);
            self.finish(&mut encoder, canvas, yarn);
            self.device.queue.submit([encoder.finish()]);
        }
        self.device.check()
    }

    fn write<T: Pod>(&self, buffer: &wgpu::Buffer, value: &T) {
        self.device.queue.write_buffer(buffer, 0, bytemuck::bytes_of(value));
    }

    /// Points to cross-sections, where they changed.
    fn prepare(&self, encoder: &mut wgpu::CommandEncoder, yarn: &mut Yarn, keep_volume: bool) {
        if yarn.keep_volume == Some(keep_volume) {
            return;
        }
        yarn.keep_volume = Some(keep_volume);
        for part in &yarn.parts {
            self.write(&part.preparing, &[part.points, part.own.len() as u32, u32::from(keep_volume), 0]);
        }
        for pipeline in [&self.passes.prepare, &self.passes.twist] {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            for part in &yarn.parts {
                pass.set_bind_group(0, &part.prepare, &[]);
                dispatch(&mut pass, part.points);
            }
        }
    }

    /// Lists what is seen.
    fn cull(&self, encoder: &mut wgpu::CommandEncoder, canvas: &Canvas, yarn: &Yarn) {
        let counts: Vec<u32> =
            LEVELS.iter().flat_map(|[steps, around]| [6 * steps * around, 0, 0, 0, 0]).collect();
        for part in &yarn.parts {
            for seen in &part.seen {
                self.device.queue.write_buffer(&seen.draws, 0, bytemuck::cast_slice(&counts));
            }
        }
        for part in &yarn.parts {
            for (seen, eye) in part.seen.iter().zip([&canvas.eye, &canvas.from_light]) {
                let buffers = [
                    eye,
                    &seen.culling,
                    &seen.places,
                    &seen.leaves,
                    &seen.arrives,
                    &seen.links,
                    &seen.list,
                    &seen.draws,
                ];
                let group = self.group("cull", &self.passes.culling, &buffers);
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&self.passes.cull);
                pass.set_bind_group(0, &group, &[]);
                dispatch(&mut pass, part.own.len() as u32);
            }
        }
    }

    /// Depths of yarn as seen from somewhere.
    fn depths(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        pipeline: &wgpu::RenderPipeline,
        eye: &wgpu::BindGroup,
        yarn: &Yarn,
        which: usize,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("depths"),
            depth_stencil_attachment: Some(depth_attachment(view, wgpu::LoadOp::Clear(0.0))),
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, eye, &[]);
        self.draw(&mut pass, yarn, which);
    }

    /// All levels of what is seen from somewhere.
    fn draw(&self, pass: &mut wgpu::RenderPass, yarn: &Yarn, which: usize) {
        for part in &yarn.parts {
            let seen = &part.seen[which];
            for (level, indices) in self.passes.indices.iter().enumerate() {
                pass.set_bind_group(1, &seen.yarn, &[level as u32 * LEVEL_BYTES as u32]);
                pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed_indirect(&seen.draws, 20 * level as u64);
            }
        }
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
            pass.set_pipeline(&self.passes.shade);
            pass.set_bind_group(0, &canvas.eye_group, &[]);
            pass.set_bind_group(2, &canvas.shade_group, &[]);
            self.draw(&mut pass, yarn, 0);
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
        let mut counts = Counts { points: yarn.points, ..Counts::default() };
        for part in &yarn.parts {
            for (which, seen) in part.seen.iter().enumerate() {
                let back = Readback::new(&Maker(&self.device), 80);
                let mut encoder = self.device.device.create_command_encoder(&Default::default());
                back.copy(&mut encoder, &[(&seen.draws, 0, 80)]);
                self.device.queue.submit([encoder.finish()]);
                back.wait(&self.device, |bytes| {
                    let words: &[u32] = bytemuck::cast_slice(bytes);
                    let of = if which == 0 { &mut counts.drawn } else { &mut counts.shadow };
                    for (level, count) in of.iter_mut().enumerate() {
                        *count += words[5 * level + 1];
                    }
                })?;
            }
        }
        Ok(counts)
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

fn dispatch(pass: &mut wgpu::ComputePass, threads: u32) {
    let groups = threads.div_ceil(64).max(1);
    let rows = groups.div_ceil(MOST_GROUPS);
    pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
}

impl Yarn {
    /// The box around it, world units.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds.map(|p| self.origin + p * self.unit)
    }
}

const _: () = assert!(size_of::<Level>() as u64 == LEVEL_BYTES && NONE == u32::MAX);
