//! Yarn on the device: its buffers, in parts where they would not fit, and the passes that run over them.

use super::parts::{self, NONE, Part};
use super::passes::{HALVES, LEVELS, NEAR, Passes};
use super::strands::Strands;
use super::targets::Canvas;
use crate::backend::gpu::{Device, DevicePoints, Maker, Readback};
use crate::{Error, Result};
use glam::DVec3;
use wgpu::BufferUsages;

/// Workgroups on an axis at most, whatever the adapter.
const MOST_GROUPS: u32 = 65_535;
/// Bytes between the settings of two levels, as adapters want dynamic offsets aligned.
const LEVEL_BYTES: u64 = 256;
const DRAWS_BYTES: u64 = 20 * LEVELS.len() as u64;

/// Yarn on the device.
#[derive(Debug)]
pub struct Yarn {
    parts: Vec<OnDevice>,
    pub(super) origin: DVec3,
    pub(super) unit: f64,
    /// Box around it in units, and the largest radius.
    pub(super) box_in_units: [DVec3; 2],
    pub(super) radius: f64,
    points: usize,
    keep_volume: Option<bool>,
}

/// How much of a picture was drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// `[level]` tubes (and ends) drawn, from the coarsest level to the finest; at the coarsest, a tube may stand for several segments.
    pub drawn: [u32; LEVELS.len()],
    /// The same for the shadow map.
    pub shadow: [u32; LEVELS.len()],
    /// Control points there are.
    pub points: usize,
}

/// From where yarn is seen.
#[derive(Clone, Copy)]
pub enum Viewpoint {
    Camera,
    Light,
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
    cull: wgpu::BindGroup,
    tubes: wgpu::BindGroup,
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

impl Level {
    fn all(room: usize) -> [Self; LEVELS.len()] {
        std::array::from_fn(|i| {
            let [steps, around] = LEVELS[i];
            let (list, backwards) = (i as u32 / 2, i as u32 % 2);
            Self {
                steps,
                around,
                list,
                backwards,
                room: room as u32,
                faces: u32::from(i < HALVES),
                unused: [0; 58],
            }
        })
    }
}

/// Buffers as they are bound, whole.
fn whole<'a>(buffers: &[&'a wgpu::Buffer]) -> Vec<wgpu::BindingResource<'a>> {
    buffers.iter().map(|b| b.as_entire_binding()).collect()
}

impl OnDevice {
    fn new(
        device: &Device,
        passes: &Passes,
        part: &Part,
        fixed: &[[f32; 4]],
        sides: &[[f32; 4]],
    ) -> Result<Self> {
        let maker = Maker(device);
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
        let room = part.own.len() + part.ends;
        let culling = maker.uniform("culling", &[part.own.len() as u32, room as u32, 0, 0]);
        let levels = maker.uniform("levels", &Level::all(room));
        let group =
            |name, layout, resources: &[wgpu::BindingResource]| passes.group(device, name, layout, resources);
        let seen = || -> Result<Seen> {
            let pairs = LEVELS.len().div_ceil(2);
            let list = empty("list", 4 * pairs * room)?;
            let draws =
                maker.storage("draws", DRAWS_BYTES, BufferUsages::INDIRECT | BufferUsages::COPY_SRC)?;
            let cull = whole(&[&culling, &places, &leaves, &arrives, &links, &list, &draws]);
            let binding = wgpu::BufferBinding { buffer: &levels, offset: 0, size: wgpu::BufferSize::new(24) };
            let mut tubes = vec![wgpu::BindingResource::Buffer(binding)];
            tubes.extend(whole(&[&places, &leaves, &arrives, &sides, &links, &fixed, &colours, &list]));
            Ok(Seen {
                cull: group("cull", &passes.culling, &cull),
                tubes: group("tubes", &passes.yarn, &tubes),
                draws,
            })
        };
        let prepare = whole(&[&preparing, &raw, &links, &fixed, &places, &leaves, &arrives, &sides]);
        Ok(Self {
            own: part.own.clone(),
            ghosts: part.ghosts.clone(),
            points: points as u32,
            seen: [seen()?, seen()?],
            prepare: group("prepare", &passes.preparing, &prepare),
            raw,
            colours,
            preparing,
        })
    }

    fn put(&self, queue: &wgpu::Queue, strands: &Strands) {
        let own = &strands.points[self.own.clone()];
        queue.write_buffer(&self.raw, 0, bytemuck::cast_slice(own));
        let ghosts: Vec<[f32; 3]> = self.ghosts.iter().map(|g| strands.points[*g as usize]).collect();
        queue.write_buffer(&self.raw, 12 * own.len() as u64, bytemuck::cast_slice(&ghosts));
        let word = |c: &[u8; 3]| u32::from_le_bytes([c[0], c[1], c[2], 255]);
        let mut words: Vec<u32> = strands.colours[self.own.clone()].iter().map(word).collect();
        words.extend(self.ghosts.iter().map(|g| word(&strands.colours[*g as usize])));
        queue.write_buffer(&self.colours, 0, bytemuck::cast_slice(&words));
    }
}

impl Yarn {
    /// Brings strands onto the device, in parts of so many points at most.
    pub(super) fn new(
        device: &Device,
        passes: &Passes,
        strands: &Strands,
        most_points: usize,
    ) -> Result<Self> {
        strands.check()?;
        if strands.points.is_empty() {
            return Err(Error::invalid("found no yarn to draw, expected at least a point"));
        }
        let (fixed, sides) = (parts::fixed(strands), parts::sides(strands));
        let parts = parts::parts(strands, most_points);
        let parts =
            parts.iter().map(|p| OnDevice::new(device, passes, p, &fixed, &sides)).collect::<Result<_>>()?;
        let mut yarn = Self {
            parts,
            origin: strands.origin,
            unit: strands.unit,
            box_in_units: [DVec3::ZERO; 2],
            radius: f64::from(strands.radius.iter().copied().fold(0.0, f32::max)),
            points: strands.points.len(),
            keep_volume: None,
        };
        yarn.put(device, strands)?;
        Ok(yarn)
    }

