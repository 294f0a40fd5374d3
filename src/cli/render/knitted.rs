//! Pictures of stitch meshes and patterns, relaxed frame by frame.

use super::{Arguments, Up};
use crate::cli::relax::{fallen_faces, warn_of_mesh, warn_of_scene};
use crate::cli::{Console, inputs, knit};
use glam::DVec3;
use knotmesh::backend::gpu::DevicePoints;
use knotmesh::backend::{Backend, DeviceBackend, FrameOutput, Recipe, Running, Wanted, middle, table_cache};
use knotmesh::cloth::{RelaxOptions, Ribs};
use knotmesh::design::{self, Knitted};
use knotmesh::io::frames::{Frames, frame_range};
use knotmesh::knot::{Settings, Solver, Start};
use knotmesh::mesh::StitchMesh;
use knotmesh::render::style::{Kind, kind_colours, kinds, kinds_legend};
use knotmesh::render::{Legend, Strands, Style};
use knotmesh::scene::{Mode, Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use knotmesh::{Error, Result};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// A mesh over time; see [`super::source::Source`].
pub struct FromMesh {
    pub path: PathBuf,
    pub frames: Range<usize>,
    pub moves: bool,
    pub strands: Strands,
    pub numbers: Vec<f32>,
    /// Where the fabric's front faces in the first frame, summed.
    pub normal: DVec3,
    /// How much wales run along each axis in the first frame.
    wale: DVec3,
    /// Whether it was made from a pattern, which has y upwards.
    of_pattern: bool,
    style: Style,
    kinds: Vec<Kind>,
    scene: Arc<Scene>,
    backend: DeviceBackend<f32>,
    motion: Option<Frames>,
    ribs: Ribs,
    /// Where vertices are, ribs folded.
    positions: Vec<DVec3>,
    output: FrameOutput<f32>,
    at: Option<usize>,
    /// Frames, and in the first of them faces, that fell back.
    fallen: Option<(usize, usize)>,
    console: Console,
}

impl FromMesh {
    pub fn open(arguments: &Arguments, style: Style, pattern: bool, console: Console) -> Result<Self> {
        if arguments.frame_range.is_some() && arguments.frames.is_none() {
            return Err(Error::invalid("--frame-range: expected --frames, whose range it is"));
        }
        let mode = arguments.mode.map_or(Mode::Relax, Mode::from);
        if style == Style::Energy && mode != Mode::Relax {
            return Err(Error::invalid(
                "--style energy: expected --mode relax; other modes solve for nothing",
            ));
        }
        let mut width = None;
        let (mesh, library, rest, gauge) = if pattern {
            let knitted = knit(arguments, console)?;
            width = Some(knitted.gauge.width);
            (knitted.mesh, TemplateLibrary::embedded(), None, None)
        } else {
            let (mesh, library, rest) = inputs::all(
                &arguments.input,
                &arguments.templates,
                &arguments.map,
                arguments.rest.as_deref(),
            )?;
            (mesh, library, rest, arguments.gauge.as_deref().map(units).transpose()?)
        };
        warn_of_mesh(&mesh, console);
        let options =
            SceneOptions { mode, skip_unknown: arguments.skip_unknown, gauge, rest, ..Default::default() };
        let scene = Arc::new(Scene::compile(&mesh, &library, options)?);
        warn_of_scene(&mesh, &scene, console);
        // What was knitted just now has no height yet.
        let fold = arguments.fold_ribs || pattern && !arguments.flat_ribs;
        let width = width.unwrap_or(scene.gauge);
        let ribs = if fold { Ribs::new(&mesh, &library, width) } else { Ribs::default() };
        let mut backend = backend(arguments, &scene, style, console)?;
        let mut motion =
            arguments.frames.as_ref().map(|f| Frames::open(f, scene.vertex_count)).transpose()?;
        let count = motion.as_ref().map_or(1, Frames::len);
        let frames = match &arguments.frame_range {
            Some(text) => frame_range(text, count)?,
            None => 0..count,
        };
        if frames.is_empty() {
            return Err(Error::invalid("the frame source holds no frames: nothing to draw"));
        }
        let mut positions = mesh.positions.clone();
        if let Some(motion) = &mut motion {
            motion.read(0, &mut positions)?;
        }
        ribs.fold(&mut positions);
        if motion.is_some() {
            backend.set_origin(middle(&positions));
        }
        let mut made = Self {
            path: arguments.input.clone(),
            moves: count > 1,
            strands: Strands::default(),
            numbers: Vec::new(),
            normal: DVec3::ZERO,
            wale: DVec3::ZERO,
            of_pattern: pattern || !mesh.face_origins.is_empty(),
            style,
            kinds: Vec::new(),
            scene,
            backend,
            motion,
            ribs,
            positions,
            output: FrameOutput::default(),
            at: None,
            fallen: None,
            console,
            frames,
        };
        made.dress(arguments, &mesh)?;
        Ok(made)
    }

    /// Solves the first frame, and gives yarn its colours.
    fn dress(&mut self, arguments: &Arguments, mesh: &StitchMesh) -> Result<()> {
        self.solve(self.frames.start)?;
        self.strands = Strands::of_frame(mesh, &self.scene, &self.output);
        if self.style == Style::Type {
            self.kinds = kinds(mesh, &self.scene);
            self.strands.colours = kind_colours(mesh, &self.scene, &self.kinds);
        }
        if !arguments.colour.is_empty() {
            for (yarn, ends) in self.strands.offsets.windows(2).enumerate() {
                let colour = arguments.colour[yarn % arguments.colour.len()].0;
                self.strands.colours[ends[0] as usize..ends[1] as usize].fill(colour);
            }
        }
        (self.normal, self.wale) = directions(&self.scene, &self.positions);
        self.measure();
        Ok(())
    }

    pub fn read(&mut self, frame: usize) -> Result<()> {
        if self.at != Some(frame) {
            self.solve(frame)?;
            // A device may keep points to itself; one that fails does not.
            if !self.output.points.is_empty() {
                self.strands.move_to(&self.output);
                self.measure();
            }
        }
        Ok(())
    }

    /// The points of the frame that was read last, where they lie on the device that they were solved on.
    pub fn device_points(&self) -> Option<DevicePoints<'_>> {
        self.backend.device_points()
    }

    /// Points need not come back from now on, unless numbers are found from them.
    pub fn keep_points(&mut self) -> Result<()> {
        let points = self.style.is_number();
        self.backend.set_wanted(Wanted { points, knots: false, curves: 0 })
    }

    /// Whether the points of that frame are here.
    pub fn has_points(&self) -> bool {
        !self.output.points.is_empty()
    }

    /// A box around the yarn of the frame that was read last.
    pub fn bounds(&self) -> [DVec3; 2] {
        let margin = self.scene.gauge * 0.5;
        let finite = self.positions.iter().copied().filter(|p| p.is_finite());
        let low = finite.clone().fold(DVec3::INFINITY, DVec3::min);
        [low - margin, finite.fold(DVec3::NEG_INFINITY, DVec3::max) + margin]
    }

    fn solve(&mut self, frame: usize) -> Result<()> {
        if let Some(motion) = &mut self.motion {
            motion.read(frame, &mut self.positions)?;
            self.ribs.fold(&mut self.positions);
        }
        self.backend.frame(&self.positions, &mut self.output)?;
        for note in self.backend.notes() {
            self.console.warn(note);
        }
        if self.fallen.is_none() {
            let faces = fallen_faces(&self.scene, &self.output).len();
            self.fallen = (faces > 0).then_some((frame, faces));
        }
        self.at = Some(frame);
        Ok(())
    }

    fn measure(&mut self) {
        if self.style.is_number() {
            self.numbers = self.style.of_frame(&self.strands, &self.scene, &self.output, &self.positions);
        }
    }

    /// Wales run upwards: along y, unless they run along z. In patterns feet may be longer than legs.
    pub fn up(&self) -> Option<Up> {
        Some(if !self.of_pattern && self.wale.z > self.wale.y.max(self.wale.x) { Up::Z } else { Up::Y })
    }

    pub fn kinds_legend(&self) -> Option<Legend> {
        (!self.kinds.is_empty()).then(|| kinds_legend(&self.kinds))
    }

    pub fn name_fallen(&self, console: Console) -> bool {
        if let Some((frame, faces)) = self.fallen {
            console.warn(format_args!(
                "frame {frame}: {faces} faces have no frame and were interpolated ('knotmesh relax' names them)"
            ));
        }
        self.fallen.is_some()
    }
}

