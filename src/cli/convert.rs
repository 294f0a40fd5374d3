//! `knotmesh convert`: between the formats of curves, of yarn models, and from sequences of cloth.

use super::Console;
use knotmesh::Result;
use knotmesh::io::convert::convert;
use knotmesh::io::convert_database::{Kind, convert_model, convert_sequence};
use knotmesh::io::curves::{UpAxis, WriteOptions};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Arguments {
    /// Curves: .yarns, .bcc, .obj (lines), .npz, .usda, .txt (Mitsuba), .pbrt. Or a sequence of cloth (.bin), or a yarn
    /// model (a folder with pyp and sxsasy, or .npz).
    input: PathBuf,
    /// Curves: the same kinds; several frames into a format without time become numbered files (out.%04d.bcc). A sequence
    /// becomes .npy (positions of all frames) or .obj (the mesh of frame 0), a model .npz or a new folder.
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
    let (input, output) = (&arguments.input, &arguments.output);
    match Kind::of(input, output) {
        Kind::Curves => curves(arguments, console)?,
        Kind::Sequence => console.say(convert_sequence(input, output)?),
        Kind::Model => console.say(convert_model(input, output)?),
    }
    Ok(())
}

fn curves(arguments: &Arguments, console: Console) -> Result<()> {
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
