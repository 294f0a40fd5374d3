//! Running both backends, and what they differ by.

use crate::common::Random;
use glam::DVec3;
use knotmesh::Error;
use knotmesh::backend::gpu::{Adapter, GpuBackend, GpuOptions};
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running, Skip};
use knotmesh::knot::Settings;
use knotmesh::math::{V3, Width};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Mode, Scene, SceneOptions};
use knotmesh::template::{Coordinates, TemplateLibrary};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where tables are kept, so that each is made once.
pub fn tables() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("gpu-tables")
}

/// Compiled as if nothing were deformed, so that a face at rest is one.
pub fn compiled(mesh: &StitchMesh, mode: Mode, coordinates: Coordinates) -> Arc<Scene> {
    let options = SceneOptions { mode, coordinates, gauge: Some(1.0), ..SceneOptions::default() };
    Arc::new(Scene::compile(mesh, &TemplateLibrary::embedded(), options).expect("compiles"))
}

/// One shader for all: software compiles each for seconds.
pub const JOINT: GpuOptions = GpuOptions::PLAIN;

/// What a frame comes to, by name.
pub const PARTS: [&str; 6] = ["surface", "points", "sides", "knots", "energies", "statuses"];

/// `[part]` floats of a frame.
pub type Frame = [Vec<f32>; PARTS.len()];

fn flat(vectors: &[V3<f32>]) -> Vec<f32> {
    vectors.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
}

fn frame(output: &FrameOutput<f32>, surface: &[V3<f32>], sides: &[V3<f32>]) -> Frame {
    let knots = output.knots.iter().flat_map(|k| [k.direction.u, k.direction.v, k.half_length]);
    let energies = output.faces.iter().flat_map(|f| [f.energy_start, f.energy]);
    [
        flat(surface),
        flat(&output.points),
        flat(sides),
        knots.collect(),
        energies.collect(),
        output.faces.iter().map(|f| f32::from(f.status as u8)).collect(),
    ]
}

/// Equal bits; any NaN is as good as another, for nothing says which one an operation gives.
pub fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// A scene in motion and how it is solved.
pub struct Case<'a> {
    pub scene: &'a Arc<Scene>,
    pub motion: &'a [Vec<DVec3>],
    pub settings: Settings,
    pub energies: bool,
}

impl<'a> Case<'a> {
    pub fn new(scene: &'a Arc<Scene>, motion: &'a [Vec<DVec3>], settings: Settings) -> Self {
        Self { scene, motion, settings, energies: true }
    }

    pub fn running(&self) -> Running {
        Running { threads: 1, width: Width::One, skip: Skip::NOTHING, energies: self.energies }
    }

    pub fn twin(&self) -> CpuBackend<f32> {
        CpuBackend::with_cache(self.scene.clone(), &self.settings, &self.running(), Some(&tables()))
            .expect("in range")
    }

    pub fn device(&self, adapter: &Adapter, options: &GpuOptions) -> GpuBackend {
        self.try_device(adapter, options).expect("the device takes it")
    }

    pub fn try_device(&self, adapter: &Adapter, options: &GpuOptions) -> Result<GpuBackend, Error> {
        let cache = tables();
        GpuBackend::new(self.scene.clone(), &self.settings, &self.running(), options, adapter, Some(&cache))
    }

    /// The frames by the CPU.
    pub fn by_twin(&self) -> Vec<Frame> {
        let mut backend = self.twin();
        let mut output = FrameOutput::default();
        let frame = |positions: &Vec<DVec3>| {
            backend.frame(positions, &mut output).expect("as many as vertices");
            frame(&output, &backend.surface(), &self.sides(&backend, &output))
        };
        self.motion.iter().map(frame).collect()
    }

    fn sides(&self, backend: &CpuBackend<f32>, output: &FrameOutput<f32>) -> Vec<V3<f32>> {
        let (slots, sources) = (backend.slots(output), self.scene.point_slots());
        let of_seam = |point: &u32| sources[*point as usize].map(|slot| slots[slot as usize]);
        self.scene.yarns.seams.iter().flat_map(of_seam).collect()
    }

