//! How many stitches a pattern has on paper: sums over its rows, from the gauge and the pattern's lengths.

/// What is counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Count {
    pub cast_on: usize,
    pub worked: usize,
    pub bound_off: usize,
    pub grafted: usize,
    pub drawn: usize,
    /// Ends of yarn, in pairs.
    pub yarns: usize,
}

/// Lengths in centimetres by stitches and rows on 10 cm.
#[derive(Clone, Copy)]
pub struct Paper {
    pub stitches: f64,
    pub rows: f64,
}

impl Paper {
    fn across(self, cm: f64) -> f64 {
        cm * self.stitches / 10.0
    }
    fn up(self, cm: f64) -> f64 {
        cm * self.rows / 10.0
    }
}

fn near(x: f64) -> usize {
    (x + 1e-9).round() as usize
}

fn multiple(x: f64, of: usize, plus: usize) -> usize {
    near((x - plus as f64) / of as f64) * of + plus
}

/// A flat piece of so many stitches and rows.
fn flat(n: usize, rows: usize) -> Count {
    Count { cast_on: n, worked: n * rows, bound_off: n, yarns: 1, ..Count::default() }
}

/// Names of the patterns, the gauges that they state, and their sizes: the first is what is worked unless another is asked for.
pub const PATTERNS: &[(&str, (f64, f64), &[&str])] = &[
    ("stockinette", (22.0, 30.0), &[]),
    ("garter", (20.0, 28.0), &[]),
    ("rib-1x1", (24.0, 30.0), &[]),
    ("rib-2x2", (24.0, 30.0), &[]),
    ("seed", (20.0, 28.0), &[]),
    ("feather-and-fan", (22.0, 30.0), &[]),
    ("flame-chevron", (22.0, 30.0), &[]),
    ("openwork-lace", (20.0, 28.0), &[]),
    ("tuck", (18.0, 26.0), &[]),
    ("slip-stitch", (22.0, 30.0), &[]),
    ("scarf", (20.0, 28.0), &["short", "long"]),
    ("hat", (20.0, 28.0), &["adult", "child", "large"]),
    ("sock", (30.0, 42.0), &["medium", "small", "large"]),
    ("mitten", (24.0, 32.0), &["medium", "small", "large"]),
    ("button-band", (20.0, 28.0), &[]),
    ("cowl", (16.0, 22.0), &[]),
    ("raglan-sweater", (16.0, 22.0), &["m", "s", "l", "xl"]),
];

/// What a pattern has on paper.
pub fn on_paper(name: &str, size: Option<&str>, g: Paper) -> Count {
    match name {
        "stockinette" | "garter" => flat(near(g.across(10.0)), multiple(g.up(10.0), 2, 0)),
        "rib-1x1" | "seed" => flat(multiple(g.across(10.0), 2, 1), multiple(g.up(10.0), 2, 0)),
        "rib-2x2" => flat(multiple(g.across(10.0), 4, 2), multiple(g.up(10.0), 2, 0)),
        "feather-and-fan" => {
            let repeats = near((g.across(20.0) - 4.0) / 18.0).max(1);
            flat(18 * repeats + 4, 4 * near(g.up(12.0) / 4.0).max(1))
        }
        "flame-chevron" => {
            let repeats = near((g.across(16.0) - 4.0) / 7.0).max(1);
            flat(7 * repeats + 4, 20 * near(g.up(16.0) / 20.0).max(1))
        }
        "openwork-lace" => {
            let repeats = near((g.across(16.0) - 5.0) / 8.0).max(1);
            flat(8 * repeats + 5, 8 * near(g.up(14.0) / 8.0).max(1))
        }
        "tuck" => flat(multiple(g.across(10.0), 2, 1), 8 * near(g.up(10.0) / 8.0).max(1) + 2),
        "slip-stitch" => {
            let repeats = near(g.up(10.0) / 8.0).max(1);
            // Two rows of the first colour, then four changes of colour every eight rows.
            Count { yarns: 1 + 4 * repeats, ..flat(multiple(g.across(10.0), 4, 3), 2 + 8 * repeats) }
        }
        "scarf" => {
            let long = if size == Some("long") { 170.0 } else { 110.0 };
            let ends = multiple(g.up(5.0), 2, 0);
            let middle = multiple(g.up(long), 2, 0).saturating_sub(2 * ends).max(2);
            flat(multiple(g.across(20.0), 4, 2), ends + middle + ends)
        }
        "hat" => hat(size, g),
        "sock" => sock(size, g),
        "mitten" => mitten(size, g),
        "button-band" => button_band(g),
        "cowl" => {
            let rows = multiple(g.up(24.0), 2, 1).max(11);
            // Yarn turns at each side after every other row.
            Count { grafted: rows.div_ceil(2), yarns: 2, ..flat(multiple(g.across(60.0), 2, 1), rows) }
        }
        "raglan-sweater" => sweater(size, g),
        _ => panic!("{name} is not counted"),
    }
}

