//! A part of a scene on the device: all of it, unless that is more than shaders can see of a buffer.

use super::adapter::Device;
use super::buffers::{Maker, Places, SKIP_COUNTS, Topology};
use super::layout::{self, Lists, Settings, Turn};
use super::pipeline::bind_group;
use super::readback::Readback;
use super::shared::SharedKernels;
use super::slice::Slice;
use super::types::{Shaders, StitchType};
use super::{GpuOptions, counters, counting, trace};
use crate::Result;
use crate::backend::Running;
use crate::knot::{Kernel, Start};
use crate::scene::Scene;
use std::ops::Range;
use wgpu::BufferUsages;

/// The buffers that all batches of a part see.
#[derive(Debug)]
pub(super) struct Buffers {
    pub surface: wgpu::Buffer,
    pub topology: wgpu::Buffer,
    /// Control points, then sides of seams.
    pub points: wgpu::Buffer,
    pub knots: wgpu::Buffer,
    pub results: wgpu::Buffer,
    pub lists: wgpu::Buffer,
    pub shapes: wgpu::Buffer,
    pub known: wgpu::Buffer,
    pub dispatches: wgpu::Buffer,
    pub turn: wgpu::Buffer,
}

/// A part.
#[derive(Debug)]
pub(super) struct Part {
    pub slice: Slice,
    pub places: Places,
    pub buffers: Buffers,
    pub surface_group: wgpu::BindGroup,
    pub arguments_group: wgpu::BindGroup,
    /// What is counted of areas, normals, seams and points.
    pub counts: Option<wgpu::Buffer>,
    /// `[batch]`; none for a stitch without yarn, or with no face in this part.
    pub batches: Vec<Option<BatchOnDevice>>,
    pub readback: Readback,
}

/// What parts are made from.
pub(super) struct PartMaker<'a> {
    pub device: &'a Device,
    pub scene: &'a Scene,
    pub running: &'a Running,
    pub options: &'a GpuOptions,
    pub start: Start,
    pub kernels: &'a [Kernel<f32>],
    pub shared: &'a SharedKernels,
    pub shaders: &'a Shaders,
    pub types: &'a [Option<StitchType>],
}

impl PartMaker<'_> {
    pub fn part(&self, slice: Slice, topology: Topology) -> Result<Part> {
        let maker = Maker(self.device);
        let Topology { words, places } = topology;
        let sizes = places.sizes;
        let copied = BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let points = 12 * (u64::from(sizes.points) + u64::from(sizes.sides));
        let lists = 2 * self.scene.batches.len();
        let buffers = Buffers {
            surface: maker.storage("places and normals", 4 * places.surface, copied)?,
            topology: maker.words("topology", &words)?,
            points: maker.storage("control points", points, copied)?,
            knots: maker.storage("knots", 12 * places.knots, copied)?,
            results: maker.storage("results", 12 * places.faces, copied)?,
            lists: maker.storage("lists", 4 * places.lists, copied)?,
            shapes: maker.storage("shapes", 4 * places.shapes, copied)?,
            known: maker.storage("known shapes", 4 * places.known, copied)?,
            dispatches: maker.dispatches(lists),
            turn: maker.uniform("turn", &Turn::default()),
        };
        drop(words);
        let uniform = maker.uniform("sizes", &sizes);
        let threads = [sizes.faces, sizes.groups, sizes.seams, sizes.points + sizes.sides];
        let counts = counting::buffer(&maker, self.options, threads.into_iter().fold(0, u32::max))?;
        let mut bound = vec![&uniform, &buffers.surface, &buffers.topology, &buffers.points, &buffers.turn];
        bound.extend(&counts);
        let surface_group = bind_group(self.device, "surface", &self.shared.surface_layout, &bound);
        let uniform = maker.uniform("lists", &Lists { count: lists as u32, first_count: SKIP_COUNTS as u32 });
        let bound = [&uniform, &buffers.lists, &buffers.dispatches];
        let arguments_group = bind_group(self.device, "arguments", &self.shared.arguments_layout, &bound);
        let batches = (0..self.scene.batches.len()).map(|b| self.batch(b, &slice, &places, &buffers));
        let batches = batches.collect::<Result<_>>()?;
        let bytes = points + 12 * (places.knots + places.faces) + 4 * SKIP_COUNTS as u64;
        let readback = Readback::new(&maker, bytes);
        Ok(Part { slice, places, buffers, surface_group, arguments_group, counts, batches, readback })
    }

    fn batch(
        &self,
        b: usize,
        slice: &Slice,
        places: &Places,
        buffers: &Buffers,
    ) -> Result<Option<BatchOnDevice>> {
        let own = &slice.batches[b];
        let (Some(on_device), kernel) = (&self.types[b], &self.kernels[b]) else { return Ok(None) };
        if own.is_empty() {
            return Ok(None);
        }
        let weights = kernel.weights();
        let (place, sizes) = (&places.batches[b], &places.sizes);
        let settings = Settings {
            beta: kernel.beta().unwrap_or(1.0),
            weight_angle: weights.angle,
            weight_length: weights.length,
            nan: f32::NAN.to_bits(),
            iterations: kernel.iterations(),
            face_count: own.len() as u32,
            begin: 0,
            first_corner: place.corners,
            first_strand: place.strands,
            first_mesh_face: place.faces,
            first_face: place.first_face,
            first_knot: place.first_knot,
            point_count: sizes.points,
            given: 0,
            near: 0,
            way: layout::DIRECT,
            first_count: place.count,
            first_entry: place.entry,
            first_shape: place.shape,
            first_known: place.known,
            skip: 0,
            tolerance: (self.running.skip.tolerance * self.scene.yarn_radius) as f32,
            own: 0,
            from_previous: u32::from(self.start == Start::Previous),
            bent: sizes.bent,
            turned: sizes.turned,
            seen: places.seen,
            face_normals: sizes.vertices,
            group_normals: sizes.vertices + sizes.faces,
        };
        let maker = Maker(self.device);
        let uniforms = [maker.uniform("settings", &settings), maker.uniform("settings", &settings)];
        let words = match (self.options.trace, self.options.count) {
            (true, _) => Some(trace::words(&kernel.stencil)),
            (false, count) => count.then_some(counters::COUNTERS),
        };
        let storage = |words| maker.storage("trace", 4 * (words * own.len()) as u64, BufferUsages::COPY_SRC);
        let trace = words.map(storage).transpose()?;
        let Buffers { surface, topology, points, knots, results, lists, shapes, known, .. } = buffers;
        let StitchType { stencil, table, .. } = on_device;
        let stitch_groups = uniforms.each_ref().map(|uniform| {
            let mut bound = vec![stencil, uniform, surface, topology, points, knots, results, table, lists];
            bound.extend(&trace);
            bind_group(self.device, "stitch", &self.shaders.stitch_layout, &bound)
        });
        let chosen = counting::buffer(&maker, self.options, own.len() as u32)?;
        let mut bound = vec![stencil, &uniforms[0], surface, topology, shapes, knots, results, known, lists];
        bound.extend(&chosen);
        let choose_group = bind_group(self.device, "choose", &self.shaders.choose_layout, &bound);
        let made = BatchOnDevice { stitch_groups, choose_group, trace, chosen, uniforms, settings };
        made.write(&self.device.queue);
        Ok(Some(made))
    }
}

