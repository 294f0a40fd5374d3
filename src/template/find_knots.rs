//! Knots found in a template given as plain polylines (`.sf`), and the polylines rewritten through them.
//!
//! **Rule.** Two strands that cross twice in a row (in the plane, along both) with the other strand on top
//! the second time clasp each other: the crossings are the contacts c± of a knot and their midpoint is its
//! centre. A strand may clasp itself, by two parts that do not overlap. d points up the wale (tilt in
//! [0, π)), and the strand whose middle lies further to the side of `(d.v, -d.u)` takes the control p+, the
//! other one p-. All other crossings stay what they were: free points.
//!
//! **Rewriting.** Between its two crossings a strand's own points give way to contact, control, contact.
//! Points of the rest that are nearer than r (in the plane) to the contact next to them go too: they would
//! only make segments shorter than the yarn is thick. The other points stay free.
//!
//! **Stacked loops** (decreases, double yarns). One leg clasps several loops at about the same place. The
//! knots, one for each pair of leg and loop, are drawn to a common centre where they are nearer than r, but
//! the leg can pass contact, control, contact only once: nesting the knots' points instead would make
//! segments of nearly no length, whose cosines mean nothing. So the leg takes the points of the first loop
//! in the file's order, and the other loops pass their own knots alone. Each yarn then has its own contacts
//! and control at the shared centre, as in Huang et al. 2025. Several legs (double yarn) are matched with
//! the loops one to one; a pair left with no strand of its own to move gets no knot and is named in the
//! notes. At each end of a stack the strands on top are placed at z = r, 3r, 5r... and the ones below at
//! -r, -3r, -5r..., in the order of their heights in the file.
//!
//! **Never a fold.** Where the rewritten strand would turn back sharply and the original did not, a free
//! point at the turn goes if it is close to the contact, else the strand keeps its own points there.

use glam::{DVec2, DVec3};

use super::{Knot, Place, Strand, Template};

mod crossings;
mod notes;
mod rewrite;

use crossings::{Crossing, Path, clasps, crossings};
use notes::{FreeCrossing, Reason};

/// A clasp on its way to becoming a knot.
#[derive(Clone, Debug)]
struct Candidate {
    /// The two strands (the same twice if a strand clasps itself).
    strands: [usize; 2],
    /// The crossings at c- and c+.
    ends: [Crossing; 2],
    /// The knot.
    knot: Knot,
    /// The half-length was below r/2.
    raised: bool,
    /// Sign of the control that the first strand takes; the other takes the opposite.
    first_control: f64,
    /// Which of the two strands is rewritten through the knot.
    taken: [bool; 2],
}

impl Candidate {
    /// The part of a strand that the knot replaces.
    fn interval(&self, side: usize) -> (f64, f64) {
        let [a, b] = [self.ends[0].along[side], self.ends[1].along[side]];
        (a.min(b), a.max(b))
    }

    /// c- (`end` 0) or c+ (1).
    fn contact(&self, end: usize) -> DVec2 {
        self.knot.center + [-1.0, 1.0][end] * self.knot.half_length * self.knot.direction
    }

    /// Whether a strand of `other` passes this knot where it would have passed that one.
    fn replaces(&self, other: &Candidate, side: usize) -> bool {
        let (from, to) = other.interval(side);
        (0..2).any(|s| {
            let (a, b) = self.interval(s);
            self.taken[s] && self.strands[s] == other.strands[side] && a < to && from < b
        })
    }

    /// Whether either strand is rewritten through the knot.
    fn used(&self) -> bool {
        self.taken[0] || self.taken[1]
    }
}