fn hat(size: Option<&str>, g: Paper) -> Count {
    let (around, tall) = match size {
        Some("child") => (46.0, 12.0),
        Some("large") => (58.0, 17.0),
        _ => (52.0, 15.0),
    };
    let wedge = near(g.across(around) / 8.0).max(2);
    let brim = near(g.up(5.0)).max(2);
    let rounds = brim + near(g.up(tall)).saturating_sub(brim).max(2);
    let crown: usize = (1..=wedge - 2).map(|i| 2 * 8 * (wedge - i)).sum();
    // A last round takes two of each wedge together.
    Count {
        cast_on: 8 * wedge,
        worked: 8 * wedge * rounds + crown + 8,
        drawn: 8,
        yarns: 1,
        ..Count::default()
    }
}

fn sock(size: Option<&str>, g: Paper) -> Count {
    let (around, leg, foot) = match size {
        Some("small") => (18.0, 13.0, 21.0),
        Some("large") => (24.0, 19.0, 28.0),
        _ => (21.0, 16.0, 24.0),
    };
    let n = multiple(g.across(around), 8, 0).max(16);
    let heel = n / 2;
    let turns = near(heel as f64 / 3.0).max(1);
    let toe = ((n as f64 - (n as f64 / 3.0).max(8.0)) / 4.0 + 1e-9).floor() as usize;
    let cuff = near(g.up(4.0)).max(2);
    let leg = cuff + near(g.up(leg)).saturating_sub(cuff).max(2);
    let foot = (g.up(foot * 0.75) - 2.0 * toe as f64).round().max(2.0) as usize;
    // Heel rows: all but the last stitch, then always one stitch less, down to the middle; from there always one more, up to
    // all but one at each side.
    let middle = heel - 2 * turns;
    let down: usize = (middle..heel).sum();
    let up: usize = (middle + 1..heel - 1).sum();
    // The round after it finds the first stitch passed already.
    let rounds = n * (leg + foot + 1) + (n - 1) + (1..=toe).map(|i| 2 * (n - 4 * i)).sum::<usize>();
    Count { cast_on: n, worked: rounds + down + up, grafted: heel - 2 * toe, yarns: 1, ..Count::default() }
}

