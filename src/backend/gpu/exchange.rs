//! What goes to the device for a frame, what it is told to do, and what comes back.

use super::buffers::SKIP_COUNTS;
use super::frame::Into;
use super::layout::{self, KnotWords, ResultWords, Turn};
use super::{GpuBackend, MOST_GROUPS, OnCpu};
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
    pub(super) fn send_twin(&self, twin: &CpuBackend<f32>, found: &FrameOutput<f32>) {
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
    pub(super) fn known_words(&mut self) -> Vec<u32> {
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

    /// Everything from places to control points.
    pub(super) fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
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
        let mut order: Vec<_> = self.batches.iter().enumerate().collect();
        if self.options.order != 0 {
            fastrand::Rng::with_seed(self.options.order).shuffle(&mut order);
        }
        for (b, batch) in order {
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
    pub(super) fn collect(&self, output: &mut FrameOutput<f32>) -> Result<()> {
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
    pub(super) fn turn(&self, motion: &Motion) {
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

pub(super) fn take_points(bytes: &[u8], scene: &Scene, output: &mut FrameOutput<f32>) {
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

pub(super) fn vectors(words: &[f32]) -> impl Iterator<Item = V3<f32>> {
    words.chunks_exact(3).map(|p| V3::new(p[0], p[1], p[2]))
}
