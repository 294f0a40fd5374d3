//! The figures as rows: printed, or as CSV.

use super::errors::Summary;
use super::timing::Clocked;
use super::variants::{Engine, Variant};
use crate::knot::{Solver, Start};
use crate::scene::Mode;
use std::fmt::Write;

/// The name of the row that everything is held against.
pub const REFERENCE: &str = "converged optimum";

/// One variant's figures.
#[derive(Clone, Debug)]
pub struct Row {
    /// The variant's name, or [`REFERENCE`].
    pub name: String,
    /// Its family.
    pub family: &'static str,
    /// The frame, if the row is about one.
    pub frame: Option<String>,
    mode: &'static str,
    precision: &'static str,
    solver: &'static str,
    start: &'static str,
    iterations: Option<u32>,
    threads: Option<usize>,
    repeats: usize,
    /// Seconds a frame: the median over the repeats, the mean over frames.
    pub seconds: Option<f64>,
    /// The part of them that a device says it was at work.
    pub device_seconds: Option<f64>,
    /// The same over the stitches of a frame, nanoseconds.
    pub nanoseconds_a_stitch: Option<f64>,
    /// Its errors.
    pub errors: Summary,
}

/// A cell: text, a number where there is one, or a count.
enum Cell {
    Text(String),
    Number(Option<f64>),
    Count(Option<u64>),
}

/// A column: its name in CSV (with the unit), its head in the printed table (if it is printed), its cell.
type Column = (&'static str, Option<&'static str>, fn(&Row) -> Cell);

const COLUMNS: &[Column] = &[
    ("variant", Some("variant"), |r| Cell::Text(r.name.clone())),
    ("family", None, |r| Cell::Text(r.family.into())),
    ("frame", None, |r| Cell::Text(r.frame.clone().unwrap_or_else(|| "all".into()))),
    ("mode", None, |r| Cell::Text(r.mode.into())),
    ("solver", None, |r| Cell::Text(r.solver.into())),
    ("iterations", None, |r| Cell::Count(r.iterations.map(u64::from))),
    ("start", None, |r| Cell::Text(r.start.into())),
    ("precision", None, |r| Cell::Text(r.precision.into())),
    ("threads", None, |r| Cell::Count(r.threads.map(|t| t as u64))),
    ("repeats", Some("runs"), |r| Cell::Count(Some(r.repeats as u64))),
    ("frame_ms", Some("frame ms"), |r| Cell::Number(r.seconds.map(|s| 1e3 * s))),
    ("device_ms", Some("device ms"), |r| Cell::Number(r.device_seconds.map(|s| 1e3 * s))),
    ("stitch_ns", Some("stitch ns"), |r| Cell::Number(r.nanoseconds_a_stitch)),
    ("distance_median_r", Some("dist 50 %"), |r| Cell::Number(r.errors.distance_median)),
    ("distance_p95_r", Some("dist 95 %"), |r| Cell::Number(r.errors.distance_p95)),
    ("distance_max_r", Some("dist max"), |r| Cell::Number(r.errors.distance_max)),
    ("energy_above_mean", Some("E above"), |r| Cell::Number(r.errors.energy_mean)),
    ("energy_above_p95", Some("E 95 %"), |r| Cell::Number(r.errors.energy_p95)),
    ("interpenetration_share", Some("near"), |r| Cell::Number(r.errors.interpenetration)),
    ("smallest_distance_r", Some("least"), |r| Cell::Number(r.errors.smallest)),
    ("kink_max_deg", Some("kink"), |r| Cell::Number(Some(r.errors.kink))),
    ("faces_fell_back", Some("fell"), |r| Cell::Count(Some(r.errors.fell_back as u64))),
];

/// What the printed table's columns mean.
pub const EXPLANATION: &str = "\
frame ms, stitch ns: wall-clock time of a frame, and of it for each stitch (median of the runs, mean over frames)
device ms: the part of it that a GPU was at work on the frame, by its own timestamps (by the clock from submission to
      completion where it takes none)
dist: of each face with knots, the largest distance of a control point to the converged optimum, in yarn radii;
      median, 95th percentile and largest over faces and frames
