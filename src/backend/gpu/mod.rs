//! The GPU backend: a thread a stitch, a dispatch a stitch type. The f32 CPU backend is its twin, stage by stage and, where
//! shaders run as they are written, bit by bit.

mod adapter;
mod batch;
mod buffers;
mod exact;
pub mod layout;
mod pipeline;
mod readback;
pub mod shader;
pub mod trace;

pub use adapter::{Adapter, AdapterReport};

use super::known::Known;
use super::rigid::Motion;
use super::sight::Sight;
use super::surface::Surface;
use super::{Backend, CpuBackend, FrameOutput, GIVEN, Running, Skip, Skipped, Tables, kernels, unsolved};
use crate::Result;
use crate::knot::{FaceResult, Kernel, KnotState, Settings, Start, Status};
use crate::math::{V2, V3};
use crate::scene::Scene;
use adapter::Device;
use batch::{BatchMaker, BatchOnDevice, Shared};
use buffers::{Maker, Places, SKIP_COUNTS, Topology};
use glam::DVec3;
use layout::{KnotWords, ResultWords, Turn};
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
    /// Whether each shape of stitch type has a shader of its own, with all counts known to the compiler, or one shader
    /// serves all; unless told, the former on hardware, the latter on software, which compiles slowly.
    pub own_shaders: Option<bool>,
    /// Whether stages are kept for [`GpuBackend::trace`].
    pub trace: bool,
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
        Self {
            workgroup: shader::WORKGROUP,
            exact: true,
            own_shaders: None,
            trace: false,
            on_cpu: OnCpu::Nothing,
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
        let own = options.own_shaders.unwrap_or(!adapter.report().is_software());
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
            shader::compile(&device.device, exact, !own, name, text).map_err(|fault| device.fault(&fault.0))
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
        let lists = maker.uniform("lists", &[2 * scene.batches.len() as u32, SKIP_COUNTS as u32]);
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
            BatchMaker::new(&device, &scene, running, options, start, shared, &places, &kernels, own)?;
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

    /// Whether anything may be left out, so that faces are chosen one by one.
    fn chooses(&self) -> bool {
        let Skip { unmoved, rigid, rest, shared, .. } = self.running.skip;
        let all = self.options.on_cpu == OnCpu::Nothing;
        all && (unmoved || rigid || rest || shared || self.sight.faces.is_some())
    }

    /// Sends what is new of a frame.
    fn send(&mut self, into: Into) {
        let chooses = self.chooses();
        let known = if chooses { self.known_words() } else { Vec::new() };
        let queue = &self.device.queue;
        let Into { own, continued, .. } = into;
        let given = self.start == Start::Previous && own;
        if given && !continued {
            let words: Vec<KnotWords> = into.knots.iter().map(|k| knot_words(*k)).collect();
            queue.write_buffer(&self.buffers.knots, 0, bytemuck::cast_slice(&words));
        }
        queue.write_buffer(&self.buffers.surface, 0, bytemuck::cast_slice(floats(&self.surface.local)));
        if self.options.on_cpu == OnCpu::Surface {
            let at = 12 * self.surface.local.len();
            let normals = [floats(&self.surface.areas), floats(&self.surface.normals)].concat();
            queue.write_buffer(&self.buffers.surface, at as u64, bytemuck::cast_slice(&normals));
        }
        if let Some(twin) = &self.twin {
            self.send_twin(&twin.0, &twin.1);
        }
        if chooses {
            let at = |word: u32| 4 * u64::from(word);
            let moved = bits(&self.surface.moved);
            queue.write_buffer(
                &self.buffers.surface,
                at(self.places.sizes.moved),
                bytemuck::cast_slice(&moved),
            );
            if let Some(seen) = &self.sight.faces {
                let seen = bits(seen);
                queue.write_buffer(&self.buffers.surface, at(self.places.seen), bytemuck::cast_slice(&seen));
            }
            queue.write_buffer(&self.buffers.known, 0, bytemuck::cast_slice(&known));
        }
        let Skip { unmoved, rigid, rest, shared, .. } = self.running.skip;
        let flags = [unmoved, rigid, rest, shared, self.sight.faces.is_none()];
        let skip = flags.iter().enumerate().map(|(i, flag)| u32::from(*flag) << i).sum();
        let way = match self.options.on_cpu {
            OnCpu::Knots | OnCpu::Points => layout::DIRECT_LIFT,
            _ if chooses => layout::SOLVE_LIST,
            _ => layout::DIRECT,
        };
        for batch in self.batches.iter_mut().flatten() {
            batch.tell(&self.device.queue, |settings| {
                settings.given = u32::from(given);
                settings.near = u32::from(continued);
                settings.own = u32::from(own);
                settings.way = way;
                settings.skip = skip;
            });
        }
    }

    /// Sends what the CPU found.
    fn send_twin(&self, twin: &CpuBackend<f32>, found: &FrameOutput<f32>) {
        let queue = &self.device.queue;
        let knots: Vec<KnotWords> = found.knots.iter().map(|k| knot_words(*k)).collect();
        queue.write_buffer(&self.buffers.knots, 0, bytemuck::cast_slice(&knots));
        let results = found.faces.iter().map(|f| ResultWords {
            energy_start: f.energy_start,
            energy: f.energy,
            status: f.status as u32,
        });
        let results: Vec<ResultWords> = results.collect();
        queue.write_buffer(&self.buffers.results, 0, bytemuck::cast_slice(&results));
        let points = [floats(&found.points), floats(twin.sides())].concat();
        queue.write_buffer(&self.buffers.points, 0, bytemuck::cast_slice(&points));
    }

    /// The shapes whose solve is known, the first faces' brought up to date.
    fn known_words(&mut self) -> Vec<u32> {
        let mut words = Vec::with_capacity(self.places.known as usize);
        let batches = self.scene.batches.iter().zip(&self.kernels);
        for ((batch, kernel), (rest, first)) in batches.zip(self.rests.iter().zip(&mut self.firsts)) {
            let (n, k) = (kernel.stencil.corner_count, kernel.stencil.knot_count());
            if let Some(first) = first {
                first.update(&batch.corners[..n], kernel, &self.surface);
            }
            for known in [rest.as_ref(), first.as_ref().filter(|f| f.sound)] {
                let begin = words.len();
                if let Some(known) = known {
                    words.push(1);
                    words.extend(known.shape[1..].iter().flat_map(|p| [p.u.to_bits(), p.v.to_bits()]));
                    let knots = known.state.iter().map(|s| knot_words(*s));
                    words.extend(knots.flat_map(|s| [s.u, s.v, s.half_length].map(f32::to_bits)));
                    let result = &known.result;
                    words.extend([
                        result.energy_start.to_bits(),
                        result.energy.to_bits(),
                        result.status as u32,
                    ]);
                }
                words.resize(begin + 2 * n + 2 + 3 * k, 0);
            }
        }
        words
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
        let chooses = self.chooses();
        if chooses {
            let header = 4 * (SKIP_COUNTS + 2 * self.batches.len()) as u64;
            encoder.clear_buffer(&self.buffers.lists, 0, Some(header));
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_bind_group(0, &self.surface_group, &[]);
        if self.options.on_cpu != OnCpu::Surface {
            self.dispatch(&mut pass, &self.areas, self.places.sizes.faces);
            self.dispatch(&mut pass, &self.normals, self.places.sizes.groups);
        }
        if chooses {
            for batch in self.batches.iter().flatten() {
                pass.set_bind_group(0, &batch.choose_group, &[]);
                self.dispatch(&mut pass, &batch.choose, batch.face_count());
            }
            pass.set_bind_group(0, &self.arguments_group, &[]);
            self.dispatch(&mut pass, &self.arguments, 2 * self.batches.len() as u32);
        }
        for (b, batch) in self.batches.iter().enumerate() {
            let Some(batch) = batch.as_ref().filter(|_| self.options.on_cpu < OnCpu::Points) else {
                continue;
            };
            if !chooses {
                pass.set_bind_group(0, &batch.stitch_groups[0], &[]);
                self.dispatch(&mut pass, &batch.stitch, batch.face_count());
                continue;
            }
            pass.set_pipeline(&batch.stitch);
            for (list, group) in batch.stitch_groups.iter().enumerate() {
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups_indirect(&self.buffers.dispatches, 12 * (2 * b + list) as u64);
            }
        }
        pass.set_bind_group(0, &self.surface_group, &[]);
        self.dispatch(&mut pass, &self.join, self.places.sizes.seams);
    }

    /// Waits for the frame.
    fn collect(&self, output: &mut FrameOutput<f32>) -> Result<()> {
        let scene = &*self.scene;
        let sizes =
            [&self.buffers.points, &self.buffers.knots, &self.buffers.results].map(|b| b.size() as usize);
        let chooses = self.chooses();
        let mut without_yarn = 0;
        self.readback.wait(&self.device, |bytes| {
            let (points, rest) = bytes.split_at(sizes[0]);
            let (knots, rest) = rest.split_at(sizes[1]);
            let (results, counts) = rest.split_at(sizes[2]);
            take_points(points, scene, output);
            let words: &[KnotWords] = bytemuck::cast_slice(&knots[..12 * scene.knot_count]);
            output.knots.clear();
            output.knots.extend(
                words.iter().map(|k| KnotState { direction: V2::new(k.u, k.v), half_length: k.half_length }),
            );
            let words: &[ResultWords] = bytemuck::cast_slice(&results[..12 * scene.face_count]);
            output.faces.clear();
            output.faces.extend(words.iter().map(|r| FaceResult {
                energy_start: r.energy_start,
                energy: r.energy,
                status: Status::ALL[r.status as usize % Status::ALL.len()],
            }));
            let counts: &[u32] = bytemuck::cast_slice(&counts[..4 * SKIP_COUNTS]);
            output.skipped = skipped(counts);
        })?;
        for (batch, kernel) in scene.batches.iter().zip(&self.kernels) {
            if kernel.stencil.points.is_empty() {
                output.faces[batch.first_face..][..batch.faces.len()].fill(unsolved());
                without_yarn += batch.faces.len();
            }
        }
        if chooses {
            output.skipped.without_knots += without_yarn;
        } else {
            let solved = scene.batches.iter().zip(&self.kernels).filter(|(_, k)| k.solves());
            let without_knots = scene.face_count - solved.map(|(b, _)| b.faces.len()).sum::<usize>();
            output.skipped = Skipped { without_knots, ..Skipped::default() };
        }
        Ok(())
    }

    /// Turns the points along.
    fn turn(&self, motion: &Motion) {
        let turn = Turn(
            motion.columns(self.surface.origin(), self.scene.gauge).map(|c: V3<f32>| [c.x, c.y, c.z, 0.0]),
        );
        self.device.queue.write_buffer(&self.buffers.turn, 0, bytemuck::bytes_of(&turn));
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_bind_group(0, &self.surface_group, &[]);
        let sizes = &self.places.sizes;
        self.dispatch(&mut pass, &self.carry, sizes.points + 2 * sizes.seams);
        drop(pass);
        self.readback.copy(&mut encoder, &[(&self.buffers.points, None)]);
        self.device.queue.submit([encoder.finish()]);
    }
}

/// A frame that the device is at work on.
#[derive(Debug)]
enum Pending {
    /// Nothing moved: nothing is done.
    Stays(Skipped),
    /// The mesh moved as one.
    Turned,
    /// Faces were worked on.
    Solved,
}

/// What is known of the output that a frame will go into.
#[derive(Clone, Copy)]
struct Into<'a> {
    /// Its knots, where they may be starts.
    knots: &'a [KnotState<f32>],
    /// Whether it holds a frame of this backend, or starts that somebody gave; and whether that is the last frame.
    own: bool,
    continued: bool,
    /// Faces that are hidden in it.
    hidden: usize,
}

