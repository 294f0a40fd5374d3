//! The project's own result file (`.npz`): NumPy arrays of all frames. Array names are a promise to scripts.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `points` | `[frame, point, 3]` f32 or f64 | positions, yarns one after the other (f32: add `origin`) |
//! | `origin` | `[3]` f64 | only beside f32 points |
//! | `yarn_offsets` | `[yarn + 1]` u32 | yarn i is points `offsets[i]` .. `offsets[i+1]` |
//! | `yarn_closed` | `[yarn]` bool | closed yarns do not repeat their first point |
//! | `radius`, `gauge` | scalar | yarn radius; world units per template unit |
//! | `point_face`, `point_knot` | `[point]` i32 | owning face; knot within that face or -1 |
//! | `point_role` | `[point]` u8 | 0 boundary, 1 contact, 2 control, 3 free, 4 sample |
//! | `face_knot_offsets` | `[face + 1]` u32 | knots of face f are `offsets[f]` .. `offsets[f+1]` |
//! | `knot_direction`, `knot_half_length` | `[frame, knot, 2]`, `[frame, knot]` | in the face frame, template units |
//! | `face_energy_start`, `face_energy` | `[frame, face]` | energy at the start and at the end |
//! | `face_status` | `[frame, face]` u8 | how the solve ended |
//! | `arclength` | `[point]` | rest length along the yarn, world units |
//! | `point_tile`, `point_vertex` | `[point, 2]`, `[point]` i32 | period of the pattern as (row, column); its vertex |
//! | `twist`, `director` | `[frame, point]`, `[frame, point, 3]` | of the edge that leaves the point: radians; unit vectors |
//!
//! Arrays that the source of the curves does not know are left out; a conversion from another curve format writes
//! `points` (f64), `yarn_offsets`, `yarn_closed` and, where all yarns have the same, `radius`. The reader is in
//! [`super::npz_read`].

use super::curves::{FrameWriter, frame_count_error, visit_points};
use super::npy::header_bytes;
use super::output::Output;
use super::zip::ZipWriter;
use crate::yarn::CurveSource;
use crate::{Error, Result};
use glam::DVec3;
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use tempfile::SpooledTempFile;

/// How float arrays are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NpzPrecision {
    /// f32, with `points` relative to an origin (world units), so that small yarn far away keeps its shape.
    F32 {
        /// What is to be added to `points`.
        origin: DVec3,
    },
    /// f64.
    F64,
}

/// Numbers of either size; they are stored as [`NpzPrecision`] says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Floats<'a> {
    /// Single precision.
    F32(&'a [f32]),
    /// Double precision.
    F64(&'a [f64]),
}

/// Arrays that are the same in all frames. Empty ones and `None` are left out, but for the yarns.
#[derive(Clone, Copy, Debug, Default)]
pub struct StaticArrays<'a> {
    /// `[yarn + 1]` first point of each yarn, and the number of points.
    pub yarn_offsets: &'a [u32],
    /// `[yarn]`
    pub yarn_closed: &'a [bool],
    /// Yarn radius, world units.
    pub radius: Option<f64>,
    /// World units per template unit.
    pub gauge: Option<f64>,
    /// `[point]` owning face.
    pub point_face: &'a [i32],
    /// `[point]` knot within the face, or -1.
    pub point_knot: &'a [i32],
    /// `[point]` 0 boundary, 1 contact, 2 control, 3 free, 4 sample.
    pub point_role: &'a [u8],
    /// `[face + 1]` first knot of each face, and the number of knots.
    pub face_knot_offsets: &'a [u32],
    /// `[point]` rest length along the yarn, world units.
    pub arclength: &'a [f64],
    /// `[point]` the period of the pattern that it belongs to: row, column.
    pub point_tile: &'a [[i32; 2]],
    /// `[point]` the pattern's vertex.
    pub point_vertex: &'a [i32],
}

/// Arrays of one frame beside its points. A frame must have those that the first one had, in the same lengths.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameArrays<'a> {
    /// `[knot, 2]` directions in the face frame.
    pub knot_direction: Option<Floats<'a>>,
    /// `[knot]` half lengths, template units.
    pub knot_half_length: Option<Floats<'a>>,
    /// `[face]` energy at the start.
    pub face_energy_start: Option<Floats<'a>>,
    /// `[face]` energy at the end.
    pub face_energy: Option<Floats<'a>>,
    /// `[face]` how the solve ended.
    pub face_status: Option<&'a [u8]>,
    /// `[point]` radians.
    pub twist: Option<Floats<'a>>,
    /// `[point, 3]` unit vectors.
    pub director: Option<Floats<'a>>,
}

