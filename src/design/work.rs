//! Knitting: steps become faces, loops go from needle to needle.

mod borders;
mod pieces;

use super::expand::Step;
use super::expression::Problem;
use super::fabric::{Direction, Fabric, NewStitch, PieceRecord, RowRecord, edge};
use super::needles::{Held, Layers, Loop, Needles, Slot, stitches};
use super::stitch::{Side, Stitch};
use super::token::Place;
use crate::mesh::FaceEdge;
use std::collections::BTreeMap;

/// Faces of a fabric at most: indices have 32 bits, and memory an end.
const MOST_FACES: usize = 20_000_000;

/// Where the working yarn leaves the last stitch.
#[derive(Clone, Copy, Debug)]
struct Tip {
    edge: FaceEdge,
    direction: Direction,
    /// A bind-off's last loop leaves there too.
    chain: bool,
}

/// A knitter at work.
#[derive(Debug)]
pub struct Knitter {
    /// What has been knitted.
    pub fabric: Fabric,
    /// What is on the needles.
    pub needles: Needles,
    /// Held stitches by name.
    pub held: BTreeMap<String, Held>,
    /// Whether the right side faces the knitter in the row to come.
    pub right_side: bool,
    /// Ends of yarn left for grafting, by name.
    tails: BTreeMap<String, Tip>,
    tip: Option<Tip>,
    /// The needles were turned already.
    turned: bool,
    colour: u16,
    most_faces: usize,
    /// Stitches made, cast on and bound off.
    pub made: Made,
}

/// Counts of what was worked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Made {
    /// Loops cast on.
    pub cast_on: usize,
    /// Loops made by stitches of rows.
    pub worked: usize,
    /// Stitches bound off.
    pub bound_off: usize,
    /// Stitches grafted, pairs counted once.
    pub grafted: usize,
    /// Stitches drawn together.
    pub drawn: usize,
}

impl Made {
    /// All of them.
    pub fn total(&self) -> usize {
        self.cast_on + self.worked + self.bound_off + self.grafted + self.drawn
    }
}

impl Knitter {
    /// Empty needles; so many faces at most.
    pub fn new(most_faces: Option<usize>) -> Self {
        Self {
            fabric: Fabric::default(),
            needles: Needles::default(),
            held: BTreeMap::new(),
            right_side: true,
            tails: BTreeMap::new(),
            tip: None,
            turned: true,
            colour: 0,
            most_faces: most_faces.unwrap_or(MOST_FACES).min(MOST_FACES),
            made: Made::default(),
        }
    }

    /// Goes on in this colour.
    pub fn take_colour(&mut self, number: u16) {
        self.colour = number;
    }

    /// The piece that is worked on.
    pub fn piece(&self) -> Option<&PieceRecord> {
        self.fabric.pieces.last()
    }

    fn round(&self) -> bool {
        self.piece().is_some_and(|p| p.round)
    }

    fn direction(&self) -> Direction {
        if self.right_side { Direction::Left } else { Direction::Right }
    }

    /// Turns the work, or goes on to the next round: afterwards the left needle holds what comes next.
    pub fn prepare(&mut self) {
        if !self.turned {
            if self.round() {
                if self.needles.left.is_empty() {
                    self.needles.round_ends();
                }
            } else {
                self.needles.turn();
            }
            self.turned = true;
        }
    }

    /// Works a row: `steps` use up the left needle, or end in a turn.
    pub fn row(&mut self, steps: &[(Step, Place)], round: bool, place: Place) -> Result<(), Problem> {
        self.prepare();
        let whole = self.needles.right.is_empty();
        let begin = self.fabric.faces.len();
        let direction = self.direction();
        if self.needles.left.is_empty()
            && !steps.iter().any(|(s, _)| matches!(s, Step::From(_) | Step::CastOn))
        {
            return Err(Problem::new(place, "a row with nothing on the needles", "stitches: co N first"));
        }
        if !self.round()
            && let Some(tip) = self.tip
            && tip.direction != direction
        {
            self.turn_at_edge(tip, place);
        }
        self.check_size(steps.len(), place)?;
        let mut at = 0;
        while at < steps.len() {
            at += self.step(steps, at)?;
        }
        let turned = matches!(steps.last(), Some((Step::Turn, _)));
        while matches!(self.needles.left.last(), Some(Slot::Marker(_))) && !turned {
            self.needles.right.extend(self.needles.left.pop());
        }
        let left = stitches(&self.needles.left);
        if !turned && left > 0 {
            return Err(Problem::new(
                place,
                format_args!("{left} stitches not worked at the end of the row"),
                "a row that uses all stitches, or ends in a turn",
            ));
        }
        if self.tip.is_some_and(|t| t.chain) {
            return Err(Problem::new(
                place,
                "a bind-off that is not held",
                "a stitch after it, or the end of the row",
            ));
        }
        if self.round() && !turned && !(self.right_side && (round || self.needles.left.is_empty())) {
            return Err(Problem::new(place, "a wrong-side row to its end in the round", "a turn at its end"));
        }
        let closed = self.round() && whole && !turned;
        self.record(begin, direction, closed, turned, place);
        if turned {
            self.turned = true;
        } else {
            self.turned = false;
            if !self.round() {
                self.right_side = !self.right_side;
            }
        }
        Ok(())
    }

