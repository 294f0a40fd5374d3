//! Cloth against itself, at the level of stitches: nodes that are no neighbours keep a distance.
//!
//! Pairs that may meet come from a uniform grid (Teschner et al. 2003, *Optimized Spatial Hashing*), in the order of its cells and
//! nodes, and are kept until nodes have moved so far, relative to the cloth's mean motion, that others might meet. Pairs are then
//! settled one after the other, which takes one thread and no choice: the same bytes every time.

use super::obstacle::RECOVERY;
use super::scene::Friction;
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// Nodes a task looks around.
const CHUNK: usize = 512;

/// Nodes that keep their distance, and what is known of which are near.
#[derive(Clone, Debug)]
pub struct Layers {
    thickness: f64,
    friction: Friction,
    /// `[node]` 1 / kg; 0 for held nodes.
    inverse_mass: Vec<f64>,
    /// `[node + 1]` into `excluded`.
    excluded_offsets: Vec<u32>,
    /// Nodes that are a face or two away, rising.
    excluded: Vec<u32>,
    /// Beyond the thickness, pairs up to here are kept; chosen anew with every search.
    margin: f64,
    pairs: Vec<[u32; 2]>,
    /// Positions when pairs were looked for.
    looked: Vec<DVec3>,
    grid: Grid,
    found: Vec<Vec<[u32; 2]>>,
}

/// What became of all pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayerContacts {
    /// Pairs that were pushed apart.
    pub contacts: usize,
    /// How much nearer than the thickness the nearest were found, metres.
    pub deep: f64,
}

/// A node where it was sorted in.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    at: DVec3,
    cell: IVec3,
    node: u32,
}

/// Nodes sorted into cells, which are hashed into a table.
#[derive(Clone, Debug, Default)]
struct Grid {
    /// Slots of the table, a power of two, less one.
    mask: usize,
    /// `[slot + 1]` into `nodes`.
    offsets: Vec<u32>,
    /// By slot.
    nodes: Vec<Place>,
    /// `[node]` its cell.
    cells: Vec<IVec3>,
}

impl Layers {
    /// Nodes of so much inverse mass; `faces` are those of the cloth as triangles, over nodes: pairs in one triangle, or in two
    /// with a common corner, are neighbours.
    pub fn new(thickness: f64, friction: Friction, inverse_mass: Vec<f64>, faces: &[[u32; 3]]) -> Self {
        let count = inverse_mass.len();
        let mut near: Vec<Vec<u32>> = vec![Vec::new(); count];
        for t in faces {
            for k in 0..3 {
                near[t[k] as usize].extend([t[(k + 1) % 3], t[(k + 2) % 3]]);
            }
        }
        near.iter_mut().for_each(|all| {
            all.sort_unstable();
            all.dedup();
        });
        let mut excluded_offsets = vec![0];
        let mut excluded = Vec::new();
        for node in 0..count {
            let mut all: Vec<u32> = near[node].iter().flat_map(|n| &near[*n as usize]).copied().collect();
            all.extend(&near[node]);
            all.sort_unstable();
            all.dedup();
            excluded.extend(all);
            excluded_offsets.push(excluded.len() as u32);
        }
        Self {
            thickness,
            friction,
            inverse_mass,
            excluded_offsets,
            excluded,
            margin: thickness,
            pairs: Vec::new(),
            looked: Vec::new(),
            grid: Grid::default(),
            found: Vec::new(),
        }
    }

