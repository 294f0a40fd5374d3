//! A round: one mesh of faces on their own, a few frames of random shapes, all backends side by side.

use super::checks::Record;
use super::shapes::{Kind, random, shape};
use super::variants::{Variant, variants};
use crate::Result;
use crate::backend::{
    Backend, DeviceBackend, DeviceKind, FrameOutput, Precision, Recipe, Running, Skip, table_cache,
};
use crate::ids::{FaceId, TypeId, VertexId};
use crate::knot::{KnotState, Settings, Solver, Start};
use crate::math::{V2, Width};
use crate::mesh::{StitchMesh, StitchType};
use crate::scene::{Role, Scene, SceneOptions, Stencil};
use crate::template::{Template, TemplateLibrary};
use glam::DVec3;
use std::ops::Range;
use std::sync::Arc;

/// Faces of a round's mesh.
pub const FACES: u64 = 1024;
/// Frames of a round; each face's shape jumps from frame to frame.
pub const FRAMES: u64 = 4;
/// Of a round's faces, those of its leading template: several chunks of work for the threads. The others go
/// through the whole library.
const LEADING: u64 = 768;

/// Streams of random numbers.
const OF_FACES: u64 = 0;
const OF_ROUNDS: u64 = 1;

/// Where a face stands in a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The round.
    pub round: u64,
    /// The frame within the round.
    pub frame: u64,
    /// The face within the frame.
    pub slot: u64,
}

impl Place {
    /// Of a face by its number.
    pub fn of(number: u64) -> Self {
        let within = number % (FACES * FRAMES);
        Self { round: number / (FACES * FRAMES), frame: within / FACES, slot: within % FACES }
    }

    /// The face's number.
    pub fn number(self) -> u64 {
        (self.round * FRAMES + self.frame) * FACES + self.slot
    }
}

/// What a round is made of; the same for the whole of it and for any of its faces alone.
pub struct Plan<'a> {
    library: &'a TemplateLibrary,
    seed: u64,
    round: u64,
    leading: usize,
    /// How stitches are solved.
    pub variant: Variant,
    /// World units per template unit.
    pub gauge: f64,
}

impl<'a> Plan<'a> {
    /// Of a round of a run.
    pub fn new(library: &'a TemplateLibrary, seed: u64, round: u64) -> Self {
        let mut random = random(seed, OF_ROUNDS, round);
        // One with knots: others have nothing to solve.
        let knotted: Vec<usize> =
            (0..library.templates().len()).filter(|t| !library.templates()[*t].knots.is_empty()).collect();
        let leading = knotted[random.usize(..knotted.len())];
        let exponent = 24.0 * random.f64() - 12.0;
        let all = variants();
        let variant = all[(round % all.len() as u64) as usize].clone();
        Self {
            library,
            seed,
            round,
            leading,
            gauge: if random.bool() { 1.0 } else { 10f64.powf(exponent) },
            variant,
        }
    }

    /// Steps that a face's state may have gone through: those of all frames so far where each starts at the one
    /// before.
    pub fn steps(&self, face: &Face) -> u32 {
        let settings = &self.variant.settings;
        let frames = if settings.start == Start::Previous { 1 + face.place.frame as u32 } else { 1 };
        frames * settings.iterations
    }

    /// The template of a slot.
    pub fn template(&self, slot: u64) -> &'a Template {
        let templates = self.library.templates();
        let other = (slot.saturating_sub(LEADING) + self.round) as usize;
        &templates[if slot < LEADING { self.leading } else { other % templates.len() }]
    }

    /// A face's kind, and its corners in world units.
    pub fn face(&self, frame: u64, slot: u64) -> (Kind, Vec<DVec3>) {
        let (kind, corners) = self.local(frame, slot);
        (kind, corners.into_iter().map(|p| p * self.gauge).collect())
    }

    fn local(&self, frame: u64, slot: u64) -> (Kind, Vec<DVec3>) {
        let rest = &self.template(slot).corners;
        let number = Place { round: self.round, frame, slot }.number();
        shape(&mut random(self.seed, OF_FACES, number), rest, || match frame {
            0 => rest.iter().map(|c| c.extend(0.0)).collect(),
            _ => self.local(frame - 1, slot).1,
        })
    }
}

/// What the run of several threads is made on.
#[derive(Clone, Copy, Debug)]
pub struct Threaded<'a> {
    /// How many.
    pub threads: usize,
    /// Where it runs in f32.
    pub device: DeviceKind,
    /// Part of the name of the GPU adapter to take.
    pub adapter: Option<&'a str>,
}

impl Threaded<'static> {
    /// On the CPU.
    pub const fn cpu(threads: usize) -> Self {
        Self { threads, device: DeviceKind::Cpu, adapter: None }
    }
}

