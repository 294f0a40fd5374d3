//! Binary Curve Collection (`.bcc`, by Cem Yuksel): curves of f32 points, closed ones marked by a negative count.
//!
//! Written as `C0` (uniform Catmull-Rom), f32, without the first point of closed curves repeated. The format
//! stores no radius. A closed curve without points cannot be told from an open one.

use super::curves::{CurveHeader, UpAxis, WriteOptions, push_singles, visit_points};
use super::output::Output;
use crate::yarn::{CurveSource, Curves};
use crate::{Error, Result};
use glam::DVec3;
use std::path::Path;

const HEADER: usize = 64;

/// What the two letters of the curve type mean.
fn curve_type(letters: [u8; 2]) -> Option<&'static str> {
    Some(match &letters {
        b"C0" => "C0, uniform Catmull-Rom",
        [b'C', b'1'..=b'9'] => "a Catmull-Rom variant",
        b"BS" => "BS, B-spline",
        b"BZ" => "BZ, Bezier",
        b"PL" => "PL, polyline",
        _ => return None,
    })
}

/// Reads a file. Points are kept as they are, whatever the curve type; a closed curve that repeats its first
/// point loses the repeated one.
pub fn read(path: &Path, bytes: &[u8], header: &mut CurveHeader) -> Result<Curves> {
    if bytes.len() < 3 || &bytes[..3] != b"BCC" {
        return Err(Error::binary(path, 0, "other bytes", "'BCC', the start of a .bcc file"));
    }
    if bytes.len() < HEADER {
        return Err(Error::binary(path, bytes.len(), "the end of the file", "a header of 64 bytes"));
    }
    let (int_bytes, float_bytes) = ((bytes[3] >> 4) as usize, (bytes[3] & 15) as usize);
    if !matches!(int_bytes, 4 | 8) || !matches!(float_bytes, 4 | 8) {
        let found =
            format!("the size byte {:#04x} ({int_bytes}-byte integers, {float_bytes}-byte floats)", bytes[3]);
        return Err(Error::binary(path, 3, found, "0x44 (4-byte integers and floats; 8 is read too)"));
    }
    let letters = [bytes[4], bytes[5]];
    let Some(type_name) = curve_type(letters) else {
        let found = format!("the curve type '{}'", letters.escape_ascii());
        return Err(Error::binary(path, 4, found, "C0 (or another Cn), BS, BZ or PL"));
    };
    if bytes[6] != 3 {
        return Err(Error::binary(path, 6, format_args!("{} dimensions", bytes[6]), "3"));
    }
    header.up = match bytes[7] {
        1 => Some(UpAxis::Y),
        2 => Some(UpAxis::Z),
        _ => None,
    };
    let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
    let (curve_count, point_count) = (word(8), word(16));
    // Counts are held against the file's size before anything is allocated.
    let room = (bytes.len() - HEADER) as u64;
    if curve_count > room / int_bytes as u64 {
        let expected = format!("at most {} in a file of {} bytes", room / int_bytes as u64, bytes.len());
        return Err(Error::binary(path, 8, format_args!("{curve_count} curves"), expected));
    }
    let point_bytes = 3 * float_bytes;
    let point_room = room - curve_count * int_bytes as u64;
    if point_count > point_room / point_bytes as u64 {
        let expected =
            format!("at most {} in a file of {} bytes", point_room / point_bytes as u64, bytes.len());
        return Err(Error::binary(path, 16, format_args!("{point_count} control points"), expected));
    }

    let mut curves = Curves::empty();
    curves.points.reserve_exact(point_count as usize);
    let mut at = HEADER;
    let mut repeated = 0;
    for curve in 0..curve_count {
        let Some(count) = bytes.get(at..at + int_bytes) else {
            let found = format!("the end of the file after {curve} of {curve_count} curves");
            return Err(Error::binary(path, bytes.len(), found, "a point count"));
        };
        let count = match int_bytes {
            4 => i32::from_le_bytes(std::array::from_fn(|i| count[i])) as i64,
            _ => i64::from_le_bytes(std::array::from_fn(|i| count[i])),
        };
        let (closed, length) = (count < 0, count.unsigned_abs());
        let left = point_count - curves.points.len() as u64 - repeated;
        if length > left {
            let expected = format!("at most {left}, what is left of {point_count} control points");
            return Err(Error::binary(path, at, format_args!("a curve of {length} points"), expected));
        }
        at += int_bytes;
        let data = bytes.get(at..at + length as usize * point_bytes).unwrap_or(&[]);
        for (i, p) in data.chunks_exact(point_bytes).enumerate() {
            let number = |k: usize| match float_bytes {
                4 => f32::from_le_bytes(std::array::from_fn(|i| p[4 * k + i])) as f64,
                _ => f64::from_le_bytes(std::array::from_fn(|i| p[8 * k + i])),
            };
            let point = DVec3::new(number(0), number(1), number(2));
            if !point.is_finite() {
                return Err(Error::binary(path, at + i * point_bytes, point, "finite coordinates"));
            }
            curves.points.push(point);
        }
        let first = curves.offsets[curves.offsets.len() - 1];
        if closed && length >= 2 && curves.points[first] == curves.points[curves.points.len() - 1] {
            curves.points.pop();
            repeated += 1;
        }
        curves.end_yarn(closed, None);
        at += data.len();
    }
    let read = curves.points.len() as u64 + repeated;
    if read != point_count {
        return Err(Error::binary(
            path,
            16,
            format_args!("{point_count} control points"),
            format_args!("the {read} of the curves"),
        ));
    }
    if at != bytes.len() {
        return Err(Error::binary(
            path,
            at,
            format_args!("{} bytes after the last curve", bytes.len() - at),
            "the end of the file",
        ));
    }

    header.fact("curve type", type_name);
    header.fact("number sizes", format_args!("{int_bytes}-byte integers, {float_bytes}-byte floats"));
    header.fact(
        "up axis",
        match bytes[7] {
            1 => "y".into(),
            2 => "z".into(),
            other => format!("unknown ({other})"),
        },
    );
    // The 40 bytes are free text that some writers leave uninitialised.
    let info: &[u8] = bytes[24..HEADER].split(|&b| b == 0).next().unwrap_or(&[]);
    if !info.is_empty() && info.iter().all(|b| (b' '..=b'~').contains(b)) {
        header.fact("info", String::from_utf8_lossy(info));
    }
    header.note(repeated as usize, |n| {
        format!("{n} closed curves repeated their first point; the repeated one was dropped")
    });
    if &letters != b"C0" && &letters != b"PL" {
        header.notes.push(format!("the curve type is {type_name}; its control points are taken as they are"));
    }
    Ok(curves)
}

