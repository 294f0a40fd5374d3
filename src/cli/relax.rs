//! `knotmesh relax`: a stitch mesh in, relaxed yarn out.

use super::database::{self, DatabaseArguments};
use super::device::DeviceArguments;
use super::inputs::{self, Rename};
use super::outputs;
use super::progress::Progress;
use super::report::{self, FrameReport, Inputs, Report, Seconds};
use super::skip::{SkipArguments, SkipReport, Visible};
use super::{Console, Ending};
use knotmesh::backend::{
    Backend, DeviceBackend, FrameOutput, Precision, Recipe, Running, middle, table_cache,
};
use knotmesh::cloth::Ribs;
use knotmesh::curve::CurveExtras;
use knotmesh::ids::FaceId;
use knotmesh::io::curves::CurveFormat;
use knotmesh::io::frames::{Frames, frame_range};
use knotmesh::knot::{Settings, Solver, Start, Status};
use knotmesh::math::Scalar;
use knotmesh::measure::misfit::{Misfit, misfit};
use knotmesh::mesh::StitchMesh;
use knotmesh::mesh::corners::gaps;
use knotmesh::scene::{Mode, Scene, SceneOptions};
use knotmesh::template::Coordinates;
use knotmesh::{Error, Result};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

#[derive(clap::Args)]
pub struct Arguments {
    /// The stitch mesh: .smobj, or .obj with stitches named by material or group. With --backend database a mesh with
    /// material coordinates: .obj with UVs (metres), .bin (a MADYPG sequence), or .smobj.
    pub mesh: PathBuf,
    /// Template libraries (.json, .sf, or directories of them) on top of the embedded one; the last
    /// definition of a key wins.
    #[arg(long, value_name = "FILE|DIR")]
    pub templates: Vec<PathBuf>,
    /// Vertex positions over time: .npy `[frame, vertex, 3]`, or OBJ files by a (quoted) glob pattern. Without
    /// it, the mesh's own positions are the one frame.
    #[arg(long, value_name = "FRAMES")]
    pub frames: Option<String>,
    /// Which frames: A:B (B not included), either side may be left out; negative numbers count from the end. Files
    /// are those of a run of all frames, to the byte, with --skip unmoved,rest (or rest,shared, or none) and any start
    /// but previous.
    #[arg(long, value_name = "A:B", allow_hyphen_values = true)]
    pub frame_range: Option<String>,
    /// relax solves for the yarn, knots interpolates knots and carries them rigidly, embed interpolates
    /// every point.
    #[arg(long, conflicts_with = "model", value_enum, default_value = "relax")]
    pub mode: ModeName,
    /// safeguarded never raises the energy; gauss-newton is the plain iteration of Huang et al. 2025.
    #[arg(long, conflicts_with = "model", value_enum, default_value = "safeguarded")]
    pub solver: SolverName,
    /// Where each solve starts: a table of optima of each stitch type (built once, kept in the user's cache
    /// folder or in KNOTMESH_CACHE), the template deformed with the face, or the previous frame. The default is
    /// the table, and for gauss-newton the deformed template.
    #[arg(long, conflicts_with = "model", value_enum)]
    pub start: Option<StartName>,
    /// Steps of the solve at most; safeguarded ones stop where nothing is left to gain. The default is 2 from a
    /// table, else 3.
    #[arg(long, conflicts_with = "model")]
    pub iterations: Option<u32>,
    /// f64 is the reference.
    #[arg(long, value_enum, default_value = "f32")]
    pub precision: PrecisionName,
    /// A mesh with the same vertices whose positions are the rest shape (for the gauge).
    #[arg(long, value_name = "MESH")]
    pub rest: Option<PathBuf>,
    /// Rename stitches: a full key or a bare name on either side.
    #[arg(long = "map", value_name = "OLDKEY=KEY")]
    pub map: Vec<Rename>,
    /// Knot spacing: 1 plain interpolation, 0 loops as wide as at rest.
    #[arg(long, conflicts_with = "model", default_value_t = 1.0)]
    pub beta: f64,
    /// Weight of angles in the energy.
    #[arg(long, conflicts_with = "model", default_value_t = 1.0)]
    pub weight_angle: f64,
    /// Weight of lengths in the energy.
    #[arg(long, conflicts_with = "model", default_value_t = 100.0)]
    pub weight_length: f64,
    /// World units per course spacing; measured from the rest mesh if not given.
    #[arg(long, conflicts_with = "model")]
    pub gauge: Option<f64>,
    /// Extra curve points per segment; 0 writes control points (.bcc and .usda, whose splines are uniform,
    /// get at least 6).
    #[arg(long, default_value_t = 4)]
    pub subdivide: usize,
    /// Threads; 0 takes one per core.
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    #[command(flatten)]
    pub skip: SkipArguments,
    #[command(flatten)]
    pub device: DeviceArguments,
    #[command(flatten)]
    pub database: DatabaseArguments,
    /// mean-value joins corners across faces; wachspress treats each face on its own, as smobj-to-yarns does.
    #[arg(long, conflicts_with = "model", value_enum, default_value = "mean-value")]
    pub coordinates: CoordinatesName,
    /// Give height to ribs that lie flat and squeezed, as real ones have: wales of knits come forward, wales of purls go back.
    #[arg(long, conflicts_with = "model")]
    pub fold_ribs: bool,
    /// Leave out faces whose stitch the library lacks.
    #[arg(long, conflicts_with = "model")]
    pub skip_unknown: bool,
    /// Exit 0 even if faces fell back to interpolation.
    #[arg(long, conflicts_with = "model")]
    pub allow_degenerate: bool,
    /// Write counts, statuses, times and error measures as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Result files by extension: .yarns, .bcc, .obj, .npz, .usda, .txt (Mitsuba), .pbrt. Several frames into
    /// a format without time become numbered files (out.%04d.bcc).
    #[arg(short, long = "output", value_name = "OUT", required = true)]
    pub outputs: Vec<PathBuf>,
}

