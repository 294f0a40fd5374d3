//! `knotmesh drape`: a stitch mesh and a scene in, frames of cloth out.

use super::inputs::{self, Rename};
use super::progress::Progress;
use super::{Console, Ending};
use knotmesh::cloth::ClothOptions;
use knotmesh::drape::scene::DrapeScene;
use knotmesh::drape::{Drape, DrapeReport, check};
use knotmesh::io::frames::{FramesWriter, frame_range};
use knotmesh::io::output::Output;
use knotmesh::io::scene_json;
use knotmesh::io::text::extension;
use knotmesh::mesh::StitchMesh;
use knotmesh::template::TemplateLibrary;
use knotmesh::{Error, Result};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub struct Arguments {
    /// The stitch mesh: .smobj, or .obj with stitches named by material or group.
    mesh: PathBuf,
    /// The scene: what is held, moved, in the way (JSON, described in docs/scenes.md).
    #[arg(long, value_name = "SCENE.json")]
    scene: PathBuf,
    /// Frames, in the mesh's units: .npy `[frame, vertex, 3]`, as relax --frames reads it, or .obj, a file a frame
    /// (out.%04d.obj).
    #[arg(short, long, value_name = "FRAMES", required_unless_present = "check")]
    output: Option<PathBuf>,
    /// Read everything, say what the scene selects and what of it can have no effect, and stop.
    #[arg(long)]
    check: bool,
    /// Template libraries (.json, .sf, or directories of them) on top of the embedded one.
    #[arg(long, value_name = "FILE|DIR")]
    templates: Vec<PathBuf>,
    /// Rename stitches: a full key or a bare name on either side.
    #[arg(long = "map", value_name = "OLDKEY=KEY")]
    map: Vec<Rename>,
    /// Which frames to write: A:B (B not included), either side may be left out; negative numbers count from the end.
    /// Those before them are stepped all the same.
    #[arg(long, value_name = "A:B", allow_hyphen_values = true)]
    frame_range: Option<String>,
    /// Threads; 0 takes one per core. Frames do not depend on it.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Write each frame's time, energies, cut steps, contacts and deepest penetration as JSON.
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
}

/// The report's file.
#[derive(Serialize)]
struct Report<'a> {
    program: String,
    mesh: &'a PathBuf,
    scene: &'a PathBuf,
    vertices: usize,
    nodes: usize,
    faces: usize,
    held_nodes: usize,
    self_thickness: Option<f64>,
    /// The largest force left by relaxing, relative, if the scene asked for it.
    relax_residual: Option<f64>,
    frames: Vec<DrapeReport>,
    files: Vec<PathBuf>,
    seconds: Seconds,
}

#[derive(Default, Serialize)]
struct Seconds {
    prepare: f64,
    step: f64,
    total: f64,
}

/// Steps.
pub fn run(arguments: &Arguments, console: Console) -> Result<Ending> {
    let began = Instant::now();
    check_outputs(arguments)?;
    let progress = Progress::new(console.quiet);
    progress.stage("reading");
    let (mesh, library, _) = inputs::all(&arguments.mesh, &arguments.templates, &arguments.map, None)?;
    let scene = scene_json::read_file(&arguments.scene)?;
    let range = match &arguments.frame_range {
        Some(text) => frame_range(text, scene.frames)?,
        None => 0..scene.frames,
    };
    let said = check(&mesh, &scene)?;
    if arguments.check {
        progress.finish();
        let mut text = String::new();
        said.selects.iter().for_each(|line| text += &format!("{line}\n"));
        said.ignored.iter().for_each(|line| text += &format!("ignored: {line}\n"));
        super::print(&text)?;
        return Ok(Ending::Done);
    }
    said.selects.iter().for_each(|line| console.say(line));
    said.ignored.iter().for_each(|line| console.warn(format_args!("ignored: {line}")));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build();
    let pool = pool.map_err(|e| Error::invalid(format_args!("threads cannot be started: {e}")))?;
    let job = Job { arguments, console, progress, mesh, library, scene, began };
    pool.install(|| job.frames(range))
}

