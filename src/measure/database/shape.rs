//! The loops around the middle of a swatch: places that can be compared, and measures of their shape.

use super::poses::Pose;
use super::rows::{Loops, Row, Stitch};
use glam::{DVec2, DVec3, IVec2, UVec2};

/// Places along a loop between two neighbouring crossings.
const PLACES: usize = 8;
/// Pieces of a loop between crossings: foot, leg, knot, head, knot, leg, foot, and the sinker to the next loop.
const PIECES: usize = 8;

/// Which stitches are looked at: one period of the pattern.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// Columns and rows.
    pub count: UVec2,
    /// Size of a stitch at rest, metres.
    pub stitch: DVec2,
}

/// Places of one pose of one method, rolled flat, metres, always as many in the same order; NaN where rows do not cross as
/// a plain knit's do.
#[derive(Clone, Debug, Default)]
pub struct Places {
    /// `[stitch][crossing][yarn]`
    pub contacts: Vec<DVec3>,
    /// `[stitch][left, right]` knots' centres.
    pub knots: Vec<DVec3>,
    /// `[stitch][piece][place]` along its loop, at equal shares of yarn between crossings.
    pub loops: Vec<DVec3>,
    /// Means over the stitches.
    pub shape: Shape,
    /// Stitches that are none.
    pub lost: usize,
}

/// Measures of loops that need no comparison; lengths in radii of the table's yarn.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shape {
    /// Distance of the two knots that hold a loop's head.
    pub head: f64,
    /// Distance of the two knots at the feet of neighbouring loops.
    pub sinker: f64,
    /// A loop from its feet to its head, across the courses.
    pub height: f64,
    /// Half the distance of a knot's contacts.
    pub half_length: f64,
    /// Tilt of a knot's contacts from the course, inwards, degrees.
    pub tilt: f64,
    /// Tilt of a leg from the course, inwards, over its middle half, degrees.
    pub leg: f64,
    /// How far the centreline reaches from back to front.
    pub thickness: f64,
    /// Yarn of a loop, knot to knot: one leg, its head, one sinker, and all of it.
    pub lengths: [f64; 4],
    /// Least distance of the centrelines of neighbouring rows, in the method's own radii: yarns that touch are 2 apart.
    pub clearance: f64,
}

impl Shape {
    /// All numbers, with names as in tables.
    pub fn numbers(&self) -> [(&'static str, f64); 12] {
        let [leg, head, sinker, all] = self.lengths;
        [
            ("head_width_r", self.head),
            ("sinker_width_r", self.sinker),
            ("loop_height_r", self.height),
            ("half_length_r", self.half_length),
            ("knot_tilt_deg", self.tilt),
            ("leg_tilt_deg", self.leg),
            ("thickness_r", self.thickness),
            ("leg_yarn_r", leg),
            ("head_yarn_r", head),
            ("sinker_yarn_r", sinker),
            ("loop_yarn_r", all),
            ("clearance_own_r", self.clearance),
        ]
    }
}

impl Places {
    /// Takes the places of loops. `radius` is the table's yarn's, `own` the method's, metres.
    pub fn new(loops: &Loops, half: DVec2, window: Window, radius: f64, own: f64) -> Self {
        let cells = loops.by_cell(-half, window.stitch);
        let first = (half / window.stitch).floor().as_ivec2();
        let mut places = Self::default();
        let mut shapes = Vec::new();
        for j in 0..window.count.y as i32 {
            for i in 0..window.count.x as i32 {
                let cell = first + IVec2::new(i, j);
                let at = |by: (i32, i32)| cells.get(&(cell + IVec2::from(by))).copied();
                let parts = [at((0, 0)), at((0, -1)), at((1, -1))];
                let found = match parts {
                    [Some(head), Some(feet), Some(next)] => Loop::new(&loops.rows, head, feet, next),
                    _ => None,
                };
                match found {
                    Some(found) => {
                        places.contacts.extend(found.head.crossings.iter().flat_map(|c| c.at));
                        places.knots.extend(found.head.knots());
                        places.loops.extend(found.places());
                        shapes.push(found.shape(&loops.rows, own).in_radii(radius));
                    }
                    None => {
                        places.lost += 1;
                        places.contacts.extend([DVec3::NAN; 8]);
                        places.knots.extend([DVec3::NAN; 2]);
                        places.loops.extend([DVec3::NAN; PIECES * PLACES]);
                    }
                }
            }
        }
        places.shape = Shape::mean(&shapes);
        places
    }
}

/// A loop: from the left foot over its head to the right foot, and on to the next loop's.
struct Loop<'a> {
    row: &'a Row,
    head: &'a Stitch,
    /// Yarn up to its crossings and the next loop's first, metres.
    events: [f64; PIECES + 1],
    knots: [[DVec3; 2]; 3],
}

