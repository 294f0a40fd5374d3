//! `knotmesh relax-mesh`: a stitch mesh in, the same with its faces at their natural sizes out.

use super::knit::percent;
use super::report::write_json;
use super::{Console, Ending, complain, inputs, print};
use knotmesh::cloth::{Cloth, ClothOptions, RelaxOptions, RelaxReport, Sizes, relax};
use knotmesh::io::output::Output;
use knotmesh::io::text::extension;
use knotmesh::io::{smobj, stitch_sizes};
use knotmesh::mesh::StitchMesh;
use knotmesh::{Error, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Width of a stitch where the mesh does not say in what unit it is: 22 stitches on 10 cm, worsted yarn.
const STITCH: f64 = 0.0045;

/// Widths of a stitch, metres, at which a mesh is taken to be in metres.
const METRIC: std::ops::RangeInclusive<f64> = 0.0005..=0.05;

#[derive(clap::Args)]
pub struct Arguments {
    /// The stitch mesh: .smobj, or .obj with stitches named by material or group.
    mesh: PathBuf,
    /// The relaxed mesh (.smobj). All but positions is kept.
    #[arg(short, long, value_name = "MESH2.smobj", required_unless_present = "check")]
    output: Option<PathBuf>,
    /// Stitches and rows per 10 cm of plain fabric, such as 22x30. Without it the size of a stitch is what the mesh was
    /// made to (by `knit`), else measured: the mesh's area over that of its templates.
    #[arg(long, value_name = "STITCHESxROWS")]
    gauge: Option<Gauge>,
    /// Factors of the natural sizes of stitch types: JSON, {"tuck+": {"course": 1.2, "wale": 0.8}}.
    #[arg(long, value_name = "FILE.json")]
    sizes: Option<PathBuf>,
    /// Metres of a mesh unit [default: 1 with --gauge or where a stitch is then 0.5 to 50 mm wide, else such that it is 4.5 mm
    /// wide].
    #[arg(long, value_name = "METRES")]
    unit: Option<f64>,
    /// Template libraries (.json, .sf, or directories of them) on top of the embedded one.
    #[arg(long, value_name = "FILE|DIR")]
    templates: Vec<PathBuf>,
    /// The largest force on a vertex at which it ends, relative to stretch stiffness times stitch size.
    #[arg(long, default_value_t = RelaxOptions::default().residual)]
    residual: f64,
    /// Steps at most.
    #[arg(long, default_value_t = RelaxOptions::default().iterations)]
    iterations: usize,
    /// So many times as stiff against bending at first: what is rough is smooth before it buckles. 30 suits garments.
    #[arg(long, value_name = "TIMES", default_value_t = 1.0, value_parser = times)]
    stiffer: f64,
    /// What encloses room lies as on a form that widens a tube by so many per cent. 3 suits garments.
    #[arg(long, value_name = "PERCENT", default_value_t = 0.0, value_parser = percent)]
    inflate: f64,
    /// Write counts, sizes, energies and times as JSON.
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Read everything, say what there is and what has no effect, and stop.
    #[arg(long)]
    check: bool,
}

fn times(text: &str) -> std::result::Result<f64, String> {
    let number = text.parse().ok().filter(|x| (1.0..=1e6).contains(x));
    number.ok_or_else(|| format!("found '{text}', expected a number from 1 to 1e6"))
}

/// Stitches and rows per 10 cm.
#[derive(Clone, Copy, Debug)]
struct Gauge([f64; 2]);

impl std::str::FromStr for Gauge {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let numbers = text.split_once('x').and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
        numbers
            .filter(|n| n.iter().all(|x| (0.1..=1000.0).contains(x)))
            .map(Self)
            .ok_or_else(|| "expected stitches and rows per 10 cm, such as 22x30".into())
    }
}

#[derive(Serialize)]
struct Report {
    mesh: PathBuf,
    faces: usize,
    nodes: usize,
    /// Metres.
    metres_of_a_unit: f64,
    natural_width: f64,
    natural_height: f64,
    iterations: usize,
    rounds: usize,
    residual: f64,
    residual_bound: f64,
    converged: bool,
    kept_flat: bool,
    /// Faces that fold upon themselves or their neighbours at the end.
    folded_faces: usize,
    /// Joules.
    energy_start: f64,
    energy_end: f64,
    /// Root mean square of the strains of edges.
    strain_start: f64,
    strain_end: f64,
    seconds: f64,
}

