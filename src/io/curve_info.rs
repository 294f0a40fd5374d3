//! What is in a curve file, for people and as data.

use super::curves::{CurveFormat, CurveReader};
use crate::Result;
use crate::yarn::Curves;
use glam::DVec3;
use std::path::{Path, PathBuf};

/// The description of a curve file. Numbers of yarns, lengths and radii are those of the first frame.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct CurveInfo {
    /// The file.
    pub path: PathBuf,
    /// Its format.
    pub format: CurveFormat,
    /// Frames in the file.
    pub frames: usize,
    /// Curves.
    pub curves: usize,
    /// Open ones among them.
    pub open: usize,
    /// Closed ones among them.
    pub closed: usize,
    /// Points of all curves, without repeated ones.
    pub points: usize,
    /// Lowest and highest corner of the box around the points of all frames, world units.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Summed length of the straight segments, closing ones included, world units.
    pub length: f64,
    /// Smallest and largest radius, where the file has one, world units.
    pub radius: Option<[f64; 2]>,
    /// Header fields of the format: names and values.
    pub facts: Vec<(String, String)>,
    /// Oddities, one sentence each.
    pub notes: Vec<String>,
}

/// A closing segment this many times longer than the curve's median segment is called a gap.
const GAP: f64 = 10.0;

/// Reads a curve file to the end and describes it. A file that cannot be read, or holds coordinates that are not
/// finite, is an error with its place.
pub fn curve_info(path: &Path) -> Result<CurveInfo> {
    let mut reader = CurveReader::open(path)?;
    let mut info = CurveInfo {
        path: path.into(),
        format: reader.format,
        frames: 0,
        curves: 0,
        open: 0,
        closed: 0,
        points: 0,
        bounds: None,
        length: 0.0,
        radius: None,
        facts: std::mem::take(&mut reader.header.facts),
        notes: std::mem::take(&mut reader.header.notes),
    };
    while let Some(curves) = reader.next_frame()? {
        if info.frames == 0 {
            info.first_frame(&curves);
        }
        info.frames += 1;
        if let Some(&first) = curves.points.first() {
            let start = info.bounds.map_or([first; 2], |b| b.map(DVec3::from_array));
            let [low, high] = curves.points.iter().fold(start, |[low, high], p| [low.min(*p), high.max(*p)]);
            info.bounds = Some([low.to_array(), high.to_array()]);
        }
    }
    Ok(info)
}

impl CurveInfo {
    fn first_frame(&mut self, curves: &Curves) {
        self.curves = curves.closed.len();
        self.closed = curves.closed.iter().filter(|&&c| c).count();
        self.open = self.curves - self.closed;
        self.points = curves.points.len();
        let radii = curves.radius.iter().flatten();
        self.radius = radii.fold(None, |range: Option<[f64; 2]>, &r| {
            let [low, high] = range.unwrap_or([r, r]);
            Some([low.min(r), high.max(r)])
        });
        let (mut gaps, mut widest, mut short) = (0, (0.0, 0), 0);
        for (yarn, range) in curves.offsets.windows(2).enumerate() {
            let points = &curves.points[range[0]..range[1]];
            short += usize::from(points.len() < 2);
            let mut segments: Vec<f64> = points.windows(2).map(|w| w[0].distance(w[1])).collect();
            self.length += segments.iter().sum::<f64>();
            if !curves.closed[yarn] || points.len() < 3 {
                continue;
            }
            let closing = points[0].distance(points[points.len() - 1]);
            self.length += closing;
            let middle = segments.len() / 2;
            let median = *segments.select_nth_unstable_by(middle, f64::total_cmp).1;
            if closing > GAP * median {
                gaps += 1;
                if closing > widest.0 {
                    widest = (closing, yarn + 1);
                }
            }
        }
        if gaps > 0 {
            self.notes.push(format!(
                "{gaps} closed curves end far from their start (over {GAP} median segments); the widest gap is {:.6}, of curve {}",
                widest.0, widest.1
            ));
        }
        if short > 0 {
            self.notes.push(format!("{short} curves have fewer than two points"));
        }
    }
}

impl std::fmt::Display for CurveInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}", self.path.display())?;
        let mut line = |name: &str, value: String| writeln!(f, "  {name:<14} {value}");
        line("format", format!(".{}", self.format.extension()))?;
        line("frames", self.frames.to_string())?;
        line("curves", format!("{} ({} open, {} closed)", self.curves, self.open, self.closed))?;
        line("points", self.points.to_string())?;
        if let Some([low, high]) = self.bounds {
            let corner = |p: [f64; 3]| format!("({:.6}, {:.6}, {:.6})", p[0], p[1], p[2]);
            line("bounds", format!("{} to {}", corner(low), corner(high)))?;
        }
        line("length", format!("{:.6}", self.length))?;
        line(
            "radius",
            match self.radius {
                None => "not in the file".into(),
                Some([low, high]) if low == high => format!("{low:.6}"),
                Some([low, high]) => format!("{low:.6} to {high:.6}"),
            },
        )?;
        for (name, value) in &self.facts {
            line(name, value.clone())?;
        }
        for note in &self.notes {
            writeln!(f, "  note: {note}")?;
        }
        Ok(())
    }
}
