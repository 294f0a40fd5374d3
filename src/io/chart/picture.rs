//! Colour charts as PNG: each pixel is a knit stitch of its colour. Transparent pixels (less than half opaque) are knit in
//! whatever colour is in use.

use super::{Drawing, DrawnRow, MOST_SQUARES, Square};
use crate::design::stitch::Stitch;
use crate::design::token::Place;
use crate::{Error, Result};
use png::{ColorType, Decoder, Limits, Transformations};
use std::io::Cursor;
use std::path::Path;

/// Reads a picture: grey, palette or RGB, with or without alpha, any depth, interlaced or not. Of an animation, its first
/// frame.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Drawing> {
    let broken = |e: png::DecodingError| Error::binary(path, 0, e, "a PNG picture");
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: 256 << 20 });
    decoder.set_transformations(Transformations::normalize_to_color8());
    let header = decoder.read_header_info().map_err(broken)?;
    let (width, height) = (header.width as usize, header.height as usize);
    if width.checked_mul(height).is_none_or(|n| n > MOST_SQUARES) {
        return Err(Error::binary(
            path,
            0,
            format_args!("{width} x {height} pixels"),
            format_args!("at most {MOST_SQUARES}, one a stitch"),
        ));
    }
    let mut reader = decoder.read_info().map_err(broken)?;
    let size = reader.output_buffer_size().unwrap_or(0);
    let mut buffer = vec![0; size];
    let info = reader.next_frame(&mut buffer).map_err(broken)?;
    let channels = info.color_type.samples();
    let colour = |p: &[u8]| match (info.color_type, p) {
        (ColorType::Grayscale, &[v]) => Some([v; 3]),
        (ColorType::GrayscaleAlpha, &[v, a]) => (a >= 128).then_some([v; 3]),
        (ColorType::Rgb, &[r, g, b]) => Some([r, g, b]),
        (ColorType::Rgba, &[r, g, b, a]) => (a >= 128).then_some([r, g, b]),
        _ => None,
    };
    let (width, height) = (info.width as usize, info.height as usize);
    let mut rows: Vec<DrawnRow> = Vec::with_capacity(height);
    for (y, line) in buffer.chunks_exact(info.line_size).take(height).enumerate() {
        let place = |x: usize| Place { line: y as u32 + 1, column: x as u32 + 1 };
        let pixels = line.chunks_exact(channels).take(width).enumerate();
        let squares =
            pixels.map(|(x, p)| Square { stitch: Stitch::Knit, colour: colour(p), place: place(x) });
        rows.push(DrawnRow { place: place(0), squares: squares.collect() });
    }
    rows.reverse();
    Ok(Drawing { rows })
}
