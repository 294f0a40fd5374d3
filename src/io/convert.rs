//! From one curve format to another.

use super::curves::{CurveFormat, CurveReader, WriteOptions, open_frame_writer};
use super::npz::common_radius;
use crate::yarn::CurveSource;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// What a conversion did.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct ConvertSummary {
    /// Frames written.
    pub frames: usize,
    /// Yarns of the first frame.
    pub yarns: usize,
    /// Points of the first frame.
    pub points: usize,
    /// The files written.
    pub files: Vec<PathBuf>,
    /// Oddities of the input, and what the output could not hold.
    pub notes: Vec<String>,
}

impl std::fmt::Display for ConvertSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} yarns, {} points, {} frames", self.yarns, self.points, self.frames)?;
        match &self.files[..] {
            [] => Ok(()),
            [file] => write!(f, " -> {}", file.display()),
            [first, .., last] => write!(f, " -> {} to {}", first.display(), last.display()),
        }
    }
}

/// Reads all frames of `input` and writes them to `output`; both formats go by the extension. Radius, closedness,
/// pattern lines, units, rest lengths and the up axis are kept where both formats have them. `options.radius` is
/// for yarns without a radius of their own; formats that need one fail without. An `.npz` output gets the arrays
/// listed in [`super::npz`]. Frames are numbered from 0.
pub fn convert(input: &Path, output: &Path, options: &WriteOptions) -> Result<ConvertSummary> {
    let format = CurveFormat::from_path(output)?;
    let mut reader = CurveReader::open(input)?;
    let mut summary =
        ConvertSummary { notes: std::mem::take(&mut reader.header.notes), ..ConvertSummary::default() };
    let options = WriteOptions { up: reader.header.up.unwrap_or(options.up), ..*options };
    let frame_count = reader.frames_left();
    if frame_count == 0 {
        return Err(Error::invalid(format_args!(
            "{}: found no frames, expected at least one",
            input.display()
        )));
    }
    let mut writer = open_frame_writer(output, frame_count, &options)?;
    while let Some(mut curves) = reader.next_frame()? {
        for radius in &mut curves.radius {
            *radius = radius.or(options.radius);
        }
        if summary.frames == 0 {
            summary.yarns = curves.yarn_count();
            summary.points = curves.points.len();
            if format == CurveFormat::Npz
                && curves.radius.iter().any(Option::is_some)
                && common_radius(&curves).is_none()
            {
                summary
                    .notes
                    .push("the yarns differ in radius; .npz holds one for all, so it was left out".into());
            }
            let empty = (0..summary.yarns).filter(|&yarn| curves.yarn_len(yarn) == 0).count();
            if empty > 0 && matches!(format, CurveFormat::Obj | CurveFormat::Mitsuba | CurveFormat::Pbrt) {
                summary.notes.push(format!("{empty} yarns without points were left out"));
            }
        }
        writer.frame(summary.frames, &curves)?;
        summary.frames += 1;
    }
    summary.files = writer.finish()?;
    Ok(summary)
}
