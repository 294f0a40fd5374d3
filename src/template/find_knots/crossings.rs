//! Where two strands cross in the plane, and which two crossings make a clasp.

use glam::{DVec2, DVec3, Vec3Swizzles};

/// A strand as positions in template space.
pub(super) struct Path {
    /// One position per point; NaN where the point has none.
    pub at: Vec<DVec3>,
    /// The same in the plane, moved a hair's breadth so that no two points of the template coincide.
    generic: Vec<DVec2>,
}

impl Path {
    /// `first` numbers the strand's first point within the template: it seeds the displacement. Displaced
    /// points are in general position, so vertices that touch need no cases of their own: a true crossing
    /// is found an odd number of times (once), a touch an even number of times (cancelled below).
    pub fn new(at: Vec<DVec3>, first: usize, yarn_radius: f64) -> Self {
        // Fractions of the plastic number's powers fill the unit square evenly.
        let shift = |n: usize| {
            let n = n as f64;
            DVec2::new((n * 0.754_877_666_246_692_8).fract(), (n * 0.569_840_290_998_053_3).fract())
        };
        let generic =
            at.iter().enumerate().map(|(i, p)| p.xy() + 1e-8 * yarn_radius * shift(first + i)).collect();
        Path { at, generic }
    }

    fn lerp(&self, segment: usize, t: f64) -> DVec3 {
        self.at[segment] + t * (self.at[segment + 1] - self.at[segment])
    }
}

/// A crossing of two visits; index 0 is the first strand's (of one strand with itself: the earlier) visit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// Where, in the plane.
    pub at: DVec2,
    /// Segment number plus fraction, along each strand.
    pub along: [f64; 2],
    /// Height of each strand there.
    pub z: [f64; 2],
}

impl Crossing {
    /// Whether the first visit is on top; `None` if neither is.
    pub fn first_on_top(&self) -> Option<bool> {
        (self.z[0] != self.z[1]).then_some(self.z[0] > self.z[1])
    }
}

/// All crossings of two strands, or of one with itself (`b` is `None`), in order along the first.
pub(super) fn crossings(a: &Path, b: Option<&Path>) -> Vec<Crossing> {
    let (other, itself) = (b.unwrap_or(a), b.is_none());
    let mut found = Vec::new();
    for i in 0..a.at.len().saturating_sub(1) {
        // Neighbouring segments of one strand meet but never cross.
        for j in (if itself { i + 2 } else { 0 })..other.at.len().saturating_sub(1) {
            let (p, q) = (a.generic[i], other.generic[j]);
            let (u, v, w) = (a.generic[i + 1] - p, other.generic[j + 1] - q, q - p);
            let cross = u.perp_dot(v);
            let (s, t) = (w.perp_dot(v) / cross, w.perp_dot(u) / cross);
            // NaN and infinity, also of parallel segments, are in no range.
            if !((0.0..1.0).contains(&s) && (0.0..1.0).contains(&t)) {
                continue;
            }
            let (x, y) = (a.lerp(i, s), other.lerp(j, t));
            // Strands that leave the face one over the other do not cross there.
            let ends = is_end(i as f64 + s, a) && is_end(j as f64 + t, other);
            if x.is_finite() && y.is_finite() && !ends {
                found.push(Crossing { at: x.xy(), along: [i as f64 + s, j as f64 + t], z: [x.z, y.z] });
            }
        }
    }
    found.sort_by(|x, y| x.along[0].total_cmp(&y.along[0]).then(x.along[1].total_cmp(&y.along[1])));
    found
}

fn is_end(along: f64, path: &Path) -> bool {
    along < 1e-6 || along > path.at.len() as f64 - 1.0 - 1e-6
}

/// Clasps among the crossings of a pair: two crossings in a row along both strands with the order swapped.
pub(super) struct Clasps {
    /// Indices of the two crossings, the first along the first strand first.
    pub clasps: Vec<[usize; 2]>,
    /// Crossings of no clasp; mere touches are not among them.
    pub rest: Vec<usize>,
}

/// Pairs up crossings, each used at most once, greedily along the first strand. Where nothing more pairs
/// up, two unused crossings in a row, nearer than the yarn radius, with the same strand on top are a touch:
/// the strand could be pulled aside there, so they are struck out and what they separated is tried again.
pub(super) fn clasps(found: &[Crossing], itself: bool, yarn_radius: f64) -> Clasps {
    let mut alive: Vec<usize> = (0..found.len()).collect();
    let mut used = vec![false; found.len()];
    let mut clasps = Vec::new();
    loop {
        let ranks = ranks(found, &alive, itself);
        let in_a_row = |k: usize| {
            let (i, j) = (alive[k], alive[k + 1]);
            let adjacent = |side: usize| ranks[k][side].abs_diff(ranks[k + 1][side]) == 1;
            let apart = !itself
                || found[i].along[0].max(found[j].along[0]) < found[i].along[1].min(found[j].along[1]);
            (adjacent(0) && adjacent(1) && apart).then_some((i, j))
        };
        let pairs: Vec<(usize, usize)> = (1..alive.len()).filter_map(|k| in_a_row(k - 1)).collect();
        let mut touched = vec![false; found.len()];
        let mut changed = false;
        for swapped in [true, false] {
            for &(i, j) in &pairs {
                if used[i] || used[j] || touched[i] || touched[j] {
                    continue;
                }
                let (Some(x), Some(y)) = (found[i].first_on_top(), found[j].first_on_top()) else { continue };
                if swapped && x != y {
                    (used[i], used[j]) = (true, true);
                    clasps.push([i, j]);
                } else if !swapped && x == y && found[i].at.distance(found[j].at) < yarn_radius {
                    (touched[i], touched[j]) = (true, true);
                    changed = true;
                }
            }
        }
        if !changed {
            break;
        }
        alive.retain(|&i| !touched[i]);
    }
    clasps.sort_unstable();
    Clasps { clasps, rest: alive.into_iter().filter(|&i| !used[i]).collect() }
}

/// Rank of each living crossing along each strand, among all visits there.
fn ranks(found: &[Crossing], alive: &[usize], itself: bool) -> Vec<[usize; 2]> {
    let mut visits: Vec<(usize, f64, usize, usize)> = Vec::with_capacity(2 * alive.len());
    for (k, &i) in alive.iter().enumerate() {
        for side in 0..2 {
            visits.push((if itself { 0 } else { side }, found[i].along[side], k, side));
        }
    }
    visits.sort_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)).then(x.2.cmp(&y.2)).then(x.3.cmp(&y.3)));
    let mut ranks = vec![[0; 2]; alive.len()];
    for (rank, &(_, _, k, side)) in visits.iter().enumerate() {
        ranks[k][side] = rank;
    }
    ranks
}