/// Outputs must have a folder, and be neither each other nor an input.
fn check_outputs(arguments: &Arguments) -> Result<()> {
    let same = |path: &PathBuf| std::fs::canonicalize(path).unwrap_or_else(|_| path.clone());
    let mut seen: Vec<PathBuf> =
        arguments.templates.iter().chain([&arguments.mesh, &arguments.scene]).map(same).collect();
    for path in arguments.output.iter().chain(&arguments.report) {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
        if folder.is_some_and(|f| !f.is_dir()) {
            return Err(Error::invalid(format_args!("{}: its folder does not exist", path.display())));
        }
        let place = same(path);
        if seen.contains(&place) {
            return Err(Error::invalid(format_args!(
                "{}: an output would replace an input or another output",
                path.display()
            )));
        }
        seen.push(place);
    }
    if let Some(path) = arguments.output.as_ref().filter(|p| !["npy", "obj"].contains(&extension(p).as_str()))
    {
        return Err(Error::invalid(format_args!(
            "{}: found another kind of file, expected .npy (all frames) or .obj (a file a frame)",
            path.display()
        )));
    }
    Ok(())
}

struct Job<'a> {
    arguments: &'a Arguments,
    console: Console,
    progress: Progress,
    mesh: StitchMesh,
    library: TemplateLibrary,
    scene: DrapeScene,
    began: Instant,
}

impl Job<'_> {
    fn frames(self, range: std::ops::Range<usize>) -> Result<Ending> {
        let Job { arguments, console, progress, mesh, library, scene, began } = self;
        progress.stage(if scene.relax { "relaxing" } else { "compiling" });
        let mut drape = Drape::new(&mesh, &library, &scene, &ClothOptions::default())?;
        if let Some(relaxed) = drape.relaxed().filter(|r| !r.converged) {
            console.warn(format_args!(
                "relaxing ended with forces of {:.1e} of the fabric's stiffness left",
                relaxed.residual
            ));
        }
        let mut seconds = Seconds { prepare: began.elapsed().as_secs_f64(), ..Seconds::default() };
        let output = arguments.output.as_deref().unwrap_or("".as_ref());
        let mut writer = FramesWriter::create(output, range.len(), &mesh)?;
        progress.steps(range.end, "stepping and writing", "frame");
        let began_steps = Instant::now();
        let mut reports = Vec::new();
        while reports.len() < range.end && drape.advance() {
            let frame = reports.len();
            reports.push(*drape.report());
            if range.contains(&frame) {
                writer.frame(frame, drape.positions())?;
            }
            progress.update(frame + 1);
        }
        let files = writer.finish()?;
        progress.finish();
        seconds.step = began_steps.elapsed().as_secs_f64();
        seconds.total = began.elapsed().as_secs_f64();
        files.iter().for_each(|file| console.say(format_args!("wrote {}", file.display())));
        let cut: u32 = reports.iter().map(|r| r.cut).sum();
        if cut > 0 {
            console.warn(format_args!("frames were done again in smaller steps {cut} times"));
        }
        let damped: Vec<usize> = reports.iter().filter(|r| r.damped).map(|r| r.frame).collect();
        if let Some(first) = damped.first() {
            console.warn(format_args!(
                "{} frames stayed bad in the smallest steps and were left out, the cloth at rest; the first is {first}",
                damped.len()
            ));
        }
        let ending = if damped.is_empty() { Ending::Done } else { Ending::Broken };
        if let Some(path) = &arguments.report {
            let report = Report {
                program: format!("knotmesh {}", env!("CARGO_PKG_VERSION")),
                mesh: &arguments.mesh,
                scene: &arguments.scene,
                vertices: mesh.positions.len(),
                nodes: drape.stepper().positions().len(),
                faces: mesh.face_count(),
                held_nodes: drape.stage().held().len(),
                self_thickness: drape.stage().self_thickness(),
                relax_residual: drape.relaxed().map(|r| r.residual),
                frames: reports,
                files,
                seconds,
            };
            let mut out = Output::create(path)?;
            let mut text = serde_json::to_string_pretty(&report).map_err(Error::invalid)?;
            text.push('\n');
            out.put(text.as_bytes())?;
            out.commit()?;
        }
        Ok(ending)
    }
}
