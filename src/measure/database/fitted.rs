//! A plain knit made after a pattern: a template whose knots lie where the pattern's yarns cross at rest, so that what is left
//! between the two methods is how they answer to strain.

use super::poses::Pose;
use super::rows::{Loops, Row, Stitch};
use crate::knot::curve::sample;
use crate::math::V3;
use crate::pattern::Pattern;
use crate::template::check::check;
use crate::template::{Knot, Place, Template, TemplatePoint};
use crate::{Error, Result};
use glam::{DVec2, DVec3, IVec2, UVec2};

/// Extra points between two of the pattern's.
const SUBDIVIDE: usize = 6;
/// Most stitches of a period along either side.
const MOST: u32 = 8;

/// A pattern's stitches.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Stitches along the course and rows that one period holds.
    pub count: UVec2,
    /// Size of a stitch, metres.
    pub stitch: DVec2,
    /// Lower left corner of a stitch's cell, metres: its contacts lie around the cell's middle.
    pub origin: DVec2,
    /// How far the yarn's centre stands off the plane at most, metres.
    pub height: f64,
    /// The knit.
    pub template: Template,
}

impl Cells {
    /// Finds the stitches of a plain knit.
    ///
    /// # Errors
    /// A pattern that is none, seen from the front.
    pub fn new(pattern: &Pattern) -> Result<Self> {
        let refuse =
            |what: &str| Err(Error::invalid(format_args!("found a pattern {what}, expected a plain knit")));
        let Some(count) = pattern.stitches() else {
            return refuse("whose rows are not all of as many loops");
        };
        if count.max_element() > MOST {
            return refuse("of very many stitches");
        }
        let stitch = pattern.size / count.as_dvec2();
        let loops = Loops::find(rows(pattern)?, &Pose::REST, stitch, f64::from(count.max_element()) + 3.0);
        // All stitches of a grid lie alike in their cells: the mean of angles knows no borders.
        let phase = |k: usize| {
            let angle = |at: &DVec2| std::f64::consts::TAU * at[k] / stitch[k];
            let sum: DVec2 = loops.stitches.iter().map(|(at, _)| DVec2::from_angle(angle(at))).sum();
            sum.to_angle() / std::f64::consts::TAU * stitch[k]
        };
        let origin = DVec2::new(phase(0), phase(1)) - stitch / 2.0;
        let cells = loops.by_cell(origin, stitch);
        let mut sum = Sum::default();
        for j in 0..count.y as i32 {
            for i in 0..count.x as i32 {
                let cell = IVec2::new(i, j);
                let Some(found) = cells.get(&cell) else {
                    return refuse("with a stitch whose loop is not held by another one from behind");
                };
                let middle = origin + (cell.as_dvec2() + 0.5) * stitch;
                if sum.add(found, &loops.rows, middle, stitch).is_none() {
                    return refuse("with a loop that leaves its stitch elsewhere than a plain knit's does");
                }
            }
        }
        let height = pattern.places.iter().map(|p| p.z.abs()).fold(0.0, f64::max);
        let template = sum.template(stitch, pattern.radius);
        if let Err((found, expected)) = check(&template) {
            return Err(Error::invalid(format_args!(
                "the pattern's stitch as a template: found {found}, expected {expected}"
            )));
        }
        Ok(Self { count, stitch, origin, height, template })
    }
}

/// The rows of a pattern at rest, over a few periods each way.
fn rows(pattern: &Pattern) -> Result<Vec<Row>> {
    let links = pattern.links()?;
    let mut seen = vec![false; pattern.vertex_count()];
    let mut rows = Vec::new();
    for start in 0..pattern.vertex_count() {
        if seen[start] {
            continue;
        }
        let (mut period, mut at, mut tile) = (Vec::new(), start, IVec2::ZERO);
        loop {
            seen[at] = true;
            period.push(pattern.places[at] + (tile.as_dvec2() * pattern.size).extend(0.0));
            let edge = pattern.edges[links.leaving[at] as usize];
            (at, tile) = (edge.to as usize, tile + edge.tile);
            if at == start {
                break;
            }
        }
        let shifted = |u: i32, v: i32| {
            let by = (IVec2::new(u * tile.x, v).as_dvec2() * pattern.size).extend(0.0);
            period.iter().map(move |p| V3::<f64>::of(*p + by))
        };
        let across = (12 / pattern.stitches().map_or(1, |s| s.x) as i32).max(2);
        for v in -8..=8 {
            let points: Vec<V3<f64>> = (-across..=across).flat_map(|u| shifted(u, v)).collect();
            let mut world = Vec::new();
            sample(&points, false, SUBDIVIDE, &mut |p| {
                world.push(p.to_f64());
                Ok(())
            })?;
            rows.push(Row::new(world, &Pose::REST));
        }
    }
    let height = |r: &Row| r.flat.iter().map(|p| p.y).sum::<f64>() / r.flat.len() as f64;
    rows.sort_by(|a, b| height(a).total_cmp(&height(b)));
    Ok(rows)
}