/// Relaxes a mesh.
pub fn run(arguments: &Arguments, console: Console) -> Result<Ending> {
    check_arguments(arguments)?;
    let library = inputs::library(&arguments.templates)?;
    let mut mesh = inputs::mesh(&arguments.mesh, &library, &[])?;
    let mut options = ClothOptions {
        sizes: arguments.gauge.map(|Gauge([stitches, rows])| Sizes::of_gauge(stitches, rows)),
        ..ClothOptions::default()
    };
    if let Some(path) = &arguments.sizes {
        options.types = stitch_sizes::read_file(path)?;
    }
    let ignored: Vec<&String> =
        options.types.keys().filter(|name| !mesh.types.iter().any(|t| t.name == **name)).collect();
    for name in &ignored {
        console.warn(format_args!("--sizes names '{name}', a stitch that the mesh does not have: no effect"));
    }
    let unknown =
        (0..mesh.face_count()).filter(|f| library.find(mesh.face_type((*f).into())).is_none()).count();
    if unknown > 0 {
        console
            .warn(format_args!("{unknown} faces have stitches that the library lacks: taken as plain ones"));
    }
    let unit = match (arguments.unit, arguments.gauge) {
        (Some(unit), _) => unit,
        (None, Some(_)) => 1.0,
        (None, None) => unit_of(&Cloth::new(&mesh, &library, &options)?),
    };
    mesh.positions.iter_mut().for_each(|p| *p *= unit);
    mesh.gauge = mesh.gauge.map(|size| size.map(|x| x * unit));
    let cloth = Cloth::new(&mesh, &library, &options)?;
    let sizes = cloth.sizes();
    let summary = format!(
        "{} faces, {} nodes, {} springs; a mesh unit is {unit} m, a plain stitch {:.3} mm wide and {:.3} mm high",
        mesh.face_count(),
        cloth.node_count(),
        cloth.springs().len(),
        sizes.course * 1e3,
        sizes.wale * 1e3
    );
    if arguments.check {
        print(&format!("{summary}\n"))?;
        return Ok(Ending::Done);
    }
    console.say(&summary);
    let (report, relaxed) = solve(arguments, &mesh, &cloth, unit)?;
    mesh.positions = relaxed;
    // Natural sizes are what it is made to from now on, where they were not measured.
    if mesh.gauge.is_some() || arguments.gauge.is_some() {
        mesh.gauge = Some([sizes.course, sizes.wale].map(|x| x / unit));
    }
    if let Some(path) = &arguments.output {
        write(path, &mesh)?;
    }
    if let Some(path) = &arguments.report {
        write_json(path, &report)?;
    }
    console.say(format_args!(
        "{} iterations, residual {:.2e}, energy {:.3e} to {:.3e} J, {} folded faces, {:.2} s",
        report.iterations,
        report.residual,
        report.energy_start,
        report.energy_end,
        report.folded_faces,
        report.seconds
    ));
    if report.converged {
        return Ok(Ending::Done);
    }
    complain(format_args!(
        "{}: residual {:.2e} after {} iterations, expected {:.2e} or less; the mesh is written as far as it got",
        arguments.mesh.display(),
        report.residual,
        report.iterations,
        report.residual_bound
    ));
    Ok(Ending::Broken)
}

fn solve(
    arguments: &Arguments,
    mesh: &StitchMesh,
    cloth: &Cloth,
    unit: f64,
) -> Result<(Report, Vec<glam::DVec3>)> {
    let options = RelaxOptions {
        residual: arguments.residual,
        iterations: arguments.iterations,
        stiffer: arguments.stiffer,
        inflation: arguments.inflate / 100.0,
        ..RelaxOptions::default()
    };
    let mut nodes = cloth.rest_positions().to_vec();
    let strain_start = cloth.strain(&nodes);
    let began = Instant::now();
    let RelaxReport {
        iterations, rounds, residual, converged, energy_start, energy_end, flat, folded, ..
    } = relax(cloth, &mut nodes, &options)?;
    let seconds = began.elapsed().as_secs_f64();
    let report = Report {
        mesh: arguments.mesh.clone(),
        faces: mesh.face_count(),
        nodes: cloth.node_count(),
        metres_of_a_unit: unit,
        natural_width: cloth.sizes().course,
        natural_height: cloth.sizes().wale,
        iterations,
        rounds,
        residual,
        residual_bound: arguments.residual,
        converged,
        kept_flat: flat,
        folded_faces: folded,
        energy_start,
        energy_end,
        strain_start,
        strain_end: cloth.strain(&nodes),
        seconds,
    };
    let mut relaxed = mesh.positions.clone();
    cloth.write_back(&nodes, &mut relaxed);
    relaxed.iter_mut().for_each(|p| *p /= unit);
    Ok((report, relaxed))
}

/// Metres of a mesh unit by the width of its stitches.
fn unit_of(cloth: &Cloth) -> f64 {
    let width = cloth.sizes().course;
    if METRIC.contains(&width) { 1.0 } else { STITCH / width }
}

fn check_arguments(arguments: &Arguments) -> Result<()> {
    if arguments.unit.is_some_and(|u| !(1e-9..=1e9).contains(&u)) {
        return Err(Error::invalid("--unit: expected metres of a mesh unit, from 1e-9 to 1e9"));
    }
    if !(arguments.residual > 0.0 && arguments.residual.is_finite()) {
        return Err(Error::invalid("--residual: expected a positive number"));
    }
    if let Some(path) = arguments.output.as_ref().filter(|p| extension(p) != "smobj") {
        return Err(Error::invalid(format_args!("{}: expected an output of kind .smobj", path.display())));
    }
    let same = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let inputs = arguments.templates.iter().chain(&arguments.sizes).chain([&arguments.mesh]);
    let mut taken: Vec<PathBuf> = inputs.map(|p| same(p)).collect();
    for path in arguments.output.iter().chain(&arguments.report) {
        let place = same(path);
        if taken.contains(&place) && place.is_file() {
            return Err(Error::invalid(format_args!("{}: an output would replace an input", path.display())));
        }
        taken.push(place);
    }
    if let (Some(output), Some(report)) = (&arguments.output, &arguments.report)
        && output == report
    {
        return Err(Error::invalid(format_args!("{}: named as an output twice", output.display())));
    }
    Ok(())
}

fn write(path: &Path, mesh: &StitchMesh) -> Result<()> {
    let mut out = Output::create(path)?;
    smobj::write(mesh, &mut out).map_err(|e| Error::io(path, e))?;
    out.commit()
}
