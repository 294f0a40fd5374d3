//! The order of nodes and constraints: neighbours near each other, in blocks that threads work on side by side.
//!
//! Nodes are numbered by reverse Cuthill-McKee, so a block of consecutive nodes is a strip of the fabric and few constraints
//! reach across blocks. Those within a block come first, block by block; those across come last and are dealt with by one
//! thread. Blocks depend on the mesh alone, so results do not depend on the number of threads. Within a block constraints are
//! sorted by colour: those of a colour share no node, and processors work on several at once.

use std::ops::Range;

/// Where blocks of nodes, and the constraints within them, begin.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blocks {
    /// Nodes of a block; the last may have fewer.
    pub size: usize,
    /// `[block + 1]` springs within block b are `springs[b] .. springs[b + 1]`; those across follow.
    pub springs: Vec<u32>,
    /// The same for bends.
    pub bends: Vec<u32>,
}

impl Blocks {
    /// Blocks for so many nodes.
    pub fn new(nodes: usize) -> Self {
        // Strips of an eighth: one in twenty constraints reaches across on a mesh of 22,800 faces.
        Self { size: nodes.div_ceil(8).clamp(256, 8192), ..Self::default() }
    }

    /// Springs within a block.
    pub fn springs_of(&self, block: usize) -> Range<usize> {
        range(&self.springs, block)
    }

    /// Bends within a block.
    pub fn bends_of(&self, block: usize) -> Range<usize> {
        range(&self.bends, block)
    }

    /// The first spring across blocks.
    pub fn springs_across(&self) -> usize {
        self.springs.last().map_or(0, |s| *s as usize)
    }

    /// The first bend across blocks.
    pub fn bends_across(&self) -> usize {
        self.bends.last().map_or(0, |s| *s as usize)
    }
}

fn range(starts: &[u32], block: usize) -> Range<usize> {
    starts[block] as usize..starts[block + 1] as usize
}

/// `[old node]` its new number, by reverse Cuthill-McKee (Cuthill and McKee 1969) over edges `[a, b]`.
pub(crate) fn renumber(nodes: usize, edges: &[[u32; 2]]) -> Vec<u32> {
    let (offsets, neighbours) = adjacency(nodes, edges);
    let around = |n: usize| &neighbours[offsets[n] as usize..offsets[n + 1] as usize];
    let degree = |n: u32| offsets[n as usize + 1] - offsets[n as usize];
    let mut seen = vec![false; nodes];
    let mut order: Vec<u32> = Vec::with_capacity(nodes);
    let mut sorted = Vec::new();
    let mut walk = |start: u32, seen: &mut [bool], order: &mut Vec<u32>| {
        let mut at = order.len();
        seen[start as usize] = true;
        order.push(start);
        while at < order.len() {
            sorted.clear();
            for n in around(order[at] as usize) {
                if !seen[*n as usize] {
                    seen[*n as usize] = true;
                    sorted.push(*n);
                }
            }
            sorted.sort_unstable_by_key(|n| (degree(*n), *n));
            order.extend_from_slice(&sorted);
            at += 1;
        }
    };
    for node in 0..nodes as u32 {
        if seen[node as usize] {
            continue;
        }
        // The node that is reached last lies at an end of the component: strips across it are short.
        let begin = order.len();
        walk(node, &mut seen, &mut order);
        let end = order[order.len() - 1];
        for n in order.drain(begin..) {
            seen[n as usize] = false;
        }
        walk(end, &mut seen, &mut order);
    }
    let mut number = vec![0; nodes];
    for (at, node) in order.iter().rev().enumerate() {
        number[*node as usize] = at as u32;
    }
    number
}

/// `[node + 1]` where the neighbours of each node begin, and neighbours.
pub(super) fn adjacency(nodes: usize, edges: &[[u32; 2]]) -> (Vec<u32>, Vec<u32>) {
    let mut offsets = vec![0_u32; nodes + 1];
    for n in edges.iter().flatten() {
        offsets[*n as usize + 1] += 1;
    }
    for n in 0..nodes {
        offsets[n + 1] += offsets[n];
    }
    let mut next = offsets.clone();
    let mut neighbours = vec![0; edges.len() * 2];
    for [a, b] in edges {
        for (a, b) in [(a, b), (b, a)] {
            neighbours[next[*a as usize] as usize] = *b;
            next[*a as usize] += 1;
        }
    }
    (offsets, neighbours)
}

/// Sorts constraints by block and colour and returns where blocks begin (`[block + 1]`); those across blocks come last.
pub(crate) fn sort<T: Copy>(
    items: &mut Vec<T>,
    nodes: usize,
    size: usize,
    of: impl Fn(&T) -> [u32; 4],
) -> Vec<u32> {
    let blocks = nodes.div_ceil(size);
    let block_of = |item: &T| {
        let ends = of(item).map(|n| n as usize / size);
        if ends.iter().all(|b| *b == ends[0]) { ends[0] } else { blocks }
    };
    items.sort_by_key(|item| (block_of(item), of(item)));
    // Greedy colours, in node order; the 64th takes what is left.
    let mut used = vec![0_u64; nodes];
    let mut keyed: Vec<(usize, u32, T)> = items
        .iter()
        .map(|item| {
            let taken = of(item).iter().fold(0, |all, n| all | used[*n as usize]);
            let colour = (!taken).trailing_zeros().min(63);
            of(item).iter().for_each(|n| used[*n as usize] |= 1 << colour);
            (block_of(item), colour, *item)
        })
        .collect();
    keyed.sort_by_key(|(block, colour, _)| (*block, *colour));
    let starts = (0..=blocks).map(|b| keyed.partition_point(|(block, ..)| *block < b) as u32).collect();
    items.clear();
    items.extend(keyed.into_iter().map(|(.., item)| item));
    starts
}
