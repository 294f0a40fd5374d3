//! `knotmesh render`: from anything that has yarn to pictures of it.

mod camera;
mod curves;
mod knitted;
mod output;
mod source;
mod values;

use super::device::DeviceArguments;
use super::inputs::Rename;
use super::knit::ChartArguments;
use super::progress::Progress;
use super::relax::ModeName;
use super::{Console, Ending};
use knotmesh::backend::gpu::Adapter;
use knotmesh::render::camera::{Camera, View};
use knotmesh::render::{Canvas, Legend, Look, Painter, Picture, Shading, Style, Yarn};
use knotmesh::{Error, Result};
use output::Pictures;
use source::Source;
use std::path::PathBuf;
use values::{Behind, Colour, Interval, Place};

#[derive(clap::Args)]
pub struct Arguments {
    /// A stitch mesh (.smobj, .obj with faces), a pattern (.knit) or a chart (.chart, .json, .png), all relaxed on the way; or
    /// curves (.yarns, .bcc, .usda, .npz, .txt, .pbrt, .obj with lines).
    pub input: PathBuf,
    /// A .png, numbered ones for several frames (out.%04d.png), a folder for them, or a .gif.
    #[arg(short, long, value_name = "OUT.png|OUT.gif|DIR")]
    pub output: PathBuf,
    /// What colours say: the yarns (or the stitches' own, of charts), tension (length over length at rest), error (how far
    /// that is from 1), energy (what the solver left), type (of stitches), tightness (how much of its face yarn covers).
    #[arg(long, value_enum, default_value = "yarn", help_heading = "Picture")]
    pub style: StyleName,
    /// Numbers between which colours change; found from all frames if not given.
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true, help_heading = "Picture")]
    pub range: Option<Interval>,
    /// Leave the legend out.
    #[arg(long, help_heading = "Picture")]
    pub no_legend: bool,
    /// Pixels across.
    #[arg(long, default_value_t = 1280, value_parser = clap::value_parser!(u32).range(16..=16384), help_heading = "Picture")]
    pub width: u32,
    /// Pixels down.
    #[arg(long, default_value_t = 960, value_parser = clap::value_parser!(u32).range(16..=16384), help_heading = "Picture")]
    pub height: u32,
    /// Samples a pixel, in fours; 16 on hardware, 8 on an adapter of software. Of several pictures, which move, up to 64 where yarn
    /// is thin: 32 over its radius in pixels.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096), help_heading = "Picture")]
    pub samples: Option<u32>,
    /// Colours of the yarns, one after the other and again from the first.
    #[arg(long, value_name = "#RRGGBB", help_heading = "Picture")]
    pub colour: Vec<Colour>,
    /// paper, white, transparent, a colour, or two of them (top and bottom).
    #[arg(long, value_name = "COLOUR[,COLOUR]", default_value = "paper", help_heading = "Picture")]
    pub background: Behind,
    /// Yarn throws no shadows.
    #[arg(long, help_heading = "Picture")]
    pub no_shadows: bool,
    /// Yarn is smooth: no plies, no fibres.
    #[arg(long, help_heading = "Picture")]
    pub no_plies: bool,
    /// Where from: front, back, left, right, top, bottom, quarter, or degrees around and above (35,25). Without, flat fabric
    /// is seen from its front, anything else a little from the side and above.
    #[arg(long, value_name = "NAME|AZ,EL", allow_hyphen_values = true, help_heading = "Camera")]
    pub camera: Option<View>,
    /// 2 shows half as much.
    #[arg(long, default_value_t = 1.0, help_heading = "Camera")]
    pub zoom: f64,
    /// What is in the middle of the picture, in the input's own units.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, help_heading = "Camera")]
    pub target: Option<Place>,
    /// The axis that points up. Without, that of the file, or the one that wales run along.
    #[arg(long, value_enum, help_heading = "Camera")]
    pub up: Option<Up>,
    /// So many pictures from all around.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000), help_heading = "Camera")]
    pub turntable: Option<u32>,
    /// Pictures a second, of a .gif.
    #[arg(long, default_value_t = 24.0, help_heading = "Camera")]
    pub fps: f64,
    /// Template libraries on top of the embedded one, as `relax` takes them.
    #[arg(long, value_name = "FILE|DIR", help_heading = "Meshes")]
    pub templates: Vec<PathBuf>,
    /// Rename stitches, as `relax` does.
    #[arg(long = "map", value_name = "OLDKEY=KEY", help_heading = "Meshes")]
    pub map: Vec<Rename>,
    /// Leave out faces whose stitch the library lacks.
    #[arg(long, help_heading = "Meshes")]
    pub skip_unknown: bool,
    /// Vertex positions over time: .npy or OBJ files, as `relax` takes them.
    #[arg(long, value_name = "FRAMES", help_heading = "Meshes")]
    pub frames: Option<String>,
    /// Which frames, of --frames or of a curve file: A:B (B not included).
    #[arg(long, value_name = "A:B", allow_hyphen_values = true)]
    pub frame_range: Option<String>,
    /// A mesh with the same vertices whose positions are the rest shape.
    #[arg(long, value_name = "MESH", help_heading = "Meshes")]
    pub rest: Option<PathBuf>,
    /// relax (the default) solves for the yarn, knots carries knots rigidly, embed interpolates every point.
    #[arg(long, value_enum, help_heading = "Meshes")]
    pub mode: Option<ModeName>,
    /// Knot spacing: 1 (the default) plain interpolation, 0 loops as wide as at rest.
    #[arg(long, help_heading = "Meshes")]
    pub beta: Option<f64>,
    /// Of a mesh: world units per course spacing. Of a pattern: stitches and rows on 10 cm, 22x36.
    #[arg(long, value_name = "UNITS|STITCHESxROWS", help_heading = "Meshes")]
    pub gauge: Option<String>,
    /// Which of a pattern's sizes; the first if not given.
    #[arg(long, value_name = "NAME", help_heading = "Meshes")]
    pub size: Option<String>,
    #[command(flatten, next_help_heading = "Meshes")]
    pub chart: ChartArguments,
    /// Give height to ribs of a mesh, as `relax` does.
    #[arg(long, help_heading = "Meshes")]
    pub fold_ribs: bool,
    /// Leave the ribs of a pattern flat, which are given height otherwise.
    #[arg(long, help_heading = "Meshes")]
    pub flat_ribs: bool,
    /// Exit 0 even if faces fell back to interpolation.
    #[arg(long, help_heading = "Meshes")]
    pub allow_degenerate: bool,
    /// Yarn radius of curves that have none of their own.
    #[arg(long, help_heading = "Curves")]
    pub radius: Option<f64>,
    /// What meshes are solved on, as `relax` takes it. Pictures are drawn on a GPU of hardware, else on one of software.
    #[command(flatten)]
    pub device: DeviceArguments,
    #[arg(long, hide = true)]
    pub backend: Option<String>,
    #[arg(long, hide = true)]
    pub model: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum StyleName {
    Yarn,
    Tension,
    Error,
    Energy,
    Type,
    Tightness,
}

