//! Rows of loops as curves, and where neighbouring rows cross.

use super::poses::Pose;
use crate::Result;
use crate::yarn::CurveSource;
use glam::{DVec2, DVec3, IVec2};
use std::collections::HashMap;

/// The yarn of a row, from left to right.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// `[point]` rolled flat, metres.
    pub flat: Vec<DVec3>,
    /// `[point]` in space, metres.
    pub world: Vec<DVec3>,
    /// `[point]` length of yarn up to it, metres.
    pub arc: Vec<f64>,
}

impl Row {
    /// A row of points in space.
    pub fn new(mut world: Vec<DVec3>, pose: &Pose) -> Self {
        let across = |p: &[DVec3]| Some(pose.flatten(*p.last()?).x - pose.flatten(p[0]).x);
        if across(&world).is_some_and(|x| x < 0.0) {
            world.reverse();
        }
        let mut arc = Vec::with_capacity(world.len());
        let mut length = 0.0;
        for (i, p) in world.iter().enumerate() {
            length += if i > 0 { p.distance(world[i - 1]) } else { 0.0 };
            arc.push(length);
        }
        Self { flat: world.iter().map(|p| pose.flatten(*p)).collect(), world, arc }
    }

    /// Where it is, rolled flat, after so much yarn.
    pub fn at(&self, arc: f64) -> DVec3 {
        let i = self.arc.partition_point(|a| *a <= arc).clamp(1, self.arc.len() - 1);
        let share = (arc - self.arc[i - 1]) / (self.arc[i] - self.arc[i - 1]).max(f64::MIN_POSITIVE);
        self.flat[i - 1].lerp(self.flat[i], share.clamp(0.0, 1.0))
    }

    fn extent(&self) -> f64 {
        let x = |f: fn(f64, f64) -> f64, from| self.flat.iter().map(|p| p.x).fold(from, f);
        x(f64::max, f64::NEG_INFINITY) - x(f64::min, f64::INFINITY)
    }

    fn height(&self) -> f64 {
        self.flat.iter().map(|p| p.y).sum::<f64>() / self.flat.len() as f64
    }
}

/// The rows of a swatch: yarns that go on over most of its width, from below to above.
///
/// # Errors
/// Those of the curves.
pub fn rows(curves: &dyn CurveSource, pose: &Pose, width: f64) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for yarn in 0..curves.yarn_count() {
        let mut world = Vec::with_capacity(curves.yarn_len(yarn));
        curves.visit(yarn, &mut |points| {
            world.extend_from_slice(points);
            Ok(())
        })?;
        if world.len() > 1 {
            rows.push(Row::new(world, pose));
        }
    }
    rows.retain(|r| r.extent() > 0.7 * width);
    rows.sort_by(|a, b| a.height().total_cmp(&b.height()));
    Ok(rows)
}

/// Where two rows cross, seen from the front.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Yarn of the lower and of the upper row up to it, metres.
    pub arc: [f64; 2],
    /// Where their centrelines are, rolled flat, metres.
    pub at: [DVec3; 2],
}

impl Crossing {
    /// Whether the lower row lies in front.
    fn lower_in_front(&self) -> bool {
        self.at[0].z > self.at[1].z
    }

    /// Between both yarns.
    pub fn middle(&self) -> DVec3 {
        (self.at[0] + self.at[1]) / 2.0
    }
}

/// A stitch: the head of a loop of the row below, held by the feet of a loop of the row above.
#[derive(Clone, Copy, Debug)]
pub struct Stitch {
    /// The row whose loop has its head here.
    pub row: usize,
    /// Crossings along that row: left foot (lower, upper), right foot (upper, lower).
    pub crossings: [Crossing; 4],
}

impl Stitch {
    /// Centres of the knots, left and right.
    pub fn knots(&self) -> [DVec3; 2] {
        let c = self.crossings.map(|c| c.middle());
        [(c[0] + c[1]) / 2.0, (c[3] + c[2]) / 2.0]
    }

    /// From a knot's centre to its upper contact, left and right.
    pub fn half_lengths(&self) -> [DVec2; 2] {
        let c = self.crossings.map(|c| c.middle().truncate());
        [(c[1] - c[0]) / 2.0, (c[2] - c[3]) / 2.0]
    }
}

