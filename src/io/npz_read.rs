//! The curves of the project's own result file (`.npz`), read frame by frame. [`super::npz`] lists the arrays.
//!
//! `points` (`[frame, point, 3]` or `[point, 3]`, floats or integers) and `yarn_offsets` must be there; `yarn_closed`,
//! `radius` (one number, or one per yarn) and `origin` may be.

use super::curves::CurveHeader;
use super::npy::NpyHeader;
use super::npz_arrays::{Arrays, read_header, shape_error};
use super::zip::EntryReader;
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
        let mut archive = Arrays::open(path)?;
        let mut at = 0;
        let mut load = |name: &str| -> Result<Option<Vec<f64>>> {
            let fits = |shape: &[u64]| shape.len() <= 1;
            let Some(array) = archive.load(name, MAX_STATIC, fits, "the array's shape as documented")? else {
                return Ok(None);
            };
            at = array.at;
            Ok(Some(array.numbers().collect()))
        };
        let invalid =
            |at: u64, found: &str, expected: &str| Error::binary(path, at as usize, found, expected);

        let Some(offsets) = load("yarn_offsets")? else {
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
        let closed = load("yarn_closed")?;
        if closed.as_ref().is_some_and(|c| c.len() != yarns) {
            return Err(invalid(at, "another number of values in 'yarn_closed'", "one per yarn"));
        }
        let radius = load("radius")?.unwrap_or_default();
        if radius.len() > 1 && radius.len() != yarns || radius.iter().any(|r| !(r.is_finite() && *r >= 0.0)) {
            return Err(invalid(at, "other values in 'radius'", "one number of at least 0"));
        }
        let origin = load("origin")?.unwrap_or(vec![0.0; 3]);
        if origin.len() != 3 || origin.iter().any(|x| !x.is_finite()) {
            return Err(invalid(at, "other values in 'origin'", "three finite numbers"));
        }
        let gauge = load("gauge")?.and_then(|values| values.first().copied());

        let names = archive.names().join(", ");
        let Some((mut points, entry)) = archive.turn_to("points")? else {
            return Err(invalid(0, "no array 'points'", "a result file with 'points' and 'yarn_offsets'"));
        };
        header.fact("arrays", names);
        let npy = read_header(path, &mut points, &entry)?;
        let (frames, count) = match npy.shape[..] {
            [frames, count, 3] => (frames, count),
            [count, 3] => (1, count),
            _ => {
                let expected = "the array's shape as documented";
                return Err(shape_error(path, &entry, &npy, points.left(), expected));
            }
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
