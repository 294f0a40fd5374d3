//! `knotmesh convert`: between the curve formats.

use super::Console;
use knotmesh::Result;
use knotmesh::io::convert::convert;
use knotmesh::io::curves::{UpAxis, WriteOptions};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Arguments {
    /// Curves: .yarns, .bcc, .obj (lines), .npz, .usda, .txt (Mitsuba), .pbrt
    input: PathBuf,
    /// The same kinds. Several frames into a format without time become numbered files (out.%04d.bcc).
    output: PathBuf,
    /// Yarn radius in world units, for formats that need one when the input has none.
    #[arg(long)]
    radius: Option<f64>,
    /// The axis that points up (.bcc, .usda).
    #[arg(long, value_enum, default_value = "y")]
    up: Up,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Up {
    Y,
    Z,
}

/// Converts.
pub fn run(arguments: &Arguments, console: Console) -> Result<()> {
    let up = match arguments.up {
        Up::Y => UpAxis::Y,
        Up::Z => UpAxis::Z,
    };
    let options = WriteOptions { radius: arguments.radius, up, ..WriteOptions::default() };
    let summary = convert(&arguments.input, &arguments.output, &options)?;
    for note in &summary.notes {
        console.warn(note);
    }
    console.say(summary);
    Ok(())
}