/// Works a pattern or chart and gives its stitches their natural sizes.
fn knit(arguments: &Arguments, console: Console) -> Result<Knitted> {
    let path = &arguments.input;
    let gauge = arguments.gauge.as_deref().map(knit::gauge).transpose();
    let gauge = gauge.map_err(|e| Error::invalid(format_args!("--gauge: {e}")))?;
    let size = arguments.size.as_ref().map(|s| s.to_lowercase());
    let settings = design::Settings { gauge, size, ..design::Settings::default() };
    let mut knitted = knit::work(path, &settings, &arguments.chart)?;
    knit::relaxed(&mut knitted, &RelaxOptions::garment(), console)?;
    Ok(knitted)
}

/// The gauge of a mesh.
fn units(text: &str) -> Result<f64> {
    text.trim().parse().map_err(|_| {
        Error::invalid(format_args!(
            "--gauge: found '{text}', expected world units per course spacing (stitches and rows are for patterns)"
        ))
    })
}

fn backend(
    arguments: &Arguments,
    scene: &Arc<Scene>,
    style: Style,
    console: Console,
) -> Result<DeviceBackend<f32>> {
    let settings = Settings {
        solver: Solver::Safeguarded,
        start: Start::Table,
        iterations: 2,
        beta: arguments.beta.unwrap_or(1.0),
        ..Settings::default()
    };
    let recipe = Recipe {
        scene: scene.clone(),
        settings,
        running: Running { energies: style == Style::Energy, ..Running::default() },
        cache: table_cache::folder(),
        adapter: arguments.device.adapter.clone(),
        timed: false,
    };
    let mut backend = DeviceBackend::new(recipe, arguments.device.device.into())?;
    if let Some(adapter) = backend.adapter() {
        console.say(format_args!("solving on {adapter}"));
    }
    backend.set_wanted(Wanted { points: true, knots: false, curves: 0 })?;
    Ok(backend)
}

/// Sums over the faces: which way their fronts face, and how much their wales run along each axis.
fn directions(scene: &Scene, positions: &[DVec3]) -> (DVec3, DVec3) {
    let (mut normal, mut wales) = (DVec3::ZERO, DVec3::ZERO);
    for batch in &scene.batches {
        let shape = &scene.templates[batch.stencil].corners;
        let middle = shape.iter().sum::<glam::DVec2>() / shape.len().max(1) as f64;
        for corners in batch.corners.chunks_exact(shape.len().max(1)) {
            let (mut course, mut wale) = (DVec3::ZERO, DVec3::ZERO);
            for (vertex, corner) in corners.iter().zip(shape) {
                let place = positions[*vertex as usize] - positions[corners[0] as usize];
                course += place * (corner.x - middle.x);
                wale += place * (corner.y - middle.y);
            }
            if course.is_finite() && wale.is_finite() {
                normal += course.cross(wale).normalize_or_zero();
                wales += wale.normalize_or_zero().abs();
            }
        }
    }
    (normal, wales)
}
