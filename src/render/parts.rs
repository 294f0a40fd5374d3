//! Strands cut into parts that fit a device's buffers. A part is a run of points, and beside them the few of its neighbours
//! (ghosts) that its curves depend on.

use super::fibre::TURN;
use super::strands::Strands;
use glam::Vec3;
use std::collections::HashMap;
use std::ops::Range;

/// In place of a point that is not there.
pub const NONE: u32 = u32::MAX;

/// The points of a part, its own first.
pub struct Part {
    /// Which points are its own.
    pub own: Range<usize>,
    /// Points of other parts that it needs.
    pub ghosts: Vec<u32>,
    /// `[point]` points before and after, or [`NONE`].
    pub links: Vec<[u32; 2]>,
    /// How many yarns begin or end in it.
    pub ends: usize,
}

/// Points before and after each of a run, in the whole.
struct Neighbours<'a>(&'a Strands);

impl Neighbours<'_> {
    fn of(&self, point: usize) -> [Option<usize>; 2] {
        let strands = self.0;
        let yarn = strands.offsets.partition_point(|o| *o as usize <= point) - 1;
        let (begin, end) = (strands.offsets[yarn] as usize, strands.offsets[yarn + 1] as usize);
        let closed = strands.closed[yarn] && end - begin > 2;
        let before = if point > begin { Some(point - 1) } else { closed.then(|| end - 1) };
        let after = if point + 1 < end { Some(point + 1) } else { closed.then_some(begin) };
        [before, after]
    }
}

/// Segments that may be drawn as one at most; as in `shaders/yarn_cull.wgsl`.
pub const RUN: usize = 8;

/// Cuts strands into parts of at most `most` points of their own (or [`RUN`], where that is more), between runs.
pub fn parts(strands: &Strands, most: usize) -> Vec<Part> {
    let count = strands.points.len();
    let each = (most / RUN).max(1) * RUN;
    let parts = count.div_ceil(each).max(1);
    (0..parts).map(|k| part(strands, each * k..count.min(each * (k + 1)))).collect()
}

fn part(strands: &Strands, own: Range<usize>) -> Part {
    let neighbours = Neighbours(strands);
    let mut ghosts: Vec<u32> = Vec::new();
    let mut places: HashMap<usize, u32> = HashMap::new();
    let mut need = |point: usize, ghosts: &mut Vec<u32>| {
        if !own.contains(&point) && !places.contains_key(&point) {
            places.insert(point, (own.len() + ghosts.len()) as u32);
            ghosts.push(point as u32);
        }
    };
    // Only points near the cuts have neighbours elsewhere: those of a yarn's ends too, where it is closed.
    let mut links = Vec::with_capacity(own.len());
    let mut ends = 0;
    let global: Vec<[Option<usize>; 2]> = own.clone().map(|i| neighbours.of(i)).collect();
    for [before, after] in &global {
        ends += usize::from(before.is_none()) + usize::from(after.is_none());
        before.iter().for_each(|p| need(*p, &mut ghosts));
        if let Some(after) = after {
            need(*after, &mut ghosts);
            neighbours.of(*after)[1].iter().for_each(|p| need(*p, &mut ghosts));
        }
    }
    let local = |point: Option<usize>| match point {
        Some(p) if own.contains(&p) => (p - own.start) as u32,
        Some(p) => places.get(&p).copied().unwrap_or(NONE),
        None => NONE,
    };
    links.extend(global.iter().map(|l| l.map(local)));
    links.extend(ghosts.iter().map(|g| neighbours.of(*g as usize).map(local)));
    Part { own, ghosts, links, ends }
}

impl Part {
    /// Points, ghosts too.
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// Something of each point, from an array of all points.
    pub fn gather<T: Copy>(&self, all: &[T]) -> Vec<T> {
        let mut some = all[self.own.clone()].to_vec();
        some.extend(self.ghosts.iter().map(|g| all[*g as usize]));
        some
    }
}

/// `[point]` what does not change over time: length at rest of the segment that begins there, radius at rest, turns of the twist up
/// to there (less whole ones), and in that segment.
pub fn fixed(strands: &Strands) -> Vec<[f32; 4]> {
    let mut fixed = Vec::with_capacity(strands.points.len());
    for (yarn, ends) in strands.offsets.windows(2).enumerate() {
        let range = ends[0] as usize..ends[1] as usize;
        let radius = strands.radius[yarn];
        // Yarns begin anywhere in their twist.
        let mut turns = (yarn as f64 * 0.618_033_988_75).fract();
        for i in range.clone() {
            let next = if i + 1 < range.end { i + 1 } else { range.start };
            let mut rest = strands.rest[i];
            if rest <= 0.0 {
                rest = (Vec3::from(strands.points[next]) - Vec3::from(strands.points[i])).length();
            }
            let in_segment = rest / (TURN * radius);
            fixed.push([rest, radius, turns as f32, in_segment]);
            turns = (turns + f64::from(in_segment)).fract();
        }
        if strands.closed[yarn] && !range.is_empty() {
            close_twist(&mut fixed[range]);
        }
    }
    fixed
}