impl GpuBackend {
    /// Puts the device to work on a frame.
    fn submit(&mut self, positions: &[DVec3], into: Into) -> Result<Pending> {
        let known = into.continued && !self.sight.anew && self.start != Start::Previous;
        let may_stay = known && self.running.skip.unmoved;
        let unmoved = self.scene.face_count.saturating_sub(into.hidden);
        let stays = Pending::Stays(Skipped { hidden: into.hidden, unmoved, ..Skipped::default() });
        if may_stay && self.surface.rests(positions) {
            return Ok(stays);
        }
        let looks = known && self.sight.faces.is_none() && self.options.on_cpu == OnCpu::Nothing;
        let motion = if looks {
            self.surface.motion(&self.scene, &self.running.skip, positions, self.turned)
        } else {
            None
        };
        let moved = match self.options.on_cpu {
            OnCpu::Surface => self.surface.update(&self.scene, positions)?,
            _ => self.surface.take(&self.scene, positions)?,
        };
        if !moved && may_stay {
            return Ok(stays);
        }
        if let Some(twin) = &mut self.twin {
            let (backend, output) = &mut **twin;
            backend.frame(positions, output)?;
        }
        self.turned = if motion.is_some() { self.turned + 1 } else { 0 };
        if let Some(motion) = motion {
            self.turn(&motion);
            return Ok(Pending::Turned);
        }
        self.send(into);
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.encode(&mut encoder);
        let Buffers { points, knots, results, lists, .. } = &self.buffers;
        let counts = (lists, Some(4 * SKIP_COUNTS as u64));
        self.readback.copy(&mut encoder, &[(points, None), (knots, None), (results, None), counts]);
        self.device.queue.submit([encoder.finish()]);
        self.sight.anew = false;
        Ok(Pending::Solved)
    }

