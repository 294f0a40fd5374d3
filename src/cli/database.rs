//! `relax --backend database`: the precomputed method of Sperl et al. 2021.

use super::cloth::{Cloth, Count};
use super::outputs;
use super::progress::Progress;
use super::relax::{Arguments, PrecisionName};
use super::report::{Seconds, peak_memory, write_json};
use super::skip::Visible;
use super::{Console, Ending};
use knotmesh::backend::middle;
use knotmesh::database::{
    Bending, Compat, Fabric, FabricCurves, FabricDevice, FabricRecipe, FaceWeights, RunningYarn, Settings,
    SkippedYarn, Weaver, Woven, YarnFrame,
};
use knotmesh::io::curves::{CurveFormat, FrameWriter, WriteOptions, open_frame_writer};
use knotmesh::io::fabric_result::{FabricWriter, Written};
use knotmesh::io::frames::frame_range;
use knotmesh::io::yarn_model;
use knotmesh::{Error, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

#[derive(clap::Args)]
pub struct DatabaseArguments {
    /// knots solves for the yarn of each stitch; database lays a periodic pattern over the mesh and displaces it as yarn-level
    /// simulation did (Sperl et al. 2021).
    #[arg(long, value_enum, default_value = "knots")]
    pub backend: BackendName,
    /// The pattern and its displacements: a folder (pyp, sxsasy/axes.txt, sxsasy/data.npy) or .npz.
    #[arg(long, value_name = "DIR|FILE.npz", required_if_eq("backend", "database"))]
    pub model: Option<PathBuf>,
    /// Lower bound of the strain's eigenvalues before the look-up: compressed yarn does not buckle (0 to 1; a stretch of
    /// 0.894 is 0.8).
    #[arg(long, default_value_t = Settings::default().min_eigenvalue, requires = "model")]
    pub min_eigenvalue: f64,
    /// Bending as stretch that differs over the height, or not at all.
    #[arg(long, value_enum, default_value = "linearized", requires = "model")]
    pub bending: BendingName,
    /// Share of Phong deformation, 0 to 1: 0 keeps the mesh's flat triangles.
    #[arg(long, default_value_t = Settings::default().phong, requires = "model")]
    pub phong: f64,
    /// Factor of the displacements; 0 embeds the pattern.
    #[arg(long, default_value_t = Settings::default().displacement, requires = "model", allow_hyphen_values = true)]
    pub displacement: f64,
    /// How much of each of its faces a mesh vertex takes.
    #[arg(long, value_enum, default_value = "shepard", requires = "model")]
    pub face_weights: WeightsName,
    /// Results of the authors' program, its faults included.
    #[arg(long, value_enum, requires = "model")]
    pub compat: Option<CompatName>,
    /// Metres of a world unit: positions and material coordinates are multiplied (1 if not given). Of a stitch mesh its
    /// positions only; if not given, they are such that it has the pattern's area at rest.
    #[arg(long, requires = "model")]
    pub scale: Option<f64>,
    /// Stitches along the course and rows that one period of the pattern holds, for stitch meshes; read off plain knits and ribs
    /// if not given.
    #[arg(long, value_name = "COLUMNSxROWS", requires = "model")]
    pub pattern_stitches: Option<Count>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum BackendName {
    Knots,
    Database,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum BendingName {
    Linearized,
    None,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum WeightsName {
    Shepard,
    Equal,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum CompatName {
    Madypg,
}

impl DatabaseArguments {
    /// The model, where this is the backend that is asked for.
    pub fn model(&self) -> Result<Option<&Path>> {
        match (self.backend, &self.model) {
            (BackendName::Database, model) => Ok(model.as_deref()),
            (BackendName::Knots, None) => Ok(None),
            (BackendName::Knots, Some(model)) => Err(Error::invalid(format_args!(
                "--model {}: expected --backend database beside it",
                model.display()
            ))),
        }
    }

    fn settings(&self) -> Settings {
        Settings {
            min_eigenvalue: self.min_eigenvalue,
            bending: match self.bending {
                BendingName::Linearized => Bending::Linearized,
                BendingName::None => Bending::None,
            },
            phong: self.phong,
            displacement: self.displacement,
            weights: match self.face_weights {
                WeightsName::Shepard => FaceWeights::Shepard,
                WeightsName::Equal => FaceWeights::Equal,
            },
            compat: match self.compat {
                Some(CompatName::Madypg) => Compat::Madypg,
                None => Compat::None,
            },
            ..Settings::default()
        }
    }
}

/// What a run did.
#[derive(Serialize)]
struct Report<'a> {
    program: String,
    command: Vec<String>,
    mesh: &'a Path,
    model: &'a Path,
    vertices: usize,
    faces: usize,
    pattern_vertices: usize,
    yarn_radius: f64,
    yarns: usize,
    yarns_closed: usize,
    points: usize,
    frames: Vec<FrameReport>,
    peak_memory_bytes: Option<u64>,
    /// The GPU adapter that frames were worked out on, at the end; null for the CPU.
    adapter: Option<String>,
    files: Vec<PathBuf>,
    seconds: Seconds,
}

#[derive(Serialize)]
struct FrameReport {
    frame: usize,
    /// Points whose strain lies outside the table's.
    outside: usize,
    skipped: SkippedYarn,
}

/// Lays the pattern, and follows the frames.
pub fn run(arguments: &Arguments, model: &Path, console: Console) -> Result<Ending> {
    if arguments.subdivide > 1000 {
        return Err(Error::invalid("--subdivide goes to 1000"));
    }
    let began = Instant::now();
    let progress = Progress::new(console.quiet);
    progress.stage("reading");
    let yarn_model = yarn_model::read(model)?;
    let cloth = Cloth::open(arguments, &yarn_model.pattern)?;
    let mut seconds = Seconds { parse: began.elapsed().as_secs_f64(), ..Seconds::default() };
    progress.stage("laying the pattern");
    let laying = Instant::now();
    let fabric = Arc::new(Fabric::new(&cloth.mesh, yarn_model, arguments.database.settings())?);
    seconds.compile = laying.elapsed().as_secs_f64();
    if fabric.point_count() == 0 {
        return Err(Error::invalid(format_args!(
            "{}: found no yarn on the mesh, whose faces are smaller than the pattern's yarns: are its units metres? --scale \
             changes them",
            arguments.mesh.display()
        )));
    }
    console.say(format_args!(
        "{} faces, {} yarns, {} points; yarn radius {:.6}",
        cloth.mesh.faces.len(),
        fabric.yarn_count(),
        fabric.point_count(),
        fabric.model.pattern.radius / cloth.unit
    ));
    let job = Job { arguments, model, console, progress, cloth, fabric, seconds, began };
    match arguments.precision {
        PrecisionName::F32 => job.frames::<f32>(),
        PrecisionName::F64 => job.frames::<f64>(),
    }
}

struct Job<'a> {
    arguments: &'a Arguments,
    model: &'a Path,
    console: Console,
    progress: Progress,
    cloth: Cloth,
    fabric: Arc<Fabric>,
    seconds: Seconds,
    began: Instant,
}

impl Job<'_> {
    fn frames<T: Woven>(mut self) -> Result<Ending> {
        let arguments = self.arguments;
        let count = self.cloth.frame_count();
        let range = match &arguments.frame_range {
            Some(text) if self.cloth.moves() => frame_range(text, count)?,
            Some(_) => {
                return Err(Error::invalid("--frame-range: expected --frames or a .bin, whose range it is"));
            }
            None => 0..count,
        };
        if range.is_empty() {
            return Err(Error::invalid("the frame source holds no frames: nothing to do"));
        }
        let running = RunningYarn {
            threads: arguments.threads,
            width: arguments.skip.width(),
            skip: arguments.skip.skip_yarn(),
        };
        let recipe =
            FabricRecipe { fabric: self.fabric.clone(), running, adapter: arguments.device.adapter.clone() };
        let mut weaver = FabricDevice::<T>::new(recipe, arguments.device.device.into())?;
        if let Some(adapter) = weaver.adapter() {
            self.console.say(format_args!("working on {adapter}"));
        }
        self.name_notes(&mut weaver);
        let visible = arguments.skip.visible.as_ref();
        let polygons = self.cloth.mesh.source_count();
        let mut visible = visible.map(|path| Visible::open(path, polygons, count)).transpose()?;
        let (mut positions, mut faces) = (Vec::new(), Vec::new());
        if range.start > 0 {
            // Places are relative to what those of a run of all frames are: the bytes are the same.
            self.cloth.read(0, &mut positions)?;
            weaver.set_origin(middle(&positions));
        }
        let mut sinks: Vec<Sink> = Vec::new();
        let mut output = YarnFrame::default();
        let mut reports = Vec::new();
        let mut outside = (0, 0);
        self.progress.steps(range.len(), "working out and writing", "frame");
        for (done, frame) in range.clone().enumerate() {
            let began = Instant::now();
            self.cloth.read(frame, &mut positions)?;
            if let Some(visible) = &mut visible {
                self.cloth.by_face(visible.read(frame)?, &mut faces);
                weaver.set_visible(Some(&faces))?;
            }
            self.seconds.read_frames += began.elapsed().as_secs_f64();
            let began = Instant::now();
            weaver.frame(&positions, &mut output)?;
            self.name_notes(&mut weaver);
            self.seconds.solve += began.elapsed().as_secs_f64();
            if output.outside > outside.0 {
                outside = (output.outside, frame);
            }
            let began = Instant::now();
            if sinks.is_empty() {
                sinks = self.open(&output, range.len(), count > 1)?;
            }
            let results = sinks.iter().any(|s| matches!(s.writer, Writer::Result(_)));
            let directors = if results { weaver.directors(&positions, &output)? } else { Vec::new() };
            for sink in &mut sinks {
                let curves = FabricCurves::new(&self.fabric, &output, sink.subdivide, self.cloth.unit);
                match &mut sink.writer {
                    Writer::Curves(writer) => writer.frame(frame, &curves)?,
                    Writer::Result(writer) => writer.frame(&curves, &output, &directors)?,
                }
            }
            self.seconds.write += began.elapsed().as_secs_f64();
            reports.push(FrameReport { frame, outside: output.outside, skipped: output.skipped });
            self.progress.update(done + 1);
        }
        let mut files = Vec::new();
        for sink in sinks {
            files.extend(sink.finish()?);
        }
        self.progress.finish();
        for file in &files {
            self.console.say(format_args!("wrote {}", file.display()));
        }
        if outside.0 > 0 {
            self.console.warn(format_args!(
                "strains beyond the table's: up to {} of {} points (frame {}), displaced as at its border",
                outside.0,
                self.fabric.point_count(),
                outside.1
            ));
        }
        if let Some(path) = &arguments.report {
            self.seconds.total = self.began.elapsed().as_secs_f64();
            let fabric = &self.fabric;
            let report = Report {
                program: format!("knotmesh {}", env!("CARGO_PKG_VERSION")),
                command: std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect(),
                mesh: &arguments.mesh,
                model: self.model,
                vertices: fabric.vertex_count,
                faces: fabric.face_count(),
                pattern_vertices: fabric.model.pattern.vertex_count(),
                yarn_radius: fabric.model.pattern.radius / self.cloth.unit,
                yarns: fabric.yarn_count(),
                yarns_closed: fabric.yarn_closed.iter().filter(|c| **c).count(),
                points: fabric.point_count(),
                frames: reports,
                peak_memory_bytes: peak_memory(),
                adapter: weaver.adapter().map(str::to_string),
                files,
                seconds: self.seconds,
            };
            write_json(path, &report)?;
        }
        Ok(Ending::Done)
    }

    fn name_notes<T: Woven>(&self, weaver: &mut FabricDevice<T>) {
        for note in weaver.notes() {
            self.console.warn(note);
        }
    }

    fn open<T: Woven>(&self, output: &YarnFrame<T>, frames: usize, sequence: bool) -> Result<Vec<Sink>> {
        let options = WriteOptions { sequence, ..WriteOptions::default() };
        let unit = self.cloth.unit;
        let sink = |path: &PathBuf| {
            let format = CurveFormat::from_path(path)?;
            let subdivide = outputs::subdivide(self.arguments, format);
            let writer = if format == CurveFormat::Npz {
                let written = Written { subdivide, unit, frames };
                Writer::Result(Box::new(FabricWriter::create(path, &self.fabric, output, written)?))
            } else {
                Writer::Curves(open_frame_writer(path, frames, &options)?)
            };
            Ok(Sink { writer, subdivide })
        };
        self.arguments.outputs.iter().map(sink).collect()
    }
}

/// One output file, or one file a frame.
struct Sink {
    writer: Writer,
    subdivide: usize,
}

enum Writer {
    Curves(Box<dyn FrameWriter>),
    Result(Box<FabricWriter>),
}

impl Sink {
    fn finish(self) -> Result<Vec<PathBuf>> {
        match self.writer {
            Writer::Curves(writer) => writer.finish(),
            Writer::Result(writer) => Ok(vec![writer.finish()?]),
        }
    }
}
