//! PBRT-v4 scenes (`.pbrt`): a `Shape "curve"` of cubic Bezier segments per yarn, to be included in a scene.
//!
//! Written are the segments of the uniform Catmull-Rom curve through the points (the end points mirrored for open
//! curves, so that the first and last segments have their chord's tangent). Read are such shapes back to the
//! points on the curve; a curve of at least two segments that ends where it starts is closed. Curves without
//! points cannot be written and are left out; a single point becomes a segment without length.

use super::curves::{CurveHeader, WriteOptions, radius_of, visit_points};
use super::numbers::{DOUBLE, push_number};
use super::output::Output;
use super::scan::{Kind, Scanner};
use crate::Result;
use crate::yarn::{CurveSource, Curves};
use glam::DVec3;
use std::path::Path;

/// Directives that neither move nor change a shape.
const IGNORED: &[&str] = &[
    "AttributeBegin",
    "AttributeEnd",
    "WorldBegin",
    "Material",
    "NamedMaterial",
    "MakeNamedMaterial",
    "Texture",
];

/// Reads the curves of a file.
pub fn read(path: &Path, bytes: &[u8], header: &mut CurveHeader) -> Result<Curves> {
    let mut s = Scanner::new(path, bytes);
    let mut curves = Curves::empty();
    let mut tapered = 0;
    loop {
        let token = s.next()?;
        match token.kind {
            Kind::End => break,
            Kind::Word("Shape") => {
                let kind = s.next()?;
                if kind.kind != Kind::Quoted("curve") {
                    return Err(s.unexpected(kind, "\"curve\""));
                }
                shape(&mut s, kind.at, &mut curves, &mut tapered)?;
            }
            Kind::Word(word) if IGNORED.contains(&word) => {
                while matches!(s.peek()?.kind, Kind::Quoted(_) | Kind::Mark(b'[')) {
                    s.skip_value()?;
                    // The value of a parameter may come without brackets.
                    if let Kind::Word(value) = s.peek()?.kind
                        && (value.parse::<f64>().is_ok() || value == "true" || value == "false")
                    {
                        s.next()?;
                    }
                }
            }
            _ => {
                return Err(s.unexpected(token, "Shape \"curve\" (transforms and other shapes are not read)"));
            }
        }
    }
    header.note(tapered, |n| format!("{n} curves have a width that varies; the mean of both ends was taken"));
    Ok(curves)
}

/// A value list, with or without brackets.
fn numbers(s: &mut Scanner, each: &mut dyn FnMut(f64)) -> Result<usize> {
    if !s.take(b'[')? {
        each(s.number("a number")?);
        return Ok(1);
    }
    let mut count = 0;
    while !s.take(b']')? {
        each(s.number("a finite number or ']'")?);
        count += 1;
    }
    Ok(count)
}

fn shape(s: &mut Scanner, shape_at: usize, curves: &mut Curves, tapered: &mut usize) -> Result<()> {
    let mut widths = [1.0, 1.0];
    let mut controls = 0;
    let first = curves.points.len();
    while let Kind::Quoted(declaration) = s.peek()?.kind {
        let at = s.next()?.at;
        match declaration.split_ascii_whitespace().last().unwrap_or("") {
            "P" if controls > 0 => return Err(s.error(at, "a second \"P\"", "one per shape")),
            "P" => {
                // Every third control point lies on the curve.
                let mut point = [0.0; 3];
                let mut i = 0;
                let values = numbers(s, &mut |x| {
                    point[i % 3] = x;
                    i += 1;
                    if i % 9 == 3 {
                        curves.points.push(DVec3::from_array(point));
                    }
                })?;
                controls = values / 3;
                if values % 3 != 0 || controls % 3 != 1 || controls < 4 {
                    let found = format!("{values} numbers in \"P\"");
                    return Err(s.error(at, found, "3 (3 n + 1) numbers for n Bezier segments"));
                }
            }
            name @ ("width" | "width0" | "width1") => {
                let mut width = 0.0;
                if numbers(s, &mut |x| width = x)? != 1 || width < 0.0 {
                    return Err(s.error(
                        at,
                        format_args!("another value of \"{name}\""),
                        "one number of at least 0",
                    ));
                }
                match name {
                    "width0" => widths[0] = width,
                    "width1" => widths[1] = width,
                    _ => widths = [width; 2],
                }
            }
            name @ ("basis" | "type") => {
                let bracket = s.take(b'[')?;
                let value = s.next()?;
                let known: &[&str] =
                    if name == "basis" { &["bezier"] } else { &["cylinder", "flat", "ribbon"] };
                if !known.iter().any(|k| value.kind == Kind::Quoted(k)) {
                    return Err(s.unexpected(value, &format!("\"{}\"", known.join("\" or \""))));
                }
                if bracket {
                    s.expect(b']')?;
                }
            }
            "degree" => {
                let mut degree = 0.0;
                if numbers(s, &mut |x| degree = x)? != 1 || degree != 3.0 {
                    return Err(s.error(at, "another degree", "cubic curves, degree 3"));
                }
            }
            _ => s.skip_value()?,
        }
    }
    if controls == 0 {
        return Err(s.error(shape_at, "a curve without \"P\"", "its control points"));
    }
    let on_curve = &curves.points[first..];
    let meets = on_curve[0] == on_curve[on_curve.len() - 1];
    let closed = meets && on_curve.len() >= 3;
    // A single point is written as a segment without length.
    if closed || meets {
        curves.points.pop();
    }
    *tapered += usize::from(widths[0] != widths[1]);
    curves.end_yarn(closed, Some(0.25 * widths[0] + 0.25 * widths[1]));
    Ok(())
}