/// What is averaged over stitches and both of their sides, metres around the middle of the cell, as the left side has it.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    count: f64,
    center: DVec2,
    half_length: DVec2,
    /// Heights of the upper and of the lower row at the lower contact, then at the upper contact.
    heights: [[f64; 2]; 2],
    /// Where the lower row comes in below: along, and its height.
    below: DVec2,
    /// Where the upper row comes in from the side: up, and its height.
    side: DVec2,
}

impl Sum {
    fn add(&mut self, stitch: &Stitch, rows: &[Row], middle: DVec2, size: DVec2) -> Option<()> {
        let (knots, halves) = (stitch.knots(), stitch.half_lengths());
        for (side, mirror) in [(0, 1.0), (1, -1.0)] {
            let mirrored = |p: DVec2| DVec2::new(mirror * p.x, p.y);
            self.center += mirrored(knots[side].truncate() - middle);
            self.half_length += mirrored(halves[side]);
            let contacts = if side == 0 { [0, 1] } else { [3, 2] }.map(|k| stitch.crossings[k]);
            for (heights, contact) in self.heights.iter_mut().zip(contacts) {
                heights[0] += contact.at[1].z;
                heights[1] += contact.at[0].z;
            }
            // Backwards from the left foot, forwards from the right one.
            let lower = &rows[stitch.row];
            let upper = rows.get(stitch.row + 1)?;
            let below = leaves(lower, contacts[0].arc[0], -mirror, |p| p.y - (middle.y - 0.5 * size.y))?;
            let beside =
                leaves(upper, contacts[0].arc[1], -mirror, |p| mirror * (p.x - middle.x) + 0.5 * size.x)?;
            self.below += DVec2::new(mirror * (below.x - middle.x), below.z);
            self.side += DVec2::new(beside.y - middle.y, beside.z);
            self.count += 1.0;
        }
        Some(())
    }

    fn template(&self, size: DVec2, radius: f64) -> Template {
        // A course is 1 wide.
        let unit = 1.0 / (self.count * size.x);
        let (center, half) = (self.center * unit, self.half_length * unit);
        let heights = self.heights.map(|row| row.map(|z| z * unit));
        let (below, side) = (self.below * unit, self.side * unit);
        let height = size.y / size.x;
        let knot = |mirror: f64| {
            let flip = DVec2::new(mirror, 1.0);
            Knot {
                center: center * flip,
                direction: (half * flip).normalize_or(DVec2::Y),
                half_length: half.length(),
            }
        };
        let point = |place: Place, z: f64| TemplatePoint { place, z };
        let edge = |edge: u32, along: f64, z: f64| point(Place::Boundary { edge, along }, z);
        // Through a knot upwards: `yarn` 0 is the upper row's, 1 the lower row's.
        let through = |knot: u32, yarn: usize, control: f64| {
            let [low, high] = heights.map(|h| h[yarn]);
            vec![
                point(Place::Contact { knot, sign: -1.0 }, low),
                point(Place::Control { knot, sign: control }, (low + high) / 2.0),
                point(Place::Contact { knot, sign: 1.0 }, high),
            ]
        };
        let (left, up) = (0.5 + below.x, 0.5 + side.x / height);
        let leg = |from: TemplatePoint, knot: u32, control: f64, to: TemplatePoint| {
            [vec![from], through(knot, 0, control), vec![to]].concat()
        };
        let mut down = through(1, 1, 1.0);
        down.reverse();
        Template {
            name: "knit+".into(),
            labels: ["-lX", "+yX", "+lX", "-yX"].map(str::to_string).to_vec(),
            corners: [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
                .map(|(u, v)| DVec2::new(u, v * height))
                .to_vec(),
            yarn_radius: radius / size.x,
            knots: vec![knot(1.0), knot(-1.0)],
            strands: vec![
                leg(edge(3, 1.0 - up, side.y), 0, 1.0, edge(2, 1.0 - left, below.y)),
                leg(edge(1, up, side.y), 1, -1.0, edge(2, left, below.y)),
                [vec![edge(0, left, below.y)], through(0, 1, -1.0), down, vec![edge(0, 1.0 - left, below.y)]]
                    .concat(),
            ],
            polylines: None,
            notes: Vec::new(),
        }
    }
}

/// Where a row, followed from somewhere forwards or backwards, leaves the side of a line on which `inside` is positive.
fn leaves(row: &Row, arc: f64, step: f64, inside: impl Fn(DVec3) -> f64) -> Option<DVec3> {
    let mut at = row.at(arc);
    let first = row.arc.partition_point(|a| *a <= arc);
    let beyond: Box<dyn Iterator<Item = usize>> =
        if step > 0.0 { Box::new(first..row.flat.len()) } else { Box::new((0..first).rev()) };
    for i in beyond {
        let next = row.flat[i];
        let (here, there) = (inside(at), inside(next));
        if here >= 0.0 && there < 0.0 {
            return Some(at.lerp(next, here / (here - there)));
        }
        at = next;
    }
    None
}