    /// Waits for a frame.
    fn finish(&mut self, pending: Pending, output: &mut FrameOutput<f32>) -> Result<()> {
        match pending {
            Pending::Stays(skipped) => output.skipped = skipped,
            Pending::Turned => {
                let bytes = self.buffers.points.size() as usize;
                self.readback.wait(&self.device, |all| take_points(&all[..bytes], &self.scene, output))?;
                output.skipped = Skipped::turned(&self.scene, &self.kernels);
            }
            Pending::Solved => {
                self.collect(output)?;
                output.origin = self.surface.origin();
                output.gauge = self.scene.gauge;
                self.stamp = super::STAMPS.fetch_add(1, Relaxed);
                (output.stamp, output.backend) = (self.stamp, self.name);
            }
        }
        self.hidden = output.skipped.hidden;
        self.device.check()
    }
}

impl Backend<f32> for GpuBackend {
    fn frame(&mut self, positions: &[DVec3], output: &mut FrameOutput<f32>) -> Result<()> {
        let mut continued = self.stamp != 0 && output.stamp == self.stamp;
        if let Some(pending) = self.ahead.take() {
            if continued && !self.sight.anew && self.surface.holds(positions) {
                return self.finish(pending, output);
            }
            // Another frame than the one told ahead: what the device holds is of no use.
            continued = false;
        }
        let own = output.backend == self.name || output.backend == GIVEN;
        let into = Into { knots: &output.knots, own, continued, hidden: output.skipped.hidden };
        let pending = self.submit(positions, into)?;
        self.finish(pending, output)
    }

