//! The GPU backend: a thread a stitch, a dispatch a stitch type. The f32 CPU backend is its twin, stage by stage and, where
//! shaders run as they are written, bit by bit.

mod adapter;
mod buffers;
mod exact;
pub mod layout;
mod readback;
pub mod shader;
pub mod trace;

pub use adapter::{Adapter, AdapterReport};

use super::surface::Surface;
use super::{Backend, FrameOutput, GIVEN, Running, Skipped, Tables, kernels, unsolved};
use crate::Result;
use crate::knot::{FaceResult, Kernel, KnotState, Settings, Start, Status};
use crate::math::{V2, V3};
use crate::scene::Scene;
use adapter::Device;
use buffers::{Maker, Topology};
use glam::DVec3;
use layout::{Counts, KnotWords, ResultWords, Sizes, Variant};
use readback::Readback;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use wgpu::BufferUsages;

/// Workgroups that a dispatch has at most on an axis, whatever the adapter.
const MOST_GROUPS: u32 = 65_535;

/// How the device is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpuOptions {
    /// Threads that work side by side; the result does not depend on it.
    pub workgroup: u32,
    /// Whether shaders run with their sums as they are written, where the device can; else as its compiler sees fit.
    pub exact: bool,
    /// Whether each shape of stitch type has a shader of its own, with all counts known to the compiler, or one shader
    /// serves all; unless told, the former on hardware, the latter on software, which compiles slowly.
    pub own_shaders: Option<bool>,
    /// Whether stages are kept for [`GpuBackend::trace`].
    pub trace: bool,
    /// Seed of an order in which stitch types are dispatched; 0 is their own. The result does not depend on it.
    pub order: u64,
    /// A text in the shaders and what stands there instead: a fault, to see that comparisons find it.
    #[doc(hidden)]
    pub fault: Option<(&'static str, &'static str)>,
}

impl Default for GpuOptions {
    fn default() -> Self {
        Self {
            workgroup: shader::WORKGROUP,
            exact: true,
            own_shaders: None,
            trace: false,
            order: 0,
            fault: None,
        }
    }
}

impl GpuOptions {
    /// A shader's text, with the fault that is asked for.
    fn faulty(&self, text: String) -> String {
        match self.fault {
            Some((from, to)) => text.replace(from, to),
            None => text,
        }
    }
}

/// A batch on the device.
#[derive(Debug)]
struct BatchOnDevice {
    pipeline: wgpu::ComputePipeline,
    bind_group: wgpu::BindGroup,
    uniform: wgpu::Buffer,
    settings: layout::Settings,
    trace: Option<wgpu::Buffer>,
}

/// Runs scenes on a GPU, in f32.
#[derive(Debug)]
pub struct GpuBackend {
    scene: Arc<Scene>,
    device: Device,
    options: GpuOptions,
    kernels: Vec<Kernel<f32>>,
    tables: Tables,
    start: Start,
    running: Running,
    surface: Surface<f32>,
    sizes: Sizes,
    surface_buffer: wgpu::Buffer,
    points: wgpu::Buffer,
    knots: wgpu::Buffer,
    results: wgpu::Buffer,
    areas: wgpu::ComputePipeline,
    normals: wgpu::ComputePipeline,
    join: wgpu::ComputePipeline,
    surface_group: wgpu::BindGroup,
    /// `[batch]`; none for a stitch without yarn.
    batches: Vec<Option<BatchOnDevice>>,
    readback: Readback,
    name: u64,
    stamp: u64,
}

