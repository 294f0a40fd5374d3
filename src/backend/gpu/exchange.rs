//! What goes to the device for a frame, what it is told to do, and what comes back.

use super::buffers::SKIP_COUNTS;
use super::frame::Into;
use super::layout::{self, KnotWords, ResultWords, Turn};
use super::part::Part;
use super::{GpuBackend, MOST_GROUPS, OnCpu, PASSES};
use crate::Result;
use crate::backend::rigid::Motion;
use crate::backend::{CpuBackend, FrameOutput, Skip, Skipped, unsolved};
use crate::knot::{FaceResult, KnotState, Start, Status};
use crate::math::{V2, V3};
use crate::scene::Scene;

impl GpuBackend {
    /// Whether anything may be left out, so that faces are chosen one by one.
    pub(super) fn chooses(&self) -> bool {
        let Skip { unmoved, rigid, rest, shared, .. } = self.running.skip;
        let all = self.options.on_cpu == OnCpu::Nothing;
        all && (unmoved || rigid || rest || shared || self.sight.faces.is_some())
    }

    /// Sends what is new of a frame.
    pub(super) fn send(&mut self, into: Into) {
        let chooses = self.chooses();
        if chooses {
            self.find_known();
        }
        let Into { own, continued, .. } = into;
        let given = self.start == Start::Previous && own && into.knots.len() == self.scene.knot_count;
        let given = given || self.start == Start::Previous && continued;
        let queue = &self.device.queue;
        let write = |buffer: &wgpu::Buffer, at: u64, bytes: &[u8]| {
            if !bytes.is_empty() {
                queue.write_buffer(buffer, at, bytes);
            }
        };
        for part in &self.parts {
            let Part { slice, places, buffers, .. } = part;
            let sizes = &places.sizes;
            if given && !continued {
                self.send_knots(part, into.knots);
            }
            let local = slice.vertices.gather(&self.surface.local);
            write(&buffers.surface, 0, bytemuck::cast_slice(floats(&local)));
            if self.options.on_cpu == OnCpu::Surface {
                let areas = slice.faces.gather(&self.surface.areas);
                let normals = slice.groups.gather(&self.surface.normals);
                let at = 12 * u64::from(sizes.vertices);
                write(&buffers.surface, at, bytemuck::cast_slice(floats(&areas)));
                let at = at + 12 * u64::from(sizes.faces);
                write(&buffers.surface, at, bytemuck::cast_slice(floats(&normals)));
            }
            if let Some(twin) = &self.twin {
                self.send_twin(part, &twin.0, &twin.1);
            }
            if chooses {
                let at = |word: u32| 4 * u64::from(word);
                let scratch = &mut self.scratch;
                bits(&slice.vertices.gather(&self.surface.moved), scratch);
                write(&buffers.surface, at(sizes.moved), bytemuck::cast_slice(scratch));
                if let Some(seen) = &self.sight.faces {
                    bits(&slice.faces.gather(seen), scratch);
                    write(&buffers.surface, at(places.seen), bytemuck::cast_slice(scratch));
                }
                write(&buffers.known, 0, bytemuck::cast_slice(&self.known));
            }
        }
        let Skip { unmoved, rigid, rest, shared, .. } = self.running.skip;
        let flags = [unmoved, rigid, rest, shared, self.sight.faces.is_none()];
        let skip = flags.iter().enumerate().map(|(i, flag)| u32::from(*flag) << i).sum();
        let way = match self.options.on_cpu {
            OnCpu::Knots | OnCpu::Points => layout::DIRECT_LIFT,
            _ if chooses => layout::SOLVE_LIST,
            _ => layout::DIRECT,
        };
        for batch in self.parts.iter_mut().flat_map(|p| p.batches.iter_mut().flatten()) {
            batch.tell(&self.device.queue, |settings| {
                settings.given = u32::from(given);
                settings.near = u32::from(continued);
                settings.own = u32::from(own);
                settings.way = way;
                settings.skip = skip;
            });
        }
    }

    /// Sends the knots of a part.
    fn send_knots(&self, part: &Part, knots: &[KnotState<f32>]) {
        for b in 0..self.scene.batches.len() {
            let [here, there] = part.knot_ranges(&self.scene, b);
            if !here.is_empty() {
                let words: Vec<KnotWords> = knots[there].iter().map(|k| knot_words(*k)).collect();
                let at = 12 * here.start as u64;
                self.device.queue.write_buffer(&part.buffers.knots, at, bytemuck::cast_slice(&words));
            }
        }
    }

