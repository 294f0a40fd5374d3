//! How near the centrelines of yarns come: samples every r/2 along the curve, arc within 1.2 pi r on the
//! same yarn excluded.

use crate::Result;
use crate::yarn::CurveSource;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// Distances of centrelines, in yarn radii: touching yarns are 2 apart.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Clearance {
    /// Samples looked at.
    pub samples: usize,
    /// Share of the samples nearer than r to another centreline: half of one yarn lies in the other.
    pub share_below_r: f64,
    /// Share of the samples nearer than 1.5 r to another centreline.
    pub share_below_1_5r: f64,
    /// Share of the samples nearer than 2 r.
    pub share_below_2r: f64,
    /// The smallest distance in r, capped at 2.5 where nothing is nearer.
    pub smallest: f64,
}

/// Distances beyond this many radii are not looked for.
const REACH: f64 = 2.5;
/// More samples than this are thinned out evenly.
const MOST: usize = 500_000;
/// Samples taken at most.
const MOST_SAMPLES: usize = 20_000_000;

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
    let distances = distances(curves, r)?;
    let share =
        |limit: f64| distances.iter().filter(|d| **d < limit).count() as f64 / distances.len().max(1) as f64;
    Ok(Clearance {
        samples: distances.len(),
        share_below_r: share(1.0),
        share_below_1_5r: share(1.5),
        share_below_2r: share(2.0),
        smallest: distances.iter().copied().fold(REACH, f64::min),
    })
}

/// `[sample]` how near another centreline comes, in yarn radii, capped at 2.5; see [`clearance`].
///
/// # Errors
/// Those of the source.
pub fn distances(curves: &dyn CurveSource, r: f64) -> Result<Vec<f64>> {
    // Yarn torn over the whole of space needs no finer samples than these.
    let step = f64::max(0.5 * r, length_of(curves)? / MOST_SAMPLES as f64);
    let (samples, lengths) = sample(curves, step)?;
    let cell = |p: DVec3| (p / (REACH * r)).floor().as_i64vec3();
    // Samples sorted by cell, so that three neighbouring cells along z are one run.
    let mut order: Vec<([i64; 3], u32)> =
        samples.par_iter().enumerate().map(|(i, s)| (cell(s.at).to_array(), i as u32)).collect();
    order.par_sort_unstable();
    let exempt = 1.2 * std::f64::consts::PI * r;
    let nearest = |s: &Sample| {
        let center = cell(s.at);
        let mut nearest = REACH;
        for offset in 0..9 {
            let [x, y] = [center.x + offset % 3 - 1, center.y + offset / 3 - 1];
            let begin = order.partition_point(|(at, _)| *at < [x, y, center.z - 1]);
            for (at, other) in &order[begin..] {
                if *at > [x, y, center.z + 1] {
                    break;
                }
                let other = &samples[*other as usize];
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
        nearest
    };
    // A share needs no more than so many samples.
    let every = samples.len().div_ceil(MOST).max(1);
    Ok(samples.par_iter().step_by(every).map(nearest).collect())
}

/// A yarn's length and closedness.
type Extent = (f64, bool);

/// Length of all curves together, closing segments left out.
fn length_of(curves: &dyn CurveSource) -> Result<f64> {
    let mut total = 0.0;
    for yarn in 0..curves.yarn_count() {
        let mut last: Option<DVec3> = None;
        curves.visit(yarn, &mut |points| {
            for p in points {
                total += last.map_or(0.0, |l| (*p - l).length());
                last = Some(*p);
            }
            Ok(())
        })?;
    }
    Ok(total)
}

/// Samples every `step` along all curves, and each curve's `(length, closed)`.
fn sample(curves: &dyn CurveSource, step: f64) -> Result<(Vec<Sample>, Vec<Extent>)> {
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
