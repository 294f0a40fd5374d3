//! The figures as a picture: time per stitch against error, with the Pareto front.
//!
//! Text is set in Noto Sans, which the program carries (crate `ttf-noto-sans`), so that machines without fonts
//! draw the same picture; in the SVG it is text in the reader's own sans-serif.

use super::labels::{Box2, Labels};
use super::pareto::front;
use super::table::Row;
use crate::{Error, Result};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::fmt::Display;

/// Width and height, pixels.
pub const SIZE: (u32, u32) = (1200, 800);
/// Errors below this are drawn at it.
pub const FLOOR: f64 = 1e-7;
/// Width of the legend, pixels.
const LEGEND: u32 = 250;
const FONT: &str = "sans-serif";
const GREY: RGBColor = RGBColor(110, 110, 110);
/// Colours that colour-blind people can tell apart (Okabe and Ito), and black.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(150, 130, 20),
];

/// The picture as SVG. `title` stands on top, `subtitle` below it. Rows without time or distance are left out.
///
/// # Errors
/// No row has both.
pub fn svg(rows: &[Row], title: &str, subtitle: &str) -> Result<String> {
    let mut text = String::new();
    let root = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
    draw(&root, rows, title, subtitle)?;
    drop(root);
    Ok(text)
}

/// The picture as PNG.
///
/// # Errors
/// No row has both time and distance.
pub fn png(rows: &[Row], title: &str, subtitle: &str) -> Result<Vec<u8>> {
    let mut pixels = vec![0; (3 * SIZE.0 * SIZE.1) as usize];
    let root = BitMapBackend::with_buffer(&mut pixels, SIZE).into_drawing_area();
    draw(&root, rows, title, subtitle)?;
    drop(root);
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, SIZE.0, SIZE.1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(undrawn)?;
    writer.write_image_data(&pixels).map_err(undrawn)?;
    writer.finish().map_err(undrawn)?;
    Ok(file)
}

fn undrawn(error: impl Display) -> Error {
    Error::invalid(format_args!("the plot cannot be drawn: {error}"))
}

/// A row's place in the plot: nanoseconds a stitch, 95th percentile distance in r.
struct Dot<'a> {
    name: &'a str,
    family: usize,
    at: (f64, f64),
    pixel: (i32, i32),
}

type Area<'a, B> = DrawingArea<B, Shift>;