E: (E - E*) / (1 + E*) of each such face, E* at the optimum: mean, 95th percentile (f32 rounds it to about 1e-7)
near: share of the curve nearer than 1.5 r to another centreline; least: the smallest distance in r (at most 2.5);
      in many frames of a large mesh, some of the frames stand for all
kink: largest turn where a yarn goes from face to face, beyond the turn there at rest, degrees
fell: faces that fell back to interpolation
";

impl Row {
    pub(super) fn new(
        variant: Option<&Variant>,
        frame: Option<&str>,
        stitches: usize,
        clock: &Clocked,
        errors: &Summary,
    ) -> Self {
        let seconds = clock.mean();
        let mut row = Self {
            name: REFERENCE.into(),
            family: "reference",
            frame: frame.map(str::to_string),
            mode: "relax",
            precision: "f64",
            solver: "",
            start: "",
            iterations: None,
            threads: None,
            repeats: clock.repeats,
            seconds,
            device_seconds: clock.mean_on_device(),
            nanoseconds_a_stitch: seconds.map(|s| 1e9 * s / stitches.max(1) as f64),
            errors: *errors,
        };
        if let Some(variant) = variant {
            row.name.clone_from(&variant.name);
            row.family = variant.family;
            row.precision = variant.precision.name();
            row.threads = Some(variant.running.threads);
            row.mode = match variant.mode {
                Mode::Relax => "relax",
                Mode::Knots => "knots",
                Mode::Embed => "embed",
            };
            row.describe_solve(variant);
        }
        row
    }

    fn describe_solve(&mut self, variant: &Variant) {
        if variant.mode != Mode::Relax {
            return;
        }
        self.start = "affine";
        if matches!(variant.engine, Engine::LevenbergMarquardt { .. }) {
            self.solver = "levenberg-marquardt";
            return;
        }
        self.solver = match variant.settings.solver {
            Solver::Safeguarded => "safeguarded",
            Solver::GaussNewton => "gauss-newton",
        };
        if variant.settings.start == Start::Previous {
            self.start = "previous";
        }
        self.iterations = Some(variant.settings.iterations);
    }
}

/// CSV with a header row; cells that do not apply are empty. `threads` 0 is one per core.
pub fn csv(rows: &[Row]) -> String {
    let mut text = COLUMNS.iter().map(|c| c.0).collect::<Vec<_>>().join(",") + "\n";
    for row in rows {
        let cells = COLUMNS.iter().map(|column| match column.2(row) {
            Cell::Text(text) => quoted(&text),
            // Shortest form that reads back to the bit.
            Cell::Number(value) => value.map_or(String::new(), |v| format!("{v:e}")),
            Cell::Count(value) => value.map_or(String::new(), |v| v.to_string()),
        });
        text += &cells.collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    text
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.into()
    }
}

/// A table for people, columns aligned.
pub fn printed(rows: &[Row]) -> String {
    let columns: Vec<_> = COLUMNS.iter().filter_map(|c| c.1.map(|head| (head, c.2))).collect();
    let mut lines = vec![columns.iter().map(|c| c.0.to_string()).collect::<Vec<_>>()];
    lines.extend(rows.iter().map(|row| {
        let cell = |c: &(&str, fn(&Row) -> Cell)| match c.1(row) {
            Cell::Text(text) => text,
            Cell::Number(value) => value.map_or("-".into(), short),
            Cell::Count(value) => value.map_or("-".into(), |v| v.to_string()),
        };
        columns.iter().map(cell).collect()
    }));
    let width = |c: usize| lines.iter().map(|line| line[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns.len()).map(width).collect();
    let mut text = String::new();
    for line in &lines {
        for (c, cell) in line.iter().enumerate() {
            let width = widths[c];
            // Names to the left, numbers to the right; memory takes any text.
            let _ = if c == 0 { write!(text, "{cell:width$}") } else { write!(text, "  {cell:>width$}") };
        }
        text.push('\n');
    }
    text
}

/// Three digits.
fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        format!("{value}")
    } else if (1e-2..1e5).contains(&size) {
        let digits = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.1e}")
    }
}
