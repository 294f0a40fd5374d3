//! Finished pictures.

use super::colour::linear;
use super::look::Background;
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

    /// The same with so many more columns of a background at the right, as `develop` lays it behind yarn.
    pub fn widened(&self, columns: u32, background: Background) -> Self {
        let width = self.width + columns;
        let mut pixels = Vec::with_capacity(width as usize * self.height as usize);
        for y in 0..self.height {
            pixels.extend((0..self.width).map(|x| self.at(x, y)));
            pixels.extend((self.width..width).map(|x| behind(background, [x, y], self.height)));
        }
        Self { width, height: self.height, pixels }
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

/// A pixel of a background; the numbers are those of `shaders/yarn_develop.wgsl`.
fn behind(background: Background, [x, y]: [u32; 2], height: u32) -> [u8; 4] {
    let Background::Gradient(top, bottom) = background else { return [0; 4] };
    let t = (y as f32 + 0.5) / height as f32;
    let grain = (52.982_918 * (x as f32 * 0.067_110_56 + y as f32 * 0.005_837_15).fract()).fract() - 0.5;
    let channel = |c: usize| {
        let light = linear(top[c]) * (1.0 - t) + linear(bottom[c]) * t;
        let srgb = if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
        ((srgb + grain / 255.0) * 255.0).round().clamp(0.0, 255.0) as u8
    };
    [channel(0), channel(1), channel(2), 255]
}