impl GpuBackend {
    /// A backend for a scene on an adapter; `cache` is a folder in which tables are kept.
    ///
    /// # Errors
    /// Settings out of range; a device that cannot be opened, lacks room or refuses a shader.
    pub fn new(
        scene: Arc<Scene>,
        settings: &Settings,
        running: &Running,
        options: &GpuOptions,
        adapter: &Adapter,
        cache: Option<&Path>,
    ) -> Result<Self> {
        super::check(settings, running)?;
        let device = adapter.open()?;
        let exact = options.exact && device.exact;
        let (kernels, tables) = kernels::<f32>(&scene, settings, running, cache);
        let Topology { words, sizes, batches: places } = Topology::new(&scene)?;
        let maker = Maker(&device);
        let topology = maker.words("topology", &words)?;
        drop(words);
        let places_and_normals = 12 * u64::from(sizes.vertices + sizes.faces + sizes.groups);
        let copied = BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let surface_buffer = maker.storage("places and normals", places_and_normals, copied)?;
        let points = maker.storage(
            "control points",
            12 * (u64::from(sizes.points) + 2 * u64::from(sizes.seams)),
            copied,
        )?;
        let knots = maker.storage("knots", 12 * scene.knot_count as u64, copied)?;
        let results = maker.storage("results", 12 * scene.face_count as u64, copied)?;

        let own = options.own_shaders.unwrap_or(!adapter.report().is_software());
        let text = options.faulty(shader::surface(options.workgroup));
        let module = shader::compile(&device.device, exact, !own, "surface", &text)
            .map_err(|fault| device.fault(&fault.0))?;
        let kinds = [Kind::Uniform, Kind::Write, Kind::Read, Kind::Write];
        let layout = bind_group_layout(&device, "surface", &kinds);
        let sizes_buffer = maker.uniform("sizes", &sizes);
        let surface_group =
            bind_group(&device, "surface", &layout, &[&sizes_buffer, &surface_buffer, &topology, &points]);
        let [areas, normals, join] =
            ["areas", "corner_normals", "join"].map(|entry| pipeline(&device, &layout, &module, entry));
        let (areas, normals, join) = (areas?, normals?, join?);

        let mut kinds = vec![Kind::Read, Kind::Uniform, Kind::Read, Kind::Read];
        kinds.extend([Kind::Write, Kind::Write, Kind::Write, Kind::Read]);
        if options.trace {
            kinds.push(Kind::Write);
        }
        let layout = bind_group_layout(&device, "stitch", &kinds);
        let most = kernels.iter().map(Counts::new).fold(Counts::default(), Counts::max);
        let grid = kernels.iter().find_map(|k| k.table().map(|t| *t.grid()));
        let no_table = maker.words("no table", &[0.0f32])?;
        let mut compiled: HashMap<String, wgpu::ComputePipeline> = HashMap::new();
        let mut batches = Vec::with_capacity(scene.batches.len());
        for ((batch, kernel), [corners, strands]) in scene.batches.iter().zip(&kernels).zip(places) {
            if kernel.stencil.points.is_empty() {
                batches.push(None);
                continue;
            }
            let table = kernel.table().filter(|_| kernel.solves());
            let counts = Counts::new(kernel);
            let room = if own { counts } else { most };
            let variant = Variant {
                room,
                own,
                grid: grid.as_ref().filter(|_| !own || table.is_some()),
                spaced: kernel.beta().is_some(),
                energies: running.energies,
                trace: options.trace,
            };
            let text = options.faulty(shader::stitch(&variant, options.workgroup));
            let pipeline = match compiled.get(&text) {
                Some(pipeline) => pipeline.clone(),
                None => {
                    let key = scene.templates[batch.stencil].key();
                    let module = shader::compile(&device.device, exact, !own, &key, &text)
                        .map_err(|fault| device.fault(&fault.0))?;
                    let made = pipeline(&device, &layout, &module, "stitch")?;
                    compiled.insert(text, made.clone());
                    made
                }
            };
            let weights = kernel.weights();
            let settings = layout::Settings {
                beta: kernel.beta().unwrap_or(1.0),
                weight_angle: weights.angle,
                weight_length: weights.length,
                nan: f32::NAN.to_bits(),
                iterations: kernel.iterations(),
                face_count: batch.faces.len() as u32,
                begin: 0,
                first_corner: corners,
                first_strand: strands,
                first_face: batch.first_face as u32,
                first_knot: batch.first_knot as u32,
                point_count: sizes.points,
                given: 0,
                near: 0,
            };
            let uniform = maker.uniform("settings", &settings);
            let stencil = maker.words("stencil", &layout::words(kernel, &room))?;
            let table = match table {
                Some(table) => &maker.words("table", &layout::table_words(table))?,
                None => &no_table,
            };
            let trace = match options.trace {
                true => {
                    let words = trace::words(&kernel.stencil) * batch.faces.len();
                    Some(maker.storage("trace", 4 * words as u64, BufferUsages::COPY_SRC)?)
                }
                false => None,
            };
            let mut bound =
                vec![&stencil, &uniform, &surface_buffer, &topology, &points, &knots, &results, table];
            bound.extend(&trace);
            let bind_group = bind_group(&device, "stitch", &layout, &bound);
            batches.push(Some(BatchOnDevice { pipeline, bind_group, uniform, settings, trace }));
        }
        let bytes = [points.size(), knots.size(), results.size()];
        let readback = Readback::new(&maker, bytes.iter().sum());
        device.check()?;
        Ok(Self {
            scene,
            options: *options,
            kernels,
            tables,
            start: settings.start,
            running: *running,
            surface: Surface::default(),
            sizes,
            surface_buffer,
            points,
            knots,
            results,
            areas,
            normals,
            join,
            surface_group,
            batches,
            readback,
            name: super::STAMPS.fetch_add(1, Relaxed),
            stamp: 0,
            device,
        })
    }