impl<'a> Loop<'a> {
    fn new(rows: &'a [Row], head: &'a Stitch, feet: &Stitch, next: &Stitch) -> Option<Self> {
        // The feet are held in the stitch below, where this row is the upper one.
        if feet.row + 1 != head.row || next.row != feet.row {
            return None;
        }
        let up = |stitch: &Stitch, k: usize| stitch.crossings[k].arc[1];
        let down = |k: usize| head.crossings[k].arc[0];
        let events = [
            up(feet, 0),
            up(feet, 1),
            down(0),
            down(1),
            down(2),
            down(3),
            up(feet, 2),
            up(feet, 3),
            up(next, 0),
        ];
        let knots = [head.knots(), feet.knots(), next.knots()];
        events.is_sorted_by(|a, b| a < b).then(|| Self { row: &rows[head.row], head, events, knots })
    }

    fn places(&self) -> impl Iterator<Item = DVec3> {
        self.events.windows(2).flat_map(|pair| {
            (0..PLACES).map(|k| {
                let share = k as f64 / PLACES as f64;
                self.row.at(pair[0] + share * (pair[1] - pair[0]))
            })
        })
    }

    fn shape(&self, rows: &[Row], own: f64) -> Shape {
        let [head, feet, next] = self.knots;
        let places: Vec<DVec3> = self.places().collect();
        let extent = |k: usize| {
            let all = places.iter().map(|p| p[k]);
            all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
        };
        let halves = self.head.half_lengths();
        let inwards = |left: DVec2, right: DVec2| {
            (left.to_angle() + std::f64::consts::PI - right.to_angle()).to_degrees() / 2.0
        };
        let e = &self.events;
        let middle = |k: usize| (e[k] + e[k + 1]) / 2.0;
        let [left_foot, left_knot, right_knot, right_foot] = [middle(0), middle(2), middle(4), middle(6)];
        let chord = |from: f64, to: f64| {
            let at = |share: f64| self.row.at(from + share * (to - from)).truncate();
            at(0.75) - at(0.25)
        };
        let sinker = e[8] - right_foot + (left_foot - e[0]);
        Shape {
            head: head[0].distance(head[1]),
            sinker: feet[1].distance(next[0]),
            height: extent(1),
            half_length: (halves[0].length() + halves[1].length()) / 2.0,
            tilt: inwards(halves[0], halves[1]),
            leg: inwards(chord(left_foot, left_knot), chord(right_foot, right_knot)),
            thickness: extent(2),
            lengths: [
                (left_knot - left_foot + right_foot - right_knot) / 2.0,
                right_knot - left_knot,
                sinker,
                e[8] - e[0],
            ],
            clearance: clearance(rows, self.head.row, &self.events) / own,
        }
    }
}

impl Shape {
    fn in_radii(mut self, radius: f64) -> Self {
        for length in
            [&mut self.head, &mut self.sinker, &mut self.height, &mut self.half_length, &mut self.thickness]
        {
            *length /= radius;
        }
        self.lengths = self.lengths.map(|l| l / radius);
        self
    }

    /// The mean of each, and the least clearance.
    fn mean(all: &[Self]) -> Self {
        let mean = |f: &dyn Fn(&Self) -> f64| all.iter().map(f).sum::<f64>() / all.len() as f64;
        Self {
            head: mean(&|s| s.head),
            sinker: mean(&|s| s.sinker),
            height: mean(&|s| s.height),
            half_length: mean(&|s| s.half_length),
            tilt: mean(&|s| s.tilt),
            leg: mean(&|s| s.leg),
            thickness: mean(&|s| s.thickness),
            lengths: [0, 1, 2, 3].map(|k| mean(&|s| s.lengths[k])),
            clearance: all.iter().map(|s| s.clearance).fold(f64::NAN, f64::min),
        }
    }
}

