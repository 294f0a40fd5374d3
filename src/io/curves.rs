//! Curve files of every format: choosing the format, reading frames, writing frames.

use super::output::{FramePattern, Output};
use super::{bcc, mitsuba, npz, npz_read, obj_lines, pbrt, text, usda, usda_read, yarns};
use crate::yarn::{CurveSource, Curves};
use crate::{Error, Result};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// The formats that hold yarn as curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CurveFormat {
    /// `.yarns`: chunks with radius, pattern lines and rest lengths.
    Yarns,
    /// `.bcc`: Binary Curve Collection.
    Bcc,
    /// `.obj`: polylines (`v` and `l`).
    Obj,
    /// `.npz`: NumPy arrays, several frames.
    Npz,
    /// `.usda`: USD BasisCurves, several frames.
    Usda,
    /// `.txt`: Mitsuba's `x y z r` lines.
    Mitsuba,
    /// `.pbrt`: PBRT-v4 `Shape "curve"`.
    Pbrt,
}

/// Extensions and their formats.
const EXTENSIONS: [(&str, CurveFormat); 7] = [
    ("yarns", CurveFormat::Yarns),
    ("bcc", CurveFormat::Bcc),
    ("obj", CurveFormat::Obj),
    ("npz", CurveFormat::Npz),
    ("usda", CurveFormat::Usda),
    ("txt", CurveFormat::Mitsuba),
    ("pbrt", CurveFormat::Pbrt),
];

impl CurveFormat {
    /// The format that a path's extension stands for, in any case.
    pub fn from_path(path: &Path) -> Result<Self> {
        let extension = text::extension(path);
        EXTENSIONS.iter().find(|(known, _)| *known == extension).map(|&(_, format)| format).ok_or_else(|| {
            let known: Vec<_> = EXTENSIONS.iter().map(|(e, _)| format!(".{e}")).collect();
            let found = if extension.is_empty() {
                "no extension".into()
            } else {
                format!("the extension '.{extension}'")
            };
            Error::invalid(format_args!(
                "{}: found {found}, expected a curve file ({}, where .txt is Mitsuba's)",
                path.display(),
                known.join(", ")
            ))
        })
    }

    /// The extension, without the dot.
    pub fn extension(self) -> &'static str {
        EXTENSIONS.iter().find(|(_, format)| *format == self).map_or("", |(extension, _)| extension)
    }

    /// Whether one file holds several frames. The others get one file per frame.
    pub fn holds_time(self) -> bool {
        matches!(self, CurveFormat::Npz | CurveFormat::Usda)
    }

    /// Whether readers of the format draw a uniform Catmull-Rom curve through the points, which needs points
    /// spaced evenly enough not to overshoot.
    pub fn is_uniform_spline(self) -> bool {
        matches!(self, CurveFormat::Bcc | CurveFormat::Usda)
    }

    /// Whether every yarn needs a radius.
    pub fn needs_radius(self) -> bool {
        matches!(self, CurveFormat::Yarns | CurveFormat::Usda | CurveFormat::Mitsuba | CurveFormat::Pbrt)
    }
}

/// Which axis points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum UpAxis {
    /// +y.
    #[default]
    Y,
    /// +z.
    Z,
}

/// What a curve file says beside its frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveHeader {
    /// The up axis, where the format has one.
    pub up: Option<UpAxis>,
    /// Header fields as name and value, for people.
    pub facts: Vec<(String, String)>,
    /// Oddities met while reading: one sentence each.
    pub notes: Vec<String>,
}

impl CurveHeader {
    pub(crate) fn fact(&mut self, name: &str, value: impl std::fmt::Display) {
        let value = value.to_string().chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
        self.facts.push((name.into(), value));
    }

    pub(crate) fn note(&mut self, count: usize, sentence: impl FnOnce(usize) -> String) {
        if count > 0 {
            self.notes.push(sentence(count));
        }
    }
}

/// A curve file that is read frame by frame.
pub struct CurveReader {
    /// The file's format.
    pub format: CurveFormat,
    /// What the file says beside its frames.
    pub header: CurveHeader,
    frames: Frames,
}

enum Frames {
    Memory(std::vec::IntoIter<Curves>),
    Npz(Box<npz_read::NpzReader>),
}

impl CurveReader {
    /// Opens a file; its extension names the format. Formats of one frame are read at once.
    pub fn open(path: &Path) -> Result<Self> {
        let format = CurveFormat::from_path(path)?;
        if format == CurveFormat::Npz {
            let (reader, header) = npz_read::NpzReader::open(path)?;
            return Ok(Self { format, header, frames: Frames::Npz(Box::new(reader)) });
        }
        Self::from_bytes(path, &text::read_bytes(path)?)
    }