fn draw<B: DrawingBackend>(root: &Area<B>, rows: &[Row], title: &str, subtitle: &str) -> Result<()> {
    register_font(FONT, FontStyle::Normal, ttf_noto_sans::REGULAR)
        .map_err(|_| undrawn("its font is broken"))?;
    let mut families: Vec<&str> = Vec::new();
    let mut dots = Vec::new();
    for row in rows {
        let (Some(time), Some(error)) = (row.nanoseconds_a_stitch, row.errors.distance_p95) else { continue };
        if !(time > 0.0 && time.is_finite() && error.is_finite()) {
            continue;
        }
        let known = families.iter().position(|f| *f == row.family);
        let family = known.unwrap_or_else(|| {
            families.push(row.family);
            families.len() - 1
        });
        dots.push(Dot { name: &row.name, family, at: (time, error.max(FLOOR)), pixel: (0, 0) });
    }
    if dots.is_empty() {
        return Err(undrawn("no variant has both a time and a distance"));
    }

    root.fill(&WHITE).map_err(undrawn)?;
    text(root, title, 21, (20, 12), &BLACK)?;
    text(root, subtitle, 14, (20, 42), &GREY)?;
    let (plot, legend) = root.margin(66, 8, 8, 8).split_horizontally(SIZE.0 - LEGEND - 16);
    let range = |value: fn(&Dot) -> f64| {
        let (low, high) = dots.iter().map(value).fold((f64::MAX, 0.0f64), |r, v| (r.0.min(v), r.1.max(v)));
        // Whole thirds of decades around the data.
        let third = |v: f64, slack: f64| 10f64.powf((3.0 * (v.log10() + slack)).round() / 3.0);
        (third(low, -0.25), third(high, 0.25))
    };
    let (x, y) = (range(|d| d.at.0), range(|d| d.at.1));
    let mut chart = ChartBuilder::on(&plot)
        .x_label_area_size(56)
        .y_label_area_size(76)
        .margin_right(16)
        .build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())
        .map_err(undrawn)?;
    chart
        .configure_mesh()
        .x_desc("time per stitch (ns)")
        .y_desc("distance to the converged optimum, 95th percentile of stitches (yarn radii)")
        .x_label_formatter(&|v| thousands(*v))
        .y_label_formatter(&|v| if *v > FLOOR * 1.001 { format!("{v:e}") } else { format!("\u{2264} {v:e}") })
        .axis_desc_style((FONT, 15))
        .label_style((FONT, 13))
        .light_line_style(RGBColor(244, 244, 244))
        .bold_line_style(RGBColor(222, 222, 222))
        .draw()
        .map_err(undrawn)?;
    for dot in &mut dots {
        dot.pixel = chart.backend_coord(&dot.at);
    }
    let ([left, right], [top, bottom]) = (chart.plotting_area().get_pixel_range()).into_arrays();

    let points: Vec<(f64, f64)> = dots.iter().map(|d| d.at).collect();
    let front: Vec<&Dot> = front(&points).into_iter().map(|i| &dots[i]).collect();
    let line: Vec<(i32, i32)> = front.iter().map(|d| d.pixel).collect();
    root.draw(&PathElement::new(line.clone(), GREY.stroke_width(2))).map_err(undrawn)?;
    for dot in &dots {
        marker(root, dot.family, dot.pixel)?;
    }
    let pixels: Vec<(i32, i32)> = dots.iter().map(|d| d.pixel).collect();
    let mut labels = Labels::new(Box2 { left, right, top, bottom }, &pixels, &line);
    for dot in &front {
        let style = (FONT, 14).into_text_style(root);
        let (width, height) = root.estimate_text_size(dot.name, &style).map_err(undrawn)?;
        let at = labels.place(dot.pixel, (width as i32, height as i32));
        if let Some(end) = at.leader {
            let leader = vec![dot.pixel, end];
            root.draw(&PathElement::new(leader, GREY.mix(0.6).stroke_width(1))).map_err(undrawn)?;
        }
        text(root, dot.name, 14, at.corner, &BLACK)?;
    }

    for (i, family) in families.iter().enumerate() {
        let y = 14 + 26 * i as i32;
        let (base, _) = legend.get_base_pixel();
        let top = legend.get_base_pixel().1;
        marker(root, i, (base + 14, top + y))?;
        text(root, family, 15, (base + 30, top + y - 9), &BLACK)?;
    }
    let y = 14 + 26 * families.len() as i32;
    let (left, top) = legend.get_base_pixel();
    let stroke = vec![(left + 4, top + y), (left + 24, top + y)];
    root.draw(&PathElement::new(stroke, GREY.stroke_width(2))).map_err(undrawn)?;
    text(root, "Pareto front", 15, (left + 30, top + y - 9), &BLACK)?;
    root.present().map_err(undrawn)
}

/// Pixel ranges as arrays.
trait IntoArrays {
    fn into_arrays(self) -> ([i32; 2], [i32; 2]);
}

impl IntoArrays for (std::ops::Range<i32>, std::ops::Range<i32>) {
    fn into_arrays(self) -> ([i32; 2], [i32; 2]) {
        ([self.0.start, self.0.end], [self.1.start, self.1.end])
    }
}

fn text<B: DrawingBackend>(
    root: &Area<B>,
    text: &str,
    size: u32,
    at: (i32, i32),
    colour: &RGBColor,
) -> Result<()> {
    let style = TextStyle::from((FONT, size).into_font()).color(colour);
    root.draw_text(text, &style, at).map_err(undrawn)
}

/// A family's marker: eight colours, and another shape with each.
fn marker<B: DrawingBackend>(root: &Area<B>, family: usize, (x, y): (i32, i32)) -> Result<()> {
    let style = COLOURS[family % COLOURS.len()];
    let polygon = |corners: &[(i32, i32)]| {
        let corners: Vec<_> = corners.iter().map(|(dx, dy)| (x + dx, y + dy)).collect();
        root.draw(&Polygon::new(corners, style.filled()))
    };
    match family % 5 {
        0 => root.draw(&Circle::new((x, y), 5, style.filled())),
        1 => root.draw(&Rectangle::new([(x - 4, y - 4), (x + 4, y + 4)], style.filled())),
        2 => polygon(&[(0, -6), (6, 5), (-6, 5)]),
        3 => polygon(&[(0, -6), (6, 0), (0, 6), (-6, 0)]),
        _ => polygon(&[(0, 6), (6, -5), (-6, -5)]),
    }
    .map_err(undrawn)
}

/// A number with commas at the thousands.
fn thousands(value: f64) -> String {
    if value < 10.0 {
        return format!("{value}");
    }
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
