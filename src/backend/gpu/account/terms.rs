//! What residuals cost that depend on knots: their part of the normal equations and of the curvature.

use super::{Costs, DOT2, Stage, WORD};
use crate::scene::{Term, Terms};

/// Bytes of a term: its point, segment, rest, number of knots, knots and codes.
const TERM: usize = 10 * WORD;

/// Which of a term's points and segments move with which of its unknowns.
pub(super) struct Pattern {
    /// `[segment]` unknowns that it moves with, as bits; and those that both of its ends move with.
    moves: [u32; 2],
    both: [u32; 2],
    /// Unknowns of its knots.
    unknowns: u32,
    /// Points of knots, and how many of them are contacts.
    points: usize,
    contacts: usize,
}

impl Pattern {
    /// Of a term over so many points.
    pub fn new(term: &Term<f32>, points: usize) -> Self {
        let codes = &term.codes[..points];
        // A point turns with its knot's first unknown; a contact moves with the half-length too.
        let of_point = |code: &u32| match code {
            0 => 0,
            code => (if code % 2 == 1 { 0b11 } else { 0b01 }) << (2 * ((code - 1) / 2)),
        };
        let by: Vec<u32> = codes.iter().map(of_point).collect();
        let segment = |s: usize| match by.get(s..s + 2) {
            Some([a, b]) => (a | b, a & b),
            _ => (0, 0),
        };
        let [e, f] = [segment(0), segment(1)];
        Self {
            moves: [e.0, f.0],
            both: [e.1, f.1],
            unknowns: 2 * term.knot_count,
            points: codes.iter().filter(|code| **code != 0).count(),
            contacts: codes.iter().filter(|code| *code % 2 == 1).count(),
        }
    }
}

fn count(bits: u32) -> usize {
    bits.count_ones() as usize
}

/// Entries of a lower triangle over so many unknowns.
fn triangle(n: usize) -> usize {
    n * (n + 1) / 2
}

/// Pairs i >= j of an unknown i of `a` and j of `b`.
fn pairs(a: u32, b: u32) -> usize {
    (0..6).filter(|i| a >> i & 1 == 1).map(|i| count(b & ((2 << i) - 1))).sum()
}

/// A term's points: a contact's signed direction takes its four words and 2 operations.
fn find_moves(costs: &mut Costs, pattern: &Pattern) {
    costs.stencil(Stage::Sums, 4 * WORD * pattern.contacts);
    costs.work(Stage::Sums, 2 * pattern.contacts);
}

/// b and A by the derivatives: a product and a sum for each entry.
fn add_first(costs: &mut Costs, unknowns: usize) {
    costs.work(Stage::Sums, 2 * unknowns + 2 * triangle(unknowns));
}

/// C by the points' own second derivatives: a dot product and a sum, a contact's twice.
fn add_turning(costs: &mut Costs, pattern: &Pattern) {
    costs.work(Stage::Sums, (DOT2 + 1) * (pattern.points + pattern.contacts));
}

/// Lengths and cosines within knots.
pub(super) fn own_sums(costs: &mut Costs, terms: &Terms<f32>, safe: bool) {
    let (lengths, cosines) = (terms.own_lengths.len(), terms.own_cosines.len());
    // The derivative (1), counted (1), b and A (2 each), the energy (2); C (3 + 1).
    let add_own = 1 + 1 + 2 + 2 + 2 + if safe { 4 } else { 0 };
    // Four words. The residual 2, its slope 1, the second derivative 3.
    costs.stencil(Stage::Sums, 4 * WORD * lengths);
    costs.work(Stage::Sums, (2 + 1 + 3 + add_own) * lengths);
    // Five words, and square and knot of the length. l l and m (2), the residual 5, g 5, the second derivative 5, g l 1.
    costs.stencil(Stage::Sums, 7 * WORD * cosines);
    costs.work(Stage::Sums, (2 + 5 + 5 + 5 + 1 + add_own) * cosines);
}

/// A length between knots.
pub(super) fn length_sums(costs: &mut Costs, pattern: &Pattern, safe: bool) {
    let moving = count(pattern.moves[0]);
    costs.stencil(Stage::Sums, TERM);
    find_moves(costs, pattern);
    // Ends that both move (2); along the segment DOT2, weighted 1.
    costs.work(Stage::Sums, 2 * count(pattern.both[0]) + (DOT2 + 1) * moving);
    add_first(costs, moving);
    if safe {
        // Weights 2, the force 2. An entry: two products and a difference more than a dot product, and added (2).
        costs.work(Stage::Sums, 2 + 2 + (DOT2 + 1 + 1 + 2) * triangle(moving));
        add_turning(costs, pattern);
    }
}

/// A cosine between knots.
pub(super) fn cosine_sums(costs: &mut Costs, pattern: &Pattern, safe: bool) {
    let [e, f] = pattern.moves;
    let unknowns = pattern.unknowns as usize;
    costs.stencil(Stage::Sums, TERM);
    // p and q.
    costs.work(Stage::Sums, 2 * 4);
    find_moves(costs, pattern);
    // Both segments by all unknowns, whether they move or not: scaled 2, two dot products.
    costs.work(Stage::Sums, 2 * (count(pattern.both[0]) + count(pattern.both[1])));
    costs.work(Stage::Sums, 2 * (2 + 2 * DOT2) * unknowns);
    // Weighted, and added where both move.
    costs.work(Stage::Sums, unknowns + count(e & f));
    add_first(costs, count(e | f));
    if safe {
        // One segment by i, the other by j: a dot product, (turn + cosine along) along (3), along turn (1), two
        // differences; the second of them, and squares, are added to what was there.
        let mixed = DOT2 + 3 + 1 + 2;
        // One segment twice: along along less a dot product, times the cosine (2 + 1), less two products (4).
        let square = DOT2 + 2 + 1 + 4;
        costs.work(Stage::Sums, mixed * pairs(e, f) + (mixed + 1) * pairs(f, e));
        costs.work(Stage::Sums, (square + 1) * (triangle(count(e)) + triangle(count(f))));
        // Entries of C: a product and a sum.
        costs.work(Stage::Sums, 2 * triangle(count(e | f)));
        // The share 1; forces on both ends (3 each), on the middle 2.
        costs.work(Stage::Sums, 1 + 3 + 3 + 2);
        add_turning(costs, pattern);
    }
}
