//! Wavefront OBJ polylines: `v x y z` and `l i j k …`.
//!
//! Written with one `l` per curve; closed ones end with their first index again, single points are `p`. Curves
//! without points cannot be written and are left out. Read are whole curves, curves split into two-point lines
//! (as Blender writes them), lines continued by a backslash (as Houdini writes them) and negative indices.

use super::curves::{CurveHeader, WriteOptions, visit_points};
use super::numbers::{DOUBLE, push_number};
use super::obj_mesh::OTHER_KEYWORDS;
use super::output::Output;
use super::text::Lines;
use crate::yarn::{CurveSource, Curves};
use crate::{Error, Result};
use glam::DVec3;
use std::path::Path;

/// Everything the statements said.
#[derive(Default)]
struct Parsed {
    vertices: Vec<DVec3>,
    /// Indices (from 0) of all `l` and `p` elements, one element after the other.
    indices: Vec<u32>,
    /// Where each element ends in `indices`.
    ends: Vec<usize>,
    faces: usize,
}

fn parse(path: &Path, bytes: &[u8]) -> Result<Parsed> {
    let mut parsed = Parsed::default();
    // The largest index so far and its place: vertices may come after the lines that use them.
    let mut largest = (0u64, 0, 0);
    const EXPECTED: &str = "'v x y z', three finite numbers";
    for mut line in Lines::new(path, bytes, true).continued() {
        let first_line = line.number;
        let Some(keyword) = line.word()? else { continue };
        match keyword.text {
            "v" => {
                let point = DVec3::new(line.f64(EXPECTED)?, line.f64(EXPECTED)?, line.f64(EXPECTED)?);
                parsed.vertices.push(point);
            }
            "l" | "p" => {
                let begin = parsed.indices.len();
                while let Some(word) = line.word()? {
                    let count = parsed.vertices.len() as i64;
                    let number: Option<i64> = word.text.split('/').next().and_then(|n| n.parse().ok());
                    let index = match number {
                        Some(n @ 1..=0xffff_ffff) => n - 1,
                        Some(n) if n < 0 && n >= -count => count + n,
                        Some(n) if n < 0 => {
                            let expected =
                                format!("an index down to -{count}, the first of the vertices so far");
                            return Err(line.error(word.column, n, expected));
                        }
                        _ => {
                            return Err(line.unexpected(word, "a vertex index, counted from 1 or negative"));
                        }
                    };
                    if index as u64 >= largest.0 {
                        largest = (index as u64 + 1, line.number, word.column);
                    }
                    parsed.indices.push(index as u32);
                    if keyword.text == "p" {
                        parsed.ends.push(parsed.indices.len());
                    }
                }
                if keyword.text == "l" {
                    if parsed.indices.len() < begin + 2 {
                        return Err(Error::input(
                            path,
                            first_line,
                            keyword.column,
                            "a line of fewer than two points",
                            "'l i j …'",
                        ));
                    }
                    parsed.ends.push(parsed.indices.len());
                }
            }
            other => {
                if other == "f" {
                    parsed.faces += 1;
                } else if !OTHER_KEYWORDS.contains(&other) && !["vt", "g", "o", "usemtl"].contains(&other) {
                    return Err(line.unexpected(keyword, "an OBJ statement ('v' and 'l' for curves)"));
                }
                while line.word()?.is_some() {}
            }
        }
    }
    let (index, line, column) = largest;
    if index > parsed.vertices.len() as u64 {
        let expected = format!("an index up to {}, the number of vertices", parsed.vertices.len());
        return Err(Error::input(path, line, column, index, expected));
    }
    Ok(parsed)
}

/// Two-point lines joined at their shared vertices.
struct Chain {
    vertices: Vec<u32>,
    closed: bool,
    /// The lowest number among its lines: the chain's place in the file.
    line: usize,
}