/// Finds the knots of a template given as polylines of boundary and free points (template units) and
/// rewrites its strands through them (see the module). `polylines` of the result are the given ones; its
/// `notes` say what was found and what stays free. Never fails: nonsense just has no knots.
pub fn find_knots(
    name: &str,
    labels: &[String],
    corners: &[DVec2],
    polylines: &[Strand],
    yarn_radius: f64,
) -> Template {
    let mut search = Search::new(corners, polylines, yarn_radius);
    search.find();
    search.choose();
    search.share_centers();
    let strands = search.rewrite(polylines);
    let notes = search.notes();
    Template {
        name: name.into(),
        labels: labels.to_vec(),
        corners: corners.to_vec(),
        yarn_radius,
        knots: search.candidates.iter().filter(|c| c.used()).map(|c| c.knot).collect(),
        strands,
        polylines: Some(polylines.to_vec()),
        notes,
    }
}

/// Everything known about one template so far.
struct Search {
    paths: Vec<Path>,
    yarn_radius: f64,
    candidates: Vec<Candidate>,
    free: Vec<FreeCrossing>,
    /// Free points dropped for their nearness to a contact.
    dropped: usize,
}

impl Search {
    fn new(corners: &[DVec2], polylines: &[Strand], yarn_radius: f64) -> Self {
        let mut first = 0;
        let mut paths = Vec::with_capacity(polylines.len());
        for strand in polylines {
            let at = strand.iter().map(|p| position(corners, p.place).extend(p.z)).collect();
            paths.push(Path::new(at, first, yarn_radius));
            first += strand.len();
        }
        Search { paths, yarn_radius, candidates: Vec::new(), free: Vec::new(), dropped: 0 }
    }

    /// Fills `candidates` with the clasps of all pairs of strands, in the order of the strands.
    fn find(&mut self) {
        if !(self.yarn_radius.is_finite() && self.yarn_radius > 0.0) {
            return;
        }
        for a in 0..self.paths.len() {
            for b in a..self.paths.len() {
                let other = (a != b).then(|| &self.paths[b]);
                let found = crossings(&self.paths[a], other);
                let pairs = clasps(&found, a == b, self.yarn_radius);
                for [i, j] in pairs.clasps {
                    match self.candidate([a, b], [found[i], found[j]]) {
                        Ok(candidate) => self.candidates.push(candidate),
                        Err(reason) => self.free.push(FreeCrossing { strands: [a, b], count: 2, reason }),
                    }
                }
                if !pairs.rest.is_empty() {
                    let tops: Vec<_> = pairs.rest.iter().map(|&i| found[i].first_on_top()).collect();
                    let reason = if tops.contains(&None) {
                        Reason::Level
                    } else if tops.len() == 1 {
                        Reason::Single
                    } else if tops.iter().all(|t| *t == tops[0]) {
                        Reason::SameOnTop
                    } else {
                        Reason::NotInARow
                    };
                    self.free.push(FreeCrossing { strands: [a, b], count: tops.len(), reason });
                }
            }
        }
    }

    /// The knot of two crossings of a clasp, given in order along the first strand.
    fn candidate(&self, strands: [usize; 2], mut ends: [Crossing; 2]) -> Result<Candidate, Reason> {
        let r = self.yarn_radius;
        let center = 0.5 * (ends[0].at + ends[1].at);
        let span = ends[1].at - ends[0].at;
        let length = span.length();
        if !(center.is_finite() && length.is_finite() && length > 1e-6 * r) {
            return Err(Reason::NoDirection);
        }
        let mut direction = span / length;
        if direction.y < 0.0 || (direction.y == 0.0 && direction.x < 0.0) {
            direction = -direction;
            ends.reverse();
        }
        let half_length = (0.5 * length).max(0.5 * r);
        let across = DVec2::new(direction.y, -direction.x);
        let mut offsets = [0.0; 2];
        for (side, offset) in offsets.iter_mut().enumerate() {
            let (from, to) = (ends[0].along[side], ends[1].along[side]);
            let (mean, reach) = bulge(&self.paths[strands[side]], from.min(to), from.max(to), center, across);
            if reach.is_nan() || reach > 2.0 * (half_length + r) {
                return Err(Reason::TooWide);
            }
            *offset = mean;
        }
        // A clasp holds something apart; strands that run along one another and wobble are none.
        if (offsets[0] - offsets[1]).abs() < 0.5 * r {
            return Err(Reason::Together);
        }
        Ok(Candidate {
            strands,
            ends,
            knot: Knot { center, direction, half_length },
            raised: 0.5 * length < 0.5 * r,
            first_control: if offsets[0] >= offsets[1] { 1.0 } else { -1.0 },
            taken: [false; 2],
        })
    }

