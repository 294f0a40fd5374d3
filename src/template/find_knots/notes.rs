//! What the search says about what it found.

use std::collections::BTreeMap;

use super::{Candidate, Search};

/// Crossings of two strands that make no knot.
pub(super) struct FreeCrossing {
    pub strands: [usize; 2],
    pub count: usize,
    pub reason: Reason,
}

/// Why crossings make no knot.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reason {
    Single,
    SameOnTop,
    NotInARow,
    Level,
    NoDirection,
    TooWide,
    Together,
    Occupied,
    Fold,
}

impl Reason {
    fn text(self) -> &'static str {
        match self {
            Reason::Single => "they cross only once",
            Reason::SameOnTop => "the same strand is on top each time",
            Reason::NotInARow => "no two in a row swap the strand on top",
            Reason::Level => "they meet at the same height, neither is on top",
            Reason::NoDirection => "both lie at one place, which gives the knot no direction",
            Reason::TooWide => "between them a strand goes too far away for a knot",
            Reason::Together => "the strands run along one another between them",
            Reason::Occupied => "both strands already pass other knots there",
            Reason::Fold => "a knot would fold the strands",
        }
    }
}

impl Search {
    /// One line for what was found, then one for each thing worth knowing.
    pub(super) fn notes(&self) -> Vec<String> {
        let knots: Vec<&Candidate> = self.candidates.iter().filter(|c| c.used()).collect();
        let mut notes = vec![match knots.len() {
            0 => "no knots".to_string(),
            n => {
                let names: Vec<String> = knots.iter().map(|c| pair(c.strands)).collect();
                format!("{}: {}", plural(n, "knot"), names.join(", "))
            }
        }];
        for (k, c) in knots.iter().enumerate() {
            if c.taken != [true; 2] {
                let other = usize::from(c.taken[0]);
                let instead = match knots.iter().position(|o| o.replaces(c, other)) {
                    Some(n) => format!("passes knot {n}"),
                    None => "keeps its own points".to_string(),
                };
                let [passing, other] = [c.strands[1 - other], c.strands[other]];
                notes.push(format!(
                    "knot {k} ({}): only strand {passing} passes it, strand {other} {instead} there",
                    pair(c.strands)
                ));
            }
            if c.raised {
                notes.push(format!(
                    "knot {k} ({}): half-length raised to half the yarn radius",
                    pair(c.strands)
                ));
            }
            let same = |o: &Candidate| o.knot.center == c.knot.center;
            if let Some(first) = knots[..k].iter().position(|o| same(o)) {
                notes.push(format!("knot {k} shares the centre of knot {first}"));
            }
        }
        if self.dropped > 0 {
            notes.push(format!("{} beside a contact dropped", plural(self.dropped, "free point")));
        }
        let mut counts: BTreeMap<([usize; 2], Reason), usize> = BTreeMap::new();
        for f in &self.free {
            *counts.entry((f.strands, f.reason)).or_default() += f.count;
        }
        for ((strands, reason), count) in counts {
            let verb = if count == 1 { "stays" } else { "stay" };
            let count = plural(count, "crossing");
            notes.push(format!("{count} of {} {verb} free: {}", pair(strands), reason.text()));
        }
        notes
    }
}

fn pair([a, b]: [usize; 2]) -> String {
    format!("strand {a} x strand {b}")
}

fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}
