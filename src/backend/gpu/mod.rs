//! The GPU backend: a thread a stitch, a dispatch a stitch type. The f32 CPU backend is its twin, stage by stage and, where
//! shaders run as they are written, bit by bit.

pub mod account;
mod adapter;
mod buffers;
pub mod counters;
mod counting;
mod curves;
mod exact;
mod exchange;
mod frame;
pub mod layout;
mod part;
mod pipeline;
mod readback;
mod seams;
pub mod shader;
mod shared;
mod slice;
mod spoil;
mod timer;
pub mod trace;
mod types;

// What fabrics are worked on with too.
pub(crate) use adapter::Device;
pub use adapter::{Adapter, AdapterReport};
pub(crate) use buffers::Maker;
#[doc(hidden)]
pub use counting::Counting;
pub(crate) use pipeline::{Kind, bind_group, bind_group_layout, pipeline};
pub(crate) use readback::{Readback, read};
pub(crate) use shared::compile;
pub(crate) use timer::Timer;

use super::known::Known;
use super::sight::Sight;
use super::surface::Surface;
use super::{CpuBackend, FrameOutput, Running, Skip, Tables, Wanted, kernels};
use crate::Result;
use crate::knot::{Kernel, Settings, Solver, Start};
use crate::math::V3;
use crate::scene::Scene;
use curves::CurvesOnDevice;
use exchange::vectors;
use frame::Pending;
use part::{Part, PartMaker};
use seams::CrossSeams;
use shared::SharedKernels;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::{Duration, Instant};
use timer::PASSES;
use types::{Shaders, StitchType};

/// Workgroups that a dispatch has at most on an axis, whatever the adapter.
pub(crate) const MOST_GROUPS: u32 = 65_535;

/// Steps of a Gauss-Newton solve where a driver ends a shader's loops without a word: as many as were compared, of all
/// templates. Stitches come to about a thousand rounds a step.
const MOST_STEPS: u32 = 20;

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
    /// Whether what threads do is counted for [`GpuBackend::counted`] and the like; not together with `trace`.
    #[doc(hidden)]
    pub count: bool,
    /// Seed of an order in which stitch types are dispatched; 0 is their own. The result does not depend on it.
    pub order: u64,
    /// Whether the device's own times are taken ([`super::Backend::device_times`]).
    pub timed: bool,
    /// Bytes of a buffer that shaders see at most, where the device allows more: scenes beyond it are worked on in parts. The
    /// result does not depend on it.
    pub most_bytes: Option<u64>,
    /// A function of the shaders whose sums the device's compiler may rewrite, to see what that does.
    #[doc(hidden)]
    pub free: Option<&'static str>,
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
        count: false,
        order: 0,
        timed: false,
        most_bytes: None,
        free: None,
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