/// The faces of a batch that are in a part.
#[derive(Debug)]
pub(super) struct BatchOnDevice {
    /// For faces to be solved, and for those to be lifted only.
    pub stitch_groups: [wgpu::BindGroup; 2],
    pub choose_group: wgpu::BindGroup,
    /// What stages came to, or what is counted.
    pub trace: Option<wgpu::Buffer>,
    /// What is counted while faces are chosen.
    pub chosen: Option<wgpu::Buffer>,
    uniforms: [wgpu::Buffer; 2],
    settings: Settings,
}

impl BatchOnDevice {
    pub fn face_count(&self) -> u32 {
        self.settings.face_count
    }

    /// Tells the batch what a frame is like.
    pub fn tell(&mut self, queue: &wgpu::Queue, change: impl FnOnce(&mut Settings)) {
        let before = self.settings;
        change(&mut self.settings);
        if self.settings != before {
            self.write(queue);
        }
    }

    fn write(&self, queue: &wgpu::Queue) {
        queue.write_buffer(&self.uniforms[0], 0, bytemuck::bytes_of(&self.settings));
        let lifted = Settings { way: layout::LIFT_LIST, ..self.settings };
        queue.write_buffer(&self.uniforms[1], 0, bytemuck::bytes_of(&lifted));
    }
}

impl Part {
    /// Batch `b`'s faces among results: in the part, and in the scene.
    pub fn result_ranges(&self, scene: &Scene, b: usize) -> [Range<usize>; 2] {
        let own = &self.slice.batches[b];
        let here = self.places.batches[b].first_face as usize;
        let there = scene.batches[b].first_face + own.start;
        [here..here + own.len(), there..there + own.len()]
    }

    /// Batch `b`'s knots: in the part, and in the scene.
    pub fn knot_ranges(&self, scene: &Scene, b: usize) -> [Range<usize>; 2] {
        let own = &self.slice.batches[b];
        let batch = &scene.batches[b];
        let k = scene.stencils[batch.stencil].knot_count();
        let here = self.places.batches[b].first_knot as usize;
        let there = batch.first_knot + own.start * k;
        [here..here + own.len() * k, there..there + own.len() * k]
    }
}
