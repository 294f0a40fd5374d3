//! `.yarns` files: six chunks of points, pattern lines, yarns, unit names, units and rest lengths.
//!
//! The format has no closed yarns: a closed one is written with its first point repeated, and a yarn whose last
//! point repeats its first (at least three others in between) is read as closed. Unit names are byte ranges of
//! the `strs` chunk. Rest lengths refer to points by their number in the file and to units counted from 0.

use super::curves::{CurveHeader, WriteOptions, push_singles, radius_of, visit_points};
use super::output::Output;
use crate::yarn::{CurveCheckpoint, CurveSource, Curves};
use crate::{Error, Result};
use glam::DVec3;
use std::path::Path;

/// The chunks in their order, and the size of their records.
const CHUNKS: [(&[u8; 4], usize); 6] =
    [(b"f3..", 12), (b"src.", 4), (b"yarn", 16), (b"strs", 1), (b"unit", 12), (b"chk.", 12)];
/// Colour (RGBA) of written yarns: a light grey.
const COLOR: [u8; 4] = [208, 208, 208, 255];

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

fn f32_at(bytes: &[u8], at: usize) -> f64 {
    f32::from_bits(u32_at(bytes, at)) as f64
}

/// A chunk's data and where it begins in the file.
#[derive(Clone, Copy)]
struct Chunk<'a> {
    data: &'a [u8],
    at: usize,
}

fn split<'a>(path: &Path, bytes: &'a [u8]) -> Result<[Chunk<'a>; 6]> {
    let mut chunks = [Chunk { data: &[], at: 0 }; 6];
    let mut at = 0;
    for (chunk, (tag, record)) in chunks.iter_mut().zip(CHUNKS) {
        let name = tag.escape_ascii();
        let Some(head) = bytes.get(at..at + 8) else {
            return Err(Error::binary(
                path,
                bytes.len(),
                "the end of the file",
                format_args!("the chunk '{name}'"),
            ));
        };
        if &head[..4] != tag {
            let found = format!("'{}'", head[..4].escape_ascii());
            return Err(Error::binary(path, at, found, format_args!("the chunk '{name}'")));
        }
        let size = u32_at(head, 4) as usize;
        let left = bytes.len() - at - 8;
        if size > left {
            let found = format!("a chunk '{name}' of {size} bytes");
            return Err(Error::binary(
                path,
                at + 4,
                found,
                format_args!("at most {left}, what is left of the file"),
            ));
        }
        if !size.is_multiple_of(record) {
            let found = format!("a chunk '{name}' of {size} bytes");
            return Err(Error::binary(path, at + 4, found, format_args!("a multiple of {record}")));
        }
        *chunk = Chunk { data: &bytes[at + 8..at + 8 + size], at: at + 8 };
        at += 8 + size;
    }
    if at != bytes.len() {
        return Err(Error::binary(
            path,
            at,
            format_args!("{} bytes after the last chunk", bytes.len() - at),
            "the end of the file",
        ));
    }
    Ok(chunks)
}

