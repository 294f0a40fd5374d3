//! The curves of the project's own result file (`.npz`), read frame by frame. [`super::npz`] lists the arrays.
//!
//! `points` (`[frame, point, 3]` or `[point, 3]`, floats or integers) and `yarn_offsets` must be there; `yarn_closed`,
//! `radius` (one number, or one per yarn) and `origin` may be.

use super::curves::CurveHeader;
use super::npy::{Mismatch, NpyHeader};
use super::zip::{Entry, EntryReader, ZipReader};
use crate::yarn::Curves;
use crate::{Error, Result};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Reads the curves of a result file frame by frame.
pub struct NpzReader {
    path: PathBuf,
    points: EntryReader,
    header: NpyHeader,
    origin: DVec3,
    /// The curves without their points.
    template: Curves,
    point_count: usize,
    frames_left: usize,
    data_at: u64,
}

/// Largest array read whole, in bytes: offsets of all yarns.
const MAX_STATIC: u64 = 1 << 34;

impl NpzReader {
    /// Opens a file and reads everything but the points.
    pub fn open(path: &Path) -> Result<(Self, CurveHeader)> {
        let mut header = CurveHeader::default();
        // Taken while an entry is being read.
        let mut archive = Some(ZipReader::open(path)?);
        let find = |zip: &ZipReader, name: &str| {
            zip.entries.iter().find(|e| e.name.strip_suffix(".npy") == Some(name)).cloned()
        };
        let mut at = 0;
        let mut load = |name: &str, most: usize| -> Result<Option<(NpyHeader, Vec<f64>)>> {
            let Some(entry) = archive.as_ref().and_then(|zip| find(zip, name)) else { return Ok(None) };
            let Some(zip) = archive.take() else { return Ok(None) };
            at = entry.at;
            let mut reader = zip.entry(&entry)?;
            let npy = read_header(path, &mut reader, &entry)?;
            let count = npy.count().unwrap_or(u64::MAX);
            if npy.shape.len() > most || count.checked_mul(npy.size as u64) != Some(reader.left()) {
                return Err(shape_error(path, &entry, &npy, reader.left()));
            }
            let bytes = reader.read_rest(MAX_STATIC)?;
            let values = bytes.chunks_exact(npy.size).map(|b| npy.number(b)).collect();
            archive = Some(reader.close());
            Ok(Some((npy, values)))
        };
        let invalid =
            |at: u64, found: &str, expected: &str| Error::binary(path, at as usize, found, expected);

        let Some((_, offsets)) = load("yarn_offsets", 1)? else {
            return Err(invalid(
                0,
                "no array 'yarn_offsets'",
                "a result file with 'points' and 'yarn_offsets'",
            ));
        };
        let whole = |x: &f64| *x >= 0.0 && *x <= u32::MAX as f64 && x.fract() == 0.0;
        if offsets.first() != Some(&0.0) || !offsets.iter().all(whole) || !offsets.is_sorted() {
            return Err(invalid(at, "other values in 'yarn_offsets'", "rising whole numbers from 0"));
        }
        let yarns = offsets.len() - 1;
        let closed = load("yarn_closed", 1)?.map(|(_, values)| values);
        if closed.as_ref().is_some_and(|c| c.len() != yarns) {
            return Err(invalid(at, "another number of values in 'yarn_closed'", "one per yarn"));
        }
        let radius = load("radius", 1)?.map(|(_, values)| values).unwrap_or_default();
        if radius.len() > 1 && radius.len() != yarns || radius.iter().any(|r| !(r.is_finite() && *r >= 0.0)) {
            return Err(invalid(at, "other values in 'radius'", "one number of at least 0"));
        }
        let origin = load("origin", 1)?.map(|(_, values)| values).unwrap_or(vec![0.0; 3]);
        if origin.len() != 3 || origin.iter().any(|x| !x.is_finite()) {
            return Err(invalid(at, "other values in 'origin'", "three finite numbers"));
        }
        let gauge = load("gauge", 1)?.and_then(|(_, values)| values.first().copied());

        let Some((zip, entry)) = archive.and_then(|zip| find(&zip, "points").map(|entry| (zip, entry)))
        else {
            return Err(invalid(0, "no array 'points'", "a result file with 'points' and 'yarn_offsets'"));
        };
        let names: Vec<_> = zip.entries.iter().filter_map(|e| e.name.strip_suffix(".npy")).collect();
        header.fact("arrays", names.join(", "));
        let mut points = zip.entry(&entry)?;
        let npy = read_header(path, &mut points, &entry)?;
        let (frames, count) = match npy.shape[..] {
            [frames, count, 3] => (frames, count),
            [count, 3] => (1, count),
            _ => return Err(shape_error(path, &entry, &npy, points.left())),
        };
        let bytes = npy.count().and_then(|n| n.checked_mul(npy.size as u64));
        // Frames without points take no bytes, so that their number could be anything.
        let endless = count == 0 && frames > 1 << 12;
        if bytes != Some(points.left()) || endless || count as f64 != offsets[yarns] {
            let found = format!("'points' of shape {:?} in {} bytes", npy.shape, points.left());
            let expected =
                format!("[frame, {}, 3], as 'yarn_offsets' says, and as many bytes", offsets[yarns]);
            return Err(Error::binary(path, entry.at as usize, found, expected));
        }
        header.fact("numbers", if npy.size == 8 { "f64" } else { "f32" });
        if let Some(gauge) = gauge {
            header.fact("gauge", gauge);
        }
        if closed.is_none() {
            header.notes.push("'yarn_closed' is missing; all yarns are taken as open".into());
        }
        let template = Curves {
            offsets: offsets.iter().map(|&x| x as usize).collect(),
            closed: (0..yarns).map(|yarn| closed.as_ref().is_some_and(|c| c[yarn] != 0.0)).collect(),
            radius: (0..yarns).map(|yarn| radius.get(yarn).or(radius.first()).copied()).collect(),
            ..Curves::default()
        };
        let data_at = entry.at;
        let reader = Self {
            path: path.into(),
            points,
            header: npy,
            origin: DVec3::new(origin[0], origin[1], origin[2]),
            template,
            point_count: count as usize,
            frames_left: frames as usize,
            data_at,
        };
        Ok((reader, header))
    }

