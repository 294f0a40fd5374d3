//! A stitch type's faces on the device.

use super::adapter::Device;
use super::buffers::{Maker, Places};
use super::layout::{self, Counts, Settings, Variant};
use super::pipeline::{Kind, bind_group, bind_group_layout, pipeline};
use super::{GpuOptions, counters, shader, trace};
use crate::Result;
use crate::backend::Running;
use crate::knot::table::Grid;
use crate::knot::{Kernel, Start};
use crate::scene::Scene;
use std::collections::HashMap;
use std::sync::Arc;
use wgpu::BufferUsages;

/// Buffers that all batches see.
pub(super) struct Shared<'a> {
    pub surface: &'a wgpu::Buffer,
    pub topology: &'a wgpu::Buffer,
    pub points: &'a wgpu::Buffer,
    pub knots: &'a wgpu::Buffer,
    pub results: &'a wgpu::Buffer,
    pub lists: &'a wgpu::Buffer,
    pub shapes: &'a wgpu::Buffer,
    pub known: &'a wgpu::Buffer,
}

/// A batch on the device.
#[derive(Debug)]
pub(super) struct BatchOnDevice {
    pub stitch: wgpu::ComputePipeline,
    pub choose: wgpu::ComputePipeline,
    /// For faces to be solved, and for those to be lifted only.
    pub stitch_groups: [wgpu::BindGroup; 2],
    pub choose_group: wgpu::BindGroup,
    /// What stages came to, or what is counted.
    pub trace: Option<wgpu::Buffer>,
    pub segments: Option<Arc<Vec<counters::Segment>>>,
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

/// Makes batches; shaders of the same text are compiled once.
pub(super) struct BatchMaker<'a> {
    pub device: &'a Device,
    pub scene: &'a Scene,
    pub running: &'a Running,
    pub options: &'a GpuOptions,
    pub start: Start,
    pub shared: Shared<'a>,
    pub places: &'a Places,
    stitch_layout: wgpu::BindGroupLayout,
    choose_layout: wgpu::BindGroupLayout,
    no_table: wgpu::Buffer,
    most: Counts,
    grid: Option<Grid>,
    own: bool,
    exact: bool,
    compiled: HashMap<String, wgpu::ComputePipeline>,
}

impl<'a> BatchMaker<'a> {
    pub fn new(
        device: &'a Device,
        scene: &'a Scene,
        (running, options, start): (&'a Running, &'a GpuOptions, Start),
        shared: Shared<'a>,
        places: &'a Places,
        kernels: &[Kernel<f32>],
    ) -> Result<Self> {
        use Kind::{Read, Uniform, Write};
        let mut kinds = vec![Read, Uniform, Read, Read, Write, Write, Write, Read, Read];
        if options.trace || options.count {
            kinds.push(Write);
        }
        Ok(Self {
            stitch_layout: bind_group_layout(device, "stitch", &kinds),
            choose_layout: bind_group_layout(
                device,
                "choose",
                &[Read, Uniform, Read, Read, Write, Write, Write, Read, Write],
            ),
            no_table: Maker(device).words("no table", &[0.0f32])?,
            most: kernels.iter().map(Counts::new).fold(Counts::default(), Counts::max),
            grid: kernels.iter().find_map(|k| k.table().map(|t| *t.grid())),
            exact: options.exact && device.exact,
            compiled: HashMap::new(),
            own: options.own_shaders,
            device,
            scene,
            running,
            options,
            start,
            shared,
            places,
        })
    }

    /// The pipeline of a shader's text.
    fn pipeline(&mut self, text: String, key: &str, entry: &str) -> Result<wgpu::ComputePipeline> {
        if let Some(pipeline) = self.compiled.get(&text) {
            return Ok(pipeline.clone());
        }
        let faulty = self.options.faulty(text.clone());
        let module = shader::compile(&self.device.device, self.exact, !self.own, key, &faulty)
            .map_err(|fault| self.device.fault(&fault.0))?;
        let layout = if entry == "stitch" { &self.stitch_layout } else { &self.choose_layout };
        let made = pipeline(self.device, layout, &module, entry)?;
        self.compiled.insert(text, made.clone());
        Ok(made)
    }

    /// Batch `b` of the scene; none for a stitch without yarn.
    pub fn batch(&mut self, b: usize, kernel: &Kernel<f32>) -> Result<Option<BatchOnDevice>> {
        let batch = &self.scene.batches[b];
        if kernel.stencil.points.is_empty() {
            return Ok(None);
        }
        let key = self.scene.templates[batch.stencil].key();
        let table = kernel.table().filter(|_| kernel.solves());
        let counts = Counts::new(kernel);
        let room = if self.own { counts } else { self.most };
        let grid = self.grid;
        let variant = Variant {
            room,
            own: self.own,
            grid: grid.as_ref().filter(|_| !self.own || table.is_some()),
            spaced: kernel.beta().is_some(),
            energies: self.running.energies,
            trace: self.options.trace,
            count: self.options.count,
        };
        let size = self.options.workgroup;
        let text = shader::stitch(&variant, size);
        let segments = match variant.count && !variant.trace {
            true => Some(counters::segments(&self.options.faulty(text.clone()))),
            false => None,
        };
        let segments = segments.transpose().map_err(|fault| self.device.fault(&fault.0))?.map(Arc::new);
        let stitch = self.pipeline(text, &key, "stitch")?;
        let choose = self.pipeline(shader::select(&variant, size), &key, "choose")?;

        let weights = kernel.weights();
        let place = &self.places.batches[b];
        let sizes = &self.places.sizes;
        let settings = Settings {
            beta: kernel.beta().unwrap_or(1.0),
            weight_angle: weights.angle,
            weight_length: weights.length,
            nan: f32::NAN.to_bits(),
            iterations: kernel.iterations(),
            face_count: batch.faces.len() as u32,
            begin: 0,
            first_corner: place.corners,
            first_strand: place.strands,
            first_mesh_face: place.faces,
            first_face: batch.first_face as u32,
            first_knot: batch.first_knot as u32,
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
            seen: self.places.seen,
            face_normals: sizes.vertices,
            group_normals: sizes.vertices + sizes.faces,
        };
        let maker = Maker(self.device);
        let uniforms = [maker.uniform("settings", &settings), maker.uniform("settings", &settings)];
        let stencil = maker.words("stencil", &layout::words(kernel, &room))?;
        let table = match table {
            Some(table) => &maker.words("table", &layout::table_words(table))?,
            None => &self.no_table,
        };
        let words = match (self.options.trace, self.options.count) {
            (true, _) => Some(trace::words(&kernel.stencil)),
            (false, count) => count.then_some(counters::COUNTERS),
        };
        let storage =
            |words| maker.storage("trace", 4 * (words * batch.faces.len()) as u64, BufferUsages::COPY_SRC);
        let trace = words.map(storage).transpose()?;
        let Shared { surface, topology, points, knots, results, lists, shapes, known } = &self.shared;
        let stitch_groups = uniforms.each_ref().map(|uniform| {
            let mut bound = vec![&stencil, uniform, surface, topology, points, knots, results, table, lists];
            bound.extend(&trace);
            bind_group(self.device, "stitch", &self.stitch_layout, &bound)
        });
        let bound = [&stencil, &uniforms[0], surface, topology, shapes, knots, results, known, lists];
        let choose_group = bind_group(self.device, "choose", &self.choose_layout, &bound);
        let made = BatchOnDevice {
            stitch,
            choose,
            stitch_groups,
            choose_group,
            trace,
            segments,
            uniforms,
            settings,
        };
        made.write(&self.device.queue);
        Ok(Some(made))
    }
}
