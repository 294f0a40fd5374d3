//! How near the centrelines of yarns come: samples every r/2 along the curve, arc within 1.2 pi r on the
//! same yarn excluded.

use crate::Result;
use crate::yarn::CurveSource;
use glam::{DVec3, IVec3};
use serde::Serialize;
use std::collections::HashMap;

/// Distances of centrelines, in yarn radii: touching yarns are 2 apart.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Clearance {
    /// Samples looked at.
    pub samples: usize,
    /// Share of the samples nearer than 1.5 r to another centreline.
    pub share_below_1_5r: f64,
    /// Share of the samples nearer than 2 r.
    pub share_below_2r: f64,
    /// The smallest distance in r, capped at 2.5 where nothing is nearer.
    pub smallest: f64,
}

/// Distances beyond this many radii are not looked for.
const REACH: f64 = 2.5;

struct Sample {
    at: DVec3,
    yarn: u32,
    arc: f64,
}

/// Measures curves of yarn radius `r` (world units). Curves should be dense: at most about r/2 a segment.
///
/// # Errors
/// Those of the source.
pub fn clearance(curves: &dyn CurveSource, r: f64) -> Result<Clearance> {
    let (samples, lengths) = sample(curves, 0.5 * r)?;
    let cell = |p: DVec3| (p / (REACH * r)).floor().as_ivec3();
    let mut grid: HashMap<IVec3, Vec<u32>> = HashMap::new();
    for (i, s) in samples.iter().enumerate() {
        grid.entry(cell(s.at)).or_default().push(i as u32);
    }
    let exempt = 1.2 * std::f64::consts::PI * r;
    let (mut near, mut touching, mut smallest) = (0, 0, REACH);
    for s in &samples {
        let center = cell(s.at);
        let mut nearest = REACH;
        for offset in 0..27 {
            let at = center + IVec3::new(offset % 3 - 1, offset / 3 % 3 - 1, offset / 9 - 1);
            for other in grid.get(&at).into_iter().flatten().map(|i| &samples[*i as usize]) {
                if other.yarn == s.yarn {
                    let apart = (other.arc - s.arc).abs();
                    let (length, closed) = lengths[s.yarn as usize];
                    if apart.min(if closed { length - apart } else { f64::INFINITY }) <= exempt {
                        continue;
                    }
                }
                nearest = f64::min(nearest, (other.at - s.at).length() / r);
            }
        }
        near += usize::from(nearest < 1.5);
        touching += usize::from(nearest < 2.0);
        smallest = f64::min(smallest, nearest);
    }
    let share = |n: usize| n as f64 / samples.len().max(1) as f64;
    Ok(Clearance {
        samples: samples.len(),
        share_below_1_5r: share(near),
        share_below_2r: share(touching),
        smallest,
    })
}

/// Samples every `step` along all curves, and each curve's `(length, closed)`.
fn sample(curves: &dyn CurveSource, step: f64) -> Result<(Vec<Sample>, Vec<(f64, bool)>)> {
    let mut samples = Vec::new();
    let mut lengths = Vec::new();
    for yarn in 0..curves.yarn_count() {
        let (mut first, mut last): (Option<DVec3>, Option<DVec3>) = (None, None);
        let (mut arc, mut next) = (0.0, 0.0);
        let mut walk = |p: DVec3, samples: &mut Vec<Sample>| {
            if let Some(from) = last {
                let length = (p - from).length();
                while next <= arc + length && length > 0.0 {
                    let at = from.lerp(p, (next - arc) / length);
                    samples.push(Sample { at, yarn: yarn as u32, arc: next });
                    next += step;
                }
                arc += length;
            }
            last = Some(p);
            arc
        };
        curves.visit(yarn, &mut |points| {
            for p in points {
                first.get_or_insert(*p);
                walk(*p, &mut samples);
            }
            Ok(())
        })?;
        let closed = curves.yarn_closed(yarn);
        let length = match first {
            Some(p) if closed => walk(p, &mut samples),
            Some(_) => arc,
            None => 0.0,
        };
        lengths.push((length, closed));
    }
    Ok((samples, lengths))
}