macro_rules! names {
    ($(#[$doc:meta])* $name:ident -> $target:ty { $($variant:ident => $value:expr),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, clap::ValueEnum)]
        pub enum $name { $($variant),* }
        impl From<$name> for $target {
            fn from(name: $name) -> Self {
                match name { $($name::$variant => $value),* }
            }
        }
    };
}
names!(ModeName -> Mode { Relax => Mode::Relax, Knots => Mode::Knots, Embed => Mode::Embed });
names!(SolverName -> Solver { Safeguarded => Solver::Safeguarded, GaussNewton => Solver::GaussNewton });
names!(StartName -> Start { Affine => Start::Affine, Previous => Start::Previous, Table => Start::Table });
names!(CoordinatesName -> Coordinates { MeanValue => Coordinates::MeanValue, Wachspress => Coordinates::Wachspress });

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
pub enum PrecisionName {
    F32,
    F64,
}

/// Relaxes.
pub fn run(arguments: &Arguments, console: Console) -> Result<Ending> {
    outputs::check(arguments)?;
    if let Some(model) = arguments.database.model()? {
        return database::run(arguments, model, console);
    }
    if arguments.frame_range.is_some() && arguments.frames.is_none() {
        return Err(Error::invalid("--frame-range: expected --frames, whose range it is"));
    }
    if arguments.subdivide > 1000 || arguments.iterations.is_some_and(|n| n > 100_000) {
        return Err(Error::invalid("--subdivide goes to 1000 and --iterations to 100000"));
    }
    let began = Instant::now();
    let progress = Progress::new(console.quiet);
    progress.stage("reading");
    let (mesh, library, rest) =
        inputs::all(&arguments.mesh, &arguments.templates, &arguments.map, arguments.rest.as_deref())?;
    let parse = began.elapsed();
    warn_of_mesh(&mesh, console);

    let began_compile = Instant::now();
    progress.stage("compiling");
    let options = SceneOptions {
        mode: arguments.mode.into(),
        coordinates: arguments.coordinates.into(),
        skip_unknown: arguments.skip_unknown,
        gauge: arguments.gauge,
        rest,
    };
    let scene = Arc::new(Scene::compile(&mesh, &library, options)?);
    let extras = CurveExtras::new(&mesh, &scene);
    let misfit = warn_of_scene(&mesh, &scene, console);
    console.say(format_args!(
        "{} faces, {} knots, {} yarns, {} control points; gauge {:.6}, yarn radius {:.6}",
        mesh.face_count(),
        scene.knot_count,
        scene.yarns.len(),
        scene.yarns.point_count(),
        scene.gauge,
        scene.gauge * scene.yarn_radius
    ));
    let inputs = Inputs::new(arguments, &mesh, &scene, misfit);
    let ribs = if arguments.fold_ribs { Ribs::new(&mesh, &library, scene.gauge) } else { Ribs::default() };
    if arguments.fold_ribs && ribs.is_empty() {
        console.say("--fold-ribs: there are none");
    }
    let seconds = Seconds {
        parse: parse.as_secs_f64(),
        compile: began_compile.elapsed().as_secs_f64(),
        ..Seconds::default()
    };
    let lost = mesh.checkpoints.iter().map(|c| c.lengths.len()).sum::<usize>() - extras.checkpoints.len();
    if lost > 0 {
        console
            .warn(format_args!("{lost} rest lengths ('c' lines) name a crossing that no yarn has: left out"));
    }
    let job = Job { arguments, progress, console, scene, ribs, extras, inputs, seconds, began };
    // The mesh's topology lives on in the scene; only positions are needed from here.
    let own_positions = mesh.positions;
    match arguments.precision {
        PrecisionName::F32 => job.frames::<f32>(own_positions),
        PrecisionName::F64 => job.frames::<f64>(own_positions),
    }
}

pub(super) fn warn_of_mesh(mesh: &StitchMesh, console: Console) {
    let (apart, greatest) = gaps(mesh);
    if apart > 0 {
        console.warn(format_args!(
            "{apart} of {} joined edges do not coincide, they lie up to {greatest:.6} apart; yarns are joined all \
             the same",
            mesh.joins.len()
        ));
    }
    for (kind, count) in &mesh.ignored {
        console.say(format_args!("{count} '{kind}' lines ignored"));
    }
}

/// How well the templates fit the mesh.
pub(super) fn warn_of_scene(mesh: &StitchMesh, scene: &Scene, console: Console) -> Misfit {
    let misfit = misfit(scene, scene.rest.as_deref().unwrap_or(&mesh.positions));
    // What was made to a gauge is as narrow as its ribs want.
    let made = mesh.gauge.is_some_and(|[width, _]| width == scene.gauge) && misfit.share_large <= 0.05;
    if let Some(warning) = misfit.warning(scene, |f| mesh.face_type(f).key()).filter(|_| !made) {
        console.warn(warning);
    }
    if scene.skipped_faces() > 0 {
        console.warn(format_args!(
            "{} of {} faces left out: the library lacks their stitches",
            scene.skipped_faces(),
            mesh.face_count()
        ));
    }
    misfit
}

struct Job<'a> {
    arguments: &'a Arguments,
    console: Console,
    progress: Progress,
    scene: Arc<Scene>,
    ribs: Ribs,
    extras: CurveExtras,
    inputs: Inputs,
    seconds: Seconds,
    began: Instant,
}