/// Joins two-point lines into chains, in the order of their first lines. Also counts vertices with more than two
/// lines, where chains end.
fn join(segments: &[[u32; 2]], vertex_count: usize) -> (Vec<Chain>, usize) {
    const NONE: u32 = u32::MAX;
    let mut degree = vec![0u32; vertex_count];
    let mut touching = vec![[NONE; 2]; vertex_count];
    for (i, ends) in segments.iter().enumerate() {
        for &v in ends {
            let v = v as usize;
            if degree[v] < 2 {
                touching[v][degree[v] as usize] = i as u32;
            }
            degree[v] += 1;
        }
    }
    let branches = degree.iter().filter(|&&d| d > 2).count();
    // The segment after `segment` at vertex `v`, if the chain goes on there.
    let next = |segment: usize, v: u32| -> Option<usize> {
        let v = v as usize;
        (degree[v] == 2)
            .then(|| touching[v].into_iter().find(|&s| s as usize != segment))
            .flatten()
            .map(|s| s as usize)
    };
    let other = |segment: usize, v: u32| {
        let [a, b] = segments[segment];
        if a == v { b } else { a }
    };
    let mut used = vec![false; segments.len()];
    let mut chains = Vec::new();
    for start in 0..segments.len() {
        if used[start] {
            continue;
        }
        // Back to the chain's beginning, or around the loop to this segment again.
        let (mut segment, mut v) = (start, segments[start][0]);
        let mut closed = false;
        while let Some(before) = next(segment, v) {
            if before == start {
                (segment, v, closed) = (start, segments[start][0], true);
                break;
            }
            v = other(before, v);
            segment = before;
        }
        let mut chain = vec![v];
        loop {
            used[segment] = true;
            v = other(segment, v);
            chain.push(v);
            match next(segment, v) {
                Some(after) if !used[after] => segment = after,
                _ => break,
            }
        }
        closed |= chain.len() > 1 && chain[0] == chain[chain.len() - 1];
        if closed {
            chain.pop();
        }
        chains.push(Chain { vertices: chain, closed, line: start });
    }
    (chains, branches)
}

/// Reads a file.
pub fn read(path: &Path, bytes: &[u8], header: &mut CurveHeader) -> Result<Curves> {
    let mut parsed = parse(path, bytes)?;
    let mut segments = Vec::new();
    let mut begin = 0;
    for &end in &parsed.ends {
        if let [a, b] = parsed.indices[begin..end]
            && a != b
        {
            segments.push([a, b]);
        }
        begin = end;
    }
    let (chains, branches) = join(&segments, parsed.vertices.len());
    let (segment_count, chain_count) = (segments.len(), chains.len());
    drop(segments);

    let mut curves = Curves::empty();
    let vertices = std::mem::take(&mut parsed.vertices);
    let mut add = |indices: &[u32], closed: bool| {
        curves.points.extend(indices.iter().map(|&i| vertices[i as usize]));
        curves.end_yarn(closed, None);
    };
    let (mut coinciding, mut line) = (0, 0);
    let mut chains = chains.into_iter().peekable();
    begin = 0;
    for &end in &parsed.ends {
        match parsed.indices[begin..end] {
            [a, b] if a != b => {
                if let Some(Chain { vertices: mut chain, closed, .. }) = chains.next_if(|c| c.line == line) {
                    let last = chain.len() - 1;
                    let ends_meet =
                        !closed && last >= 3 && vertices[chain[0] as usize] == vertices[chain[last] as usize];
                    if ends_meet {
                        chain.pop();
                        coinciding += 1;
                    }
                    add(&chain, closed || ends_meet);
                }
                line += 1;
            }
            ref whole => {
                let closed = whole.len() >= 2 && whole[0] == whole[whole.len() - 1];
                add(&whole[..whole.len() - usize::from(closed)], closed);
            }
        }
        begin = end;
    }
    if segment_count > chain_count {
        header.fact("two-point lines", format_args!("{segment_count}, joined"));
    }
    header.note(coinciding, |n| {
        format!("{n} curves of two-point lines end where they start; they are taken as closed")
    });
    header.note(branches, |n| format!("{n} vertices have more than two lines; curves end there"));
    header.note(parsed.faces, |n| format!("{n} faces are no curves; they are ignored"));
    Ok(curves)
}

/// Writes a file. The radius is not stored.
pub fn write(out: &mut Output, curves: &dyn CurveSource, _options: &WriteOptions) -> Result<()> {
    out.put(b"# yarn curves written by knotmesh\n")?;
    let mut text = Vec::new();
    let mut index = 1;
    for yarn in 0..curves.yarn_count() {
        let length = curves.yarn_len(yarn);
        if length == 0 {
            continue;
        }
        visit_points(curves, yarn, |points| {
            for part in points.chunks(1024) {
                text.clear();
                for p in part {
                    text.push(b'v');
                    for x in p.to_array() {
                        text.push(b' ');
                        push_number(&mut text, x, DOUBLE);
                    }
                    text.push(b'\n');
                }
                out.put(&text)?;
            }
            Ok(())
        })?;
        let closed = curves.yarn_closed(yarn);
        out.put(if length == 1 && !closed { b"p" } else { b"l" })?;
        let last = closed.then_some(index);
        for i in (index..index + length).chain(last) {
            out.put(format!(" {i}").as_bytes())?;
        }
        out.put(b"\n")?;
        index += length;
    }
    Ok(())
}