    /// Frames not read yet.
    pub fn frames_left(&self) -> usize {
        self.frames_left
    }

    /// The next frame.
    pub fn next_frame(&mut self) -> Result<Option<Curves>> {
        if self.frames_left == 0 {
            return Ok(None);
        }
        self.frames_left -= 1;
        let size = self.header.size;
        let mut curves = self.template.clone();
        let mut left = self.point_count;
        let mut bytes = Vec::new();
        while left > 0 {
            let count = left.min(1 << 14);
            bytes.resize(count * 3 * size, 0);
            self.points.read_exact(&mut bytes)?;
            for p in bytes.chunks_exact(3 * size) {
                let number = |k: usize| self.header.number(&p[k * size..]);
                let point = self.origin + DVec3::new(number(0), number(1), number(2));
                if !point.is_finite() {
                    let found = format!("{point} in 'points' at point {}", curves.points.len() + 1);
                    return Err(Error::binary(
                        &self.path,
                        self.data_at as usize,
                        found,
                        "finite coordinates",
                    ));
                }
                curves.points.push(point);
            }
            left -= count;
        }
        Ok(Some(curves))
    }
}

fn read_header(path: &Path, reader: &mut EntryReader, entry: &Entry) -> Result<NpyHeader> {
    let place = |Mismatch { at, found, expected }: Mismatch| {
        let found = format!("{found} at byte {at} of '{}'", entry.name);
        Error::binary(path, entry.at as usize, found, expected)
    };
    let mut bytes = vec![0; 12];
    reader.read_exact(&mut bytes)?;
    let (before, length) = NpyHeader::lengths(&bytes).map_err(place)?;
    // A version 1 header begins two bytes before the end of these twelve.
    bytes.resize((before + length).max(12), 0);
    reader.read_exact(&mut bytes[12..])?;
    let header = NpyHeader::parse(&bytes).map_err(place)?;
    if header.fortran_order {
        let found = format!("the array '{}' in Fortran order", entry.name);
        let expected = "C order (np.ascontiguousarray gives it)";
        return Err(Error::binary(path, entry.at as usize, found, expected));
    }
    Ok(header)
}

fn shape_error(path: &Path, entry: &Entry, npy: &NpyHeader, bytes: u64) -> Error {
    let found = format!("the shape {:?} in {bytes} bytes of '{}'", npy.shape, entry.name);
    Error::binary(path, entry.at as usize, found, "the array's shape as documented, and as many bytes")
}
