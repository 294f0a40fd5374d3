//! Draws `stitches/fair-isle.png`, a colour chart of our own: bands of diamonds and dots, 12 stitches wide.
//!
//! `cargo run --example colour_chart -- stitches/fair-isle.png`

use std::fs::File;
use std::io::BufWriter;

const COLOURS: [[u8; 3]; 4] =
    [[0xf2, 0xea, 0xd7], [0x9b, 0x2d, 0x30], [0x27, 0x4a, 0x5c], [0xd9, 0x9a, 0x3b]];
const WIDTH: usize = 12;
const HEIGHT: usize = 20;

/// Which colour a stitch has; rows from the top.
fn colour(row: usize, column: usize) -> usize {
    // Distance from the middle column of the repeat, which stands at 0.
    let across = column.min(WIDTH - column);
    match row {
        0 | 10 => 2,
        1 | 9 => usize::from(column.is_multiple_of(2)) * 2,
        2..=8 => usize::from(across + row.abs_diff(5) == 3 || across + row.abs_diff(5) == 0 || across == 6),
        11 | 19 => 0,
        _ if across % 4 == row % 4 => 3,
        _ => 0,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected the name of a picture, .png")?;
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), WIDTH as u32, HEIGHT as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(COLOURS.concat());
    let pixels: Vec<u8> = (0..WIDTH * HEIGHT).map(|k| colour(k / WIDTH, k % WIDTH) as u8).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(())
}