/// Writes a file. Every yarn needs a radius.
pub fn write(out: &mut Output, curves: &dyn CurveSource, options: &WriteOptions) -> Result<()> {
    let path = out.path().to_path_buf();
    out.put(b"# yarn curves written by knotmesh, for Include in a PBRT-v4 scene\n")?;
    for yarn in 0..curves.yarn_count() {
        let length = curves.yarn_len(yarn);
        if length == 0 {
            continue;
        }
        let mut width = Vec::new();
        push_number(&mut width, 2.0 * radius_of(&path, curves, yarn, options)?, DOUBLE);
        out.put(b"Shape \"curve\" \"string type\" \"cylinder\" \"float width0\" ")?;
        out.put(&width)?;
        out.put(b" \"float width1\" ")?;
        out.put(&width)?;
        out.put(b" \"point3 P\" [\n")?;
        let mut segments = Segments { out: &mut *out, text: Vec::new(), window: [DVec3::ZERO; 3], seen: 0 };
        let closed = curves.yarn_closed(yarn) && length >= 2;
        if closed {
            // The curve starts before its second point is known, so the last one must come first: it is looked up.
            let mut ends = [DVec3::ZERO; 3];
            let mut seen = 0;
            visit_points(curves, yarn, |points| {
                for p in points {
                    if seen < 2 {
                        ends[seen] = *p;
                    }
                    seen += 1;
                    ends[2] = *p;
                }
                Ok(())
            })?;
            let [first, second, last] = ends;
            segments.add(last)?;
            visit_points(curves, yarn, |points| points.iter().try_for_each(|p| segments.add(*p)))?;
            segments.add(first)?;
            segments.add(second)?;
        } else {
            let mut tail = [DVec3::ZERO; 2];
            let mut seen = 0;
            visit_points(curves, yarn, |points| {
                for &p in points {
                    tail = [if seen == 0 { p } else { tail[1] }, p];
                    seen += 1;
                    match seen {
                        1 => {}
                        2 => {
                            segments.add(2.0 * tail[0] - p)?;
                            segments.add(tail[0])?;
                            segments.add(p)?;
                        }
                        _ => segments.add(p)?,
                    }
                }
                Ok(())
            })?;
            if length == 1 {
                for _ in 0..3 {
                    segments.add(tail[1])?;
                }
            }
            segments.add(2.0 * tail[1] - tail[0])?;
        }
        let text = std::mem::take(&mut segments.text);
        out.put(&text)?;
        out.put(b"]\n")?;
    }
    Ok(())
}

/// Turns Catmull-Rom points, coming one by one, into Bezier control points.
struct Segments<'a> {
    out: &'a mut Output,
    text: Vec<u8>,
    window: [DVec3; 3],
    seen: usize,
}

impl Segments<'_> {
    /// Takes the next point; from the fourth on each completes the segment between the two before it.
    fn add(&mut self, next: DVec3) -> Result<()> {
        let [before, a, b] = self.window;
        if self.seen >= 3 {
            if self.seen == 3 {
                self.point(a);
            }
            self.point(a + (b - before) / 6.0);
            self.point(b - (next - a) / 6.0);
            self.point(b);
            self.text.push(b'\n');
            if self.text.len() > 1 << 16 {
                self.out.put(&self.text)?;
                self.text.clear();
            }
        }
        self.seen += 1;
        self.window = [a, b, next];
        Ok(())
    }

    fn point(&mut self, p: DVec3) {
        for x in p.to_array() {
            self.text.push(b' ');
            push_number(&mut self.text, x, DOUBLE);
        }
    }
}