/// Rows and their stitches.
#[derive(Clone, Debug)]
pub struct Loops {
    /// From below to above.
    pub rows: Vec<Row>,
    /// The middle of a stitch's contacts, were its fabric at rest (metres), and the stitch.
    pub stitches: Vec<(DVec2, Stitch)>,
}

impl Loops {
    /// Finds the stitches around the origin, so many stitches of a size at rest (metres) away at most.
    pub fn find(rows: Vec<Row>, pose: &Pose, stitch: DVec2, reach: f64) -> Self {
        let mut stitches = Vec::new();
        let near = |row: &Row| pose.undone(DVec3::new(0.0, row.height(), 0.0)).y.abs() < reach * stitch.y;
        let side = reach * stitch.x * pose.gradient.x_axis.x;
        for lower in 0..rows.len().saturating_sub(1) {
            if !near(&rows[lower]) {
                continue;
            }
            let crossings = crossings(&rows[lower], &rows[lower + 1], side);
            let mut at = 0;
            while at + 4 <= crossings.len() {
                let group = [0, 1, 2, 3].map(|k| crossings[at + k]);
                let [a, b, c, d] = group.map(|c| c.middle().y);
                // From behind the same order is seen from a head's right foot to the next one's left.
                let feet = a < b && d < c;
                if group.map(|c| c.lower_in_front()) != [true, false, false, true] || !feet {
                    at += 1;
                    continue;
                }
                let middle = group.iter().map(Crossing::middle).sum::<DVec3>() / 4.0;
                stitches.push((pose.undone(middle).truncate(), Stitch { row: lower, crossings: group }));
                at += 4;
            }
        }
        Self { rows, stitches }
    }

    /// Stitches by the cell of a grid that their middle lies in: cells of a size from an origin on, metres.
    pub fn by_cell(&self, origin: DVec2, stitch: DVec2) -> HashMap<IVec2, &Stitch> {
        self.stitches.iter().map(|(at, s)| (((*at - origin) / stitch).floor().as_ivec2(), s)).collect()
    }
}

/// Where two rows cross within `side` of the middle, in order along the lower one.
fn crossings(lower: &Row, upper: &Row, side: f64) -> Vec<Crossing> {
    let extreme =
        |row: &Row, f: fn(f64, f64) -> f64| row.flat.iter().map(|p| p.y).reduce(f).unwrap_or(f64::NAN);
    // Heads of the lower row and feet of the upper one: no other parts are on the same height.
    let heights = extreme(upper, f64::min)..=extreme(lower, f64::max);
    let pieces = |row: &Row| -> Vec<usize> {
        let near = |p: &DVec3| p.x.abs() < side && heights.contains(&p.y);
        (1..row.flat.len()).filter(|i| near(&row.flat[*i]) || near(&row.flat[i - 1])).collect()
    };
    let above = pieces(upper);
    // Contacts of knots are points of both curves. A shift too small to matter makes such a crossing one of two pieces.
    let shift = DVec3::new(1.3e-7, 0.7e-7, 0.0) * side;
    let mut found = Vec::new();
    for i in pieces(lower) {
        let (a, b) = (lower.flat[i - 1], lower.flat[i]);
        for &j in &above {
            let (c, d) = (upper.flat[j - 1] + shift, upper.flat[j] + shift);
            let apart = a.x.max(b.x) < c.x.min(d.x)
                || c.x.max(d.x) < a.x.min(b.x)
                || a.y.max(b.y) < c.y.min(d.y)
                || c.y.max(d.y) < a.y.min(b.y);
            if apart {
                continue;
            }
            let (ab, cd, ac) = ((b - a).truncate(), (d - c).truncate(), (c - a).truncate());
            let turn = ab.perp_dot(cd);
            let (s, t) = (ac.perp_dot(cd) / turn, ac.perp_dot(ab) / turn);
            // Half open, so that a crossing at a vertex counts once; NaN where both run alike.
            if (0.0..1.0).contains(&s) && (0.0..1.0).contains(&t) {
                let arc = |row: &Row, i: usize, s: f64| row.arc[i - 1] + s * (row.arc[i] - row.arc[i - 1]);
                found.push(Crossing {
                    arc: [arc(lower, i, s), arc(upper, j, t)],
                    at: [a.lerp(b, s), c.lerp(d, t)],
                });
            }
        }
    }
    found.sort_by(|a, b| a.arc[0].total_cmp(&b.arc[0]));
    found
}