    /// Reads a file's content that is in memory already; `path` names its format (any but `.npz`) and stands in
    /// messages.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self> {
        let format = CurveFormat::from_path(path)?;
        if bytes.is_empty() {
            return Err(Error::input(
                path,
                1,
                1,
                "an empty file",
                format_args!("a .{} file", format.extension()),
            ));
        }
        let mut header = CurveHeader::default();
        let frames = match format {
            CurveFormat::Yarns => vec![yarns::read(path, bytes, &mut header)?],
            CurveFormat::Bcc => vec![bcc::read(path, bytes, &mut header)?],
            CurveFormat::Obj => vec![obj_lines::read(path, bytes, &mut header)?],
            CurveFormat::Mitsuba => vec![mitsuba::read(path, bytes, &mut header)?],
            CurveFormat::Pbrt => vec![pbrt::read(path, bytes, &mut header)?],
            CurveFormat::Usda => usda_read::read(path, bytes, &mut header)?,
            CurveFormat::Npz => {
                return Err(Error::invalid(format_args!(
                    "{}: found .npz content, expected a file",
                    path.display()
                )));
            }
        };
        Ok(Self { format, header, frames: Frames::Memory(frames.into_iter()) })
    }

    /// Frames not read yet.
    pub fn frames_left(&self) -> usize {
        match &self.frames {
            Frames::Memory(frames) => frames.len(),
            Frames::Npz(reader) => reader.frames_left(),
        }
    }

    /// The next frame.
    pub fn next_frame(&mut self) -> Result<Option<Curves>> {
        match &mut self.frames {
            Frames::Memory(frames) => Ok(frames.next()),
            Frames::Npz(reader) => reader.next_frame(),
        }
    }
}

/// Reads all frames of a curve file.
pub fn read_curves(path: &Path) -> Result<Vec<Curves>> {
    let mut reader = CurveReader::open(path)?;
    let mut frames = Vec::new();
    while let Some(frame) = reader.next_frame()? {
        frames.push(frame);
    }
    Ok(frames)
}

/// What writers need to know beside the curves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WriteOptions {
    /// The radius of yarns that have none of their own, world units.
    pub radius: Option<f64>,
    /// The up axis (.bcc, .usda).
    pub up: UpAxis,
    /// Length of a world unit in metres (.usda). The default is USD's own, a centimetre.
    pub meters_per_unit: f64,
    /// Frames per second (.usda).
    pub frames_per_second: f64,
    /// Whether frames are some of a longer sequence: then one alone is numbered too.
    pub sequence: bool,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self { radius: None, up: UpAxis::Y, meters_per_unit: 0.01, frames_per_second: 24.0, sequence: false }
    }
}

/// Writes frame after frame; nothing that is not whole keeps its final name.
pub trait FrameWriter {
    /// Writes a frame. `index` numbers the file or is the time code; indices must rise.
    fn frame(&mut self, index: usize, curves: &dyn CurveSource) -> Result<()>;
    /// Completes the files and lists them. It is an error if frames are missing.
    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>>;
}

/// Opens a writer for `frame_count` frames. Formats without time get one file per frame, named by
/// [`FramePattern`].
pub fn open_frame_writer(
    path: &Path,
    frame_count: usize,
    options: &WriteOptions,
) -> Result<Box<dyn FrameWriter>> {
    let format = CurveFormat::from_path(path)?;
    for (name, value) in [
        ("radius", options.radius.unwrap_or(1.0)),
        ("metres per unit", options.meters_per_unit),
        ("frames per second", options.frames_per_second),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::invalid(format_args!("{name}: found {value}, expected a positive number")));
        }
    }
    if frame_count == 0 {
        return Err(Error::invalid(format_args!(
            "{}: found no frames, expected at least one",
            path.display()
        )));
    }
    Ok(match format {
        CurveFormat::Npz => Box::new(npz::NpzFrames::new(path, frame_count)),
        CurveFormat::Usda => Box::new(usda::UsdaWriter::create(path, frame_count, options)?),
        _ => Box::new(FilePerFrame {
            pattern: FramePattern::new(path, frame_count > 1 || options.sequence)?,
            format,
            options: *options,
            frame_count,
            written: Vec::new(),
        }),
    })
}

