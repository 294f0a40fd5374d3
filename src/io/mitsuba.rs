//! Mitsuba's curve text (`.txt`): one `x y z r` a line, a blank line between curves.
//!
//! Closed curves repeat their first point, as Mitsuba's linear curves need; on reading, a curve of at least three
//! points that ends where it starts is closed. Curves without points cannot be written and are left out.

use super::curves::{CurveHeader, WriteOptions, radius_of, visit_points};
use super::numbers::{DOUBLE, push_number};
use super::output::Output;
use super::text::Lines;
use crate::Result;
use crate::yarn::{CurveSource, Curves};
use glam::DVec3;
use std::path::Path;

/// Reads a file. A curve's radius is the mean of its points' radii.
pub fn read(path: &Path, bytes: &[u8], header: &mut CurveHeader) -> Result<Curves> {
    let mut curves = Curves::empty();
    let mut varying = 0;
    let mut radii = Radii::default();
    for mut line in Lines::new(path, bytes, false) {
        let Some(word) = line.word()? else {
            end_curve(&mut curves, &mut radii, &mut varying);
            continue;
        };
        const EXPECTED: &str = "'x y z radius', four finite numbers";
        let x = line.parse_f64(word, EXPECTED)?;
        let point = DVec3::new(x, line.f64(EXPECTED)?, line.f64(EXPECTED)?);
        let word = line.expect_word(EXPECTED)?;
        let radius = line.parse_f64(word, EXPECTED)?;
        if radius < 0.0 {
            return Err(line.unexpected(word, "a radius of at least 0"));
        }
        line.end()?;
        curves.points.push(point);
        radii.add(radius);
    }
    end_curve(&mut curves, &mut radii, &mut varying);
    header.note(varying, |n| format!("{n} curves have a radius that varies; its mean was taken"));
    Ok(curves)
}

/// Mean and range of a curve's radii.
#[derive(Default)]
struct Radii {
    count: usize,
    sum: f64,
    low: f64,
    high: f64,
}

impl Radii {
    fn add(&mut self, radius: f64) {
        if self.count == 0 {
            (self.low, self.high) = (radius, radius);
        }
        self.count += 1;
        // A part of the sum each, for the sum itself could overflow.
        self.sum += (radius - self.sum) / self.count as f64;
        self.low = self.low.min(radius);
        self.high = self.high.max(radius);
    }
}

fn end_curve(curves: &mut Curves, radii: &mut Radii, varying: &mut usize) {
    let first = curves.offsets[curves.offsets.len() - 1];
    let length = curves.points.len() - first;
    if length == 0 {
        return;
    }
    let closed = length >= 3 && curves.points[first] == curves.points[curves.points.len() - 1];
    if closed {
        curves.points.pop();
    }
    let same = radii.low == radii.high;
    *varying += usize::from(!same);
    curves.end_yarn(closed, Some(if same { radii.low } else { radii.sum }));
    *radii = Radii::default();
}

/// Writes a file. Every yarn needs a radius.
pub fn write(out: &mut Output, curves: &dyn CurveSource, options: &WriteOptions) -> Result<()> {
    let path = out.path().to_path_buf();
    let mut any = false;
    let mut text = Vec::new();
    for yarn in 0..curves.yarn_count() {
        let length = curves.yarn_len(yarn);
        if length == 0 {
            continue;
        }
        if any {
            out.put(b"\n")?;
        }
        any = true;
        let mut end = vec![b' '];
        push_number(&mut end, radius_of(&path, curves, yarn, options)?, DOUBLE);
        end.push(b'\n');
        let mut first = Vec::new();
        visit_points(curves, yarn, |points| {
            for part in points.chunks(1024) {
                text.clear();
                for p in part {
                    for x in p.to_array() {
                        push_number(&mut text, x, DOUBLE);
                        text.push(b' ');
                    }
                    text.pop();
                    text.extend_from_slice(&end);
                    if first.is_empty() {
                        first.clone_from(&text);
                    }
                }
                out.put(&text)?;
            }
            Ok(())
        })?;
        if curves.yarn_closed(yarn) && length >= 2 {
            out.put(&first)?;
        }
    }
    // An empty file would look like a failed write.
    if any { Ok(()) } else { out.put(b"\n") }
}