    /// What became of the stitch types' tables.
    pub fn tables(&self) -> &Tables {
        &self.tables
    }

    /// Whether shaders run with their sums as they are written.
    pub fn is_exact(&self) -> bool {
        self.options.exact && self.device.exact
    }

    /// What the stages of a batch's stitches came to in the last frame, if [`GpuOptions::trace`] asked for it:
    /// `[face][word]`, see [`trace::stages`].
    ///
    /// # Errors
    /// A device that fails.
    pub fn trace(&self, batch: usize) -> Result<Vec<f32>> {
        let Some(buffer) = self.batches[batch].as_ref().and_then(|b| b.trace.as_ref()) else {
            return Ok(Vec::new());
        };
        readback::read(&self.device, buffer)
    }

    /// The places of vertices, the areas of faces and the normals of corner groups of the last frame, each x, y, z.
    ///
    /// # Errors
    /// A device that fails.
    pub fn surface(&self) -> Result<Vec<V3<f32>>> {
        let words = readback::read(&self.device, &self.surface_buffer)?;
        let count = (self.sizes.vertices + self.sizes.faces + self.sizes.groups) as usize;
        Ok(vectors(&words).take(count).collect())
    }

    /// The two sides of each seam in the last frame, before they were averaged.
    ///
    /// # Errors
    /// A device that fails.
    pub fn sides(&self) -> Result<Vec<V3<f32>>> {
        let words = readback::read(&self.device, &self.points)?;
        Ok(vectors(&words).skip(self.sizes.points as usize).take(2 * self.sizes.seams as usize).collect())
    }

    /// The starts that somebody gave, or that an earlier output of this backend holds.
    fn give(&self, output: &FrameOutput<f32>, continued: bool) -> bool {
        let own = output.backend == self.name || output.backend == GIVEN;
        if self.start != Start::Previous || !own {
            return false;
        }
        if !continued {
            let words: Vec<KnotWords> = output.knots.iter().map(|k| knot_words(*k)).collect();
            self.device.queue.write_buffer(&self.knots, 0, bytemuck::cast_slice(&words));
        }
        true
    }

    fn tell(&mut self, given: bool, near: bool) {
        let queue = &self.device.queue;
        for batch in self.batches.iter_mut().flatten() {
            let settings =
                layout::Settings { given: u32::from(given), near: u32::from(near), ..batch.settings };
            if settings != batch.settings {
                batch.settings = settings;
                queue.write_buffer(&batch.uniform, 0, bytemuck::bytes_of(&settings));
            }
        }
    }

    fn dispatch(&self, pass: &mut wgpu::ComputePass, pipeline: &wgpu::ComputePipeline, threads: u32) {
        if threads == 0 {
            return;
        }
        let groups = threads.div_ceil(self.options.workgroup);
        let across = groups.min(MOST_GROUPS);
        pass.set_pipeline(pipeline);
        pass.dispatch_workgroups(across, groups.div_ceil(across), 1);
    }