/// Control points on a device, in the order of [`crate::scene::Yarns`]: three floats each, relative to an origin.
#[derive(Clone, Copy, Debug)]
pub struct DevicePoints<'a> {
    pub(crate) device: &'a Device,
    pub(crate) buffer: &'a wgpu::Buffer,
    /// World position that places are relative to.
    pub origin: glam::DVec3,
    /// World units per unit of places.
    pub unit: f64,
    /// How many there are.
    pub count: usize,
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
    shared: SharedKernels,
    shaders: Shaders,
    /// `[batch]`; none for a stitch without yarn.
    types: Vec<Option<StitchType>>,
    parts: Vec<Part>,
    /// Seams whose sides are in different parts.
    cross: CrossSeams,
    wanted: Wanted,
    /// Whether the last solved frame's knots stayed on the device.
    knots_stayed: bool,
    /// Whether its control points did.
    points_stayed: bool,
    curves: Option<CurvesOnDevice>,
    timer: Option<Timer>,
    times: Vec<(&'static str, f64)>,
    /// When the last frame was put to work.
    submitted: Instant,
    /// How long it took from there.
    waited: Duration,
    /// Words on their way: flags, and the shapes whose solve is known.
    scratch: Vec<u32>,
    known: Vec<u32>,
    /// Does what is left to the CPU.
    twin: Option<Box<(CpuBackend<f32>, FrameOutput<f32>)>>,
    /// The next frame, told ahead.
    ahead: Option<Pending>,
    /// Faces that are hidden in the last one.
    hidden: usize,
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
        let (kernels, tables) = kernels::<f32>(&scene, settings, running, cache);
        let most = match settings.solver {
            Solver::GaussNewton => MOST_STEPS,
            // They end where nothing is left to gain.
            Solver::Safeguarded => 3 * MOST_STEPS,
        };
        if device.ends_loops() && settings.iterations > most && kernels.iter().any(Kernel::solves) {
            return Err(device.fault(&format!(
                "--iterations {}: expected {most} at most, for this driver ends loops after 65,535 rounds: take \
                 --device cpu",
                settings.iterations
            )));
        }
        let shared = SharedKernels::new(&device, options)?;
        let mut shaders = Shaders::new(&device, running, options, &kernels);
        let maker = Maker(&device);
        let no_table = maker.words("no table", &[0.0f32])?;
        let mut types = Vec::with_capacity(kernels.len());
        for (batch, kernel) in scene.batches.iter().zip(&kernels) {
            let key = scene.templates[batch.stencil].key();
            let has_yarn = !kernel.stencil.points.is_empty();
            types.push(has_yarn.then(|| shaders.stitch_type(&device, kernel, &key, &no_table)).transpose()?);
        }
        let start = settings.start;
        let parts = buffers::parts(&scene, maker.most(options)).map_err(|e| device.fault(&e.to_string()))?;
        let part_maker = PartMaker {
            device: &device,
            scene: &scene,
            running,
            options,
            start,
            kernels: &kernels,
            shared: &shared,
            shaders: &shaders,
            types: &types,
        };
        let parts = parts.into_iter().map(|(slice, topology)| part_maker.part(slice, topology));
        let parts: Vec<_> = parts.collect::<Result<_>>()?;
        let cross = CrossSeams::between(&scene, &parts);
        let (rests, firsts) = super::known_shapes(&scene, &kernels, &running.skip, start);
        let timer = options.timed.then(|| Timer::new(&device, PASSES.len())).flatten();
        device.check()?;
        let twin = match options.on_cpu {
            OnCpu::Nothing | OnCpu::Surface => None,
            OnCpu::Knots | OnCpu::Points => {
                let running = Running { skip: Skip::NOTHING, ..*running };
                let twin = CpuBackend::with_cache(scene.clone(), settings, &running, cache)?;
                Some(Box::new((twin, FrameOutput::default())))
            }
        };
        let mut made = Self {
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
            shared,
            shaders,
            types,
            parts,
            cross,
            wanted: Wanted::default(),
            knots_stayed: false,
            points_stayed: false,
            curves: None,
            timer,
            times: Vec::new(),
            submitted: Instant::now(),
            waited: Duration::ZERO,
            scratch: Vec::new(),
            known: Vec::new(),
            twin,
            ahead: None,
            hidden: 0,
            name: super::STAMPS.fetch_add(1, Relaxed),
            stamp: 0,
            device,
        };
        if made.chooses() {
            made.make_choosers()?;
        }
        Ok(made)
    }

    /// Makes what chooses the faces that need work.
    fn make_choosers(&mut self) -> Result<()> {
        let batches = self.scene.batches.iter().zip(&self.kernels);
        for ((batch, kernel), of_type) in batches.zip(&mut self.types) {
            let Some(of_type) = of_type.as_mut().filter(|t| t.choose.is_none()) else { continue };
            let key = self.scene.templates[batch.stencil].key();
            of_type.choose = Some(self.shaders.choose(&self.device, kernel, &key)?);
        }
        self.device.check()
    }

    /// How many parts the scene is in, so that shaders see all of each.
    pub fn part_count(&self) -> usize {
        self.parts.len()
    }

    /// Whether shaders run with their sums as they are written.
    pub fn is_exact(&self) -> bool {
        self.options.exact && self.device.exact && self.options.free.is_none()
    }

    /// What the stages of a batch's stitches came to in the last frame, if [`GpuOptions::trace`] asked for it:
    /// `[face][word]`, see [`trace::stages`].
    ///
    /// # Errors
    /// A device that fails.
    pub fn trace(&self, batch: usize) -> Result<Vec<f32>> {
        let mut words = Vec::new();
        for part in &self.parts {
            if let Some(buffer) = part.batches[batch].as_ref().and_then(|b| b.trace.as_ref()) {
                let count = trace::words(&self.kernels[batch].stencil) * part.slice.batches[batch].len();
                words.extend_from_slice(&readback::read(&self.device, buffer)?[..count]);
            }
        }
        Ok(words)
    }

    /// The places of vertices, the areas of faces and the normals of corner groups of the last frame, each x, y, z.
    ///
    /// # Errors
    /// A device that fails.
    pub fn surface(&self) -> Result<Vec<V3<f32>>> {
        let scene = &*self.scene;
        let groups = scene.corner_groups.as_ref().map_or(0, |g| g.len());
        let counts = [scene.vertex_count, scene.face_places.len(), groups];
        let mut all = counts.map(|count| vec![V3::zero(); count]);
        for part in &self.parts {
            let words = readback::read(&self.device, &part.buffers.surface)?;
            let mut vectors = vectors(&words);
            let ids = [&part.slice.vertices, &part.slice.faces, &part.slice.groups];
            for (ids, all) in ids.into_iter().zip(&mut all) {
                ids.scatter(vectors.by_ref().take(ids.len()), all);
            }
        }
        Ok(all.concat())
    }

    /// The two sides of each seam in the last frame, before they were averaged.
    ///
    /// # Errors
    /// A device that fails.
    pub fn sides(&self) -> Result<Vec<V3<f32>>> {
        let mut all = vec![V3::zero(); 2 * self.scene.yarns.seams.len()];
        for part in &self.parts {
            let words = readback::read(&self.device, &part.buffers.points)?;
            let slice = &part.slice;
            let mut sides = vectors(&words).skip(slice.points.len());
            for seam in slice.seams.iter() {
                for side in 0..2 {
                    all[2 * seam as usize + side] = sides.next().expect("two sides a seam");
                }
            }
            for (side, place) in slice.open.iter().zip(sides) {
                all[*side as usize] = place;
            }
        }
        Ok(all)
    }
}
