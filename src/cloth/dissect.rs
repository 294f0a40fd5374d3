//! An order of nodes in which a matrix over them is factored with little fill, in parts that are independent of each other.
//!
//! Nested dissection (George 1973) by coordinates: a set of nodes is cut at the median of its longest side; nodes behind the cut
//! that touch one before it separate the two halves and come after both.

use super::order::adjacency;
use glam::DVec3;
use std::ops::Range;

/// Sets of fewer nodes are not cut.
const SMALL: usize = 48;

/// How often the whole is cut into parts that threads work on: four parts.
const CUTS: u32 = 2;

/// The order, and its independent parts; what separates them comes last.
pub(super) struct Dissection {
    /// `[place]` the node there.
    pub order: Vec<u32>,
    /// Ranges of places; no entry of the matrix joins two of them.
    pub parts: Vec<Range<usize>>,
}

/// Cuts up nodes that `edges` join.
pub(super) fn dissect(places: &[DVec3], edges: &[[u32; 2]]) -> Dissection {
    let n = places.len();
    let (offsets, neighbours) = adjacency(n, edges);
    let mut work = Work { places, offsets, neighbours, side: vec![0; n], mark: 0 };
    let mut sets = vec![(0..n as u32).collect::<Vec<_>>()];
    let mut separators = Vec::new();
    for _ in 0..CUTS {
        let mut halves = Vec::new();
        let mut between = Vec::new();
        for set in sets {
            let (a, b, separator) = work.cut(set);
            halves.extend([a, b]);
            between.push(separator);
        }
        // Deeper separators come before those that separate more.
        separators.push(between);
        sets = halves;
    }
    let mut order = Vec::with_capacity(n);
    let mut parts = Vec::new();
    for set in sets {
        let begin = order.len();
        work.order(set, &mut order);
        parts.push(begin..order.len());
    }
    separators.into_iter().rev().flatten().for_each(|s| order.extend(s));
    Dissection { order, parts }
}

struct Work<'a> {
    places: &'a [DVec3],
    offsets: Vec<u32>,
    neighbours: Vec<u32>,
    /// `[node]` twice the number of the cut at which it was last on the far side.
    side: Vec<u32>,
    mark: u32,
}

impl Work<'_> {
    /// The part before a cut, the part behind it and what separates them.
    fn cut(&mut self, mut set: Vec<u32>) -> (Vec<u32>, Vec<u32>, Vec<u32>) {
        if set.len() < 2 {
            return (set, Vec::new(), Vec::new());
        }
        let place = |n: &u32| self.places[*n as usize];
        let low = set.iter().map(place).fold(DVec3::INFINITY, DVec3::min);
        let high = set.iter().map(place).fold(DVec3::NEG_INFINITY, DVec3::max);
        let axis = (high - low).max_position();
        let middle = set.len() / 2;
        set.select_nth_unstable_by(middle, |a, b| place(a)[axis].total_cmp(&place(b)[axis]).then(a.cmp(b)));
        let mut behind = set.split_off(middle);
        // Sorted, so that what follows does not depend on how the selection went about it.
        set.sort_unstable();
        behind.sort_unstable();
        self.mark += 1;
        set.iter().for_each(|n| self.side[*n as usize] = self.mark);
        let touches = |n: &u32| {
            let around = self.offsets[*n as usize] as usize..self.offsets[*n as usize + 1] as usize;
            self.neighbours[around].iter().any(|m| self.side[*m as usize] == self.mark)
        };
        let (separator, rest) = behind.into_iter().partition(touches);
        (set, rest, separator)
    }

    fn order(&mut self, set: Vec<u32>, order: &mut Vec<u32>) {
        if set.len() < SMALL {
            order.extend(set);
            return;
        }
        let size = set.len();
        let (a, b, separator) = self.cut(set);
        // Where nothing can be cut off, a set of its own order is better than none.
        if separator.len() * 2 > size {
            [a, b, separator].into_iter().for_each(|s| order.extend(s));
            return;
        }
        self.order(a, order);
        self.order(b, order);
        order.extend(separator);
    }
}
