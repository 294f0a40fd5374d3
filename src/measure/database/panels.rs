//! Small plots side by side: lines over a number, one legend for all.

use crate::Result;
use crate::measure::picture::{self, FINER, FONT, undrawn};
use plotters::coord::Shift;
use plotters::prelude::*;

/// One plot.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// Below it.
    pub x: String,
    /// `[line]` number in the legend, and its points from left to right.
    pub lines: Vec<(usize, Vec<(f64, f64)>)>,
    /// A number that the axis reaches at least.
    pub from: Option<f64>,
}

/// How a line is drawn.
#[derive(Clone, Debug)]
pub struct Style {
    /// In the legend.
    pub name: String,
    /// Its colour.
    pub colour: RGBColor,
    /// Dashed rather than drawn through.
    pub dashed: bool,
    /// Pixels.
    pub width: u32,
}

/// A page of plots.
#[derive(Clone, Debug)]
pub struct Page {
    /// On top.
    pub title: String,
    /// Below it, a line each.
    pub subtitle: Vec<String>,
    /// Left to right, then below.
    pub panels: Vec<Panel>,
    /// Plots side by side.
    pub columns: usize,
    /// The legend.
    pub legend: Vec<Style>,
}

const CELL: (u32, u32) = (360, 290);
const GREY: RGBColor = RGBColor(110, 110, 110);
const LIGHT: RGBColor = RGBColor(225, 225, 225);
/// Height of a line of the legend, which has three columns.
const ENTRY: u32 = 22;
const ABREAST: usize = 3;

impl Page {
    /// Pixels.
    pub fn size(&self) -> (u32, u32) {
        let rows = self.panels.len().div_ceil(self.columns) as u32;
        (CELL.0 * self.columns as u32, self.top() + rows * CELL.1)
    }

    fn top(&self) -> u32 {
        48 + 19 * self.subtitle.len() as u32 + ENTRY * self.legend.len().div_ceil(ABREAST) as u32 + 10
    }

    /// As SVG.
    ///
    /// # Errors
    /// None that happen.
    pub fn svg(&self) -> Result<String> {
        let mut text = String::new();
        self.draw(&SVGBackend::with_string(&mut text, self.size()).into_drawing_area(), 1)?;
        Ok(text)
    }

    /// As PNG.
    ///
    /// # Errors
    /// None that happen.
    pub fn png(&self) -> Result<Vec<u8>> {
        picture::png(self.size(), |root| self.draw(&root, FINER as i32))
    }

    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>, s: i32) -> Result<()> {
        picture::font()?;
        root.fill(&WHITE).map_err(undrawn)?;
        let text = |text: &str, size: i32, (x, y): (i32, i32), colour: &RGBColor| {
            let style = TextStyle::from((FONT, size * s).into_font()).color(colour);
            root.draw_text(text, &style, (x * s, y * s)).map_err(undrawn)
        };
        text(&self.title, 21, (20, 10), &BLACK)?;
        for (i, line) in self.subtitle.iter().enumerate() {
            text(line, 14, (20, 38 + 19 * i as i32), &GREY)?;
        }
        let begin = 48 + 19 * self.subtitle.len() as i32;
        let width = self.size().0 as i32 / ABREAST as i32;
        for (i, style) in self.legend.iter().enumerate() {
            let (x, y) = (20 + width * (i % ABREAST) as i32, begin + (ENTRY as usize * (i / ABREAST)) as i32);
            let ends = [((x * s), (y + 8) * s), ((x + 30) * s, (y + 8) * s)];
            for line in strokes(&ends, style, s) {
                root.draw(&line).map_err(undrawn)?;
            }
            text(&style.name, 14, (x + 38, y), &BLACK)?;
        }
        let (_, below) = root.split_vertically(self.top() as i32 * s);
        let rows = self.panels.len().div_ceil(self.columns);
        for (panel, area) in self.panels.iter().zip(below.split_evenly((rows, self.columns))) {
            self.panel(panel, &area, s)?;
        }
        root.present().map_err(undrawn)
    }

    fn panel<B: DrawingBackend>(&self, panel: &Panel, area: &DrawingArea<B, Shift>, s: i32) -> Result<()> {
        let points = || panel.lines.iter().flat_map(|(_, points)| points);
        let (x, y) = (range(points().map(|p| p.0), None), range(points().map(|p| p.1), panel.from));
        let mut chart = ChartBuilder::on(area)
            .margin(10 * s)
            .caption(&panel.title, (FONT, 15 * s))
            .x_label_area_size(38 * s)
            .y_label_area_size(46 * s)
            .build_cartesian_2d(x, y)
            .map_err(undrawn)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(LIGHT.stroke_width(s as u32))
            .x_labels(6)
            .y_labels(6)
            .x_label_formatter(&number)
            .y_label_formatter(&number)
            .x_desc(&panel.x)
            .label_style((FONT, 12 * s))
            .axis_desc_style((FONT, 13 * s))
            .draw()
            .map_err(undrawn)?;
        for (style, points) in &panel.lines {
            let pixels: Vec<(i32, i32)> = points.iter().map(|p| chart.backend_coord(p)).collect();
            let (left, top) = area.get_base_pixel();
            let pixels: Vec<_> = pixels.into_iter().map(|(x, y)| (x - left, y - top)).collect();
            for line in strokes(&pixels, &self.legend[*style], s) {
                area.draw(&line).map_err(undrawn)?;
            }
        }
        Ok(())
    }
}

/// A line in a style: one piece, or dashes.
fn strokes(points: &[(i32, i32)], style: &Style, s: i32) -> Vec<PathElement<(i32, i32)>> {
    let stroke = style.colour.stroke_width(style.width * s as u32);
    if !style.dashed {
        return vec![PathElement::new(points.to_vec(), stroke)];
    }
    let (on, off) = (f64::from(6 * s), f64::from(4 * s));
    let (mut dashes, mut travelled) = (Vec::new(), 0.0);
    for pair in points.windows(2) {
        let [from, to] = [pair[0], pair[1]].map(|p| (f64::from(p.0), f64::from(p.1)));
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let at = |along: f64| {
            let share = along / length;
            (
                (from.0 + share * (to.0 - from.0)).round() as i32,
                (from.1 + share * (to.1 - from.1)).round() as i32,
            )
        };
        let mut along = 0.0;
        while along < length {
            let phase = (travelled + along) % (on + off);
            let (drawn, step) = if phase < on { (true, on - phase) } else { (false, on + off - phase) };
            let end = (along + step.max(1e-3)).min(length);
            if drawn {
                dashes.push(PathElement::new(vec![at(along), at(end)], stroke));
            }
            along = end;
        }
        travelled += length;
    }
    dashes
}

/// What numbers span, a little more.
fn range(numbers: impl Iterator<Item = f64>, from: Option<f64>) -> std::ops::Range<f64> {
    let numbers = numbers.filter(|x| x.is_finite()).chain(from);
    let (low, high) = numbers.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
    if low > high {
        return 0.0..1.0;
    }
    let slack = 0.04 * (high - low).max(1e-9);
    let low = if from == Some(low) { low } else { low - slack };
    low..high + slack
}

/// A few digits, and no negative zero.
fn number(x: &f64) -> String {
    let rounded = (x * 1e4).round() / 1e4;
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded })
}