/// Least distance of a loop's centreline to those of the rows above and below, metres.
fn clearance(rows: &[Row], row: usize, events: &[f64; PIECES + 1]) -> f64 {
    let own = &rows[row];
    let within =
        own.arc.partition_point(|a| *a < events[0])..own.arc.partition_point(|a| *a <= events[PIECES]);
    let x = |f: fn(f64, f64) -> f64, from| own.flat[within.clone()].iter().map(|p| p.x).fold(from, f);
    let (left, right) = (x(f64::min, f64::INFINITY), x(f64::max, f64::NEG_INFINITY));
    let reach = right - left;
    let mut least = f64::INFINITY;
    for other in [row.checked_sub(1), Some(row + 1)].into_iter().flatten().filter_map(|r| rows.get(r)) {
        for (i, pair) in other.world.windows(2).enumerate() {
            // What lies a loop away is not the nearest.
            if !(left - reach..=right + reach).contains(&other.flat[i].x) {
                continue;
            }
            let way = pair[1] - pair[0];
            let scale = 1.0 / way.length_squared().max(f64::MIN_POSITIVE);
            for p in &own.world[within.clone()] {
                let share = (*p - pair[0]).dot(way) * scale;
                least = least.min(p.distance_squared(pair[0] + way * share.clamp(0.0, 1.0)));
            }
        }
    }
    least.sqrt()
}

/// Distances of places to those of a reference, in yarn radii.
#[derive(Clone, Copy, Debug, Default)]
pub struct Distances {
    /// Of contacts: mean and greatest.
    pub contacts: [f64; 2],
    /// Of knots' centres.
    pub knots: [f64; 2],
    /// Of contacts relative to the centre of their knot: how knots turn, lengthen and flatten.
    pub within: [f64; 2],
    /// Along loops: root mean square and greatest.
    pub loops: [f64; 2],
}

/// How far places move off the surface's motion, compared with how far the reference's do: both relative to their own
/// rest, and to their own mean, since where the fabric as a whole slides to means nothing. Without `rests`, places are
/// compared as they are.
pub fn distances(
    pose: &Pose,
    places: &Places,
    reference: &Places,
    rests: Option<[&Places; 2]>,
    radius: f64,
) -> Distances {
    let off = |here: &[DVec3], rest: Option<&[DVec3]>| -> Vec<DVec3> {
        match rest {
            Some(rest) => here.iter().zip(rest).map(|(p, r)| *p - pose.done(*r)).collect(),
            None => here.to_vec(),
        }
    };
    let differences = |of: fn(&Places) -> &[DVec3]| -> Vec<DVec3> {
        let mine = off(of(places), rests.map(|r| of(r[0])));
        let theirs = off(of(reference), rests.map(|r| of(r[1])));
        mine.iter().zip(&theirs).map(|(a, b)| (*a - *b) / radius).collect()
    };
    let contacts = differences(|p| &p.contacts);
    let knots = differences(|p| &p.knots);
    // The four points of two contacts each belong to a knot.
    let within: Vec<DVec3> = contacts.iter().enumerate().map(|(i, d)| *d - knots[i / 4]).collect();
    let known: Vec<DVec3> = contacts.iter().copied().filter(|d| d.is_finite()).collect();
    let mean = known.iter().sum::<DVec3>() / known.len() as f64;
    let lengths = |all: Vec<DVec3>, mean: DVec3| -> Vec<f64> {
        all.into_iter().filter(|d| d.is_finite()).map(|d| (d - mean).length()).collect()
    };
    let average = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    let most = |all: &[f64]| all.iter().copied().fold(f64::NAN, f64::max);
    let contacts = lengths(contacts, mean);
    let knots = lengths(knots, mean);
    let within = lengths(within, DVec3::ZERO);
    let loops = lengths(differences(|p| &p.loops), mean);
    let squares: Vec<f64> = loops.iter().map(|d| d * d).collect();
    Distances {
        contacts: [average(&contacts), most(&contacts)],
        knots: [average(&knots), most(&knots)],
        within: [average(&within), most(&within)],
        loops: [average(&squares).sqrt(), most(&loops)],
    }
}