/// Per-frame arrays beside the points: their names and the length of their last axis.
const FRAME_ARRAYS: [(&str, usize); 7] = [
    ("knot_direction", 2),
    ("knot_half_length", 1),
    ("face_energy_start", 1),
    ("face_energy", 1),
    ("face_status", 1),
    ("twist", 1),
    ("director", 3),
];

/// Bytes of an array that are kept in memory until the file is completed; more go to a temporary file.
const KEPT: usize = 1 << 24;

/// An array that grows frame by frame.
struct Collected {
    bytes: SpooledTempFile,
    len: usize,
}

/// Writes a result file frame by frame: points go to the file as they come, the other arrays at the end.
pub struct NpzWriter {
    path: PathBuf,
    zip: ZipWriter,
    precision: NpzPrecision,
    frame_count: usize,
    frames: usize,
    yarn_offsets: Vec<u32>,
    yarn_closed: Vec<bool>,
    /// `[array]` what was collected of the per-frame arrays; none: they are left out.
    collected: [Option<Collected>; FRAME_ARRAYS.len()],
}

impl NpzWriter {
    /// Starts a file of `frame_count` frames and writes the static arrays.
    pub fn create(
        path: &Path,
        precision: NpzPrecision,
        frame_count: usize,
        arrays: &StaticArrays,
    ) -> Result<Self> {
        let mut zip = ZipWriter::new(Output::create(path)?)?;
        let points = *arrays.yarn_offsets.last().unwrap_or(&0) as u64;
        let float = float_name(precision);
        if let NpzPrecision::F32 { origin } = precision {
            entry(&mut zip, "origin", "<f8", &[3], origin.to_array().map(f64::to_le_bytes).as_flattened())?;
        }
        let offsets = if arrays.yarn_offsets.is_empty() { &[0] } else { arrays.yarn_offsets };
        let closed: Vec<u8> = arrays.yarn_closed.iter().map(|&c| c.into()).collect();
        if offsets.len() != closed.len() + 1 || !offsets.is_sorted() || offsets[0] != 0 {
            return Err(Error::invalid(format_args!(
                "{}: found yarn offsets that do not fit {} yarns, expected rising ones from 0",
                path.display(),
                closed.len()
            )));
        }
        let per_point = [
            ("point_face", arrays.point_face.len()),
            ("point_knot", arrays.point_knot.len()),
            ("point_role", arrays.point_role.len()),
            ("arclength", arrays.arclength.len()),
            ("point_tile", arrays.point_tile.len()),
            ("point_vertex", arrays.point_vertex.len()),
        ];
        for (name, length) in per_point {
            if length > 0 && length as u64 != points {
                return Err(length_error(path, name, length, points as usize));
            }
        }
        entry(&mut zip, "yarn_offsets", "<u4", &[offsets.len() as u64], &u32_bytes(offsets))?;
        entry(&mut zip, "yarn_closed", "|b1", &[closed.len() as u64], &closed)?;
        for (name, scalar) in [("radius", arrays.radius), ("gauge", arrays.gauge)] {
            if let Some(x) = scalar {
                let mut bytes = Vec::new();
                push_floats(&mut bytes, Floats::F64(&[x]), precision);
                entry(&mut zip, name, float, &[], &bytes)?;
            }
        }
        let whole = [
            ("point_face", arrays.point_face),
            ("point_knot", arrays.point_knot),
            ("point_vertex", arrays.point_vertex),
        ];
        for (name, values) in whole {
            if !values.is_empty() {
                let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
                entry(&mut zip, name, "<i4", &[values.len() as u64], &bytes)?;
            }
        }
        if !arrays.point_tile.is_empty() {
            let bytes: Vec<u8> = arrays.point_tile.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
            entry(&mut zip, "point_tile", "<i4", &[points, 2], &bytes)?;
        }
        if !arrays.arclength.is_empty() {
            let mut bytes = Vec::new();
            push_floats(&mut bytes, Floats::F64(arrays.arclength), precision);
            entry(&mut zip, "arclength", float, &[points], &bytes)?;
        }
        if !arrays.point_role.is_empty() {
            entry(&mut zip, "point_role", "|u1", &[points], arrays.point_role)?;
        }
        let knots = arrays.face_knot_offsets;
        if !knots.is_empty() {
            entry(&mut zip, "face_knot_offsets", "<u4", &[knots.len() as u64], &u32_bytes(knots))?;
        }
        let header = header_bytes(float, &[frame_count as u64, points, 3]);
        let size = frame_count as u64 * points * 3 * float_size(precision) as u64;
        zip.begin("points.npy", header.len() as u64 + size)?;
        zip.write(&header)?;
        Ok(Self {
            path: path.into(),
            zip,
            precision,
            frame_count,
            frames: 0,
            yarn_offsets: offsets.to_vec(),
            yarn_closed: arrays.yarn_closed.to_vec(),
            collected: Default::default(),
        })
    }

