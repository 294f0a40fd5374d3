//! The figures as a picture: time per stitch against error, with the Pareto front.
//!
//! In the SVG, text is in the reader's own sans-serif.

use super::labels::{Box2, Labels};
use super::pareto::front;
use super::table::Row;
use crate::Result;
use crate::measure::picture::{self, FINER, FONT, undrawn};
use plotters::coord::Shift;
use plotters::prelude::*;

/// Width and height, pixels.
pub const SIZE: (u32, u32) = (1200, 800);
/// Errors below this are drawn at it.
pub const FLOOR: f64 = 1e-7;
/// Width of the legend, pixels.
const LEGEND: i32 = 250;
const LIGHT: RGBColor = RGBColor(243, 243, 243);
const BOLD: RGBColor = RGBColor(218, 218, 218);
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

/// The picture as SVG. `title` stands on top, `subtitle` below it, a line each. Rows without time or distance are left out.
///
/// # Errors
/// No row has both.
pub fn svg(rows: &[Row], title: &str, subtitle: &[String]) -> Result<String> {
    let mut text = String::new();
    let root = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
    draw(&Canvas { root, scale: 1 }, rows, title, subtitle)?;
    Ok(text)
}

/// The picture as PNG.
///
/// # Errors
/// No row has both time and distance.
pub fn png(rows: &[Row], title: &str, subtitle: &[String]) -> Result<Vec<u8>> {
    picture::png(SIZE, |root| draw(&Canvas { root, scale: FINER as i32 }, rows, title, subtitle))
}

/// A row's place in the plot: nanoseconds a stitch, 95th percentile distance in r.
struct Dot<'a> {
    name: &'a str,
    family: usize,
    at: (f64, f64),
    pixel: (i32, i32),
}

/// What is drawn on: places and sizes are in pixels of the picture, `scale` times as many of the drawing.
struct Canvas<B: DrawingBackend> {
    root: DrawingArea<B, Shift>,
    scale: i32,
}

impl<B: DrawingBackend> Canvas<B> {
    fn draw<'a, E>(&'a self, element: E) -> Result<()>
    where
        for<'b> &'b E: plotters::element::PointCollection<'b, (i32, i32)>,
        E: plotters::element::Drawable<B>,
    {
        self.root.draw(&element).map_err(undrawn)
    }

    fn style<'a>(&self, size: i32, colour: &'a RGBColor) -> TextStyle<'a> {
        TextStyle::from((FONT, size * self.scale).into_font()).color(colour)
    }

    fn text(&self, text: &str, size: i32, (x, y): (i32, i32), colour: &RGBColor) -> Result<()> {
        let at = (x * self.scale, y * self.scale);
        self.root.draw_text(text, &self.style(size, colour), at).map_err(undrawn)
    }

    /// Width and height of a text.
    fn size(&self, text: &str, size: i32) -> Result<(i32, i32)> {
        let style = self.style(size, &BLACK);
        let (width, height) = self.root.estimate_text_size(text, &style).map_err(undrawn)?;
        Ok((width as i32 / self.scale + 1, height as i32 / self.scale + 1))
    }

    fn line(&self, points: &[(i32, i32)], width: i32, colour: RGBAColor) -> Result<()> {
        let points: Vec<_> = points.iter().map(|(x, y)| (x * self.scale, y * self.scale)).collect();
        self.draw(PathElement::new(points, colour.stroke_width((width * self.scale) as u32)))
    }

    /// A family's marker: eight colours, and five shapes in turn.
    fn marker(&self, family: usize, (x, y): (i32, i32)) -> Result<()> {
        let (s, style) = (self.scale, COLOURS[family % COLOURS.len()].filled());
        let corners: &[(i32, i32)] = match family % 5 {
            0 => return self.draw(Circle::new((s * x, s * y), 5 * s, style)),
            1 => &[(-4, -4), (4, -4), (4, 4), (-4, 4)],
            2 => &[(0, -6), (6, 5), (-6, 5)],
            3 => &[(0, -6), (6, 0), (0, 6), (-6, 0)],
            _ => &[(0, 6), (6, -5), (-6, -5)],
        };
        let corners: Vec<_> = corners.iter().map(|(dx, dy)| (s * (x + dx), s * (y + dy))).collect();
        self.draw(Polygon::new(corners, style))
    }
}