/// Changes a closed yarn's twist a little so that a whole number of turns goes round.
fn close_twist(fixed: &mut [[f32; 4]]) {
    let sum: f64 = fixed.iter().map(|f| f64::from(f[3])).sum();
    if sum <= 0.5 {
        return;
    }
    let factor = sum.round() / sum;
    let mut turns = f64::from(fixed[0][2]);
    for f in fixed {
        f[2] = turns as f32;
        f[3] = (f64::from(f[3]) * factor) as f32;
        turns = (turns + f64::from(f[3])).fract();
    }
}

/// `[point]` directions across the yarn that turn about it as little as can be from point to point; around closed yarns, what is left
/// over is shared out.
pub fn sides(strands: &Strands) -> Vec<[f32; 4]> {
    let mut sides = vec![[0.0; 4]; strands.points.len()];
    for (yarn, ends) in strands.offsets.windows(2).enumerate() {
        let points = &strands.points[ends[0] as usize..ends[1] as usize];
        let sides = &mut sides[ends[0] as usize..ends[1] as usize];
        let n = points.len();
        if n < 2 {
            continue;
        }
        let closed = strands.closed[yarn];
        let at = |i: usize| Vec3::from(points[i]);
        let tangent = |i: usize| {
            let (before, after) = match (i, closed) {
                (_, true) => ((i + n - 1) % n, (i + 1) % n),
                _ => (i.saturating_sub(1), (i + 1).min(n - 1)),
            };
            (at(after) - at(before)).try_normalize()
        };
        let mut last = tangent(0).unwrap_or(Vec3::X);
        let first = last;
        let mut side = first.any_orthonormal_vector();
        let begin = side;
        for (i, out) in sides.iter_mut().enumerate() {
            let now = tangent(i).unwrap_or(last);
            side = carried(side, last, now);
            last = now;
            *out = [side.x, side.y, side.z, 1.0];
        }
        if closed {
            let come = carried(side, last, first);
            let left = come.cross(begin).dot(first).atan2(come.dot(begin));
            for (i, out) in sides.iter_mut().enumerate() {
                let side = Vec3::new(out[0], out[1], out[2]);
                let axis = tangent(i).unwrap_or(first);
                let turned = glam::Quat::from_axis_angle(axis, left * i as f32 / n as f32) * side;
                *out = [turned.x, turned.y, turned.z, 1.0];
            }
        }
    }
    sides
}

/// Carries a direction across from one tangent to another by the least turn.
fn carried(v: Vec3, a: Vec3, b: Vec3) -> Vec3 {
    let axis = a.cross(b);
    let c = a.dot(b);
    let v = v * c + axis.cross(v) + axis * (axis.dot(v) / (1.0 + c).max(1e-3));
    (v - b * b.dot(v)).try_normalize().unwrap_or_else(|| b.any_orthonormal_vector())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn ring(n: usize, closed: bool) -> Strands {
        let place = |i: usize| {
            let a = i as f32 / n as f32 * std::f32::consts::TAU;
            [a.cos(), a.sin(), 0.3 * (3.0 * a).sin()]
        };
        Strands {
            origin: DVec3::ZERO,
            unit: 1.0,
            points: (0..n).map(place).collect(),
            offsets: vec![0, n as u32],
            closed: vec![closed],
            radius: vec![0.1],
            rest: vec![0.0; n],
            colours: vec![[0; 3]; n],
        }
    }

    /// Seen red without the points after next.
    #[test]
    fn parts_know_the_neighbours_of_their_segments() {
        for closed in [false, true] {
            let strands = ring(23, closed);
            let whole = &parts(&strands, 100)[0];
            assert!(whole.ghosts.is_empty());
            let mut seen = 0;
            for part in parts(&strands, 5) {
                let ids: Vec<u32> = (0..strands.points.len() as u32).collect();
                let ids = part.gather(&ids);
                for (local, global) in part.own.clone().enumerate() {
                    let expected = whole.links[global];
                    let found = part.links[local].map(|l| if l == NONE { NONE } else { ids[l as usize] });
                    assert_eq!(found, expected);
                    let next = part.links[local][1];
                    if next != NONE {
                        let after = part.links[next as usize][1];
                        let found = if after == NONE { NONE } else { ids[after as usize] };
                        assert_eq!(found, whole.links[expected[1] as usize][1]);
                    }
                    seen += 1;
                }
            }
            assert_eq!(seen, 23);
        }
    }

    /// Seen red without sharing out what is left over.
    #[test]
    fn sides_of_a_closed_yarn_meet_again() {
        // A trefoil, around which directions turn by what is no whole number of turns.
        let mut strands = ring(60, true);
        for (i, p) in strands.points.iter_mut().enumerate() {
            let a = i as f32 / 60.0 * std::f32::consts::TAU;
            let r = 2.0 + (3.0 * a).cos();
            *p = [r * (2.0 * a).cos(), r * (2.0 * a).sin(), (3.0 * a).sin()];
        }
        let sides = sides(&strands);
        for i in 0..60 {
            let (a, b) = (sides[i], sides[(i + 1) % 60]);
            let (a, b) = (Vec3::new(a[0], a[1], a[2]), Vec3::new(b[0], b[1], b[2]));
            assert!(a.dot(b) > 0.95, "{i}: {a} {b}");
            assert!((a.length() - 1.0).abs() < 1e-4);
        }
        let turns: f64 = fixed(&strands).iter().map(|f| f64::from(f[3])).sum();
        assert!((turns - turns.round()).abs() < 1e-5, "{turns}");
    }
}
