//! `knotmesh view`: a window on a pattern, a chart or a mesh.

use super::Ending;
use super::inputs::{self, Rename};
use super::knit::gauge;
use super::relax::ModeName;
use knotmesh::Result;
use knotmesh::design::expression::Gauge;
use knotmesh::view::{self, Kind, Launch, Options, Settings};
use std::path::PathBuf;
use std::sync::Arc;

#[derive(clap::Args)]
pub struct Arguments {
    /// A pattern (.knit), a chart (.chart, .json, .png) or a stitch mesh (.smobj, .obj); without, a new pattern.
    file: Option<PathBuf>,
    /// Template libraries (.json, .sf, or directories of them) on top of the embedded one.
    #[arg(long, value_name = "FILE|DIR")]
    templates: Vec<PathBuf>,
    /// Motion of a mesh: .npy `[frame, vertex, 3]`, or OBJ files by a (quoted) glob pattern.
    #[arg(long, value_name = "FRAMES")]
    frames: Option<String>,
    /// Rename stitches of a mesh: a full key or a bare name on either side.
    #[arg(long = "map", value_name = "OLDKEY=KEY")]
    map: Vec<Rename>,
    /// What is shown at first.
    #[arg(long, value_enum, default_value = "relax")]
    mode: ModeName,
    /// Knot spacing at first: 1 plain interpolation, 0 loops as wide as at rest.
    #[arg(long, default_value_t = 1.0)]
    beta: f64,
    /// Stitches and rows on 10 cm at first, instead of the pattern's own: 22x36, or 22.
    #[arg(long, value_name = "STITCHESxROWS", value_parser = gauge)]
    gauge: Option<Gauge>,
    /// Which of the pattern's sizes at first.
    #[arg(long, value_name = "NAME")]
    size: Option<String>,
    /// Part of the name of the adapter to draw with.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Width and height of the window.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size, hide = true)]
    window: Option<[f32; 2]>,
    /// Plays a script (docs/view.md), then closes.
    #[arg(long, value_name = "FILE", hide = true)]
    script: Option<PathBuf>,
}

/// `1280x800`
fn size(text: &str) -> Result<[f32; 2], String> {
    let number = |t: &str| t.parse::<u16>().ok().filter(|n| (100..=8000).contains(n)).map(f32::from);
    let both = text.split_once('x').and_then(|(w, h)| Some([number(w)?, number(h)?]));
    both.ok_or_else(|| format!("found '{text}', expected width x height, each from 100 to 8000"))
}

/// Opens the window.
pub fn run(arguments: &Arguments) -> Result<Ending> {
    if let Some(path) = &arguments.file {
        Kind::of(path)?;
    }
    let library = Arc::new(inputs::library(&arguments.templates)?);
    let (of_reader, map) = (library.clone(), arguments.map.clone());
    let settings = Settings {
        mode: arguments.mode.into(),
        beta: arguments.beta,
        gauge: arguments.gauge.map(|g| [0.1 / g.width, 0.1 / g.height]),
        size: arguments.size.clone(),
        ..Settings::default()
    };
    let options = Options {
        library,
        settings,
        frames: arguments.frames.clone(),
        reader: Arc::new(move |path| inputs::mesh(path, &of_reader, &map)),
        wake: Arc::new(|| {}),
    };
    let (script, adapter) = (arguments.script.clone(), arguments.adapter.clone());
    view::run(arguments.file.as_deref(), options, &Launch { script, adapter, size: arguments.window })?;
    Ok(Ending::Done)
}
