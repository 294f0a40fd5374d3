//! Random patterns that can be knit: a model of a few lines keeps count, the patterns state it row by row.

use super::{worked, yarns};
use fastrand::Rng;

/// What lies over a stitch: nothing, a tucked strand behind it or in front of it (seen from the front).
#[derive(Clone, Copy, PartialEq, Debug)]
enum Over {
    Nothing,
    Behind,
    InFront,
}

struct Maker {
    rng: Rng,
    text: String,
    round: bool,
    right_side: bool,
    /// In the order of right-side rows.
    loops: Vec<Over>,
    worked: usize,
    bound: usize,
    cast: usize,
}

impl Maker {
    fn new(seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let round = rng.bool();
        let n = rng.usize(6..16);
        let text = format!("piece a {}\nco {n}\n", if round { "round" } else { "flat" });
        let loops = vec![Over::Nothing; n];
        Self { rng, text, round, right_side: true, loops, worked: 0, bound: 0, cast: n }
    }

    /// A plain stitch that may be worked on this one.
    fn plain(&mut self, over: Over) -> &'static str {
        match (over, self.right_side) {
            (Over::Nothing, _) => ["k", "p"][self.rng.usize(0..2)],
            (Over::Behind, true) | (Over::InFront, false) => "k",
            _ => "p",
        }
    }

    fn row(&mut self) {
        let mut before = self.loops.clone();
        if !self.right_side {
            before.reverse();
        }
        let mut items: Vec<String> = Vec::new();
        let mut after = Vec::new();
        let mut at = 0;
        let tuck = if self.right_side { Over::Behind } else { Over::InFront };
        while at < before.len() {
            let free = before[at..].iter().take_while(|o| **o == Over::Nothing).count();
            let choice = self.rng.usize(0..16);
            let (item, takes, leaves, over) = match choice {
                0 if free >= 2 => {
                    (["k2tog", "p2tog", "ssk", "ssp"][self.rng.usize(0..4)], 2, 1, Over::Nothing)
                }
                1 if free >= 3 => {
                    (["sk2p", "k3tog", "p3tog", "sssp"][self.rng.usize(0..4)], 3, 1, Over::Nothing)
                }
                2 if free >= 1 => (["kfb", "pfb"][self.rng.usize(0..2)], 1, 2, Over::Nothing),
                3 | 4 => (["yo", "m1l", "m1r"][self.rng.usize(0..3)], 0, 1, Over::Nothing),
                5 if free >= 1 => (["sl", "slf", "ktbl", "ptbl"][self.rng.usize(0..4)], 1, 1, Over::Nothing),
                6 if free >= 1 => ("tuck", 1, 1, tuck),
                7 if free >= 3
                    && before.len() > 8
                    && before.len() - at > 4
                    && before[at + 2] == Over::Nothing =>
                {
                    // Two bound off, held by the next.
                    items.push("bo 2".into());
                    at += 2;
                    self.bound += 2;
                    (["k", "p"][usize::from(!self.right_side)], 1, 1, Over::Nothing)
                }
                8 if after.len() > 2 => {
                    items.push("co 2".into());
                    after.extend([Over::Nothing; 2]);
                    self.cast += 2;
                    continue;
                }
                _ => (self.plain(before[at]), 1, 1, Over::Nothing),
            };
            let item = if matches!(item, "k" | "p") { format!("{item}1") } else { item.to_string() };
            items.push(item);
            at += takes;
            after.extend(vec![over; leaves]);
            self.worked += leaves;
        }
        let side = if self.right_side { "RS" } else { "WS" };
        let name = if self.round { "Rnd".into() } else { format!("Row ({side})") };
        self.text += &format!("{name}: {}   ({} sts)\n", items.join(", "), after.len());
        if !self.right_side {
            after.reverse();
        }
        self.loops = after;
        if !self.round {
            self.right_side = !self.right_side;
        }
    }

    /// Forth and back within the stitches, then to the end.
    fn short_rows(&mut self) {
        let n = self.loops.len();
        if n < 6 || !self.right_side || self.loops.iter().any(|o| *o != Over::Nothing) {
            return;
        }
        let a = self.rng.usize(3..n);
        let b = self.rng.usize(1..a);
        self.text += &format!("Row (RS): k{a}, turn\nRow (WS): p{b}, turn\n");
        // What was purled, the stitch of the turn, the rest.
        let name = if self.round { "Rnd" } else { "Row (RS)" };
        self.text += &format!("{name}: k to end   ({n} sts)\n");
        self.worked += a + b + b + (n - a);
        if !self.round {
            self.right_side = false;
        }
    }

    fn finish(mut self) -> (String, [usize; 4]) {
        for _ in 0..self.rng.usize(1..7) {
            if self.loops.len() > 60 {
                break;
            }
            if self.rng.usize(0..4) == 0 {
                self.short_rows();
            } else {
                self.row();
            }
        }
        // Tucked strands must be held before the end.
        while self.loops.iter().any(|o| *o != Over::Nothing) {
            let mut before = self.loops.clone();
            if !self.right_side {
                before.reverse();
            }
            let items: Vec<String> = before.iter().map(|o| format!("{}1", self.plain(*o))).collect();
            let name = if self.round { "Rnd" } else { "Row" };
            self.text += &format!("{name}: {}\n", items.join(", "));
            self.worked += before.len();
            self.loops.fill(Over::Nothing);
            if !self.round {
                self.right_side = !self.right_side;
            }
        }
        let n = self.loops.len();
        let drawn = if self.rng.bool() {
            self.text += "draw\n";
            n
        } else {
            self.text += "bo\n";
            self.bound += n;
            0
        };
        (self.text, [self.cast, self.worked, self.bound, drawn])
    }
}

/// Counts after every row, totals, no loose loop, one yarn. Seen red with increases that a wrong-side row puts on
/// the wrong side, with `turn` taking its stitch along, and with a bind-off's chain that nothing holds.
#[test]
fn random_patterns_are_knit_as_they_say() {
    for seed in 0..400 {
        let (text, [cast, knit, bound, drawn]) = Maker::new(seed).finish();
        let knitted = worked(&text).unwrap_or_else(|e| panic!("seed {seed}: {e}\n{text}"));
        let made = knitted.made;
        assert_eq!(
            [made.cast_on, made.worked, made.bound_off, made.drawn],
            [cast, knit, bound, drawn],
            "seed {seed}\n{text}"
        );
        assert_eq!(knitted.loose_loops, 0, "seed {seed}\n{text}");
        assert_eq!(yarns(&knitted), 1, "seed {seed}\n{text}");
        assert!(knitted.mesh.positions.iter().all(|p| p.is_finite()), "seed {seed}");
    }
}
