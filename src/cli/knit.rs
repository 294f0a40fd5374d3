//! `knotmesh knit`: from a pattern to a stitch mesh.

use super::{Console, Ending, print};
use knotmesh::cloth::{Cloth, ClothOptions, RelaxOptions, Sizes, relax};
use knotmesh::design::expression::Gauge;
use knotmesh::design::{Knitted, Settings};
use knotmesh::io::chart::swatch::Swatch;
use knotmesh::io::output::Output;
use knotmesh::io::{chart, pattern, smobj};
use knotmesh::template::TemplateLibrary;
use knotmesh::{Error, Result};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub struct Arguments {
    /// The pattern (.knit): rows and rounds as knitters write them. Or a chart (.json, .chart, .png), knit flat.
    pattern: PathBuf,
    /// The stitch mesh (.smobj), in metres.
    #[arg(short, long, required_unless_present = "check")]
    output: Option<PathBuf>,
    /// Stitches and rows on 10 cm, instead of the pattern's own: 22x36, or 22 (rows as the templates have them).
    #[arg(long, value_name = "STITCHESxROWS", value_parser = gauge)]
    gauge: Option<Gauge>,
    /// Which of the pattern's sizes; the first if not given.
    #[arg(long, value_name = "NAME")]
    size: Option<String>,
    #[command(flatten)]
    chart: ChartArguments,
    /// Give every stitch its natural size (as relax-mesh --stiffer 30 --inflate 3); else places are rough.
    #[arg(long)]
    relax: bool,
    /// With --relax: what encloses room lies as on a form that widens a tube by so many per cent; 0 for nothing in it.
    #[arg(long, value_name = "PERCENT", default_value_t = 100.0 * RelaxOptions::garment().inflation, value_parser = percent)]
    inflate: f64,
    /// Work it and say how many stitches there are; write nothing.
    #[arg(long)]
    check: bool,
}

/// How a chart alone is worked.
#[derive(clap::Args)]
pub struct ChartArguments {
    /// Of a chart alone: how often it is worked, side by side and one above the other: 4x3.
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = repeat)]
    repeat: Option<(usize, usize)>,
    /// Of a chart alone: stitches and rows of garter around it.
    #[arg(long, value_name = "N")]
    border: Option<u16>,
}

impl ChartArguments {
    /// Whether anything was asked for.
    pub fn given(&self) -> bool {
        self.repeat.is_some() || self.border.is_some()
    }
}

/// Works a pattern or a chart.
pub(super) fn work(path: &Path, settings: &Settings, how: &ChartArguments) -> Result<Knitted> {
    if chart::is_chart(path) {
        let (columns, rows) = how.repeat.unwrap_or((1, 1));
        let border = how.border.unwrap_or(0).into();
        return chart::swatch::knit_file(path, settings, Swatch { columns, rows, border });
    }
    if how.given() {
        return Err(Error::invalid(format_args!(
            "{}: found --repeat or --border for a pattern, expected a chart (.chart, .json or .png)",
            path.display()
        )));
    }
    pattern::knit_file(path, settings)
}

/// `22x36`, `22`
pub fn gauge(text: &str) -> Result<Gauge, String> {
    let number = |t: &str| match t.trim().parse::<f64>() {
        Ok(x) if (0.1..=1000.0).contains(&x) => Ok(x),
        _ => Err(format!("found '{t}', expected stitches x rows on 10 cm, each from 0.1 to 1000")),
    };
    match text.split_once('x') {
        Some((stitches, rows)) => Ok(Gauge::per_10_cm(number(stitches)?, Some(number(rows)?))),
        None => Ok(Gauge::per_10_cm(number(text)?, None)),
    }
}

/// How much a tube is widened, per cent.
pub fn percent(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x| (0.0..=50.0).contains(x));
    number.ok_or_else(|| format!("found '{text}', expected per cent from 0 to 50"))
}