fn mitten(size: Option<&str>, g: Paper) -> Count {
    let (around, hand, thumb) = match size {
        Some("small") => (17.0, 14.0, 4.5),
        Some("large") => (23.0, 20.0, 7.0),
        _ => (20.0, 18.0, 6.0),
    };
    let n = multiple(g.across(around), 8, 0).max(16);
    let grows = near(g.across(around * 0.16)).max(1);
    let between = (near(g.up(6.5) / grows as f64)).saturating_sub(1).max(1);
    let cuff = near(g.up(6.0)).max(4);
    let top = (n - 8) / 4 - 1;
    let palm = (near(g.up(hand)) as i64 - (grows * (between + 1)) as i64 - 2 * top as i64).max(2) as usize;
    let tall = near(g.up(thumb)).saturating_sub(2).max(2);
    // Each round of increases adds two stitches, which the plain rounds after it have too.
    let gusset: usize = (1..=grows).map(|i| (1 + between) * (n + 2 * i)).sum();
    // Two rounds change gusset for gap, and one places a marker.
    let hand = n * (cuff + 4)
        + gusset
        + (n - 1)
        + n
        + n * palm
        + n
        + (1..=top).map(|i| 2 * (n - 4 * i)).sum::<usize>();
    let (waits, around) = (2 * grows + 1, 2 * grows + 4);
    Count {
        cast_on: n + 3 + 3,
        worked: hand + waits + around * tall + around / 2,
        drawn: n - 4 * top + around / 2,
        yarns: 2,
        ..Count::default()
    }
}

fn button_band(g: Paper) -> Count {
    let n = near(g.across(14.0)).max(4);
    let rows = multiple(g.up(18.0), 2, 0).max(12);
    let band = rows / 2 + 1;
    let holes = (band / 9).max(1);
    Count {
        cast_on: n + 2 * holes,
        worked: n * rows + 8 * band - 2 * 2 * holes,
        bound_off: n + 2 * holes + band,
        yarns: 2,
        ..Count::default()
    }
}

fn sweater(size: Option<&str>, g: Paper) -> Count {
    let [chest, length, sleeve, upper, wrist, yoke] = match size {
        Some("s") => [94.0, 38.0, 44.0, 34.0, 21.0, 21.0],
        Some("l") => [114.0, 42.0, 47.0, 41.0, 24.0, 25.0],
        Some("xl") => [126.0, 43.0, 48.0, 46.0, 25.0, 27.0],
        _ => [104.0, 40.0, 46.0, 37.0, 23.0, 23.0],
    };
    let body = multiple(g.across(chest), 4, 0).max(32);
    let underarm = multiple(g.across(chest / 13.0), 2, 0).max(2);
    let half = body / 2 - underarm;
    let cuff = multiple(g.across(wrist), 4, 0).max(12);
    let wanted = (g.across(upper) - cuff as f64).max(underarm as f64 + 10.0 - cuff as f64);
    let grows = (wanted / 2.0 - 1e-9).ceil().max(0.0) as usize;
    let arm = cuff + 2 * grows;
    let first = 2 * half + 2 * (arm - underarm);
    let decreases = near((first as f64 - g.across(48.0)) / 8.0);
    let decreases = decreases.min((arm - underarm - 4) / 2).min((half - 6) / 2).max(1);
    let neck = first - 8 * decreases;

    let hem = near(g.up(6.0)).max(2);
    let sides = near(g.up(length)).saturating_sub(hem).max(2);
    let straight = near(g.up(sleeve)).saturating_sub(hem).max(2);
    let apart = (straight / grows.max(1)).max(1);
    let over = straight.saturating_sub(apart * grows);
    let plain = near(g.up(yoke)) as f64 - 2.0 * decreases as f64 - (hem as f64 / 2.0).round();
    let plain = plain.max(1.0) as usize;

    let one_sleeve = cuff * hem + (1..=grows).map(|i| apart * (cuff + 2 * i)).sum::<usize>() + over * arm;
    let yoke = first * (1 + plain) + (1..=decreases).map(|i| 2 * (first - 8 * i)).sum::<usize>();
    Count {
        cast_on: 2 * cuff + body,
        worked: 2 * one_sleeve + body * (hem + sides) + yoke + neck * near(g.up(3.0)).max(2),
        bound_off: neck,
        grafted: 2 * underarm,
        drawn: 0,
        // Each sleeve's yarn grafts its underarm.
        yarns: 3,
    }
}