    /// The frames by the device, and whether that ran shaders as they are written.
    pub fn by_device(&self, adapter: &Adapter, options: &GpuOptions) -> (Vec<Frame>, bool) {
        let mut backend = self.device(adapter, options);
        let mut output = FrameOutput::default();
        let frame = |positions: &Vec<DVec3>| {
            backend.frame(positions, &mut output).expect("as many as vertices");
            let (surface, sides) = (backend.surface().expect("read"), backend.sides().expect("read"));
            frame(&output, &surface, &sides)
        };
        let frames = self.motion.iter().map(frame).collect();
        (frames, backend.is_exact())
    }

    /// The frames by the CPU with every coordinate of every vertex a unit in the last place up or down.
    pub fn by_twin_nudged(&self, seed: u64) -> Vec<Frame> {
        let mut backend = self.twin();
        // The first frame alone says what places are relative to.
        let mut output = FrameOutput::default();
        backend.frame(&self.motion[0], &mut output).expect("as many as vertices");
        let (origin, gauge) = (output.origin, output.gauge);
        let mut output = FrameOutput::default();
        let mut random = Random::new(seed);
        let frame = |positions: &Vec<DVec3>| {
            let nudged: Vec<_> = positions.iter().map(|p| nudged(*p, origin, gauge, &mut random)).collect();
            backend.frame(&nudged, &mut output).expect("as many as vertices");
            frame(&output, &backend.surface(), &self.sides(&backend, &output))
        };
        self.motion.iter().map(frame).collect()
    }

    /// `[face in batch order]` how far the points of a frame lie from those of another at most, yarn radii; infinite
    /// where only one is a number.
    pub fn apart(&self, a: &Frame, b: &Frame) -> Vec<f64> {
        let mut apart = vec![0.0f64; self.scene.face_count];
        let of_slot = self.face_of_slot();
        let points = a[1].chunks_exact(3).zip(b[1].chunks_exact(3));
        for ((p, q), slots) in points.zip(self.scene.point_slots()) {
            let square = |(x, y): (&f32, &f32)| if same(*x, *y) { 0.0 } else { f64::from(x - y).powi(2) };
            let distance = p.iter().zip(q).map(square).sum::<f64>().sqrt() / self.scene.yarn_radius;
            let distance = if distance.is_nan() { f64::INFINITY } else { distance };
            for slot in slots {
                if let Some(face) = of_slot.get(*slot as usize) {
                    apart[*face] = apart[*face].max(distance);
                }
            }
        }
        apart
    }

    fn face_of_slot(&self) -> Vec<usize> {
        let mut faces = Vec::with_capacity(self.scene.slot_count);
        for batch in &self.scene.batches {
            let count = self.scene.stencils[batch.stencil].points.len();
            for i in 0..batch.faces.len() {
                faces.extend(std::iter::repeat_n(batch.first_face + i, count));
            }
        }
        faces
    }
}

/// A place whose template units in f32 are one unit in the last place up or down, coordinate by coordinate.
fn nudged(p: DVec3, origin: DVec3, gauge: f64, random: &mut Random) -> DVec3 {
    let mut nudged = p;
    for axis in 0..3 {
        let local = ((p[axis] - origin[axis]) / gauge) as f32;
        let near = if random.bits().is_multiple_of(2) { local.next_up() } else { local.next_down() };
        let by = f64::from(near) - f64::from(local);
        if by.is_finite() {
            nudged[axis] += by * gauge;
        }
    }
    nudged
}

/// `[part]` how many floats agree, of how many.
pub fn agreement(a: &[Frame], b: &[Frame]) -> [[usize; 2]; PARTS.len()] {
    let mut counts = [[0; 2]; PARTS.len()];
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        for ((a, b), count) in a.iter().zip(b).zip(&mut counts) {
            assert_eq!(a.len(), b.len(), "as many of everything");
            count[0] += a.iter().zip(b).filter(|(a, b)| same(**a, **b)).count();
            count[1] += a.len();
        }
    }
    counts
}

/// Whether all floats agree.
pub fn agree(counts: &[[usize; 2]; PARTS.len()]) -> bool {
    counts.iter().all(|[same, all]| same == all)
}

/// Agreement in words.
pub fn told(counts: &[[usize; 2]; PARTS.len()]) -> String {
    let part = |(name, [same, all]): (&&str, &[usize; 2])| format!("{name} {same} of {all}");
    PARTS.iter().zip(counts).map(part).collect::<Vec<_>>().join(", ")
}