/// `4x3`
fn repeat(text: &str) -> Result<(usize, usize), String> {
    let number = |t: &str| t.trim().parse::<u16>().ok().filter(|n| *n > 0).map(usize::from);
    let both = text.split_once('x').and_then(|(columns, rows)| Some((number(columns)?, number(rows)?)));
    both.ok_or_else(|| format!("found '{text}', expected columns x rows, each from 1 to 65535"))
}

/// Knits.
pub fn run(arguments: &Arguments, console: Console) -> Result<Ending> {
    if let Some(output) = &arguments.output
        && output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("smobj"))
    {
        return Err(Error::invalid(format_args!(
            "{}: found another kind of output, expected .smobj",
            output.display()
        )));
    }
    let size = arguments.size.as_ref().map(|s| s.to_lowercase());
    let settings = Settings { gauge: arguments.gauge, size, ..Settings::default() };
    let mut knitted = work(&arguments.pattern, &settings, &arguments.chart)?;
    if arguments.check {
        print(&summary(&knitted))?;
    } else {
        console.say(summary(&knitted).trim_end().replace('\n', "; "));
    }
    let mut ending = Ending::Done;
    let options = RelaxOptions { inflation: arguments.inflate / 100.0, ..RelaxOptions::garment() };
    if arguments.relax && !arguments.check && !relaxed(&mut knitted, &options, console)? {
        ending = Ending::FellBack;
    }
    if let (Some(path), false) = (&arguments.output, arguments.check) {
        let mut output = Output::create(path)?;
        smobj::write(&knitted.mesh, &mut output).map_err(|e| Error::io(path, e))?;
        output.commit()?;
    }
    Ok(ending)
}

/// Relaxes the mesh; whether forces came within the bound.
pub(super) fn relaxed(knitted: &mut Knitted, how: &RelaxOptions, console: Console) -> Result<bool> {
    let Gauge { width, height } = knitted.gauge;
    let sizes = Some(Sizes { course: width, wale: height });
    let options = ClothOptions { sizes, ..ClothOptions::default() };
    let cloth = Cloth::new(&knitted.mesh, &TemplateLibrary::embedded(), &options)?;
    let mut nodes = cloth.rest_positions().to_vec();
    let report = relax(&cloth, &mut nodes, how)?;
    cloth.write_back(&nodes, &mut knitted.mesh.positions);
    console.say(format_args!(
        "relaxed in {} steps, {} rounds of conjugate gradients: energy {:.3e} J, was {:.3e} J; residual {:.1e}; {} folded faces",
        report.iterations,
        report.rounds,
        report.energy_end,
        report.energy_start,
        report.residual,
        report.folded
    ));
    if !report.converged {
        console.warn(format_args!(
            "the mesh is not quite at rest: a residual of {:.1e}, asked {:.1e}",
            report.residual, how.residual
        ));
    }
    Ok(report.converged)
}

/// What was knitted, in numbers.
fn summary(knitted: &Knitted) -> String {
    let mut text = String::new();
    if let Some(title) = &knitted.title {
        text += &format!("{title}\n");
    }
    if let Some(size) = &knitted.size {
        text += &format!("size: {size}\n");
    }
    let Gauge { width, height } = knitted.gauge;
    text += &format!("gauge: {:.4} x {:.4} on 10 cm\n", 0.1 / width, 0.1 / height);
    let made = knitted.made;
    text += &format!("stitches: {}\n", made.total());
    let kinds = [
        ("cast on", made.cast_on),
        ("worked", made.worked),
        ("bound off", made.bound_off),
        ("grafted", made.grafted),
        ("drawn together", made.drawn),
    ];
    for (kind, count) in kinds.into_iter().filter(|(_, count)| *count > 0) {
        text += &format!("  {count:7}  {kind}\n");
    }
    for piece in &knitted.pieces {
        let (rows, shape) = if piece.round { ("rounds", "in the round") } else { ("rows", "flat") };
        text += &format!(
            "piece {}: {shape}, {} {rows}, at most {} stitches\n",
            piece.name, piece.rows, piece.widest
        );
    }
    text += &format!("faces: {}\n", knitted.mesh.face_count());
    text
}