/// A backend and what it last gave.
struct Runner<T: Precision> {
    backend: DeviceBackend<T>,
    output: FrameOutput<T>,
}

impl<T: Precision> Runner<T> {
    fn new(scene: &Arc<Scene>, settings: &Settings, on: Threaded, width: Width) -> Result<Self> {
        let recipe = Recipe {
            scene: scene.clone(),
            settings: *settings,
            // Every face is solved, whatever is known of it.
            running: Running { threads: on.threads, width, skip: Skip::NOTHING, ..Running::default() },
            cache: table_cache::folder(),
            adapter: on.adapter.map(str::to_string),
            timed: false,
        };
        let mut backend = DeviceBackend::new(recipe, on.device)?;
        let mut output = FrameOutput::default();
        // A first frame of one point sets the origin to 0, whatever the faces: a face alone has the same.
        backend.frame(&vec![DVec3::ZERO; scene.vertex_count], &mut output)?;
        Ok(Self { backend, output })
    }

    fn frame(&mut self, positions: &[DVec3]) -> Result<()> {
        self.backend.frame(positions, &mut self.output)
    }
}

/// The backends of one precision.
struct Side<T: Precision> {
    alone: Runner<T>,
    threaded: Runner<T>,
    spared: Runner<T>,
}

impl<T: Precision> Side<T> {
    fn new(scene: &Arc<Scene>, settings: &Settings, threaded: Threaded) -> Result<Self> {
        let runner = |on, width| Runner::new(scene, settings, on, width);
        // One stitch at a time on one thread, and side by side on several: the same bytes.
        Ok(Self {
            alone: runner(Threaded::cpu(1), Width::One)?,
            threaded: runner(threaded, Width::Auto)?,
            spared: runner(Threaded::cpu(1), Width::Eight)?,
        })
    }

    fn frame(&mut self, positions: &[DVec3], spared: &[DVec3]) -> Result<()> {
        self.alone.frame(positions)?;
        self.threaded.frame(positions)?;
        self.spared.frame(spared)
    }
}

/// What one precision gave for a face.
#[derive(Clone, Copy)]
pub struct Seen<'a, T> {
    /// On one thread.
    pub alone: Record<'a, T>,
    /// On several.
    pub threaded: Record<'a, T>,
    /// On one, where faces with corners that are not finite are drawn together to a point.
    pub spared: Record<'a, T>,
}

/// All that was recorded of a face in a frame.
#[derive(Clone, Copy)]
pub struct Face<'a> {
    /// Its place in the run.
    pub place: Place,
    /// Its kind.
    pub kind: Kind,
    /// Its corners, world units.
    pub corners: &'a [DVec3],
    /// The template.
    pub template: &'a Template,
    /// The template, compiled.
    pub stencil: &'a Stencil<f64>,
    /// f32.
    pub single: Seen<'a, f32>,
    /// f64.
    pub double: Seen<'a, f64>,
    /// E of the f32 end state, and of the f64 one, both worked out in f64.
    pub energies: [f64; 2],
    /// `[point]` height over the face where it is interpolated, else nothing.
    pub heights: &'a [Option<f64>],
}

/// A round, ready to run: all its faces, or one of them.
pub struct Round<'a> {
    /// What it is made of.
    pub plan: Plan<'a>,
    slots: Range<u64>,
    scene: Arc<Scene>,
    kinds: Vec<Kind>,
    positions: Vec<DVec3>,
    single: Side<f32>,
    double: Side<f64>,
    /// Evaluates end states: no steps from the state given.
    judge: Runner<f64>,
    energies: [Vec<f64>; 2],
    /// `[face + 1]` prefix sums of numbers of points.
    point_offsets: Vec<usize>,
    heights: Vec<Option<f64>>,
}

impl<'a> Round<'a> {
    /// Compiles the round's mesh; `slots` picks its faces.
    ///
    /// # Errors
    /// None for the embedded library.
    pub fn new(plan: Plan<'a>, slots: Range<u64>, threaded: Threaded) -> Result<Self> {
        let mesh = mesh(&plan, slots.clone());
        let options = SceneOptions { gauge: Some(plan.gauge), ..SceneOptions::default() };
        let scene = Arc::new(Scene::compile(&mesh, plan.library, options)?);
        let mut point_offsets = vec![0];
        for face in 0..mesh.face_count() {
            let points = scene.face_stencil(face.into()).map_or(0, |(s, _)| s.points.len());
            point_offsets.push(point_offsets[face] + points);
        }
        // Nothing is joined, so yarns come face by face and each point has one slot.
        let heights = scene.point_slots().iter().map(|[slot, _]| {
            let (batch, _, point) = scene.slot_place(*slot);
            let point = &scene.stencils[batch.stencil].points[point];
            matches!(point.role, Role::Boundary | Role::Free).then_some(point.z)
        });
        let heights = heights.collect();
        let settings = &plan.variant.settings;
        let judge =
            Settings { iterations: 0, start: Start::Previous, solver: Solver::Safeguarded, ..*settings };
        Ok(Self {
            single: Side::new(&scene, settings, threaded)?,
            double: Side::new(&scene, settings, Threaded::cpu(threaded.threads))?,
            judge: Runner::new(&scene, &judge, Threaded::cpu(1), Width::One)?,
            energies: [Vec::new(), Vec::new()],
            kinds: Vec::new(),
            positions: Vec::new(),
            point_offsets,
            heights,
            scene,
            slots,
            plan,
        })
    }