fn draw<B: DrawingBackend>(canvas: &Canvas<B>, rows: &[Row], title: &str, subtitle: &[String]) -> Result<()> {
    picture::font()?;
    let (families, mut dots) = dots(rows)?;
    canvas.root.fill(&WHITE).map_err(undrawn)?;
    canvas.text(title, 21, (20, 10), &BLACK)?;
    for (i, line) in subtitle.iter().enumerate() {
        canvas.text(line, 14, (20, 38 + 19 * i as i32), &GREY)?;
    }
    let frame = axes(canvas, &mut dots, 48 + 19 * subtitle.len() as i32)?;

    // Two digits: what differs by less is no better.
    let digits = |v: f64| format!("{v:.1e}").parse().unwrap_or(v);
    let points: Vec<(f64, f64)> = dots.iter().map(|d| (d.at.0, digits(d.at.1))).collect();
    let front: Vec<&Dot> = front(&points).into_iter().map(|i| &dots[i]).collect();
    let line: Vec<(i32, i32)> = front.iter().map(|d| d.pixel).collect();
    canvas.line(&line, 2, GREY.to_rgba())?;
    for dot in &dots {
        canvas.marker(dot.family, dot.pixel)?;
    }
    let pixels: Vec<(i32, i32)> = dots.iter().map(|d| d.pixel).collect();
    let mut labels = Labels::new(frame, &pixels, &line);
    for dot in &front {
        let at = labels.place(dot.pixel, canvas.size(dot.name, 14)?);
        if let Some(end) = at.leader {
            canvas.line(&[dot.pixel, end], 1, GREY.mix(0.6))?;
        }
        canvas.text(dot.name, 14, at.corner, &BLACK)?;
    }

    let left = SIZE.0 as i32 - LEGEND;
    let row = |i: usize| frame.top + 12 + 26 * i as i32;
    for (i, family) in families.iter().enumerate() {
        canvas.marker(i, (left + 14, row(i)))?;
        canvas.text(family, 15, (left + 32, row(i) - 5), &BLACK)?;
    }
    let y = row(families.len());
    canvas.line(&[(left + 4, y), (left + 24, y)], 2, GREY.to_rgba())?;
    canvas.text("Pareto front", 15, (left + 32, y - 5), &BLACK)?;
    canvas.root.present().map_err(undrawn)
}

/// The families in order, and the rows that can be drawn.
fn dots(rows: &[Row]) -> Result<(Vec<&str>, Vec<Dot<'_>>)> {
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
    Ok((families, dots))
}

/// Draws the axes below `top` and puts the dots in their places; the frame that data lies in.
fn axes<B: DrawingBackend>(canvas: &Canvas<B>, dots: &mut [Dot], top: i32) -> Result<Box2> {
    let range = |value: fn(&Dot) -> f64| {
        let (low, high) = dots.iter().map(value).fold((f64::MAX, 0.0f64), |r, v| (r.0.min(v), r.1.max(v)));
        low * 0.6..high * 1.7
    };
    let (x, y) = (range(|d| d.at.0), range(|d| d.at.1));
    let s = canvas.scale;
    let area = canvas.root.margin(top * s, 8 * s, 8 * s, (LEGEND + 8) * s);
    let mut chart = ChartBuilder::on(&area)
        .x_label_area_size(52 * s)
        .y_label_area_size(72 * s)
        .build_cartesian_2d(x.clone().log_scale(), y.clone().log_scale())
        .map_err(undrawn)?;
    // Ticks are drawn by hand: the chart's own know powers of ten only.
    chart.configure_mesh().disable_mesh().disable_axes().draw().map_err(undrawn)?;
    let pixel = |at: (f64, f64)| {
        let (x, y) = chart.backend_coord(&at);
        ((x + s / 2) / s, (y + s / 2) / s)
    };
    let ((left, bottom), (right, top)) = (pixel((x.start, y.start)), pixel((x.end, y.end)));
    for (value, labelled) in ticks(&x) {
        let (at, _) = pixel((value, y.start));
        canvas.line(&[(at, top), (at, bottom)], 1, if labelled { BOLD } else { LIGHT }.to_rgba())?;
        if labelled {
            let label = thousands(value);
            let (width, _) = canvas.size(&label, 14)?;
            canvas.text(&label, 14, (at - width / 2, bottom + 6), &BLACK)?;
        }
    }
    for (value, _) in ticks(&y).into_iter().filter(|(v, _)| is_power(*v)) {
        let (_, at) = pixel((x.start, value));
        canvas.line(&[(left, at), (right, at)], 1, BOLD.to_rgba())?;
        let floor = if value < FLOOR * 1.5 { "\u{2264} " } else { "" };
        let label = format!("{floor}1e{:.0}", value.log10());
        let (width, height) = canvas.size(&label, 14)?;
        canvas.text(&label, 14, (left - 8 - width, at - height / 2 + 2), &BLACK)?;
    }
    canvas.line(&[(left, top), (left, bottom), (right, bottom)], 1, BLACK.to_rgba())?;
    let (width, _) = canvas.size("time per stitch (ns)", 15)?;
    canvas.text("time per stitch (ns)", 15, ((left + right - width) / 2, bottom + 30), &BLACK)?;
    let label = "distance to the converged optimum (yarn radii), 95th percentile of stitches";
    let (width, _) = canvas.size(label, 15)?;
    let style = canvas.style(15, &BLACK).transform(FontTransform::Rotate270);
    let at = (s * 12, s * ((top + bottom + width) / 2));
    canvas.root.draw_text(label, &style, at).map_err(undrawn)?;
    for dot in dots {
        dot.pixel = pixel(dot.at);
    }
    Ok(Box2 { left, right, top, bottom })
}

/// Whether a value is a power of ten.
fn is_power(value: f64) -> bool {
    (value.log10() - value.log10().round()).abs() < 1e-9
}

/// The multiples of powers of ten within a range, and whether each is labelled: 1, 2 and 5 times.
fn ticks(range: &std::ops::Range<f64>) -> Vec<(f64, bool)> {
    let decades = range.start.log10().floor() as i32..=range.end.log10().floor() as i32;
    let all =
        decades.flat_map(|d| (1..10).map(move |i| (f64::from(i) * 10f64.powi(d), [1, 2, 5].contains(&i))));
    all.filter(|(value, _)| range.contains(value)).collect()
}

/// A number with commas at the thousands.
fn thousands(value: f64) -> String {
    if value < 1.0 {
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
