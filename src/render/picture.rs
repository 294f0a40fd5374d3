//! Finished pictures.

use crate::{Error, Result};
use std::io::Write;

/// 8 bits a channel: red, green, blue (sRGB) and opacity (not multiplied in), rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `[row * width + column]`.
    pub pixels: Vec<[u8; 4]>,
}

impl Picture {
    /// One colour all over.
    pub fn plain(width: u32, height: u32, colour: [u8; 4]) -> Self {
        Self { width, height, pixels: vec![colour; width as usize * height as usize] }
    }

    /// A pixel; column and row from the top left.
    pub fn at(&self, x: u32, y: u32) -> [u8; 4] {
        self.pixels[(y * self.width + x) as usize]
    }

    /// Writes a PNG; with an alpha channel where any of it is see-through.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_png(&self, out: &mut dyn Write) -> Result<()> {
        let opaque = self.pixels.iter().all(|p| p[3] == 255);
        let mut encoder = png::Encoder::new(out, self.width, self.height);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let fault = |e: png::EncodingError| Error::invalid(format_args!("PNG: {e}"));
        if opaque {
            encoder.set_color(png::ColorType::Rgb);
            let bytes: Vec<u8> = self.pixels.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
            encoder.write_header().map_err(fault)?.write_image_data(&bytes).map_err(fault)
        } else {
            encoder.set_color(png::ColorType::Rgba);
            let bytes = self.pixels.as_flattened();
            encoder.write_header().map_err(fault)?.write_image_data(bytes).map_err(fault)
        }
    }
}