/// Reads a file.
pub fn read(path: &Path, bytes: &[u8], header: &mut CurveHeader) -> Result<Curves> {
    let [f3, src, yarn, strs, unit, chk] = split(path, bytes)?;
    let count = f3.data.len() / 12;
    if src.data.len() / 4 != count {
        let found = format!("{} pattern lines", src.data.len() / 4);
        return Err(Error::binary(path, src.at - 4, found, format_args!("{count}, one per point")));
    }
    let mut curves = Curves::empty();
    let mut previous = 0;
    let mut unused = 0;
    // Point number in the file -> point number in the result is `number - shift`, from `begin` on.
    let mut pieces: Vec<(usize, usize, usize)> = Vec::new();
    for (i, record) in yarn.data.chunks_exact(16).enumerate() {
        let at = yarn.at + 16 * i;
        let (begin, end, radius) =
            (u32_at(record, 0) as usize, u32_at(record, 4) as usize, f32_at(record, 8));
        if begin > end || end > count {
            let found = format!("a yarn of points {begin} to {end}");
            return Err(Error::binary(path, at, found, format_args!("a range within the {count} points")));
        }
        if begin < previous {
            let found = format!("a yarn that starts at point {begin}");
            return Err(Error::binary(
                path,
                at,
                found,
                format_args!("{previous}, where the yarn before ended, or later"),
            ));
        }
        if !(radius.is_finite() && radius >= 0.0) {
            return Err(Error::binary(
                path,
                at + 8,
                format_args!("the radius {radius}"),
                "a radius of at least 0",
            ));
        }
        unused += begin - previous;
        previous = end;
        let first = curves.points.len();
        for j in begin..end {
            let point =
                DVec3::new(f32_at(f3.data, 12 * j), f32_at(f3.data, 12 * j + 4), f32_at(f3.data, 12 * j + 8));
            if !point.is_finite() {
                return Err(Error::binary(path, f3.at + 12 * j, point, "finite coordinates"));
            }
            curves.points.push(point);
        }
        let mut kept = end - begin;
        let closed = kept >= 4 && curves.points[first] == curves.points[first + kept - 1];
        if closed {
            curves.points.pop();
            kept -= 1;
        }
        curves.sources.extend((begin..begin + kept).map(|j| u32_at(src.data, 4 * j)));
        curves.end_yarn(closed, Some(radius));
        pieces.push((begin, end, first));
    }
    unused += count - previous;

    for (i, record) in unit.data.chunks_exact(12).enumerate() {
        let at = unit.at + 12 * i;
        let (begin, end, length) =
            (u32_at(record, 0) as usize, u32_at(record, 4) as usize, f32_at(record, 8));
        let Some(name) = strs.data.get(begin..end) else {
            let found = format!("a unit name of bytes {begin} to {end}");
            return Err(Error::binary(
                path,
                at,
                found,
                format_args!("a range within the {} bytes of 'strs'", strs.data.len()),
            ));
        };
        let Ok(name) = std::str::from_utf8(name) else {
            return Err(Error::binary(path, strs.at + begin, "a unit name that is not UTF-8", "text"));
        };
        if !length.is_finite() {
            return Err(Error::binary(
                path,
                at + 8,
                format_args!("the unit length {length}"),
                "a finite number",
            ));
        }
        // Overlapping ranges could turn a small file into a lot of names.
        if name.len() > 256 {
            return Err(Error::binary(
                path,
                at,
                format_args!("a unit name of {} bytes", name.len()),
                "at most 256",
            ));
        }
        curves.units.push((name.into(), length));
    }
    let mut lost = 0;
    for (i, record) in chk.data.chunks_exact(12).enumerate() {
        let at = chk.at + 12 * i;
        let (number, length, unit) = (u32_at(record, 0) as usize, f32_at(record, 4), u32_at(record, 8));
        if number >= count {
            return Err(Error::binary(
                path,
                at,
                format_args!("a rest length at point {number}"),
                format_args!("a point below {count}"),
            ));
        }
        if !length.is_finite() {
            return Err(Error::binary(
                path,
                at + 4,
                format_args!("the rest length {length}"),
                "a finite number",
            ));
        }
        if unit as usize >= curves.units.len() {
            return Err(Error::binary(
                path,
                at + 8,
                format_args!("the unit {unit}"),
                format_args!("one below {}", curves.units.len()),
            ));
        }
        let piece = pieces.partition_point(|&(begin, ..)| begin <= number);
        // Empty yarns share their begin with the next one, which comes last and so wins.
        let Some(&(begin, end, first)) = pieces[..piece].last().filter(|piece| number < piece.1) else {
            lost += 1;
            continue;
        };
        let kept = curves.offsets[piece] - first;
        let within = if number - begin < kept { number - begin } else { 0 };
        debug_assert!(end - begin >= kept);
        curves.checkpoints.push(CurveCheckpoint { point: (first + within) as u32, length, unit });
    }
    header.fact("units", curves.units.len());
    header.fact("rest lengths", curves.checkpoints.len());
    header.note(unused, |n| format!("{n} points belong to no yarn; they were dropped"));
    header.note(lost, |n| format!("{n} rest lengths start at points of no yarn; they were dropped"));
    Ok(curves)
}

/// Points of a yarn in the file: closed ones repeat their first.
fn written_len(curves: &dyn CurveSource, yarn: usize) -> usize {
    let length = curves.yarn_len(yarn);
    length + usize::from(curves.yarn_closed(yarn) && length > 0)
}