    /// Sends what the CPU found.
    fn send_twin(&self, part: &Part, twin: &CpuBackend<f32>, found: &FrameOutput<f32>) {
        let queue = &self.device.queue;
        self.send_knots(part, &found.knots);
        for b in 0..self.scene.batches.len() {
            let [here, there] = part.result_ranges(&self.scene, b);
            if here.is_empty() {
                continue;
            }
            let results = found.faces[there].iter().map(|f| ResultWords {
                energy_start: f.energy_start,
                energy: f.energy,
                status: f.status as u32,
            });
            let results: Vec<ResultWords> = results.collect();
            queue.write_buffer(&part.buffers.results, 12 * here.start as u64, bytemuck::cast_slice(&results));
        }
        let slice = &part.slice;
        let mut points = slice.points.gather(&found.points).into_owned();
        let sides = twin.sides();
        points.extend(slice.seams.iter().flat_map(|s| [2 * s, 2 * s + 1]).map(|side| sides[side as usize]));
        points.extend(slice.open.iter().map(|side| sides[*side as usize]));
        queue.write_buffer(&part.buffers.points, 0, bytemuck::cast_slice(floats(&points)));
    }

    /// The shapes whose solve is known, the first faces' brought up to date.
    fn find_known(&mut self) {
        let words = &mut self.known;
        words.clear();
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
    }

    pub(super) fn dispatch(
        &self,
        pass: &mut wgpu::ComputePass,
        pipeline: &wgpu::ComputePipeline,
        threads: u32,
    ) {
        if threads == 0 {
            return;
        }
        let groups = threads.div_ceil(self.options.workgroup);
        let across = groups.min(MOST_GROUPS);
        pass.set_pipeline(pipeline);
        pass.dispatch_workgroups(across, groups.div_ceil(across), 1);
    }

