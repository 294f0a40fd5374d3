//! What else is converted: sequences of cloth to positions or a mesh, yarn models to and from folders.

use super::npy::header_bytes;
use super::output::Output;
use super::sequence::Sequence;
use super::text::extension;
use super::{obj_mesh, yarn_model};
use crate::{Error, Result};
use std::path::Path;

/// What a conversion is one of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Curves, by [`super::convert::convert`].
    Curves,
    /// A sequence of cloth, by [`convert_sequence`].
    Sequence,
    /// A yarn model, by [`convert_model`].
    Model,
}

impl Kind {
    /// Sequences are `.bin`; a yarn model is a folder (curves have an extension), or an `.npz` that is to become one.
    pub fn of(input: &Path, output: &Path) -> Self {
        match extension(input).as_str() {
            "" => Kind::Model,
            _ if input.is_dir() => Kind::Model,
            "bin" => Kind::Sequence,
            "npz" if output.extension().is_none() => Kind::Model,
            _ => Kind::Curves,
        }
    }
}

/// Writes a sequence's positions as a `.npy` of shape `[frame, vertex, 3]`, f32, frame by frame, or its frame 0 as an OBJ
/// mesh with texture coordinates. Returns what was done, in words.
///
/// # Errors
/// What [`Sequence`] refuses; an output of another extension; the system's.
pub fn convert_sequence(input: &Path, output: &Path) -> Result<String> {
    let kind = extension(output);
    if kind != "npy" && kind != "obj" {
        return Err(wrong_output(output, "a sequence becomes a .npy of positions or an .obj of frame 0"));
    }
    let mut sequence = Sequence::open(input)?;
    let (frames, vertices) = (sequence.len(), sequence.vertex_count());
    if kind == "obj" {
        obj_mesh::write(output, sequence.mesh())?;
        let faces = sequence.mesh().faces.len();
        return Ok(format!("{vertices} vertices, {faces} faces -> {}", output.display()));
    }
    let mut out = Output::create(output)?;
    out.put(&header_bytes("<f4", &[frames as u64, vertices as u64, 3]))?;
    let (mut positions, mut bytes) = (Vec::new(), Vec::new());
    for frame in 0..frames {
        sequence.read(frame, &mut positions)?;
        bytes.clear();
        // These were f32, so that nothing is rounded.
        bytes.extend(positions.iter().flat_map(|p| p.as_vec3().to_array()).flat_map(f32::to_le_bytes));
        out.put(&bytes)?;
    }
    out.commit()?;
    Ok(format!("{frames} frames, {vertices} vertices -> {}", output.display()))
}

/// Writes a yarn model as an `.npz`, or as a folder if `output` has no extension. Returns what was done, in words.
///
/// # Errors
/// What [`yarn_model::read`] refuses; an output of another extension; a folder that is there already; the system's.
pub fn convert_model(input: &Path, output: &Path) -> Result<String> {
    let write = match extension(output).as_str() {
        "npz" => yarn_model::write_npz,
        "" => yarn_model::write_dir,
        _ => return Err(wrong_output(output, "a yarn model becomes an .npz, or a folder without extension")),
    };
    let model = yarn_model::read(input)?;
    write(output, &model)?;
    let [sx, sa, sy] = model.table.axes().each_ref().map(Vec::len);
    let vertices = model.pattern.vertex_count();
    Ok(format!("{vertices} vertices, {sx} x {sa} x {sy} nodes -> {}", output.display()))
}

fn wrong_output(output: &Path, expected: &str) -> Error {
    let extension = extension(output);
    let found =
        if extension.is_empty() { "no extension".into() } else { format!("the extension '.{extension}'") };
    Error::invalid(format_args!("{}: found {found}, expected another: {expected}", output.display()))
}