    /// Everything from places to control points.
    fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_bind_group(0, &self.surface_group, &[]);
        self.dispatch(&mut pass, &self.areas, self.sizes.faces);
        self.dispatch(&mut pass, &self.normals, self.sizes.groups);
        let mut order: Vec<&BatchOnDevice> = self.batches.iter().flatten().collect();
        if self.options.order != 0 {
            fastrand::Rng::with_seed(self.options.order).shuffle(&mut order);
        }
        for batch in order {
            pass.set_bind_group(0, &batch.bind_group, &[]);
            self.dispatch(&mut pass, &batch.pipeline, batch.settings.face_count);
        }
        pass.set_bind_group(0, &self.surface_group, &[]);
        self.dispatch(&mut pass, &self.join, self.sizes.seams);
    }

    fn collect(&self, output: &mut FrameOutput<f32>) -> Result<()> {
        let scene = &*self.scene;
        let (points, knots) = (self.points.size() as usize, self.knots.size() as usize);
        self.readback.wait(&self.device, |bytes| {
            let (point_bytes, rest) = bytes.split_at(points);
            let (knot_bytes, result_bytes) = rest.split_at(knots);
            let count = scene.yarns.point_count();
            output.points.clear();
            output.points.extend(vectors(bytemuck::cast_slice(point_bytes)).take(count));
            let words: &[KnotWords] = bytemuck::cast_slice(&knot_bytes[..12 * scene.knot_count]);
            output.knots.clear();
            output.knots.extend(
                words.iter().map(|k| KnotState { direction: V2::new(k.u, k.v), half_length: k.half_length }),
            );
            let words: &[ResultWords] = bytemuck::cast_slice(&result_bytes[..12 * scene.face_count]);
            output.faces.clear();
            output.faces.extend(words.iter().map(|r| FaceResult {
                energy_start: r.energy_start,
                energy: r.energy,
                status: Status::ALL[r.status as usize % Status::ALL.len()],
            }));
        })?;
        for (batch, kernel) in scene.batches.iter().zip(&self.kernels) {
            if kernel.stencil.points.is_empty() {
                output.faces[batch.first_face..][..batch.faces.len()].fill(unsolved());
            }
        }
        Ok(())
    }
}

impl Backend<f32> for GpuBackend {
    fn frame(&mut self, positions: &[DVec3], output: &mut FrameOutput<f32>) -> Result<()> {
        let continued = self.stamp != 0 && output.stamp == self.stamp;
        let may_stay = continued && self.start != Start::Previous && self.running.skip.unmoved;
        let stays = Skipped { unmoved: self.scene.face_count, ..Skipped::default() };
        if may_stay && self.surface.rests(positions) {
            output.skipped = stays;
            return Ok(());
        }
        if !self.surface.take(&self.scene, positions)? && may_stay {
            output.skipped = stays;
            return Ok(());
        }
        let given = self.give(output, continued);
        self.tell(given, continued);
        let queue = &self.device.queue;
        queue.write_buffer(&self.surface_buffer, 0, bytemuck::cast_slice(floats(&self.surface.local)));
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.encode(&mut encoder);
        self.readback.copy(&mut encoder, &[&self.points, &self.knots, &self.results]);
        queue.submit([encoder.finish()]);
        self.collect(output)?;
        self.device.check()?;
        output.origin = self.surface.origin();
        output.gauge = self.scene.gauge;
        let solved = self.scene.batches.iter().zip(&self.kernels).filter(|(_, k)| k.solves());
        let without_knots = self.scene.face_count - solved.map(|(b, _)| b.faces.len()).sum::<usize>();
        output.skipped = Skipped { without_knots, ..Skipped::default() };
        self.stamp = super::STAMPS.fetch_add(1, Relaxed);
        (output.stamp, output.backend) = (self.stamp, self.name);
        Ok(())
    }
}

fn knot_words(knot: KnotState<f32>) -> KnotWords {
    KnotWords { u: knot.direction.u, v: knot.direction.v, half_length: knot.half_length }
}

/// Vectors as the floats that they are.
#[allow(unsafe_code)]
fn floats(vectors: &[V3<f32>]) -> &[f32] {
    // SAFETY: `V3` is `repr(C)`, three floats without padding.
    unsafe { std::slice::from_raw_parts(vectors.as_ptr().cast(), 3 * vectors.len()) }
}

fn vectors(words: &[f32]) -> impl Iterator<Item = V3<f32>> {
    words.chunks_exact(3).map(|p| V3::new(p[0], p[1], p[2]))
}

/// What a shader does with a buffer.
#[derive(Clone, Copy)]
enum Kind {
    Uniform,
    Read,
    Write,
}

fn bind_group_layout(device: &Device, name: &str, kinds: &[Kind]) -> wgpu::BindGroupLayout {
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

fn bind_group(
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
fn pipeline(
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
