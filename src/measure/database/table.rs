//! The figures as rows: CSV, and tables to read.

use super::poses::{Pose, Series};
use super::swatch::Method;
use super::{Comparison, Figure};
use std::fmt::Write;

/// What the numbers mean.
pub const EXPLANATION: &str = "\
table: the precomputed method on a fine mesh, what all else is held against; pattern embedded: its pattern, not displaced
knit, fitted: a template whose knots lie where the pattern's yarns cross at rest; library: the one given
distance of contacts: mean over the eight contacts of a stitch (in brackets: the greatest), in radii of the table's yarn, of
      how far they move off the surface's motion; for 'pattern embedded' that is how far the table moves them at all
knots, within knots: the same of the knots' centres, and of contacts relative to them (how knots turn, lengthen and flatten)
loops: the same along whole loops, root mean square (and greatest)
at rest: distance of the rest shapes as they are, contacts and whole loops
head, sinker: distance of the two knots that hold a loop's head, and of those at the feet of neighbouring loops, in r
tilt: of a knot's contacts from the course, degrees
yarn: length of a loop over that at rest; clearance: least distance of neighbouring rows, in the method's own radii
";

/// A row a pose and method.
pub fn csv(comparison: &Comparison) -> String {
    let mut text = String::from(
        "series,amount,method,contacts_mean_r,contacts_max_r,knots_mean_r,knots_max_r,within_mean_r,within_max_r,loops_rms_r,loops_max_r",
    );
    let names = comparison.figures.first().map(|f| f.shape.numbers().map(|(name, _)| name));
    for name in names.iter().flatten() {
        let _ = write!(text, ",{name}");
    }
    text.push_str(",points_outside_table,stitches_lost\n");
    for f in &comparison.figures {
        let d = &f.distances;
        let _ = write!(text, "{},{},\"{}\"", series_name(&f.pose), f.pose.amount, f.method.name());
        for number in [d.contacts, d.knots, d.within, d.loops].into_iter().flatten() {
            let _ = write!(text, ",{}", cell(number));
        }
        for (_, number) in f.shape.numbers() {
            let _ = write!(text, ",{}", cell(number));
        }
        let _ = writeln!(text, ",{},{}", f.outside, f.lost);
    }
    text
}

fn series_name(pose: &Pose) -> &'static str {
    pose.series.map_or("rest", Series::name)
}

/// Four digits; nothing where there is no number.
fn cell(number: f64) -> String {
    if number.is_finite() { format!("{number:.4}") } else { String::new() }
}

/// Tables to read.
pub fn printed(comparison: &Comparison) -> String {
    let mut text = String::new();
    let c = &comparison.cells;
    let _ = writeln!(
        text,
        "stitch {:.3} x {:.3} mm, {} columns x {} rows a period; yarn radii:",
        1e3 * c.stitch.x,
        1e3 * c.stitch.y,
        c.count.x,
        c.count.y
    );
    for (method, radius) in &comparison.radii {
        let _ = writeln!(text, "  {:<28}{:.3} mm", method.name(), 1e3 * radius);
    }
    rest(&mut text, comparison);
    let series = Series::ALL.into_iter();
    for series in series.filter(|s| comparison.figures.iter().any(|f| f.pose.series == Some(*s))) {
        of_series(&mut text, comparison, series);
    }
    text.push('\n');
    text.push_str(EXPLANATION);
    text
}

fn rest(text: &mut String, comparison: &Comparison) {
    let _ = writeln!(
        text,
        "\n{:<28}{:>16}{:>16}{:>8}{:>8}{:>8}{:>8}{:>8}{:>10}",
        "at rest", "contacts", "loops", "head", "sinker", "height", "tilt", "yarn r", "clearance"
    );
    for f in comparison.figures.iter().filter(|f| f.pose.series.is_none()) {
        let s = &f.shape;
        let _ = writeln!(
            text,
            "{:<28}{:>16}{:>16}{:>8.2}{:>8.2}{:>8.2}{:>8.1}{:>8.1}{:>10.2}",
            f.method.name(),
            pair(f.distances.contacts),
            pair(f.distances.loops),
            s.head,
            s.sinker,
            s.height,
            s.tilt,
            s.lengths[3],
            s.clearance
        );
    }
}

fn pair([mean, most]: [f64; 2]) -> String {
    if mean.is_finite() { format!("{mean:.2} ({most:.2})") } else { "-".into() }
}

/// A series: methods by amounts.
fn of_series(text: &mut String, comparison: &Comparison, series: Series) {
    let figures = || comparison.figures.iter().filter(move |f| f.pose.series == Some(series));
    let amounts: Vec<f64> = figures().filter(|f| f.method == Method::Table).map(|f| f.pose.amount).collect();
    let rest = |method: Method| {
        comparison.figures.iter().find(move |f| f.pose.series.is_none() && f.method == method)
    };
    let mut block = |head: &str, value: &dyn Fn(&Figure) -> String, reference: bool| {
        let _ = write!(text, "\n{:<28}", format!("{}: {head}", series.name()));
        for amount in &amounts {
            let _ = write!(text, "{amount:>13}");
        }
        text.push('\n');
        for method in Method::ALL.into_iter().filter(|m| reference || *m != Method::Table) {
            let _ = write!(text, "{:<28}", method.name());
            for f in figures().filter(|f| f.method == method) {
                let _ = write!(text, "{:>13}", value(f));
            }
            text.push('\n');
        }
    };
    let number = |x: f64| if x.is_finite() { format!("{x:.2}") } else { "-".into() };
    block("contacts", &|f| pair(f.distances.contacts), false);
    block("knots", &|f| pair(f.distances.knots), false);
    block("within knots", &|f| pair(f.distances.within), false);
    block("loops", &|f| pair(f.distances.loops), false);
    block("head", &|f| number(f.shape.head), true);
    block("tilt", &|f| number(f.shape.tilt), true);
    let yarn = |f: &Figure| rest(f.method).map_or(f64::NAN, |r| f.shape.lengths[3] / r.shape.lengths[3]);
    block("yarn", &|f| number(yarn(f)), true);
    block("clearance", &|f| number(f.shape.clearance), true);
}