/// Where frames come from.
struct FrameSource {
    frames: Option<Frames>,
    visible: Option<Visible>,
    ribs: Ribs,
    /// Of the frame read last, ribs folded.
    positions: Vec<glam::DVec3>,
}

impl FrameSource {
    fn read<T: Scalar>(&mut self, frame: usize, backend: &mut dyn Backend<T>) -> Result<()> {
        if let Some(frames) = &mut self.frames {
            frames.read(frame, &mut self.positions)?;
        }
        self.ribs.fold(&mut self.positions);
        self.visible.as_mut().map_or(Ok(()), |visible| visible.show(frame, backend))
    }
}

impl Job<'_> {
    fn frames<T: Precision>(mut self, own_positions: Vec<glam::DVec3>) -> Result<Ending> {
        let arguments = self.arguments;
        let solver = arguments.solver.into();
        let start = match arguments.start {
            Some(start) => start.into(),
            None if solver == Solver::Safeguarded => Start::Table,
            None => Start::Affine,
        };
        let settings = Settings {
            solver,
            start,
            iterations: arguments.iterations.unwrap_or(if start == Start::Table { 2 } else { 3 }),
            beta: arguments.beta,
            weight_angle: arguments.weight_angle,
            weight_length: arguments.weight_length,
        };
        let result = |path: &PathBuf| CurveFormat::from_path(path).is_ok_and(|f| f == CurveFormat::Npz);
        let running = Running {
            threads: arguments.threads,
            width: arguments.skip.width(),
            skip: arguments.skip.skip(),
            energies: arguments.report.is_some() || arguments.outputs.iter().any(result),
        };
        let began = Instant::now();
        let recipe = Recipe {
            scene: self.scene.clone(),
            settings,
            running,
            cache: table_cache::folder(),
            adapter: arguments.device.adapter.clone(),
            timed: false,
        };
        let mut backend = DeviceBackend::<T>::new(recipe, arguments.device.device.into())?;
        if let Some(adapter) = backend.adapter() {
            self.console.say(format_args!("solving on {adapter}"));
        }
        backend.set_wanted(outputs::wanted(arguments)?)?;
        self.name_notes(&mut backend);
        self.seconds.tables = began.elapsed().as_secs_f64();
        if let Some(note) = &backend.tables().note {
            self.console.say(format_args!("tables are not kept: {note}"));
        }
        let mut frames = match &arguments.frames {
            Some(pattern) => Some(Frames::open(pattern, self.scene.vertex_count)?),
            None => None,
        };
        let count = frames.as_ref().map_or(1, Frames::len);
        let range = match &arguments.frame_range {
            Some(text) => frame_range(text, count)?,
            None => 0..count,
        };
        if range.is_empty() {
            return Err(Error::invalid("the frame source holds no frames: nothing to do"));
        }

        let mut positions = own_positions;
        if let Some(frames) = frames.as_mut().filter(|_| range.start > 0) {
            // Places are relative to what those of a run of all frames are: the bytes are the same.
            timed(&mut self.seconds.read_frames, || frames.read(0, &mut positions))?;
            self.ribs.fold(&mut positions);
            backend.set_origin(middle(&positions));
        }

        let faces = self.scene.face_places.len();
        let visible = arguments.skip.visible.as_ref();
        let visible = visible.map(|path| Visible::open(path, faces, count)).transpose()?;
        let mut sinks: Vec<outputs::Sink> = Vec::new();
        let mut output = FrameOutput::default();
        let mut reports = Vec::new();
        let mut fell_back = Vec::new();
        let mut peak_memory = None;
        self.progress.steps(range.len(), "solving and writing", "frame");
        let ribs = std::mem::take(&mut self.ribs);
        let mut source = FrameSource { frames, visible, ribs, positions };
        let seconds = &mut self.seconds;
        let mut ready = timed(&mut seconds.read_frames, || source.read(range.start, &mut backend));
        for (done, frame) in range.clone().enumerate() {
            ready?;
            timed(&mut self.seconds.solve, || backend.frame(&source.positions, &mut output))?;
            self.name_notes(&mut backend);
            // A device works on the next frame while this one is written. What is wrong with that one is said after.
            ready = Ok(());
            if frame + 1 < range.end {
                let read = timed(&mut self.seconds.read_frames, || source.read(frame + 1, &mut backend));
                ready =
                    read.and_then(|()| timed(&mut self.seconds.solve, || backend.ahead(&source.positions)));
            }
            if sinks.is_empty() {
                sinks =
                    outputs::open(arguments, (&self.scene, &self.extras), &output, range.len(), count > 1)?;
            }
            for sink in &mut sinks {
                timed(&mut self.seconds.write, || sink.frame(&self.scene, frame, &output))?;
            }
            let faces = fallen_faces(&self.scene, &output);
            if arguments.report.is_some() {
                peak_memory = peak_memory.or_else(report::peak_memory);
                let began = Instant::now();
                reports.push(FrameReport::new(&self.scene, frame, &output, &faces)?);
                self.seconds.measure += began.elapsed().as_secs_f64();
            }
            if !faces.is_empty() {
                fell_back.push((frame, faces));
            }
            self.progress.update(done + 1);
        }
        let mut files = Vec::new();
        for sink in sinks {
            timed(&mut self.seconds.write, || {
                files.extend(sink.finish()?);
                Ok(())
            })?;
        }
        self.progress.finish();
        for file in &files {
            self.console.say(format_args!("wrote {}", file.display()));
        }
        self.name_fallen(&fell_back);
        if let Some(path) = &arguments.report {
            self.seconds.total = self.began.elapsed().as_secs_f64();
            let (inputs, seconds) = (self.inputs, self.seconds);
            let tables = backend.tables().reports.clone();
            let skip = SkipReport::new(&arguments.skip);
            let adapter = backend.adapter().map(str::to_string);
            Report {
                inputs,
                skip,
                adapter,
                tables,
                frames: reports,
                peak_memory_bytes: peak_memory,
                files,
                seconds,
            }
            .write(path)?;
        }
        Ok(if fell_back.is_empty() || arguments.allow_degenerate { Ending::Done } else { Ending::FellBack })
    }

    fn name_notes<T: Precision>(&self, backend: &mut DeviceBackend<T>) {
        for note in backend.notes() {
            self.console.warn(note);
        }
    }

    /// Names the faces that fell back, a few of each frame.
    fn name_fallen(&self, fell_back: &[(usize, Vec<FaceId>)]) {
        const NAMED: usize = 10;
        for (frame, faces) in fell_back.iter().take(NAMED) {
            let names: Vec<String> = faces.iter().take(NAMED).map(|f| (f.0 + 1).to_string()).collect();
            let more = if faces.len() > NAMED { ", ..." } else { "" };
            self.console.warn(format_args!(
                "frame {frame}: {} faces have no frame and were interpolated: {}{more} (counted from 1)",
                faces.len(),
                names.join(", ")
            ));
        }
        if fell_back.len() > NAMED {
            self.console.warn(format_args!("and so in {} more frames", fell_back.len() - NAMED));
        }
    }
}

pub(super) fn fallen_faces<T: Scalar>(scene: &Scene, output: &FrameOutput<T>) -> Vec<FaceId> {
    let mut faces: Vec<FaceId> = scene
        .batches
        .iter()
        .flat_map(|b| b.faces.iter().zip(&output.faces[b.first_face..]))
        .filter(|(_, result)| result.status == Status::FellBack)
        .map(|(face, _)| *face)
        .collect();
    faces.sort_unstable();
    faces
}

fn timed<R>(seconds: &mut f64, work: impl FnOnce() -> Result<R>) -> Result<R> {
    let began = Instant::now();
    let result = work();
    *seconds += began.elapsed().as_secs_f64();
    result
}
