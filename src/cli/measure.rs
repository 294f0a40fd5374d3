//! `knotmesh measure`: run time against error.

use super::device::DeviceName;
use super::inputs::{self, Rename};
use super::progress::Progress;
use super::relax::CoordinatesName;
use super::{Console, measure_database, print};
use knotmesh::io::frames::{Frames, frame_range};
use knotmesh::io::output::Output;
use knotmesh::knot::Settings;
use knotmesh::measure::machine::{machine, today};
use knotmesh::measure::tradeoff::poses::{Pose, standard};
use knotmesh::measure::tradeoff::variants::{Variant, gpu_variants, variants};
use knotmesh::measure::tradeoff::{self, Job, Tradeoff, plot, table};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::SceneOptions;
use knotmesh::{Error, Result};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub struct Arguments {
    /// The stitch mesh: .smobj, or .obj with stitches named by material or group.
    #[arg(required_unless_present = "against_database")]
    mesh: Option<PathBuf>,
    /// Instead: the knot model against yarn-level simulation, on a swatch of its own of the plain knit that a yarn model
    /// holds (a folder: pyp, sxsasy/axes.txt, sxsasy/data.npy; or .npz). Takes --templates and --output.
    #[arg(long, value_name = "DIR|FILE.npz", conflicts_with_all = ["mesh", "frames", "rest", "map", "gauge", "only"])]
    against_database: Option<PathBuf>,
    /// Template libraries (.json, .sf, or directories of them) on top of the embedded one.
    #[arg(long, value_name = "FILE|DIR")]
    templates: Vec<PathBuf>,
    /// Vertex positions over time: .npy `[frame, vertex, 3]`, or OBJ files by a (quoted) glob pattern. Without it,
    /// the mesh as it is and under four deformations of its space: its longest side x 1.3, its second longest
    /// x 1.3, sheared by 0.2, bent by 90 degrees.
    #[arg(long, value_name = "FRAMES")]
    frames: Option<String>,
    /// Which frames: A:B (B not included), either side may be left out; negative numbers count from the end.
    #[arg(long, value_name = "A:B", requires = "frames", allow_hyphen_values = true)]
    frame_range: Option<String>,
    /// A mesh with the same vertices whose positions are the rest shape (for the gauge).
    #[arg(long, value_name = "MESH")]
    rest: Option<PathBuf>,
    /// Rename stitches: a full key or a bare name on either side.
    #[arg(long = "map", value_name = "OLDKEY=KEY")]
    map: Vec<Rename>,
    /// Knot spacing: 1 plain interpolation, 0 loops as wide as at rest.
    #[arg(long, default_value_t = 1.0)]
    beta: f64,
    /// Weight of angles in the energy.
    #[arg(long, default_value_t = 1.0)]
    weight_angle: f64,
    /// Weight of lengths in the energy.
    #[arg(long, default_value_t = 100.0)]
    weight_length: f64,
    /// World units per course spacing; measured from the rest mesh if not given.
    #[arg(long)]
    gauge: Option<f64>,
    /// mean-value joins corners across faces; wachspress treats each face on its own.
    #[arg(long, value_enum, default_value = "mean-value")]
    coordinates: CoordinatesName,
    /// Leave out faces whose stitch the library lacks.
    #[arg(long)]
    skip_unknown: bool,
    /// Threads of each variant; 0 takes one per core. (The variant 'all cores' takes all.)
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Timed passes over the frames, of which medians are taken; slow variants make fewer.
    #[arg(long, default_value_t = 7)]
    repeats: usize,
    /// gpu measures the best GPU adapter as well, auto does if it is hardware.
    #[arg(long, value_enum, default_value = "auto")]
    device: DeviceName,
    /// The adapter to take, by a part of its name; `knotmesh info --adapters` lists them.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Fewer numbers of steps.
    #[arg(long)]
    quick: bool,
    /// Only variants whose name contains one of these.
    #[arg(long, value_name = "TEXT")]
    only: Vec<String>,
    /// Write measure.csv (a row a variant), frames.csv (and frame), measure.txt, measure.svg and measure.png into
    /// this folder, which is made if it is missing; without it only the table is printed. With --against-database:
    /// comparison.csv, comparison.txt, distances and shapes as .svg and .png.
    #[arg(short, long = "output", value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Measures.
pub fn run(arguments: &Arguments, console: Console) -> Result<()> {
    let mesh = match (&arguments.against_database, &arguments.mesh) {
        (Some(model), _) => {
            let folder = arguments.output.as_deref();
            return measure_database::run(model, &arguments.templates, folder, console);
        }
        (None, Some(mesh)) => mesh,
        (None, None) => return Err(Error::invalid("no mesh is given: nothing to measure")),
    };
    if !(1..=10_000).contains(&arguments.repeats) {
        return Err(Error::invalid("--repeats goes from 1 to 10000"));
    }
    let variants = chosen(arguments)?;
    let progress = Progress::new(console.quiet);
    progress.stage("reading");
    let (mesh, library, rest) =
        inputs::all(mesh, &arguments.templates, &arguments.map, arguments.rest.as_deref())?;
    let poses = poses(arguments, &mesh)?;
    let options = SceneOptions {
        coordinates: arguments.coordinates.into(),
        skip_unknown: arguments.skip_unknown,
        gauge: arguments.gauge,
        rest,
        ..SceneOptions::default()
    };
    // Made before the work, so that a place that cannot be written to is known at once.
    if let Some(folder) = &arguments.output {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    }
    let job = Job {
        mesh: &mesh,
        library: &library,
        options,
        variants,
        poses,
        repeats: arguments.repeats,
        adapter: arguments.adapter.as_deref(),
    };
    let mut begun = false;
    let tradeoff = tradeoff::run(&job, &mut |done, of, _| {
        if !begun {
            progress.steps(of, "measuring", "step");
            begun = true;
        }
        progress.update(done);
    })?;
    progress.finish();

    let text = listing(arguments, &job, &tradeoff);
    print(&text)?;
    match &arguments.output {
        Some(folder) => write(arguments, folder, &text, &job, &tradeoff, console),
        None => Ok(()),
    }
}

/// The variants asked for.
fn chosen(arguments: &Arguments) -> Result<Vec<Variant>> {
    let base = Settings {
        beta: arguments.beta,
        weight_angle: arguments.weight_angle,
        weight_length: arguments.weight_length,
        ..Settings::default()
    };
    let mut variants = variants(&base, arguments.threads, arguments.quick);
    if has_gpu(arguments)?.is_some() {
        variants.extend(gpu_variants(&base));
    }
    let wanted = |v: &Variant| arguments.only.is_empty() || arguments.only.iter().any(|t| v.name.contains(t));
    variants.retain(wanted);
    if variants.is_empty() {
        return Err(Error::invalid(format_args!(
            "--only {}: no variant has that in its name",
            arguments.only.join(" --only ")
        )));
    }
    Ok(variants)
}

/// The GPU that is measured as well, if one is.
#[cfg(feature = "gpu")]
fn has_gpu(arguments: &Arguments) -> Result<Option<String>> {
    use knotmesh::backend::gpu::Adapter;
    let name = arguments.adapter.as_deref();
    let adapter = match (arguments.device, name) {
        (DeviceName::Cpu, _) => None,
        (DeviceName::Gpu, _) | (DeviceName::Auto, Some(_)) => Some(Adapter::choose(name)?),
        (DeviceName::Auto, None) => Adapter::hardware(),
    };
    Ok(adapter.map(|a| a.report().to_string()))
}

#[cfg(not(feature = "gpu"))]
fn has_gpu(arguments: &Arguments) -> Result<Option<String>> {
    if arguments.device == DeviceName::Gpu {
        return Err(Error::invalid("this build has no GPU backend: expected --device cpu"));
    }
    Ok(None)
}

/// The frames: those given, or the mesh under standard deformations.
fn poses(arguments: &Arguments, mesh: &StitchMesh) -> Result<Vec<Pose>> {
    let Some(pattern) = &arguments.frames else { return Ok(standard(&mesh.positions)) };
    let mut source = Frames::open(pattern, mesh.positions.len())?;
    let range = match &arguments.frame_range {
        Some(text) => frame_range(text, source.len())?,
        None => 0..source.len(),
    };
    let mut poses = Vec::with_capacity(range.len());
    for frame in range {
        let mut pose = Pose { name: format!("frame {frame}"), positions: Vec::new() };
        source.read(frame, &mut pose.positions)?;
        poses.push(pose);
    }
    if poses.is_empty() {
        return Err(Error::invalid("the frame source holds no frames: nothing to measure"));
    }
    Ok(poses)
}

/// What was measured: mesh and size, frames.
fn subject(arguments: &Arguments, job: &Job, tradeoff: &Tradeoff) -> (String, String) {
    let path = arguments.mesh.as_deref().and_then(Path::file_name);
    let name = path.unwrap_or_default().to_string_lossy().into_owned();
    let frames = match (&arguments.frames, job.poses.len()) {
        (Some(_), 1) => "1 frame".to_string(),
        (Some(pattern), n) => {
            let pattern = Path::new(pattern).file_name().unwrap_or_default().to_string_lossy().into_owned();
            format!("{n} frames of {pattern}")
        }
        (None, _) => {
            let names: Vec<&str> = job.poses.iter().map(|p| p.name.as_str()).collect();
            names.join("; ")
        }
    };
    let stitches = format!("{name}, {} stitches ({} with knots)", tradeoff.stitches, tradeoff.compared);
    (stitches, frames)
}

/// Where and when.
fn place(arguments: &Arguments) -> String {
    let gpu = has_gpu(arguments).ok().flatten().map(|gpu| format!("; {gpu}")).unwrap_or_default();
    format!("knotmesh {}; {}{gpu}; {}", env!("CARGO_PKG_VERSION"), machine(), today())
}

/// The table with what one needs to know to read it.
fn listing(arguments: &Arguments, job: &Job, tradeoff: &Tradeoff) -> String {
    let command: Vec<String> =
        std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned()).collect();
    let (stitches, frames) = subject(arguments, job, tradeoff);
    format!(
        "{stitches}\nframes: {frames}\n{}\nknotmesh {}\n\n{}\n{}",
        place(arguments),
        command.join(" "),
        table::printed(&tradeoff.rows),
        table::EXPLANATION
    )
}

fn write(
    arguments: &Arguments,
    folder: &Path,
    text: &str,
    job: &Job,
    tradeoff: &Tradeoff,
    console: Console,
) -> Result<()> {
    let (stitches, frames) = subject(arguments, job, tradeoff);
    let title = format!("Run time against error: {stitches}");
    let subtitle = [frames, place(arguments)];
    let put = |name: &str, bytes: &[u8]| -> Result<()> {
        let path = folder.join(name);
        let mut out = Output::create(&path)?;
        out.put(bytes)?;
        out.commit()?;
        console.say(format_args!("wrote {}", path.display()));
        Ok(())
    };
    // Figures first: a plot needs variants with both a time and a distance.
    put("measure.csv", table::csv(&tradeoff.rows).as_bytes())?;
    put("frames.csv", table::csv(&tradeoff.frame_rows).as_bytes())?;
    put("measure.txt", text.as_bytes())?;
    put("measure.svg", plot::svg(&tradeoff.rows, &title, &subtitle)?.as_bytes())?;
    put("measure.png", &plot::png(&tradeoff.rows, &title, &subtitle)?)
}
