//! Strands written anew through the knots.

use glam::{DVec2, DVec3, Vec3Swizzles};

use super::Search;
use super::notes::{FreeCrossing, Reason};
use crate::template::{Place, Strand, TemplatePoint};

/// Segments that turn by more than 150 degrees are a fold.
const FOLD_COS: f64 = -0.866;

/// Where a point of a rewritten strand comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    /// Point of the original strand.
    Original(usize),
    /// One side of a candidate.
    Run { candidate: usize, side: usize },
}

#[derive(Clone, Copy, Debug)]
struct Item {
    point: TemplatePoint,
    at: DVec3,
    source: Source,
}

impl Item {
    fn removable(&self) -> bool {
        matches!(self.source, Source::Original(_)) && matches!(self.point.place, Place::Free { .. })
    }
}

impl Search {
    /// Rewrites all strands; knots that would fold a strand are taken from it first.
    pub(super) fn rewrite(&mut self, polylines: &[Strand]) -> Vec<Strand> {
        // Each round but the last takes one knot from one strand.
        loop {
            let heights = self.heights();
            let mut strands = Vec::with_capacity(polylines.len());
            let mut culprit = None;
            self.dropped = 0;
            for (s, strand) in polylines.iter().enumerate() {
                let mut items = self.items(s, strand, &heights);
                let before = items.len();
                self.drop_beside_contacts(&mut items);
                culprit = self.unfold(s, &mut items);
                if culprit.is_some() {
                    break;
                }
                self.dropped += before - items.len();
                strands.push(items.into_iter().map(|i| i.point).collect());
            }
            let Some((k, side)) = culprit else { return strands };
            self.candidates[k].taken[side] = false;
            if !self.candidates[k].used() {
                let strands = self.candidates[k].strands;
                self.free.push(FreeCrossing { strands, count: 2, reason: Reason::Fold });
            }
        }
    }

    /// z of each side of each candidate at c- and c+. Contacts nearer than 2r (where yarns side by side would
    /// touch) are a stack: its strands are ranked outward from the face, those on top and those below apart.
    fn heights(&self) -> Vec<[[f64; 2]; 2]> {
        let contacts: Vec<(usize, usize, DVec2)> = (self.candidates.iter().enumerate())
            .filter(|(_, c)| c.used())
            .flat_map(|(k, c)| [0, 1].map(|end| (k, end, c.contact(end))))
            .collect();
        let mut heights = vec![[[0.0; 2]; 2]; self.candidates.len()];
        for stack in nearer_than(&contacts, 2.0 * self.yarn_radius) {
            for (above, sign) in [(false, -1.0), (true, 1.0)] {
                // Height outward, strand, and whom it belongs to.
                let mut passes: Vec<(f64, usize, [usize; 3])> = Vec::new();
                for &i in &stack {
                    let (k, end, _) = contacts[i];
                    let c = &self.candidates[k];
                    for side in (0..2).filter(|&side| c.taken[side]) {
                        let z = c.ends[end].z;
                        if (z[side] > z[1 - side]) == above {
                            passes.push((sign * z[side], c.strands[side], [k, side, end]));
                        }
                    }
                }
                // A stable sort: equal heights stay in the order of the file.
                passes.sort_by(|a, b| a.0.total_cmp(&b.0));
                let mut layer = 0;
                for (n, &(_, strand, [k, side, end])) in passes.iter().enumerate() {
                    // A strand is no layer over itself.
                    layer += usize::from(n > 0 && passes[n - 1].1 != strand);
                    heights[k][side][end] = sign * (2 * layer + 1) as f64 * self.yarn_radius;
                }
            }
        }
        heights
    }

    /// A strand's own points and knots in order.
    fn items(&self, s: usize, strand: &Strand, heights: &[[[f64; 2]; 2]]) -> Vec<Item> {
        let mut runs: Vec<(f64, f64, usize, usize)> = Vec::new();
        for (k, c) in self.candidates.iter().enumerate() {
            for side in (0..2).filter(|&side| c.taken[side] && c.strands[side] == s) {
                let (from, to) = c.interval(side);
                runs.push((from, to, k, side));
            }
        }
        runs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut items = Vec::with_capacity(strand.len() + 3 * runs.len());
        let mut runs = runs.into_iter().peekable();
        let mut behind = f64::NEG_INFINITY;
        for (i, &point) in strand.iter().enumerate() {
            let along = i as f64;
            while let Some(&(from, to, k, side)) = runs.peek()
                && from < along
            {
                items.extend(self.run(k, side, heights));
                behind = to;
                runs.next();
            }
            let keep = match point.place {
                Place::Boundary { .. } => true,
                Place::Free { .. } => along > behind,
                // The input has no knots that these could belong to.
                Place::Contact { .. } | Place::Control { .. } => false,
            };
            if keep {
                items.push(Item { point, at: self.paths[s].at[i], source: Source::Original(i) });
            }
        }
        items
    }

