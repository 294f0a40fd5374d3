//! The GPU backend: a thread a stitch, a dispatch a stitch type. The f32 CPU backend is its twin, stage by stage and, where
//! shaders run as they are written, bit by bit.

mod adapter;
mod batch;
mod buffers;
mod exact;
mod exchange;
mod frame;
pub mod layout;
mod pipeline;
mod readback;
pub mod shader;
mod spoil;
pub mod trace;

pub use adapter::{Adapter, AdapterReport};

use super::known::Known;
use super::sight::Sight;
use super::surface::Surface;
use super::{CpuBackend, FrameOutput, Running, Skip, Tables, kernels};
use crate::Result;
use crate::knot::{Kernel, Settings, Start};
use crate::math::V3;
use crate::scene::Scene;
use adapter::Device;
use batch::{BatchMaker, BatchOnDevice, Shared};
use buffers::{Maker, Places, SKIP_COUNTS, Topology};
use exchange::vectors;
use frame::Pending;
use layout::{Lists, Turn};
use pipeline::{Kind, bind_group, bind_group_layout, pipeline};
use readback::Readback;
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
    /// Whether each shape of stitch type has a shader of its own, with all counts known to the compiler, instead of one
    /// shader that serves all. Not compared with the twin so far: software takes minutes to compile such shaders.
    pub own_shaders: bool,
    /// Whether stages are kept for [`GpuBackend::trace`].
    pub trace: bool,
    /// Seed of an order in which stitch types are dispatched; 0 is their own. The result does not depend on it.
    pub order: u64,
    /// A text in the shaders and what stands there instead: a fault, to see that comparisons find it.
    #[doc(hidden)]
    pub fault: Option<(&'static str, &'static str)>,
    /// Which stages are left to the CPU, so that a difference can be traced to one.
    pub on_cpu: OnCpu,
}

/// Stages that are left to the CPU: each as well as those before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum OnCpu {
    /// None.
    #[default]
    Nothing,
    /// Areas and normals.
    Surface,
    /// Knots: frames, starts and solves.
    Knots,
    /// Points: only what two faces share is left to the device.
    Points,
}

impl OnCpu {
    /// By their number, 0 to 3.
    pub fn stages(number: u32) -> Option<Self> {
        [Self::Nothing, Self::Surface, Self::Knots, Self::Points].get(number as usize).copied()
    }
}

impl Default for GpuOptions {
    fn default() -> Self {
        Self::PLAIN
    }
}

impl GpuOptions {
    /// As every device is used unless told otherwise.
    pub const PLAIN: Self = Self {
        workgroup: shader::WORKGROUP,
        exact: true,
        own_shaders: false,
        trace: false,
        order: 0,
        fault: None,
        on_cpu: OnCpu::Nothing,
    };

    /// A shader's text, with the fault that is asked for.
    fn faulty(&self, text: String) -> String {
        match self.fault {
            Some((from, to)) => text.replace(from, to),
            None => text,
        }
    }
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
    sight: Sight,
    turned: u32,
    /// `[batch]` the templates' own shapes, and the first faces', where they are shared.
    rests: Vec<Option<Known<f32>>>,
    firsts: Vec<Option<Known<f32>>>,
    places: Places,
    buffers: Buffers,
    areas: wgpu::ComputePipeline,
    normals: wgpu::ComputePipeline,
    join: wgpu::ComputePipeline,
    carry: wgpu::ComputePipeline,
    surface_group: wgpu::BindGroup,
    arguments: wgpu::ComputePipeline,
    arguments_group: wgpu::BindGroup,
    /// `[batch]`; none for a stitch without yarn.
    batches: Vec<Option<BatchOnDevice>>,
    readback: Readback,
    /// Does what is left to the CPU.
    twin: Option<Box<(CpuBackend<f32>, FrameOutput<f32>)>>,
    /// The next frame, told ahead.
    ahead: Option<Pending>,
    /// Faces that are hidden in the last one.
    hidden: usize,
    name: u64,
    stamp: u64,
}

/// The buffers that all batches see.
#[derive(Debug)]
struct Buffers {
    surface: wgpu::Buffer,
    points: wgpu::Buffer,
    knots: wgpu::Buffer,
    results: wgpu::Buffer,
    lists: wgpu::Buffer,
    known: wgpu::Buffer,
    dispatches: wgpu::Buffer,
    turn: wgpu::Buffer,
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
        let own = options.own_shaders;
        let (kernels, tables) = kernels::<f32>(&scene, settings, running, cache);
        let Topology { words, places } = Topology::new(&scene)?;
        let sizes = places.sizes;
        let maker = Maker(&device);
        let topology = maker.words("topology", &words)?;
        drop(words);
        let copied = BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let points = 12 * (u64::from(sizes.points) + 2 * u64::from(sizes.seams));
        let buffers = Buffers {
            surface: maker.storage("places and normals", 4 * places.surface, copied)?,
            points: maker.storage("control points", points, copied)?,
            knots: maker.storage("knots", 12 * scene.knot_count as u64, copied)?,
            results: maker.storage("results", 12 * scene.face_count as u64, copied)?,
            lists: maker.storage("lists", 4 * places.lists, copied)?,
            known: maker.storage("known shapes", 4 * places.known, copied)?,
            dispatches: maker.dispatches(2 * scene.batches.len()),
            turn: maker.uniform("turn", &Turn::default()),
        };
        let shapes = maker.storage("shapes", 4 * places.shapes, BufferUsages::empty())?;