    fn ahead(&mut self, positions: &[DVec3]) -> Result<()> {
        if self.stamp == 0 || self.ahead.is_some() {
            return Ok(());
        }
        let into = Into { knots: &[], own: true, continued: true, hidden: self.hidden };
        self.ahead = Some(self.submit(positions, into)?);
        Ok(())
    }

    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        self.sight.set(&self.scene, visible)
    }

    fn tables(&self) -> &Tables {
        &self.tables
    }

    fn lose(&mut self) {
        self.device.device.destroy();
    }
}

/// What was skipped, as `shaders/select.wgsl` counts it.
fn skipped(counts: &[u32]) -> Skipped {
    let count = |i: usize| counts[i] as usize;
    Skipped {
        hidden: count(0),
        unmoved: count(1),
        without_knots: count(2),
        rigid: count(3),
        rest: count(4),
        shared: count(5),
    }
}

fn take_points(bytes: &[u8], scene: &Scene, output: &mut FrameOutput<f32>) {
    output.points.clear();
    output.points.extend(vectors(bytemuck::cast_slice(bytes)).take(scene.yarns.point_count()));
}

fn knot_words(knot: KnotState<f32>) -> KnotWords {
    KnotWords { u: knot.direction.u, v: knot.direction.v, half_length: knot.half_length }
}

/// Flags, 32 a word.
fn bits(flags: &[bool]) -> Vec<u32> {
    let word = |flags: &[bool]| flags.iter().enumerate().map(|(i, flag)| u32::from(*flag) << i).sum();
    flags.chunks(32).map(word).collect()
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
