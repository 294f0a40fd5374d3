//! The figures as pictures: distances over every series, and loops over stretch.

use super::panels::{Page, Panel, Style};
use super::poses::Series;
use super::swatch::Method;
use super::{Comparison, Figure};
use plotters::style::RGBColor;

const BLACK: RGBColor = RGBColor(0, 0, 0);
const GREY: RGBColor = RGBColor(140, 140, 140);
const GREEN: RGBColor = RGBColor(0, 158, 115);
const SKY: RGBColor = RGBColor(86, 180, 233);
const BLUE: RGBColor = RGBColor(0, 114, 178);
const RED: RGBColor = RGBColor(213, 94, 0);

/// The legend: all methods.
fn legend() -> Vec<Style> {
    let style = |method: &Method| {
        let (colour, dashed, width) = match *method {
            Method::Table => (BLACK, false, 3),
            Method::Pattern => (GREY, false, 2),
            Method::TableOnStitches => (GREEN, false, 2),
            Method::Knots { fitted, beta: None } => (SKY, !fitted, 2),
            Method::Knots { fitted, beta: Some(beta) } => (if beta > 0.5 { BLUE } else { RED }, !fitted, 2),
        };
        Style { name: method.name(), colour, dashed, width }
    };
    Method::ALL.iter().map(style).collect()
}

/// The lines of a series, the swatch at rest in its place among them.
fn lines(
    comparison: &Comparison,
    series: Series,
    rest: bool,
    value: &dyn Fn(&Figure) -> f64,
) -> Vec<(usize, Vec<(f64, f64)>)> {
    let line = |(i, method): (usize, &Method)| {
        let figures = comparison.figures.iter().filter(|f| f.method == *method);
        let within = |f: &&Figure| {
            f.pose.series == Some(series)
                || (f.pose.series.is_none() && rest && series != Series::ShearStretched)
        };
        let mut points: Vec<(f64, f64)> = figures.filter(within).map(|f| (f.pose.amount, value(f))).collect();
        points.retain(|p| p.1.is_finite());
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        (i, points)
    };
    // The reference lies on top of the others.
    Method::ALL.iter().enumerate().rev().map(line).collect()
}

/// Mean distance of contacts over each series.
pub fn distances(comparison: &Comparison, title: &str, subtitle: &[String]) -> Page {
    let at_rest = |f: &Figure| if f.pose.series.is_none() { 0.0 } else { f.distances.contacts[0] };
    let panel = |series: Series| Panel {
        title: series.title().into(),
        x: series.unit().into(),
        lines: lines(comparison, series, true, &at_rest),
        from: Some(0.0),
    };
    Page {
        title: title.into(),
        subtitle: subtitle.to_vec(),
        panels: Series::ALL.into_iter().map(panel).collect(),
        columns: 4,
        legend: legend(),
    }
}

/// Measures of loops over stretch along courses and along wales.
pub fn shapes(comparison: &Comparison, title: &str, subtitle: &[String]) -> Page {
    type Measure = (&'static str, fn(&Figure) -> f64);
    let measures: [Measure; 6] = [
        ("width of heads (r)", |f| f.shape.head),
        ("width of sinkers (r)", |f| f.shape.sinker),
        ("height of loops (r)", |f| f.shape.height),
        ("tilt of knots (degrees)", |f| f.shape.tilt),
        ("yarn of a loop (r)", |f| f.shape.lengths[3]),
        ("least distance of yarns (own r)", |f| f.shape.clearance),
    ];
    let panels = [Series::Course, Series::Wale].into_iter().flat_map(|series| {
        measures.into_iter().map(move |(name, value)| Panel {
            title: name.into(),
            x: format!("{}: {}", series.title(), series.unit()),
            lines: lines(comparison, series, true, &value),
            from: None,
        })
    });
    Page {
        title: title.into(),
        subtitle: subtitle.to_vec(),
        panels: panels.collect(),
        columns: 4,
        legend: legend(),
    }
}