        let compile = |name: &str, text: &str| {
            let text = options.faulty(text.to_string());
            shader::compile(&device.device, exact, !own, name, &text).map_err(|fault| device.fault(&fault.0))
        };
        let module = compile("surface", &shader::surface(options.workgroup))?;
        let kinds = [Kind::Uniform, Kind::Write, Kind::Read, Kind::Write, Kind::Uniform];
        let layout = bind_group_layout(&device, "surface", &kinds);
        let sizes_buffer = maker.uniform("sizes", &sizes);
        let bound = [&sizes_buffer, &buffers.surface, &topology, &buffers.points, &buffers.turn];
        let surface_group = bind_group(&device, "surface", &layout, &bound);
        let [areas, normals, join, carry] = ["areas", "corner_normals", "join", "carry"]
            .map(|entry| pipeline(&device, &layout, &module, entry));
        let (areas, normals, join, carry) = (areas?, normals?, join?, carry?);

        let module = compile("arguments", &shader::arguments(options.workgroup))?;
        let layout = bind_group_layout(&device, "arguments", &[Kind::Uniform, Kind::Read, Kind::Write]);
        let lists = Lists { count: 2 * scene.batches.len() as u32, first_count: SKIP_COUNTS as u32 };
        let lists = maker.uniform("lists", &lists);
        let arguments_group =
            bind_group(&device, "arguments", &layout, &[&lists, &buffers.lists, &buffers.dispatches]);
        let arguments = pipeline(&device, &layout, &module, "arguments")?;

        let shared = Shared {
            surface: &buffers.surface,
            topology: &topology,
            points: &buffers.points,
            knots: &buffers.knots,
            results: &buffers.results,
            lists: &buffers.lists,
            shapes: &shapes,
            known: &buffers.known,
        };
        let start = settings.start;
        let mut batch_maker =
            BatchMaker::new(&device, &scene, (running, options, start), shared, &places, &kernels)?;
        let batches = kernels.iter().enumerate().map(|(b, kernel)| batch_maker.batch(b, kernel));
        let batches: Vec<_> = batches.collect::<Result<_>>()?;
        drop(batch_maker);
        let (rests, firsts) = super::known_shapes(&scene, &kernels, &running.skip, start);
        let bytes = buffers.points.size() + buffers.knots.size() + buffers.results.size();
        let readback = Readback::new(&maker, bytes + 4 * SKIP_COUNTS as u64);
        device.check()?;
        let twin = match options.on_cpu {
            OnCpu::Nothing | OnCpu::Surface => None,
            OnCpu::Knots | OnCpu::Points => {
                let running = Running { skip: Skip::NOTHING, ..*running };
                let twin = CpuBackend::with_cache(scene.clone(), settings, &running, cache)?;
                Some(Box::new((twin, FrameOutput::default())))
            }
        };
        Ok(Self {
            scene,
            options: *options,
            kernels,
            tables,
            start,
            running: *running,
            surface: Surface::default(),
            sight: Sight::default(),
            turned: 0,
            rests,
            firsts,
            places,
            buffers,
            areas,
            normals,
            join,
            carry,
            surface_group,
            arguments,
            arguments_group,
            batches,
            readback,
            twin,
            ahead: None,
            hidden: 0,
            name: super::STAMPS.fetch_add(1, Relaxed),
            stamp: 0,
            device,
        })
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
        let words = readback::read(&self.device, &self.buffers.surface)?;
        let sizes = &self.places.sizes;
        let count = (sizes.vertices + sizes.faces + sizes.groups) as usize;
        Ok(vectors(&words).take(count).collect())
    }

    /// The two sides of each seam in the last frame, before they were averaged.
    ///
    /// # Errors
    /// A device that fails.
    pub fn sides(&self) -> Result<Vec<V3<f32>>> {
        let words = readback::read(&self.device, &self.buffers.points)?;
        let sizes = &self.places.sizes;
        Ok(vectors(&words).skip(sizes.points as usize).take(2 * sizes.seams as usize).collect())
    }
}