    fn record(&mut self, begin: usize, direction: Direction, closed: bool, short: bool, place: Place) {
        let row = RowRecord {
            faces: begin..self.fabric.faces.len(),
            direction,
            closed,
            short,
            piece: self.fabric.pieces.len().saturating_sub(1) as u32,
            stitches: self.needles.stitches(),
            place,
        };
        self.fabric.rows.push(row);
    }

    /// Whether there is room for so many more faces.
    fn check_size(&self, more: usize, place: Place) -> Result<(), Problem> {
        if self.fabric.faces.len().saturating_add(more) > self.most_faces {
            return Err(Problem::new(
                place,
                "a fabric without end",
                format_args!("at most {} stitches", self.most_faces),
            ));
        }
        Ok(())
    }

    /// Does a step, with the ones after it that share its face; says how many they were.
    fn step(&mut self, steps: &[(Step, Place)], at: usize) -> Result<usize, Problem> {
        let (step, place) = (&steps[at].0, steps[at].1);
        let next = steps.get(at + 1).map(|(s, _)| s);
        match step {
            Step::Work(stitch, colour) => {
                let before = self.colour;
                self.colour = colour.unwrap_or(before);
                let used = self.work(*stitch, *colour, next, place);
                self.colour = before;
                used
            }
            Step::BindOff => {
                let more = steps[at + 1..].iter().any(|(s, _)| !matches!(s, Step::With(_)));
                self.bind_off(more, place).map(|()| 1)
            }
            Step::CastOn => {
                self.no_chain(place)?;
                self.cast_on_one(self.direction(), place);
                Ok(1)
            }
            Step::PlaceMarker(name) => {
                self.needles.right.push(Slot::Marker(name.clone()));
                Ok(1)
            }
            Step::SlipMarker => {
                self.needles.right.extend(self.needles.left.pop());
                Ok(1)
            }
            Step::RemoveMarker => {
                self.needles.left.pop();
                Ok(1)
            }
            Step::Turn => {
                if next.is_some() {
                    return Err(Problem::new(place, "more after a turn", "the next row"));
                }
                self.no_chain(place)?;
                self.turn_short(place)?;
                Ok(1)
            }
            Step::Hold(n, name) => {
                let slots = self.pass_loops(*n);
                self.put_aside(slots, name, place)?;
                Ok(1)
            }
            Step::From(name) => {
                let mut slots = self.held.remove(name).unwrap_or_default().slots;
                if self.right_side {
                    slots.reverse();
                }
                self.needles.left.extend(slots);
                Ok(1)
            }
            Step::With(colour) => {
                self.colour = *colour;
                Ok(1)
            }
        }
    }

    /// Takes so many loops off the left needle; markers before them go over.
    fn take(&mut self, n: usize) -> Vec<Loop> {
        let mut taken = Vec::with_capacity(n);
        while taken.len() < n {
            match self.needles.left.pop() {
                Some(Slot::Loop(l)) => taken.push(l),
                Some(marker) => self.needles.right.push(marker),
                None => break,
            }
        }
        taken
    }

    /// Takes so many loops with the markers between them, in the order of right-side rows.
    fn pass_loops(&mut self, n: usize) -> Vec<Slot> {
        let mut slots = Vec::new();
        while stitches(&slots) < n {
            match self.needles.left.pop() {
                Some(slot) => slots.push(slot),
                None => break,
            }
        }
        if !self.right_side {
            slots.reverse();
        }
        slots
    }

    fn no_chain(&self, place: Place) -> Result<(), Problem> {
        match self.tip {
            Some(Tip { chain: true, .. }) => Err(Problem::new(
                place,
                "something else after a bind-off",
                "a knit or purl stitch to hold it",
            )),
            _ => Ok(()),
        }
    }