    /// Least distance between nodes, metres.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Pushes pairs apart that came too near on their way from `previous` to `positions` in `dt` seconds, and rubs them.
    pub fn push(&mut self, dt: f64, previous: &[DVec3], positions: &mut [DVec3]) -> LayerContacts {
        if self.stale(positions) {
            // Far where nodes move slowly, so that pairs serve for some substeps; near where they would not anyway.
            let way = most_moved(previous, positions);
            let lasting = 8.0 * way;
            let t = self.thickness;
            self.margin = if lasting <= 1.5 * t { lasting.max(0.25 * t) } else { 0.25 * t };
            self.look(positions);
        }
        let mut all = LayerContacts::default();
        let t = self.thickness;
        for [a, b] in &self.pairs {
            let (a, b) = (*a as usize, *b as usize);
            let apart = positions[b] - positions[a];
            let began = previous[b] - previous[a];
            // Those that changed sides on the way are not to go on as if nothing had been.
            let crossed = apart.dot(began) <= 0.0 && apart.length_squared() < 16.0 * t * t;
            let squared = apart.length_squared();
            if squared >= t * t && !crossed {
                continue;
            }
            let began_at = began.length();
            let length = squared.sqrt();
            let normal = if crossed && began_at > 1e-12 {
                began / began_at
            } else if length > 1e-12 {
                apart / length
            } else {
                continue;
            };
            let along = apart.dot(normal);
            let target = if began_at >= t { t } else { t.min(began_at + RECOVERY * dt) };
            let depth = target - along;
            let sum = self.inverse_mass[a] + self.inverse_mass[b];
            // Not: <=, for what is not finite is left alone.
            if !(depth > 1e-12 && sum > 0.0) {
                continue;
            }
            let way = apart - began;
            let tangential = way - normal * way.dot(normal);
            let back = tangential * self.friction.taken_back(tangential.length(), depth);
            let change = (normal * depth - back) / sum;
            positions[a] -= change * self.inverse_mass[a];
            positions[b] += change * self.inverse_mass[b];
            all.contacts += 1;
            all.deep = all.deep.max(t - along);
        }
        all
    }

    /// Whether nodes that are on no list may meet.
    fn stale(&self, positions: &[DVec3]) -> bool {
        if self.looked.len() != positions.len() {
            return true;
        }
        let most = most_moved(&self.looked, positions);
        most.is_nan() || most > self.margin * 0.5
    }

    /// Looks for pairs within the thickness and the margin.
    fn look(&mut self, positions: &[DVec3]) {
        self.looked.clear();
        self.looked.extend_from_slice(positions);
        let within = self.thickness + self.margin;
        self.grid.fill(positions, within);
        let (grid, offsets, excluded) = (&self.grid, &self.excluded_offsets, &self.excluded);
        let inverse_mass = &self.inverse_mass;
        self.found.resize(positions.len().div_ceil(CHUNK), Vec::new());
        self.found.par_iter_mut().enumerate().for_each(|(chunk, found)| {
            found.clear();
            for node in chunk * CHUNK..positions.len().min((chunk + 1) * CHUNK) {
                let near = &excluded[offsets[node] as usize..offsets[node + 1] as usize];
                let begin = found.len();
                grid.around(node, positions[node], within * within, |other| {
                    // Few are so near, so that a look through neighbours costs little.
                    if !near.contains(&other) && inverse_mass[node] + inverse_mass[other as usize] > 0.0 {
                        found.push([node as u32, other]);
                    }
                });
                found[begin..].sort_unstable();
            }
        });
        self.pairs.clear();
        self.found.iter().for_each(|found| self.pairs.extend_from_slice(found));
    }
}

/// The longest way of a node relative to the mean of all: what moves as one comes no nearer.
fn most_moved(from: &[DVec3], to: &[DVec3]) -> f64 {
    let mean = to.iter().zip(from).map(|(p, q)| *p - *q).sum::<DVec3>() / to.len().max(1) as f64;
    let farther = |most: f64, (p, q): (&DVec3, &DVec3)| {
        let squared = (*p - *q - mean).length_squared();
        // A maximum that keeps what is no number.
        if squared <= most { most } else { squared }
    };
    to.iter().zip(from).fold(0.0, farther).sqrt()
}

impl Grid {
    /// Cells in a row along x have slots in a row, so that three are looked at as one.
    fn slot(&self, cell: IVec3) -> usize {
        let row = (cell.y as u32).wrapping_mul(19_349_663) ^ (cell.z as u32).wrapping_mul(83_492_791);
        (row ^ row >> 15).wrapping_add(cell.x as u32) as usize & self.mask
    }