    /// Runs a frame; frames go from 0 on.
    ///
    /// # Errors
    /// Those of the backends.
    pub fn frame(&mut self, frame: u64) -> Result<()> {
        self.kinds.clear();
        self.positions.clear();
        let mut spared = Vec::new();
        for slot in self.slots.clone() {
            let (kind, corners) = self.plan.face(frame, slot);
            self.kinds.push(kind);
            let finite = corners.iter().all(|p| p.is_finite());
            spared.extend(corners.iter().map(|p| if finite { *p } else { DVec3::ZERO }));
            self.positions.extend(corners);
        }
        self.single.frame(&self.positions, &spared)?;
        self.double.frame(&self.positions, &spared)?;
        self.energies[0] = self.judged(|round| {
            let knots = &round.single.alone.output.knots;
            let wide = |k: &KnotState<f32>| KnotState {
                direction: V2::new(k.direction.u.into(), k.direction.v.into()),
                half_length: k.half_length.into(),
            };
            knots.iter().map(wide).collect()
        })?;
        self.energies[1] = self.judged(|round| round.double.alone.output.knots.clone())?;
        Ok(())
    }

    /// `[face]` in batch order: E in f64 of the states given.
    fn judged(&mut self, states: impl Fn(&Self) -> Vec<KnotState<f64>>) -> Result<Vec<f64>> {
        self.judge.output = FrameOutput::starting_from(states(self));
        self.judge.frame(&self.positions)?;
        Ok(self.judge.output.faces.iter().map(|f| f.energy_start).collect())
    }

    /// What the last frame gave for its faces.
    pub fn faces(&self, frame: u64) -> impl Iterator<Item = Face<'_>> {
        self.slots.clone().enumerate().map(move |(i, slot)| {
            let face = FaceId::from(i);
            let [begin, end] = [0, 1].map(|k| self.scene.face_offsets[i + k] as usize);
            let place = self.scene.face_places[i];
            let at = self.scene.batches[place.batch as usize].first_face + place.index as usize;
            Face {
                place: Place { round: self.plan.round, frame, slot },
                kind: self.kinds[i],
                corners: &self.positions[begin..end],
                template: self.plan.template(slot),
                stencil: &self.scene.stencils[self.scene.batches[place.batch as usize].stencil],
                single: self.seen(&self.single, face),
                double: self.seen(&self.double, face),
                energies: [0, 1].map(|k| self.energies[k][at]),
                heights: &self.heights[self.points(i)],
            }
        })
    }

    fn points(&self, face: usize) -> Range<usize> {
        self.point_offsets[face]..self.point_offsets[face + 1]
    }

    fn seen<'s, T: Precision>(&'s self, side: &'s Side<T>, face: FaceId) -> Seen<'s, T> {
        let record = |runner: &'s Runner<T>| Record {
            result: runner.output.face(&self.scene, face),
            knots: runner.output.face_knots(&self.scene, face),
            points: &runner.output.points[self.points(face.index())],
        };
        Seen { alone: record(&side.alone), threaded: record(&side.threaded), spared: record(&side.spared) }
    }
}

/// The mesh of a round: faces that share nothing.
fn mesh(plan: &Plan, slots: Range<u64>) -> StitchMesh {
    let mut mesh = StitchMesh { face_offsets: vec![0], ..StitchMesh::default() };
    for template in plan.library.templates() {
        mesh.types.push(StitchType { name: template.name.clone(), labels: template.labels.clone() });
    }
    for slot in slots {
        let template = plan.template(slot);
        let index = plan.library.templates().iter().position(|t| std::ptr::eq(t, template));
        mesh.face_types.push(TypeId::from(index.expect("it is of the library")));
        for corner in &template.corners {
            mesh.face_vertices.push(VertexId::from(mesh.positions.len()));
            mesh.positions.push(corner.extend(0.0));
        }
        mesh.face_offsets.push(mesh.positions.len() as u32);
    }
    mesh
}