    /// Contact, control, contact of one side of a candidate.
    fn run(&self, k: usize, side: usize, heights: &[[[f64; 2]; 2]]) -> [Item; 3] {
        let c = &self.candidates[k];
        let knot = self.candidates[..k].iter().filter(|c| c.used()).count() as u32;
        let (center, d) = (c.knot.center, c.knot.direction);
        let contact = |end: usize| {
            let sign = [-1.0, 1.0][end];
            let z = heights[k][side][end];
            let at = (center + sign * c.knot.half_length * d).extend(z);
            Item {
                point: TemplatePoint { place: Place::Contact { knot, sign }, z },
                at,
                source: Source::Run { candidate: k, side },
            }
        };
        let control = {
            let sign = if side == 0 { c.first_control } else { -c.first_control };
            let z = control_height(heights[k][side]);
            let at = (center + sign * self.yarn_radius * DVec2::new(d.y, -d.x)).extend(z);
            Item {
                point: TemplatePoint { place: Place::Control { knot, sign }, z },
                at,
                source: Source::Run { candidate: k, side },
            }
        };
        let forward = c.ends[0].along[side] <= c.ends[1].along[side];
        if forward { [contact(0), control, contact(1)] } else { [contact(1), control, contact(0)] }
    }

    /// Drops free points nearer than r to the contact beside them; the ends of the strand stay.
    fn drop_beside_contacts(&self, items: &mut Vec<Item>) {
        let mut i = 1;
        while i + 1 < items.len() {
            let beside = |n: &Item| {
                matches!(n.source, Source::Run { .. })
                    && n.at.xy().distance(items[i].at.xy()) < self.yarn_radius
            };
            if items[i].removable() && (beside(&items[i - 1]) || beside(&items[i + 1])) {
                items.remove(i);
                // The point before may now be the one beside the contact.
                i = i.saturating_sub(1).max(1);
            } else {
                i += 1;
            }
        }
    }

    /// Removes folds that the original has not; returns a candidate and side to give up where it cannot.
    fn unfold(&self, s: usize, items: &mut Vec<Item>) -> Option<(usize, usize)> {
        let path = &self.paths[s].at;
        let mut i = 1;
        while i + 1 < items.len() {
            let folded = is_fold(items[i - 1].at, items[i].at, items[i + 1].at);
            let own = match items[i].source {
                Source::Original(j) if j > 0 && j + 1 < path.len() => {
                    is_fold(path[j - 1], path[j], path[j + 1])
                }
                _ => false,
            };
            if !folded || own {
                i += 1;
                continue;
            }
            let around = [i, i - 1, i + 1];
            let run = around.into_iter().find_map(|j| match items[j].source {
                Source::Run { candidate, side } => Some((j, candidate, side)),
                Source::Original(_) => None,
            });
            let Some((j, candidate, side)) = run else {
                // Only a contact or control of the input that was left out can bring this about.
                i += 1;
                continue;
            };
            // Only a neighbour of the run may go: the next point then becomes the run's neighbour.
            let near = |k: &usize| {
                *k > 0
                    && *k + 1 < items.len()
                    && k.abs_diff(j) == 1
                    && items[*k].removable()
                    && items[*k].at.xy().distance(items[j].at.xy()) < 2.0 * self.yarn_radius
            };
            let Some(k) = around.into_iter().find(near) else { return Some((candidate, side)) };
            items.remove(k);
            i = i.saturating_sub(2).max(1);
        }
        None
    }
}

/// Groups of contacts that hang together by steps shorter than `reach`, in order of their first member.
fn nearer_than(contacts: &[(usize, usize, DVec2)], reach: f64) -> Vec<Vec<usize>> {
    let mut grouped = vec![false; contacts.len()];
    let mut groups = Vec::new();
    for first in 0..contacts.len() {
        if std::mem::replace(&mut grouped[first], true) {
            continue;
        }
        let mut group = vec![first];
        let mut done = 0;
        while done < group.len() {
            let from = contacts[group[done]].2;
            for (i, contact) in contacts.iter().enumerate() {
                if !grouped[i] && contact.2.distance(from) < reach {
                    grouped[i] = true;
                    group.push(i);
                }
            }
            done += 1;
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// z of a control: midway between its two contacts, which is 0 for a knot on its own. Were it 0 for deeper
/// layers too, the strands of a stack would all meet at their controls.
fn control_height(contacts: [f64; 2]) -> f64 {
    0.5 * (contacts[0] + contacts[1])
}

fn is_fold(a: DVec3, b: DVec3, c: DVec3) -> bool {
    let (u, v) = (b - a, c - b);
    u.dot(v) < FOLD_COS * u.length() * v.length()
}