/// Writes one frame to one file.
pub fn write_curves(path: &Path, curves: &dyn CurveSource, options: &WriteOptions) -> Result<()> {
    let mut writer = open_frame_writer(path, 1, options)?;
    writer.frame(0, curves)?;
    writer.finish().map(|_| ())
}

struct FilePerFrame {
    pattern: FramePattern,
    format: CurveFormat,
    options: WriteOptions,
    frame_count: usize,
    written: Vec<PathBuf>,
}

impl FrameWriter for FilePerFrame {
    fn frame(&mut self, index: usize, curves: &dyn CurveSource) -> Result<()> {
        let path = self.pattern.path(index);
        if self.written.len() >= self.frame_count {
            return Err(frame_count_error(&path, self.written.len() + 1, self.frame_count));
        }
        let mut out = Output::create(&path)?;
        let write = match self.format {
            CurveFormat::Yarns => yarns::write,
            CurveFormat::Bcc => bcc::write,
            CurveFormat::Obj => obj_lines::write,
            CurveFormat::Mitsuba => mitsuba::write,
            CurveFormat::Pbrt => pbrt::write,
            CurveFormat::Npz | CurveFormat::Usda => {
                return Err(Error::invalid("found a format that holds time, expected one file per frame"));
            }
        };
        write(&mut out, curves, &self.options)?;
        out.commit()?;
        self.written.push(path);
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>> {
        if self.written.len() != self.frame_count {
            let path = self.pattern.path(0);
            return Err(frame_count_error(&path, self.written.len(), self.frame_count));
        }
        Ok(self.written)
    }
}

pub(crate) fn frame_count_error(path: &Path, found: usize, expected: usize) -> Error {
    Error::invalid(format_args!("{}: found {found} frames to write, expected {expected}", path.display()))
}

/// Visits a yarn's points, checking that they are finite and as many as promised.
pub(crate) fn visit_points(
    curves: &dyn CurveSource,
    yarn: usize,
    mut sink: impl FnMut(&[DVec3]) -> Result<()>,
) -> Result<()> {
    let length = curves.yarn_len(yarn);
    let mut seen = 0;
    curves.visit(yarn, &mut |points| {
        // A sum is finite only if all its terms are; it may overflow for huge finite ones, hence the second look.
        let sum: DVec3 = points.iter().sum();
        if !sum.is_finite()
            && let Some(bad) = points.iter().position(|p| !p.is_finite())
        {
            return Err(Error::invalid(format_args!(
                "yarn {}, point {}: found {}, expected finite coordinates",
                yarn + 1,
                seen + bad + 1,
                points[bad]
            )));
        }
        seen += points.len();
        if seen > length {
            return Err(length_error(yarn, seen, length));
        }
        sink(points)
    })?;
    if seen == length { Ok(()) } else { Err(length_error(yarn, seen, length)) }
}

fn length_error(yarn: usize, found: usize, expected: usize) -> Error {
    Error::invalid(format_args!("yarn {}: found {found} points, expected {expected}", yarn + 1))
}

/// The radius of a yarn, its own or the option's.
pub(crate) fn radius_of(
    path: &Path,
    curves: &dyn CurveSource,
    yarn: usize,
    options: &WriteOptions,
) -> Result<f64> {
    curves.yarn_radius(yarn).or(options.radius).ok_or_else(|| {
        Error::invalid(format_args!(
            "{}: found no radius for yarn {}, expected one for this format: give it with --radius",
            path.display(),
            yarn + 1
        ))
    })
}

/// Appends positions as little-endian f32, which must not overflow.
pub(crate) fn push_singles(bytes: &mut Vec<u8>, path: &Path, yarn: usize, points: &[DVec3]) -> Result<()> {
    let mut finite = true;
    bytes.extend(points.iter().flat_map(|p| {
        let q = p.as_vec3();
        finite &= q.is_finite();
        let mut raw = [0; 12];
        raw.copy_from_slice(q.to_array().map(f32::to_le_bytes).as_flattened());
        raw
    }));
    if finite {
        return Ok(());
    }
    points.iter().try_for_each(|&p| check_single(path, yarn, p))
}

/// Errors if a position overflows as f32.
pub(crate) fn check_single(path: &Path, yarn: usize, p: DVec3) -> Result<()> {
    if p.as_vec3().is_finite() {
        return Ok(());
    }
    Err(Error::invalid(format_args!(
        "{}: found {p} in yarn {}, expected coordinates within the range of f32",
        path.display(),
        yarn + 1
    )))
}