    /// Writes the next frame. The curves must be those of the static arrays.
    pub fn frame(&mut self, curves: &dyn CurveSource, arrays: &FrameArrays) -> Result<()> {
        if self.frames == self.frame_count {
            return Err(frame_count_error(&self.path, self.frames + 1, self.frame_count));
        }
        let yarns = self.yarn_closed.len();
        let same = curves.yarn_count() == yarns
            && (0..yarns).all(|yarn| {
                let length = self.yarn_offsets[yarn + 1] - self.yarn_offsets[yarn];
                curves.yarn_len(yarn) == length as usize && curves.yarn_closed(yarn) == self.yarn_closed[yarn]
            });
        if !same {
            return Err(Error::invalid(format_args!(
                "{}: found yarns in frame {} of the file that differ in number, length or closedness, expected those of the first",
                self.path.display(),
                self.frames + 1
            )));
        }
        let mut bytes = Vec::new();
        for yarn in 0..yarns {
            visit_points(curves, yarn, |points| {
                for part in points.chunks(4096) {
                    bytes.clear();
                    match self.precision {
                        NpzPrecision::F32 { origin } => part.iter().for_each(|&p| {
                            bytes.extend_from_slice(
                                (p - origin).as_vec3().to_array().map(f32::to_le_bytes).as_flattened(),
                            );
                        }),
                        NpzPrecision::F64 => part.iter().for_each(|p| {
                            bytes.extend_from_slice(p.to_array().map(f64::to_le_bytes).as_flattened());
                        }),
                    }
                    self.zip.write(&bytes)?;
                }
                Ok(())
            })?;
        }
        for (i, (name, _)) in FRAME_ARRAYS.into_iter().enumerate() {
            let mut bytes = Vec::new();
            let floats = match name {
                "knot_direction" => arrays.knot_direction,
                "knot_half_length" => arrays.knot_half_length,
                "face_energy_start" => arrays.face_energy_start,
                "face_energy" => arrays.face_energy,
                "twist" => arrays.twist,
                "director" => arrays.director,
                _ => None,
            };
            let status = arrays.face_status.filter(|_| name == "face_status");
            let given = floats.is_some() || status.is_some();
            if let Some(floats) = floats {
                push_floats(&mut bytes, floats, self.precision);
            }
            bytes.extend_from_slice(status.unwrap_or_default());
            if self.frames == 0 && given {
                self.collected[i] = Some(Collected { bytes: SpooledTempFile::new(KEPT), len: 0 });
            }
            let before = self.collected[i].as_ref().map(|all| all.len / self.frames.max(1));
            if before.is_some() != given || self.frames > 0 && before.is_some_and(|n| n != bytes.len()) {
                return Err(length_error(&self.path, name, bytes.len(), before.unwrap_or(0)));
            }
            if let Some(all) = &mut self.collected[i] {
                all.bytes.write_all(&bytes).map_err(|e| Error::io(&self.path, e))?;
                all.len += bytes.len();
            }
        }
        self.frames += 1;
        Ok(())
    }