    /// Decides which strand passes which knot: first those that both strands can pass, in the order of the
    /// strands, then those that one strand still can.
    fn choose(&mut self) {
        let mut taken: Vec<Vec<(f64, f64)>> = vec![Vec::new(); self.paths.len()];
        for both in [true, false] {
            for c in &mut self.candidates {
                let room = |side: usize| {
                    let (from, to) = c.interval(side);
                    taken[c.strands[side]].iter().all(|&(a, b)| to <= a || b <= from)
                };
                let room = [room(0), room(1)];
                if c.used() || (both && room != [true; 2]) {
                    continue;
                }
                c.taken = room;
                for side in (0..2).filter(|&s| room[s]) {
                    taken[c.strands[side]].push(c.interval(side));
                }
            }
        }
        for c in self.candidates.iter().filter(|c| !c.used()) {
            self.free.push(FreeCrossing { strands: c.strands, count: 2, reason: Reason::Occupied });
        }
        self.candidates.retain(Candidate::used);
    }

    /// Draws knots nearer than r to a common centre, the nearest two groups first.
    fn share_centers(&mut self) {
        // Sums and counts, so that a group's centre is the mean of its knots' own ones.
        let mut groups: Vec<(DVec2, Vec<usize>)> =
            self.candidates.iter().enumerate().map(|(k, c)| (c.knot.center, vec![k])).collect();
        let mean = |g: &(DVec2, Vec<usize>)| g.0 / g.1.len() as f64;
        loop {
            let mut nearest = (self.yarn_radius, None);
            for i in 0..groups.len() {
                for j in i + 1..groups.len() {
                    let distance = mean(&groups[i]).distance(mean(&groups[j]));
                    if distance < nearest.0 {
                        nearest = (distance, Some((i, j)));
                    }
                }
            }
            let Some((i, j)) = nearest.1 else { break };
            let (sum, members) = groups.swap_remove(j);
            groups[i].0 += sum;
            groups[i].1.extend(members);
        }
        for group in groups.iter().filter(|g| g.1.len() > 1) {
            for &k in &group.1 {
                self.candidates[k].knot.center = mean(group);
            }
        }
    }
}

/// The place of a point in the plane; NaN if it has none without knots.
fn position(corners: &[DVec2], place: Place) -> DVec2 {
    match place {
        Place::Boundary { edge, along } => match corners.get(edge as usize) {
            Some(&from) => from + along * (corners[(edge as usize + 1) % corners.len()] - from),
            None => DVec2::NAN,
        },
        Place::Free { at } => at,
        Place::Contact { .. } | Place::Control { .. } => DVec2::NAN,
    }
}

/// Of the part of a path from one crossing to another: its mean offset from `center` along `across`,
/// weighted by length, and its largest distance from `center`.
fn bulge(path: &Path, from: f64, to: f64, center: DVec2, across: DVec2) -> (f64, f64) {
    let point = |along: f64| {
        let i = (along as usize).min(path.at.len().saturating_sub(2));
        let p: DVec3 = path.at[i] + (along - i as f64) * (path.at[i + 1] - path.at[i]);
        DVec2::new(p.x, p.y) - center
    };
    let (mut sum, mut length, mut reach) = (0.0, 0.0, 0.0_f64);
    let mut previous = point(from);
    let mut along = from;
    while along < to {
        along = (along.floor() + 1.0).min(to);
        let next = point(along);
        let step = next.distance(previous);
        sum += step * 0.5 * (previous + next).dot(across);
        length += step;
        reach = if next.is_finite() { reach.max(next.length()) } else { f64::NAN };
        if reach.is_nan() {
            break;
        }
        previous = next;
    }
    (if length > 0.0 { sum / length } else { 0.0 }, reach)
}
