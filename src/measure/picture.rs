//! Pictures as bitmaps, with smooth edges and text on machines without fonts.

use crate::{Error, Result};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::fmt::Display;

/// The font that text is set in.
pub const FONT: &str = "sans-serif";

/// The bitmap is drawn this many times as large and averaged down: the drawing itself smooths no edges, and sets
/// glyphs on whole pixels.
pub const FINER: u32 = 3;

/// Makes [`FONT`] Noto Sans, which the program carries (crate `ttf-noto-sans`).
///
/// # Errors
/// None that happen.
pub fn font() -> Result<()> {
    register_font(FONT, FontStyle::Normal, ttf_noto_sans::REGULAR).map_err(|_| undrawn("its font is broken"))
}

/// A picture of `size` pixels, three bytes each; `draw` draws it [`FINER`] times as large, on black.
///
/// # Errors
/// Those of `draw`.
pub fn pixels(
    size: (u32, u32),
    draw: impl FnOnce(DrawingArea<BitMapBackend, Shift>) -> Result<()>,
) -> Result<Vec<u8>> {
    let large = (FINER * size.0, FINER * size.1);
    let mut fine = vec![0; 3 * large.0 as usize * large.1 as usize];
    draw(BitMapBackend::with_buffer(&mut fine, large).into_drawing_area())?;
    Ok(averaged(&fine, size))
}

/// The same as PNG.
///
/// # Errors
/// Those of `draw`.
#[cfg(feature = "measure")]
pub fn png(
    size: (u32, u32),
    draw: impl FnOnce(DrawingArea<BitMapBackend, Shift>) -> Result<()>,
) -> Result<Vec<u8>> {
    let pixels = pixels(size, draw)?;
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, size.0, size.1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(undrawn)?;
    writer.write_image_data(&pixels).map_err(undrawn)?;
    writer.finish().map_err(undrawn)?;
    Ok(file)
}

/// Squares of [`FINER`] x [`FINER`] pixels made one.
fn averaged(fine: &[u8], size: (u32, u32)) -> Vec<u8> {
    let stride = (3 * FINER * size.0) as usize;
    let finer = FINER as usize;
    let mut pixels = Vec::with_capacity((3 * size.0 * size.1) as usize);
    for y in 0..size.1 as usize {
        for x in 0..size.0 as usize {
            for channel in 0..3 {
                let at =
                    |i: usize| fine[(finer * y + i / finer) * stride + 3 * (finer * x + i % finer) + channel];
                let sum: u32 = (0..finer * finer).map(|i| u32::from(at(i))).sum();
                pixels.push((sum / (FINER * FINER)) as u8);
            }
        }
    }
    pixels
}

/// What a plotting error is to the user.
pub fn undrawn(error: impl Display) -> Error {
    Error::invalid(format_args!("the plot cannot be drawn: {error}"))
}
