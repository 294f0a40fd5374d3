//! Chains of laid pattern vertices: the fabric's yarns.

use super::surface::{NONE, Surface};
use super::tiling::{Instance, Laid};
use glam::{DVec2, IVec2};
use std::collections::HashMap;

/// Faces that a way to the next vertex is looked for in at most.
const MOST_CROSSED: usize = 64;

/// The yarns of a fabric.
#[derive(Clone, Debug, Default)]
pub struct Strands {
    /// `[yarn + 1]` yarn i is points `offsets[i] .. offsets[i + 1]`.
    pub offsets: Vec<u32>,
    /// `[yarn]` closed yarns do not repeat their first point.
    pub closed: Vec<bool>,
    /// `[point]` instances of the laid pattern.
    pub instances: Vec<u32>,
}

/// Instances by where they lie.
struct Finder<'a> {
    surface: &'a Surface,
    laid: &'a Laid,
    /// By chart and period, the first number of as many as the pattern has vertices.
    cells: HashMap<(u32, IVec2), u32>,
    /// The instance of each, or [`NONE`].
    at: Vec<u32>,
}

impl<'a> Finder<'a> {
    fn new(surface: &'a Surface, laid: &'a Laid, charts: bool) -> Self {
        let n = laid.successors.len();
        let mut finder = Self { surface, laid, cells: HashMap::new(), at: Vec::new() };
        for (index, instance) in laid.instances.iter().enumerate() {
            let next = finder.at.len() as u32;
            let chart = if charts { surface.charts[instance.face as usize] } else { 0 };
            let base = *finder.cells.entry((chart, instance.cell)).or_insert(next) as usize;
            if base == next as usize {
                finder.at.resize(base + n, NONE);
            }
            // Where a chart lies over itself, the lowest face.
            let at = &mut finder.at[base + laid.vertices[instance.row as usize] as usize];
            *at = (*at).min(index as u32);
        }
        finder
    }

    fn find(&self, chart: u32, cell: IVec2, vertex: u32) -> Option<u32> {
        let base = *self.cells.get(&(chart, cell))?;
        Some(self.at[(base + vertex) as usize]).filter(|i| *i != NONE)
    }

    /// Where the yarn goes on from an instance, across seams too.
    fn next(&self, instance: &Instance, size: DVec2) -> Option<u32> {
        let vertex = self.laid.vertices[instance.row as usize];
        let (to, tile) = self.laid.successors[vertex as usize];
        let chart = self.surface.charts[instance.face as usize];
        if let Some(next) = self.find(chart, instance.cell + tile, to) {
            return Some(next);
        }
        // Beyond this chart: straight on over the mesh, with the pattern.
        let way = self.laid.ways[vertex as usize];
        let face = instance.face as usize;
        let [first, second] = self.surface.inverses[face];
        let (b, c) = (instance.barycentric[0] + first.dot(way), instance.barycentric[1] + second.dot(way));
        // On an edge or at a vertex any face there may be the one to go on from: all are tried, the farthest beyond first.
        let mut waiting = vec![([1.0 - b - c, b, c], face, instance.cell + tile)];
        let mut seen: Vec<(usize, IVec2)> = Vec::new();
        while let Some((all, face, cell)) = waiting.pop() {
            if seen.contains(&(face, cell)) {
                continue;
            }
            if seen.len() == MOST_CROSSED {
                break;
            }
            seen.push((face, cell));
            if let Some(next) = self.find(self.surface.charts[face], cell, to) {
                return Some(next);
            }
            let mut outside: Vec<usize> = (0..3).filter(|k| all[*k] < 1e-9).collect();
            outside.sort_by(|a, b| all[*b].total_cmp(&all[*a]));
            for opposite in outside {
                let k = (opposite + 1) % 3;
                let across = &self.surface.across[face][k];
                let Some(periods) = Surface::periods(across, size) else { continue };
                let [p, q, r] = [all[k], all[(k + 1) % 3], all[(k + 2) % 3]];
                let mut there = [0.0; 3];
                for ((corner, opposite), own) in across.corners.iter().zip(across.opposite).zip([p, q, 0.0]) {
                    there[*corner as usize] = own + r * opposite;
                }
                waiting.push((there, across.face as usize, cell + periods));
            }
        }
        None
    }
}

/// How yarns are put together.
#[derive(Clone, Copy, Debug)]
pub struct Joining {
    /// The pattern's period.
    pub size: DVec2,
    /// Across seams, and yarns that close are kept. Else by periods alone, wherever faces lie.
    pub seams: bool,
    /// Shorter yarns are left out, metres.
    pub shortest: f64,
}

/// Fewest points of a yarn.
const FEWEST: usize = 4;

/// Chains instances to yarns, in the order of the instances that they start with; closed ones come last.
/// `rest_lengths`: `[pattern vertex]` of the edge that leaves it.
pub fn chain(surface: &Surface, laid: &Laid, rest_lengths: &[f64], joining: Joining) -> Strands {
    let finder = Finder::new(surface, laid, joining.seams);
    let count = laid.instances.len();
    let (mut next, mut reached) = (vec![NONE; count], vec![false; count]);
    for (index, instance) in laid.instances.iter().enumerate() {
        let vertex = laid.vertices[instance.row as usize] as usize;
        let (to, tile) = laid.successors[vertex];
        let found = if joining.seams {
            finder.next(instance, joining.size)
        } else {
            finder.find(0, instance.cell + tile, to)
        };
        // Were two to go on to one, the first has it.
        if let Some(found) = found.filter(|f| !reached[*f as usize]) {
            next[index] = found;
            reached[found as usize] = true;
        }
    }
    let mut walker = Walker { laid, rest_lengths, next: &next, done: vec![false; count] };
    let mut strands = Strands { offsets: vec![0], ..Strands::default() };
    for start in (0..count).filter(|i| !reached[*i]) {
        walker.walk(&mut strands, start, joining.shortest);
    }
    if joining.seams {
        for start in 0..count {
            if !walker.done[start] {
                walker.walk(&mut strands, start, joining.shortest);
            }
        }
    }
    strands
}

struct Walker<'a> {
    laid: &'a Laid,
    rest_lengths: &'a [f64],
    next: &'a [u32],
    done: Vec<bool>,
}

impl Walker<'_> {
    /// Follows a yarn from an instance to its end, or to where it began.
    fn walk(&mut self, strands: &mut Strands, start: usize, shortest: f64) {
        let begin = strands.instances.len();
        let (mut at, mut length, mut closed) = (start, 0.0, false);
        loop {
            self.done[at] = true;
            strands.instances.push(at as u32);
            if self.next[at] == NONE {
                break;
            }
            length += self.rest_lengths[self.laid.vertices[self.laid.instances[at].row as usize] as usize];
            at = self.next[at] as usize;
            if at == start {
                closed = true;
                break;
            }
        }
        if strands.instances.len() - begin < FEWEST || length < shortest {
            strands.instances.truncate(begin);
        } else {
            strands.offsets.push(strands.instances.len() as u32);
            strands.closed.push(closed);
        }
    }
}
