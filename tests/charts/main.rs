//! Charts: what their files say, and the fabric that comes of it.

mod broken;
mod drawings;
mod swatches;

use knotmesh::Result;
use knotmesh::io::chart::{Drawing, read};
use std::path::Path;

/// Reads a chart of that name.
fn chart(name: &str, bytes: impl AsRef<[u8]>) -> Result<Drawing> {
    read(Path::new(name), bytes.as_ref())
}

/// A picture of 8-bit samples.
fn picture(width: u32, colour: png::ColorType, samples: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let height = (samples.len() / colour.samples()) as u32 / width;
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(samples).unwrap();
    writer.finish().unwrap();
    bytes
}