impl From<StyleName> for Style {
    fn from(name: StyleName) -> Self {
        match name {
            StyleName::Yarn => Self::Yarn,
            StyleName::Tension => Self::Tension,
            StyleName::Error => Self::Error,
            StyleName::Energy => Self::Energy,
            StyleName::Type => Self::Type,
            StyleName::Tightness => Self::Tightness,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Up {
    Y,
    Z,
}

/// A picture to be made: its number, of which frame, turned by how many degrees.
struct Shot {
    number: usize,
    frame: usize,
    turn: f64,
}

/// Draws.
pub fn run(arguments: &Arguments, console: Console) -> Result<Ending> {
    check(arguments)?;
    output::check(arguments)?;
    let style = Style::from(arguments.style);
    let progress = Progress::new(console.quiet);
    progress.stage("reading");
    let mut source = Source::open(arguments, style, console)?;
    let frames = source.frames();
    let shots = shots(arguments, frames.clone())?;
    let mut pictures = Pictures::open(arguments, &source.stem(), shots.len(), source.moves())?;

    // Before anything is drawn, all frames are gone through: one framing and one range of numbers for all.
    progress.steps(frames.len(), "framing", "frame");
    let mut seen = Seen::default();
    for (done, frame) in frames.clone().enumerate() {
        source.read(frame)?;
        seen.add(&source, frames.len());
        progress.update(done + 1);
    }
    let range = range(arguments, style, &seen.numbers)?;
    let legend = legend(arguments, style, &source, range);
    let extent = seen.extent.ok_or_else(|| {
        Error::invalid(format_args!("{}: found no yarn to draw", arguments.input.display()))
    })?;
    let size = [arguments.width, arguments.height];
    let strip = legend.as_ref().map_or(Ok(0), |l| l.width(size))?;
    let view = camera::Framing::new(arguments, &source, &extent, [size[0] - strip, size[1]]);

    // The first pass needed points here; from now on they may stay where they are.
    if let Some(mesh) = source.mesh() {
        mesh.keep_points()?;
    }
    let mut studio = Studio::open(arguments, style, &mut source, [size[0] - strip, size[1]], console)?;
    if (source.moves() || arguments.turntable.is_some()) && arguments.samples.is_none() {
        let radius = view.pixels(extent.radius(), size[1]);
        studio.look.samples = studio.look.samples.max(Look::steady(radius));
    }
    progress.steps(shots.len(), "drawing", "picture");
    let mut shown = None;
    for (done, shot) in shots.iter().enumerate() {
        if shown != Some(shot.frame) {
            source.read(shot.frame)?;
            if let Some(range) = range {
                source.colour(|number| style.colour(range, number));
            }
            studio.show(&mut source)?;
            shown = Some(shot.frame);
        }
        let mut picture = studio.paint(&view.camera(shot.turn))?;
        if let Some(legend) = &legend {
            picture = picture.widened(strip, arguments.background.0);
            legend.draw(&mut picture)?;
        }
        pictures.put(shot.number, &picture)?;
        progress.update(done + 1);
    }
    let files = pictures.finish()?;
    progress.finish();
    for file in &files {
        console.say(format_args!("wrote {}", file.display()));
    }
    let fell_back = source.name_fallen(console);
    Ok(if fell_back && !arguments.allow_degenerate { Ending::FellBack } else { Ending::Done })
}

/// What all frames together have.
#[derive(Default)]
struct Seen {
    extent: Option<camera::Extent>,
    numbers: Vec<f32>,
}

impl Seen {
    /// A frame of so many.
    fn add(&mut self, source: &Source, frames: usize) {
        camera::Extent::add(&mut self.extent, source.strands(), frames);
        // Some millions are enough for a range.
        let numbers = source.numbers();
        let every = (numbers.len() / (4_000_000 / frames.max(1)).max(100)).max(1);
        self.numbers.extend(numbers.iter().step_by(every));
    }
}

/// Refuses numbers out of range and what other commands do, before anything is read.
fn check(arguments: &Arguments) -> Result<()> {
    if arguments.backend.as_deref().is_some_and(|b| b != "knots") || arguments.model.is_some() {
        return Err(Error::invalid(format_args!(
            "--backend database: render draws its results: 'knotmesh relax {0} --backend database --model MODEL -o yarn.npz', \
             then 'knotmesh render yarn.npz'",
            arguments.input.display()
        )));
    }
    let positive = |name: &str, value: f64| {
        if value.is_finite() && value > 0.0 {
            return Ok(());
        }
        Err(Error::invalid(format_args!("{name}: found {value}, expected a positive number")))
    };
    positive("--zoom", arguments.zoom)?;
    positive("--fps", arguments.fps)?;
    positive("--radius", arguments.radius.unwrap_or(1.0))?;
    let style = Style::from(arguments.style);
    if let Some(Interval([low, high])) = arguments.range {
        if !style.is_number() {
            return Err(Error::invalid("--range: expected a --style of numbers beside it: tension, say"));
        }
        if style == Style::Energy && low <= 0.0 {
            return Err(Error::invalid(format_args!(
                "--range {low},{high}: expected numbers above 0, for energies are shown by their logarithm"
            )));
        }
    }
    if !arguments.colour.is_empty() && style != Style::Yarn {
        return Err(Error::invalid(
            "--colour: expected --style yarn; other styles have colours of their own",
        ));
    }
    Ok(())
}

/// Which pictures there are to be.
fn shots(arguments: &Arguments, frames: std::ops::Range<usize>) -> Result<Vec<Shot>> {
    let Some(count) = arguments.turntable else {
        return Ok(frames.map(|frame| Shot { number: frame, frame, turn: 0.0 }).collect());
    };
    if frames.len() > 1 {
        return Err(Error::invalid(format_args!(
            "--turntable: found {} frames, expected one: --frame-range {}:{} takes the first",
            frames.len(),
            frames.start,
            frames.start + 1
        )));
    }
    let turn = |i: u32| 360.0 * f64::from(i) / f64::from(count);
    Ok((0..count).map(|i| Shot { number: i as usize, frame: frames.start, turn: turn(i) }).collect())
}

/// Between which numbers colours change, where the style has any.
fn range(arguments: &Arguments, style: Style, numbers: &[f32]) -> Result<Option<[f64; 2]>> {
    if !style.is_number() {
        return Ok(None);
    }
    let found = style.range(numbers).ok_or_else(|| {
        Error::invalid("--style: found nothing to measure: no segment's length at rest is known, or no face has any yarn")
    })?;
    Ok(Some(arguments.range.as_ref().map_or(found, |given| given.0)))
}

fn legend(arguments: &Arguments, style: Style, source: &Source, range: Option<[f64; 2]>) -> Option<Legend> {
    if arguments.no_legend {
        return None;
    }
    match range {
        Some(range) => Some(style.legend(range, source.over())),
        None if style == Style::Type => source.kinds_legend(),
        None => None,
    }
}

/// A painter, and what it paints on.
struct Studio {
    painter: Painter,
    canvas: Canvas,
    look: Look,
    yarn: Option<(Yarn, Vec<u32>)>,
}

impl Studio {
    fn open(
        arguments: &Arguments,
        style: Style,
        source: &mut Source,
        size: [u32; 2],
        console: Console,
    ) -> Result<Self> {
        let name = arguments.device.adapter.as_deref();
        let adapter = match name {
            Some(_) => Adapter::choose(name)?,
            None => Adapter::choose(None).map_err(|_| {
                Error::invalid(
                    "no GPU adapter to draw on: expected a Vulkan, Metal or DirectX 12 driver; one of software serves \
                     too (Debian and Ubuntu: apt install mesa-vulkan-drivers)",
                )
            })?,
        };
        let report = adapter.report();
        console.say(format_args!("drawing on {report}"));
        let beside = source.mesh().and_then(|mesh| mesh.device_points());
        let painter = beside.map_or_else(|| Painter::open(&adapter), |points| Painter::beside(&points))?;
        let canvas = painter.canvas(size[0], size[1])?;
        let look = Look {
            shading: if style == Style::Yarn { Shading::Yarn } else { Shading::Numbers },
            background: arguments.background.0,
            samples: arguments.samples.unwrap_or(if report.is_software() { 8 } else { 16 }),
            shadows: !arguments.no_shadows,
            plies: !arguments.no_plies,
            ..Look::default()
        };
        Ok(Self { painter, canvas, look, yarn: None })
    }

    /// Takes the yarn of the frame that was read last.
    fn show(&mut self, source: &mut Source) -> Result<()> {
        let strands = source.strands();
        match &mut self.yarn {
            Some((yarn, offsets)) if *offsets == strands.offsets => {
                if source.has_points() {
                    self.painter.update(yarn, source.strands())?;
                }
            }
            yarn => *yarn = Some((self.painter.yarn(strands)?, strands.offsets.clone())),
        }
        // Points that are not here lie on the device.
        if let (Some((yarn, _)), Some(mesh)) = (&mut self.yarn, source.mesh())
            && !mesh.has_points()
            && let Some(points) = mesh.device_points()
        {
            self.painter.take(yarn, &points, mesh.bounds())?;
        }
        Ok(())
    }

    fn paint(&mut self, camera: &Camera) -> Result<Picture> {
        if let Some((yarn, _)) = &mut self.yarn {
            self.painter.paint(&self.canvas, yarn, camera, &self.look)?;
        }
        self.painter.picture(&self.canvas)
    }
}