    /// Writes the collected arrays and gives the file its name.
    pub fn finish(mut self) -> Result<()> {
        if self.frames != self.frame_count {
            return Err(frame_count_error(&self.path, self.frames, self.frame_count));
        }
        let mut part = vec![0; 1 << 16];
        for ((name, axis), all) in FRAME_ARRAYS.into_iter().zip(self.collected) {
            let Some(mut all) = all else { continue };
            let (descr, size) = match name {
                "face_status" => ("|u1", 1),
                _ => (float_name(self.precision), float_size(self.precision)),
            };
            let rows = (all.len / size / axis).checked_div(self.frames).unwrap_or(0);
            let shape = [self.frames as u64, rows as u64, axis as u64];
            let header = header_bytes(descr, if axis > 1 { &shape } else { &shape[..2] });
            self.zip.begin(&format!("{name}.npy"), (header.len() + all.len) as u64)?;
            self.zip.write(&header)?;
            let io = |e| Error::io(&self.path, e);
            all.bytes.rewind().map_err(io)?;
            loop {
                match all.bytes.read(&mut part).map_err(io)? {
                    0 => break,
                    n => self.zip.write(&part[..n])?,
                }
            }
        }
        self.zip.finish()
    }
}

fn float_name(precision: NpzPrecision) -> &'static str {
    if precision == NpzPrecision::F64 { "<f8" } else { "<f4" }
}

fn float_size(precision: NpzPrecision) -> usize {
    if precision == NpzPrecision::F64 { 8 } else { 4 }
}

fn u32_bytes(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn push_floats(bytes: &mut Vec<u8>, values: Floats, precision: NpzPrecision) {
    match (values, precision) {
        (Floats::F32(v), NpzPrecision::F32 { .. }) => bytes.extend(v.iter().flat_map(|x| x.to_le_bytes())),
        (Floats::F64(v), NpzPrecision::F32 { .. }) => {
            bytes.extend(v.iter().flat_map(|&x| (x as f32).to_le_bytes()))
        }
        (Floats::F32(v), NpzPrecision::F64) => bytes.extend(v.iter().flat_map(|&x| (x as f64).to_le_bytes())),
        (Floats::F64(v), NpzPrecision::F64) => bytes.extend(v.iter().flat_map(|x| x.to_le_bytes())),
    }
}

/// Writes an array.
pub(super) fn entry(zip: &mut ZipWriter, name: &str, descr: &str, shape: &[u64], data: &[u8]) -> Result<()> {
    let header = header_bytes(descr, shape);
    zip.begin(&format!("{name}.npy"), (header.len() + data.len()) as u64)?;
    zip.write(&header)?;
    zip.write(data)
}

fn length_error(path: &Path, name: &str, found: usize, expected: usize) -> Error {
    Error::invalid(format_args!("{}: found {found} values for '{name}', expected {expected}", path.display()))
}

/// Writes the arrays that any curves have: what a conversion into `.npz` gives.
pub(crate) struct NpzFrames {
    path: PathBuf,
    frame_count: usize,
    writer: Option<NpzWriter>,
}

impl NpzFrames {
    pub(crate) fn new(path: &Path, frame_count: usize) -> Self {
        Self { path: path.into(), frame_count, writer: None }
    }
}

/// The radius of all yarns, if they have the same.
pub(crate) fn common_radius(curves: &dyn CurveSource) -> Option<f64> {
    let radius = (curves.yarn_count() > 0).then(|| curves.yarn_radius(0)).flatten()?;
    (1..curves.yarn_count()).all(|yarn| curves.yarn_radius(yarn) == Some(radius)).then_some(radius)
}

impl FrameWriter for NpzFrames {
    fn frame(&mut self, _index: usize, curves: &dyn CurveSource) -> Result<()> {
        if self.writer.is_none() {
            let yarns = curves.yarn_count();
            let mut offsets = vec![0u32];
            let mut total = 0;
            for yarn in 0..yarns {
                total += curves.yarn_len(yarn);
                offsets.push(
                    u32::try_from(total)
                        .map_err(|_| length_error(&self.path, "points", total, u32::MAX as usize))?,
                );
            }
            let closed: Vec<_> = (0..yarns).map(|yarn| curves.yarn_closed(yarn)).collect();
            let arrays = StaticArrays {
                yarn_offsets: &offsets,
                yarn_closed: &closed,
                radius: common_radius(curves),
                ..StaticArrays::default()
            };
            self.writer = Some(NpzWriter::create(&self.path, NpzPrecision::F64, self.frame_count, &arrays)?);
        }
        self.writer.as_mut().map_or(Ok(()), |writer| writer.frame(curves, &FrameArrays::default()))
    }

    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>> {
        match self.writer {
            Some(writer) => writer.finish()?,
            None => return Err(frame_count_error(&self.path, 0, self.frame_count)),
        }
        Ok(vec![self.path])
    }
}