    /// Begins one of the [`PASSES`].
    fn pass<'a>(&self, encoder: &'a mut wgpu::CommandEncoder, index: usize) -> wgpu::ComputePass<'a> {
        encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(PASSES[index]),
            timestamp_writes: self.timer.as_ref().map(|t| t.writes(index)),
        })
    }

    /// Everything from places to control points, and to curves where they are wanted.
    pub(super) fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
        let chooses = self.chooses();
        let on_cpu = self.options.on_cpu;
        if chooses {
            let header = 4 * (SKIP_COUNTS + 2 * self.types.len()) as u64;
            for part in &self.parts {
                encoder.clear_buffer(&part.buffers.lists, 0, Some(header));
            }
        }
        let mut pass = self.pass(encoder, 0);
        for part in self.parts.iter().filter(|_| on_cpu != OnCpu::Surface) {
            pass.set_bind_group(0, &part.surface_group, &[]);
            self.dispatch(&mut pass, &self.shared.areas, part.places.sizes.faces);
            self.dispatch(&mut pass, &self.shared.normals, part.places.sizes.groups);
        }
        drop(pass);
        let mut pass = self.pass(encoder, 1);
        for part in self.parts.iter().filter(|_| chooses) {
            for (batch, of_type) in part.batches.iter().zip(&self.types) {
                let choose = of_type.as_ref().and_then(|t| t.choose.as_ref());
                if let (Some(batch), Some(choose)) = (batch, choose) {
                    pass.set_bind_group(0, &batch.choose_group, &[]);
                    self.dispatch(&mut pass, choose, batch.face_count());
                }
            }
            pass.set_bind_group(0, &part.arguments_group, &[]);
            self.dispatch(&mut pass, &self.shared.arguments, 2 * self.types.len() as u32);
        }
        drop(pass);
        let mut pass = self.pass(encoder, 2);
        for part in self.parts.iter().filter(|_| on_cpu < OnCpu::Points) {
            self.stitches(&mut pass, part, chooses);
        }
        drop(pass);
        let mut pass = self.pass(encoder, 3);
        for part in &self.parts {
            pass.set_bind_group(0, &part.surface_group, &[]);
            self.dispatch(&mut pass, &self.shared.join, part.places.sizes.seams);
        }
        drop(pass);
        self.encode_curves(encoder);
    }

    fn stitches(&self, pass: &mut wgpu::ComputePass, part: &Part, chooses: bool) {
        let mut order: Vec<usize> = (0..self.types.len()).collect();
        if self.options.order != 0 {
            fastrand::Rng::with_seed(self.options.order).shuffle(&mut order);
        }
        for b in order {
            let (Some(batch), Some(of_type)) = (&part.batches[b], &self.types[b]) else { continue };
            if !chooses {
                pass.set_bind_group(0, &batch.stitch_groups[0], &[]);
                self.dispatch(pass, &of_type.stitch, batch.face_count());
                continue;
            }
            pass.set_pipeline(&of_type.stitch);
            for (list, group) in batch.stitch_groups.iter().enumerate() {
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups_indirect(&part.buffers.dispatches, 12 * (2 * b + list) as u64);
            }
        }
    }

    fn encode_curves(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = self.pass(encoder, 4);
        if let Some(curves) = &self.curves {
            for window in &curves.windows {
                pass.set_bind_group(0, &window.group, &[]);
                self.dispatch(&mut pass, &curves.pipeline, window.points.len() as u32);
            }
        }
        drop(pass);
        if let Some(timer) = &self.timer {
            timer.resolve(encoder);
        }
    }

    /// Has what is wanted of a frame copied to where it comes back; the knots and results of one that was only turned along
    /// are as they were.
    pub(super) fn fetch(&self, encoder: &mut wgpu::CommandEncoder, turned: bool) {
        for part in &self.parts {
            let (buffers, comes) = (&part.buffers, self.comes(part, turned));
            let sizes = &part.places.sizes;
            let open = 12 * (u64::from(sizes.points) + u64::from(2 * sizes.seams));
            let from = [
                (&buffers.points, 0),
                (&buffers.points, open),
                (&buffers.knots, 0),
                (&buffers.results, 0),
                (&buffers.lists, 0),
            ];
            let all: Vec<_> = from.into_iter().zip(comes).map(|((b, at), n)| (b, at, n as u64)).collect();
            part.readback.copy(encoder, &all);
        }
        if let Some(curves) = &self.curves {
            curves.copy(encoder);
        }
    }

    /// Whether control points stay on the device. Those of several parts come together on the CPU, and samples hold them.
    pub(super) fn keeps_points(&self) -> bool {
        !self.wanted.points && self.parts.len() == 1 && self.curves.is_none()
    }

    /// Brings back control points of an earlier frame.
    pub(super) fn fetch_points(&self, output: &mut FrameOutput<f32>) -> Result<()> {
        output.points.resize(self.scene.yarns.point_count(), V3::zero());
        for part in &self.parts {
            let words = super::readback::read(&self.device, &part.buffers.points)?;
            let count = 3 * part.slice.points.len();
            take_points(bytemuck::cast_slice(&words[..count]), part, output);
        }
        Ok(())
    }

    /// Bytes that come back of a part: points, sides of seams with other parts, knots, results, counts of what was skipped.
    fn comes(&self, part: &Part, turned: bool) -> [usize; 5] {
        let stays = self.curves.is_some() || self.keeps_points();
        let points = if stays { 0 } else { 12 * part.slice.points.len() };
        if turned {
            return [points, 0, 0, 0, 0];
        }
        let knots = if self.wanted.knots { 12 * part.places.knots as usize } else { 0 };
        let counts = if self.chooses() { 4 * SKIP_COUNTS } else { 0 };
        [points, 12 * part.slice.open.len(), knots, 12 * part.places.faces as usize, counts]
    }

    /// Waits for the frame.
    pub(super) fn collect(&mut self, output: &mut FrameOutput<f32>) -> Result<()> {
        let scene = self.scene.clone();
        // An error must leave the output as it was.
        self.ready()?;
        output.knots.resize(if self.wanted.knots { scene.knot_count } else { 0 }, KnotState::default());
        output.faces.resize(scene.face_count, unsolved());
        if !self.keeps_points() {
            output.points.resize(scene.yarns.point_count(), V3::zero());
        }
        let mut all_skipped = Skipped::default();
        let mut cross = std::mem::take(&mut self.cross);
        for (i, part) in self.parts.iter().enumerate() {
            let comes = self.comes(part, false);
            part.readback.take(&self.device, |bytes| {
                let mut rest = bytes;
                let [points, open, knots, results, counts] = comes.map(|n| {
                    let (now, later) = rest.split_at(n);
                    rest = later;
                    now
                });
                take_points(points, part, output);
                cross.take(i, vectors(bytemuck::cast_slice(open)));
                take_faces(bytemuck::cast_slice(knots), bytemuck::cast_slice(results), part, &scene, output);
                if !counts.is_empty() {
                    all_skipped = all_skipped + skipped(bytemuck::cast_slice(counts));
                }
            })?;
        }
        cross.join(&mut output.points);
        self.cross = cross;
        self.collect_curves(output)?;
        output.skipped = all_skipped;
        let mut without_yarn = 0;
        for (batch, kernel) in scene.batches.iter().zip(&self.kernels) {
            if kernel.stencil.points.is_empty() {
                output.faces[batch.first_face..][..batch.faces.len()].fill(unsolved());
                without_yarn += batch.faces.len();
            }
        }
        if self.chooses() {
            output.skipped.without_knots += without_yarn;
        } else {
            let solved = scene.batches.iter().zip(&self.kernels).filter(|(_, k)| k.solves());
            let without_knots = scene.face_count - solved.map(|(b, _)| b.faces.len()).sum::<usize>();
            output.skipped = Skipped { without_knots, ..Skipped::default() };
        }
        Ok(())
    }

    /// Turns the points along.
    pub(super) fn turn(&self, motion: &Motion) {
        let turn = Turn(
            motion.columns(self.surface.origin(), self.scene.gauge).map(|c: V3<f32>| [c.x, c.y, c.z, 0.0]),
        );
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        for part in &self.parts {
            self.device.queue.write_buffer(&part.buffers.turn, 0, bytemuck::bytes_of(&turn));
        }
        // All timestamps are taken, or waiting for them would never end.
        (0..3).for_each(|i| drop(self.pass(&mut encoder, i)));
        let mut pass = self.pass(&mut encoder, 3);
        for part in &self.parts {
            pass.set_bind_group(0, &part.surface_group, &[]);
            let sizes = &part.places.sizes;
            self.dispatch(&mut pass, &self.shared.carry, sizes.points + sizes.sides);
        }
        drop(pass);
        self.encode_curves(&mut encoder);
        self.fetch(&mut encoder, true);
        self.device.queue.submit([encoder.finish()]);
    }

    /// Waits for points that were turned along.
    pub(super) fn collect_turned(&mut self, motion: &Motion, output: &mut FrameOutput<f32>) -> Result<()> {
        let (origin, gauge) = (self.surface.origin(), self.scene.gauge);
        self.ready()?;
        self.cross.take_turned(&output.points, motion, origin, gauge);
        for part in &self.parts {
            let bytes = self.comes(part, true)[0];
            if bytes == 0 {
                part.readback.take(&self.device, |_| ())?;
                continue;
            }
            part.readback.take(&self.device, |all| take_points(&all[..bytes], part, output))?;
        }
        self.cross.join(&mut output.points);
        self.collect_curves(output)
    }

    /// Brings back knots of an earlier frame.
    pub(super) fn fetch_knots(&self, output: &mut FrameOutput<f32>) -> Result<()> {
        output.knots.resize(self.scene.knot_count, KnotState::default());
        for part in &self.parts {
            let words = super::readback::read(&self.device, &part.buffers.knots)?;
            let count = 3 * part.places.knots as usize;
            take_faces(bytemuck::cast_slice(&words[..count]), &[], part, &self.scene, output);
        }
        Ok(())
    }

    /// Waits for all that comes back.
    fn ready(&mut self) -> Result<()> {
        self.parts.iter().try_for_each(|part| part.readback.ready(&self.device))?;
        if let Some(curves) = &self.curves {
            curves.ready(&self.device)?;
        }
        self.waited = self.submitted.elapsed();
        Ok(())
    }

    fn collect_curves(&self, output: &mut FrameOutput<f32>) -> Result<()> {
        if let Some(curves) = &self.curves {
            return curves.collect(&self.device, &self.scene, output);
        }
        output.curves.subdivide = 0;
        Ok(())
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

fn take_points(bytes: &[u8], part: &Part, output: &mut FrameOutput<f32>) {
    part.slice.points.scatter(vectors(bytemuck::cast_slice(bytes)), &mut output.points);
}

fn take_faces(
    knots: &[KnotWords],
    results: &[ResultWords],
    part: &Part,
    scene: &Scene,
    output: &mut FrameOutput<f32>,
) {
    for b in 0..scene.batches.len() {
        if !knots.is_empty() {
            let [here, there] = part.knot_ranges(scene, b);
            for (to, k) in output.knots[there].iter_mut().zip(&knots[here]) {
                *to = KnotState { direction: V2::new(k.u, k.v), half_length: k.half_length };
            }
        }
        if results.is_empty() {
            continue;
        }
        let [here, there] = part.result_ranges(scene, b);
        for (to, r) in output.faces[there].iter_mut().zip(&results[here]) {
            *to = FaceResult {
                energy_start: r.energy_start,
                energy: r.energy,
                status: Status::ALL[r.status as usize % Status::ALL.len()],
            };
        }
    }
}

fn knot_words(knot: KnotState<f32>) -> KnotWords {
    KnotWords { u: knot.direction.u, v: knot.direction.v, half_length: knot.half_length }
}

/// Flags, 32 a word.
fn bits(flags: &[bool], words: &mut Vec<u32>) {
    let word = |flags: &[bool]| flags.iter().enumerate().map(|(i, flag)| u32::from(*flag) << i).sum::<u32>();
    words.clear();
    words.extend(flags.chunks(32).map(word));
}

/// Vectors as the floats that they are.
#[allow(unsafe_code)]
fn floats(vectors: &[V3<f32>]) -> &[f32] {
    // SAFETY: `V3` is `repr(C)`, three floats without padding.
    unsafe { std::slice::from_raw_parts(vectors.as_ptr().cast(), 3 * vectors.len()) }
}

pub(super) fn vectors(words: &[f32]) -> impl Iterator<Item = V3<f32>> {
    words.chunks_exact(3).map(|p| V3::new(p[0], p[1], p[2]))
}