/// Writes a file: `C0`, f32.
pub fn write(out: &mut Output, curves: &dyn CurveSource, options: &WriteOptions) -> Result<()> {
    let path = out.path().to_path_buf();
    let yarns = curves.yarn_count();
    let points: u64 = (0..yarns).map(|yarn| curves.yarn_len(yarn) as u64).sum();
    let mut header = [0; HEADER];
    header[..8].copy_from_slice(&[
        b'B',
        b'C',
        b'C',
        0x44,
        b'C',
        b'0',
        3,
        if options.up == UpAxis::Y { 1 } else { 2 },
    ]);
    header[8..16].copy_from_slice(&(yarns as u64).to_le_bytes());
    header[16..24].copy_from_slice(&points.to_le_bytes());
    header[24..32].copy_from_slice(b"knotmesh");
    out.put(&header)?;
    let mut buffer: Vec<u8> = Vec::new();
    for yarn in 0..yarns {
        let length = curves.yarn_len(yarn);
        let count = i32::try_from(length).map_err(|_| {
            Error::invalid(format_args!(
                "{}: found {length} points in yarn {}, expected at most 2147483647",
                path.display(),
                yarn + 1
            ))
        })?;
        out.put(&if curves.yarn_closed(yarn) { -count } else { count }.to_le_bytes())?;
        visit_points(curves, yarn, |points| {
            for part in points.chunks(4096) {
                buffer.clear();
                push_singles(&mut buffer, &path, yarn, part)?;
                out.put(&buffer)?;
            }
            Ok(())
        })?;
    }
    Ok(())
}