    /// Counts and sorts; nodes keep their order within a slot.
    fn fill(&mut self, positions: &[DVec3], cell: f64) {
        // A cast of what is not finite, or too far, is some cell, and harmless.
        let scale = 1.0 / cell;
        self.cells.clear();
        self.cells.extend(positions.iter().map(|p| {
            let scaled = *p * scale;
            let cut = scaled.as_ivec3();
            // Rounded down, without a call.
            let less = |cut: i32, scaled: f64| cut.wrapping_sub(i32::from(f64::from(cut) > scaled));
            IVec3::new(less(cut.x, scaled.x), less(cut.y, scaled.y), less(cut.z, scaled.z))
        }));
        let slots = (2 * positions.len()).next_power_of_two().max(4);
        self.mask = slots - 1;
        self.offsets.clear();
        self.offsets.resize(slots + 1, 0);
        for i in 0..positions.len() {
            let slot = self.slot(self.cells[i]);
            self.offsets[slot] += 1;
        }
        let mut sum = 0;
        for offset in &mut self.offsets {
            sum += *offset;
            *offset = sum;
        }
        self.nodes.clear();
        self.nodes.resize(positions.len(), Place::default());
        for i in (0..positions.len()).rev() {
            let slot = self.slot(self.cells[i]);
            self.offsets[slot] -= 1;
            self.nodes[self.offsets[slot] as usize] =
                Place { at: positions[i], cell: self.cells[i], node: i as u32 };
        }
    }

    /// Nodes of higher numbers in the cells around a node's, within a squared distance of `at`; each once.
    fn around(&self, node: usize, at: DVec3, squared: f64, mut visit: impl FnMut(u32)) {
        let cell = self.cells[node];
        let mut look = |places: &[Place], row: IVec3| {
            for place in places {
                // Other cells may share the slots.
                let same = place.cell.y == row.y && place.cell.z == row.z;
                let beside = place.cell.x.wrapping_sub(row.x).wrapping_add(1) as u32 <= 2;
                if place.node as usize > node && place.at.distance_squared(at) <= squared && same && beside {
                    visit(place.node);
                }
            }
        };
        for y in -1..=1 {
            for z in -1..=1 {
                let row = IVec3::new(cell.x, cell.y.wrapping_add(y), cell.z.wrapping_add(z));
                let first = self.slot(IVec3::new(row.x.wrapping_sub(1), row.y, row.z));
                let (begin, end) = (self.offsets[first] as usize, (first + 3).min(self.mask + 1));
                look(&self.nodes[begin..self.offsets[end] as usize], row);
                // The rest, where the table ends.
                let rest = (first + 3).saturating_sub(self.mask + 1);
                look(&self.nodes[..self.offsets[rest] as usize], row);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_finds_every_pair() {
        // Seen red with cells of half the reach.
        let mut state = 7u64;
        let mut dice = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        let positions: Vec<DVec3> =
            (0..600).map(|_| DVec3::new(dice() - 0.5, dice() - 0.5, dice() * 0.2)).collect();
        let mut layers = Layers::new(0.02, Friction::default(), vec![1.0; 600], &[[0, 1, 2], [2, 3, 4]]);
        layers.look(&positions);
        let mut expected = Vec::new();
        for a in 0..600u32 {
            for b in a + 1..600 {
                let neighbours = b <= 4;
                if !neighbours && positions[a as usize].distance(positions[b as usize]) <= 0.04 {
                    expected.push([a, b]);
                }
            }
        }
        assert!(expected.len() > 50);
        assert_eq!(layers.pairs, expected);
    }

    #[test]
    fn pairs_do_not_change_sides() {
        // Seen red without `crossed`: both go on.
        let mut layers = Layers::new(0.01, Friction { fixed: 0.0, sliding: 0.0 }, vec![1.0, 3.0], &[]);
        let previous = [DVec3::ZERO, DVec3::X * 0.02];
        let mut positions = [DVec3::X * 0.015, DVec3::X * 0.005];
        let contacts = layers.push(1e-3, &previous, &mut positions);
        assert_eq!(contacts.contacts, 1);
        assert!((positions[1].x - positions[0].x - 0.01).abs() < 1e-12, "{positions:?}");
        // The lighter one, of inverse mass 3, gives way three times as far.
        assert!((positions[0].x - 0.010).abs() < 1e-12, "{positions:?}");
        let mut wild = [DVec3::NAN, DVec3::splat(1e300)];
        layers.push(1e-3, &previous, &mut wild);
    }
}