/// Writes a file. Every yarn needs a radius.
pub fn write(out: &mut Output, curves: &dyn CurveSource, options: &WriteOptions) -> Result<()> {
    let path = out.path().to_path_buf();
    let yarns = curves.yarn_count();
    let points: usize = (0..yarns).map(|yarn| written_len(curves, yarn)).sum();
    let chunk = |index: usize, records: usize| -> Result<Vec<u8>> {
        let (tag, record) = CHUNKS[index];
        let size = u32::try_from(records.saturating_mul(record)).map_err(|_| {
            Error::invalid(format_args!(
                "{}: found {records} records for the chunk '{}', expected at most {}",
                path.display(),
                tag.escape_ascii(),
                u32::MAX as usize / record
            ))
        })?;
        Ok([&tag[..], &size.to_le_bytes()].concat())
    };

    out.put(&chunk(0, points)?)?;
    let mut buffer = Vec::new();
    for yarn in 0..yarns {
        let mut first = Vec::new();
        visit_points(curves, yarn, |points| {
            for part in points.chunks(4096) {
                buffer.clear();
                push_singles(&mut buffer, &path, yarn, part)?;
                if first.is_empty() {
                    first.extend_from_slice(buffer.get(..12).unwrap_or(&[]));
                }
                out.put(&buffer)?;
            }
            Ok(())
        })?;
        if curves.yarn_closed(yarn) {
            out.put(&first)?;
        }
    }

    out.put(&chunk(1, points)?)?;
    for yarn in 0..yarns {
        let (mut first, mut seen) = (None, 0);
        curves.visit_sources(yarn, &mut |sources| {
            seen += sources.len();
            first = first.or(sources.first().copied());
            buffer.clear();
            buffer.extend(sources.iter().flat_map(|s| s.to_le_bytes()));
            out.put(&buffer)
        })?;
        if seen != curves.yarn_len(yarn) {
            let expected = curves.yarn_len(yarn);
            return Err(Error::invalid(format_args!(
                "yarn {}: found {seen} pattern lines, expected {expected}",
                yarn + 1
            )));
        }
        if let Some(first) = first.filter(|_| curves.yarn_closed(yarn)) {
            out.put(&first.to_le_bytes())?;
        }
    }

    out.put(&chunk(2, yarns)?)?;
    // Number of each yarn's first point, without and with the repeated points.
    let mut starts = Vec::with_capacity(yarns);
    let (mut plain, mut begin) = (0, 0);
    for yarn in 0..yarns {
        let end = begin + written_len(curves, yarn);
        let radius = radius_of(&path, curves, yarn, options)? as f32;
        out.put(&(begin as u32).to_le_bytes())?;
        out.put(&(end as u32).to_le_bytes())?;
        out.put(&radius.to_le_bytes())?;
        out.put(&COLOR)?;
        starts.push((plain, begin));
        plain += curves.yarn_len(yarn);
        begin = end;
    }

    let units = curves.units();
    out.put(&chunk(3, units.iter().map(|(name, _)| name.len()).sum())?)?;
    for (name, _) in units {
        out.put(name.as_bytes())?;
    }
    out.put(&chunk(4, units.len())?)?;
    let mut begin = 0;
    for (name, length) in units {
        let end = begin + name.len();
        out.put(&(begin as u32).to_le_bytes())?;
        out.put(&(end as u32).to_le_bytes())?;
        out.put(&(*length as f32).to_le_bytes())?;
        begin = end;
    }
    let checkpoints = curves.checkpoints();
    out.put(&chunk(5, checkpoints.len())?)?;
    for checkpoint in checkpoints {
        let number = checkpoint.point as usize;
        if number >= plain || checkpoint.unit as usize >= units.len() {
            return Err(Error::invalid(format_args!(
                "rest length: found point {number} and unit {}, expected a point below {plain} and a unit below {}",
                checkpoint.unit,
                units.len()
            )));
        }
        let (plain, begin) = starts[starts.partition_point(|&(plain, _)| plain <= number) - 1];
        out.put(&((number - plain + begin) as u32).to_le_bytes())?;
        out.put(&(checkpoint.length as f32).to_le_bytes())?;
        out.put(&checkpoint.unit.to_le_bytes())?;
    }
    Ok(())
}