    fn work(
        &mut self,
        stitch: Stitch,
        colour: Option<u16>,
        next: Option<&Step>,
        place: Place,
    ) -> Result<usize, Problem> {
        let rs = self.right_side;
        let plain = |s: Stitch| matches!(s, Stitch::Knit | Stitch::Purl);
        let chain = self.tip.is_some_and(|t| t.chain);
        if chain && !plain(stitch) {
            self.no_chain(place)?;
        }
        let following = match next {
            Some(Step::Work(s, c)) if *c == colour => Some(*s),
            _ => None,
        };
        let single = matches!(self.needles.left.last(), Some(Slot::Loop(Loop { layers: Layers::One, .. })));
        // A loop of the bare yarn shares the face of the plain stitch before it, else of the one after it.
        if plain(stitch)
            && !chain
            && single
            && let Some(make) = following.filter(|s| s.takes() == 0)
        {
            let side = if rs { Side::Left } else { Side::Right };
            self.face(make.merged(stitch, rs, side), 1, &["+lX"; 2], Layers::One, place);
            self.made.worked += 2;
            return Ok(2);
        }
        if stitch.takes() == 0
            && single
            && let Some(knit) = following.filter(|s| plain(*s))
        {
            let side = if rs { Side::Right } else { Side::Left };
            self.face(stitch.merged(knit, rs, side), 1, &["+lX"; 2], Layers::One, place);
            self.made.worked += 2;
            return Ok(2);
        }
        let layers = self.next_layers(stitch.takes());
        let name = match (layers, stitch.shows_knit(rs)) {
            (Layers::One, _) => stitch.template(rs),
            (Layers::TuckBehind, true) if plain(stitch) && !chain => "knittuck",
            (Layers::TuckInFront, false) if plain(stitch) && !chain => "purltuck",
            (layers, _) => {
                let other = if (layers == Layers::TuckBehind) == rs { "knit" } else { "purl" };
                return Err(Problem::new(
                    place,
                    "another stitch on a tucked one",
                    format_args!("a plain {other} stitch, which holds the tucked yarn"),
                ));
            }
        };
        self.made.worked += stitch.leaves();
        if chain {
            let name = if stitch.shows_knit(rs) { "bind-off-next" } else { "purl-bind-off-next" };
            self.face_with(name, 1, &["+lX"], ["cX", "yX"], Layers::One, place);
            return Ok(1);
        }
        let made = match stitch {
            Stitch::Tuck if rs => Layers::TuckBehind,
            Stitch::Tuck => Layers::TuckInFront,
            _ => Layers::One,
        };
        let tops = vec!["+lX"; stitch.leaves()];
        self.face(name, stitch.takes(), &tops, made, place);
        Ok(1)
    }

    /// What the next loops consist of: the first that is more than a loop.
    fn next_layers(&self, n: usize) -> Layers {
        let loops = self.needles.left.iter().rev().filter_map(Slot::as_loop).take(n);
        loops.map(|l| l.layers).find(|l| *l != Layers::One).unwrap_or(Layers::One)
    }

    fn face(&mut self, name: &str, bottoms: usize, tops: &[&str], layers: Layers, place: Place) -> u32 {
        self.face_with(name, bottoms, tops, ["yX", "yX"], layers, place)
    }

    /// Adds a stitch: it takes loops from the left needle, goes on with the yarn, and puts its own loops onto the right.
    fn face_with(
        &mut self,
        name: &str,
        bottoms: usize,
        tops: &[&str],
        sides: [&str; 2],
        layers: Layers,
        place: Place,
    ) -> u32 {
        let direction = self.direction();
        let loops = self.take(bottoms);
        let stitch = NewStitch { name, direction, bottoms, tops, sides, place, colour: self.colour };
        let face = self.fabric.stitch(stitch);
        for (k, below) in loops.iter().enumerate() {
            let k = if direction == Direction::Left { bottoms - 1 - k } else { k };
            self.fabric.join(below.edge, edge(face, k as u32));
        }
        self.go_on(face, direction, sides[1] == "cX", place);
        let numbers = bottoms as u32 + 1..bottoms as u32 + 1 + tops.len() as u32;
        let loops = numbers
            .zip(tops)
            .filter(|(_, label)| **label != "x")
            .map(|(k, _)| Slot::Loop(Loop { edge: edge(face, k), layers }));
        let mut loops: Vec<Slot> = loops.collect();
        if direction == Direction::Right {
            loops.reverse();
        }
        self.needles.right.extend(loops);
        face
    }

    /// The yarn goes through a face.
    fn go_on(&mut self, face: u32, direction: Direction, chain: bool, place: Place) {
        let record = self.fabric.faces[face as usize];
        let (comes, goes) = match direction {
            Direction::Left => (record.right(), record.left()),
            Direction::Right => (record.left(), record.right()),
        };
        match self.tip {
            Some(tip) => self.fabric.join(tip.edge, edge(face, comes)),
            None => self.yarn_begins(edge(face, comes), direction, place),
        }
        self.tip = Some(Tip { edge: edge(face, goes), direction, chain });
    }

    fn bind_off(&mut self, more: bool, place: Place) -> Result<(), Problem> {
        let chain = self.tip.is_some_and(|t| t.chain);
        if self.next_layers(1) != Layers::One {
            return Err(Problem::new(place, "a bind-off on a tucked stitch", "a row that knits it first"));
        }
        let last = !more && stitches(&self.needles.left) == 1;
        let name = match (chain, last) {
            (false, false) => "bind-off-first",
            (true, false) => "bind-off",
            (true, true) => "bind-off-last",
            (false, true) => "bind-off-only",
        };
        let name = if self.right_side { name.to_string() } else { format!("purl-{name}") };
        let side = |chain| if chain { "cX" } else { "yX" };
        self.face_with(&name, 1, &["x"], [side(chain), side(!last)], Layers::One, place);
        self.made.bound_off += 1;
        if last {
            self.cut(place);
        }
        Ok(())
    }
}