    /// The box around it, world units.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.box_in_units.map(|p| self.origin + p * self.unit)
    }

    pub(super) fn update(&mut self, device: &Device, strands: &Strands) -> Result<()> {
        strands.check()?;
        if strands.points.len() != self.points {
            return Err(Error::invalid(format_args!(
                "found {} points, expected the {} there are",
                strands.points.len(),
                self.points
            )));
        }
        self.put(device, strands)
    }

    fn put(&mut self, device: &Device, strands: &Strands) -> Result<()> {
        (self.origin, self.unit) = (strands.origin, strands.unit);
        let world = strands.bounds().unwrap_or([strands.origin; 2]);
        self.box_in_units = world.map(|p| (p - strands.origin) / strands.unit);
        self.parts.iter().for_each(|part| part.put(&device.queue, strands));
        self.keep_volume = None;
        device.check()
    }

    pub(super) fn take(&mut self, device: &Device, points: &DevicePoints, bounds: [DVec3; 2]) -> Result<()> {
        let ([part], true) = (&self.parts[..], points.count == self.points) else {
            return Err(device.fault("found yarn in parts, or other yarn, expected that of the points"));
        };
        if points.device.device != device.device {
            return Err(device.fault("found points on another device"));
        }
        let mut encoder = device.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(points.buffer, 0, &part.raw, 0, Some(12 * points.count as u64));
        device.queue.submit([encoder.finish()]);
        (self.origin, self.unit) = (points.origin, points.unit);
        self.box_in_units = bounds.map(|p| (p - points.origin) / points.unit);
        self.keep_volume = None;
        device.check()
    }

    /// Points to cross-sections, where they changed.
    pub(super) fn prepare(
        &mut self,
        device: &Device,
        passes: &Passes,
        encoder: &mut wgpu::CommandEncoder,
        keep_volume: bool,
    ) {
        if self.keep_volume == Some(keep_volume) {
            return;
        }
        self.keep_volume = Some(keep_volume);
        for part in &self.parts {
            let settings = [part.points, u32::from(keep_volume), 0, 0];
            device.queue.write_buffer(&part.preparing, 0, bytemuck::bytes_of(&settings));
        }
        for pipeline in [&passes.prepare, &passes.twist] {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            for part in &self.parts {
                pass.set_bind_group(0, &part.prepare, &[]);
                dispatch(&mut pass, part.points);
            }
        }
    }

    /// Lists what is seen.
    pub(super) fn cull(
        &self,
        device: &Device,
        passes: &Passes,
        encoder: &mut wgpu::CommandEncoder,
        canvas: &Canvas,
    ) {
        let draws = |[steps, around]: &[u32; 2]| [6 * steps * around, 0, 0, 0, 0];
        let draws: Vec<u32> = LEVELS.iter().flat_map(draws).collect();
        for seen in self.parts.iter().flat_map(|part| &part.seen) {
            device.queue.write_buffer(&seen.draws, 0, bytemuck::cast_slice(&draws));
        }
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&passes.cull);
        for part in &self.parts {
            for (seen, eye) in part.seen.iter().zip([&canvas.eye_group, &canvas.light_group]) {
                pass.set_bind_group(0, eye, &[]);
                pass.set_bind_group(1, &seen.cull, &[]);
                dispatch(&mut pass, (part.own.len() as u32).div_ceil(parts::RUN as u32));
            }
        }
    }

    /// All levels of what is seen from somewhere; those before [`NEAR`] by the first of two pipelines.
    pub(super) fn draw(
        &self,
        passes: &Passes,
        pass: &mut wgpu::RenderPass,
        pipelines: [&wgpu::RenderPipeline; 2],
        from: Viewpoint,
    ) {
        for (level, indices) in passes.indices.iter().enumerate() {
            pass.set_pipeline(pipelines[usize::from(level >= NEAR)]);
            pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            for part in &self.parts {
                let seen = &part.seen[from as usize];
                pass.set_bind_group(1, &seen.tubes, &[level as u32 * LEVEL_BYTES as u32]);
                pass.draw_indexed_indirect(&seen.draws, 20 * level as u64);
            }
        }
    }

    pub(super) fn counts(&self, device: &Device) -> Result<Counts> {
        let mut counts = Counts { points: self.points, ..Counts::default() };
        for part in &self.parts {
            for (seen, of) in part.seen.iter().zip([&mut counts.drawn, &mut counts.shadow]) {
                let back = Readback::new(&Maker(device), DRAWS_BYTES);
                let mut encoder = device.device.create_command_encoder(&Default::default());
                back.copy(&mut encoder, &[(&seen.draws, 0, DRAWS_BYTES)]);
                device.queue.submit([encoder.finish()]);
                back.wait(device, |bytes| {
                    let words: &[u32] = bytemuck::cast_slice(bytes);
                    of.iter_mut().zip(words.chunks_exact(5)).for_each(|(count, draw)| *count += draw[1]);
                })?;
            }
        }
        Ok(counts)
    }
}

fn dispatch(pass: &mut wgpu::ComputePass, threads: u32) {
    let groups = threads.div_ceil(64).max(1);
    let rows = groups.div_ceil(MOST_GROUPS);
    pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
}

const _: () = assert!(size_of::<Level>() as u64 == LEVEL_BYTES && NONE == u32::MAX);
