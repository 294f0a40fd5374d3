//! Beginnings and ends of pieces, and how they are put together.

use super::Knitter;
use crate::design::expression::Problem;
use crate::design::fabric::{Direction, NewStitch, PieceRecord, edge};
use crate::design::needles::{Held, Layers, Loop, Slot, stitches};
use crate::design::syntax::Edge;
use crate::design::token::Place;
use crate::mesh::StitchType;

impl Knitter {
    /// Begins a piece.
    ///
    /// # Errors
    /// Stitches are still on the needles.
    pub fn begin_piece(&mut self, piece: PieceRecord, place: Place) -> Result<(), Problem> {
        self.needles_empty(place)?;
        if self.fabric.pieces.iter().any(|p| p.name == piece.name) {
            return Err(Problem::new(place, format_args!("a second piece '{}'", piece.name), "another name"));
        }
        self.cut(place);
        self.fabric.pieces.push(piece);
        self.right_side = true;
        self.turned = true;
        Ok(())
    }

    /// Nothing may be left when a piece or the pattern ends.
    pub fn needles_empty(&self, place: Place) -> Result<(), Problem> {
        match self.needles.stitches() {
            0 => Ok(()),
            n => Err(Problem::new(
                place,
                format_args!("{n} stitches still on the needles"),
                "bo, draw, hold or graft before this",
            )),
        }
    }

    /// Casts on: the first row of a piece, or more stitches where the yarn is.
    pub fn cast_on(&mut self, n: usize, place: Place) -> Result<(), Problem> {
        let begin = self.fabric.faces.len();
        self.no_chain(place)?;
        let first = self.needles.stitches() == 0 && self.tip.is_none();
        if !first && (self.turned || self.tip.is_none()) {
            // Where the yarn is cut, or the next row is begun, there is no telling on which needle they would go.
            return Err(Problem::new(
                place,
                "a cast-on between rows, with no yarn at the end of one",
                "co N within a row",
            ));
        }
        let direction = match self.tip {
            Some(tip) => tip.direction,
            None if self.round() => Direction::Left,
            None => Direction::Right,
        };
        self.check_size(n, place)?;
        for _ in 0..n {
            self.cast_on_one(direction, place);
        }
        if first {
            self.turned = false;
        }
        let closed = first && self.round();
        self.record(begin, direction, closed, false, place);
        Ok(())
    }

    pub(super) fn cast_on_one(&mut self, direction: Direction, place: Place) {
        let stitch = NewStitch {
            name: "tuck-twist",
            direction,
            bottoms: 1,
            tops: &["+lX"],
            sides: ["yX", "yX"],
            place,
            colour: self.colour,
        };
        let face = self.fabric.stitch(stitch);
        self.go_on(face, direction, false, place);
        self.needles.right.push(Slot::Loop(Loop { edge: edge(face, 2), layers: Layers::One }));
        self.made.cast_on += 1;
    }

    /// The yarn is cut and drawn through everything on the needles.
    pub fn draw(&mut self, place: Place) -> Result<(), Problem> {
        self.prepare();
        self.no_chain(place)?;
        let n = stitches(&self.needles.left);
        if n == 0 || !self.needles.right.is_empty() {
            return Err(Problem::new(
                place,
                "nothing to draw the yarn through",
                "stitches on the needles, a row ended",
            ));
        }
        let begin = self.fabric.faces.len();
        let direction = self.direction();
        if let Some(tip) = self.tip.filter(|t| !self.round() && t.direction != direction) {
            self.turn_at_edge(tip, place);
        }
        self.needles.left.retain(|s| matches!(s, Slot::Loop(_)));
        for _ in 0..n {
            if self.next_layers(1) != Layers::One {
                return Err(Problem::new(place, "a tucked stitch", "a row that knits it first"));
            }
            // A round's last stitch meets its first one's corner; that one is a quad, so that neither collapses.
            if self.round() && self.fabric.faces.len() == begin {
                self.face("hold", 1, &["x"], Layers::One, place);
            } else {
                self.face("draw", 1, &[], Layers::One, place);
            }
            self.made.drawn += 1;
        }
        let closed = self.round();
        if closed {
            // The end stays in the middle of the drawn-in round, where a border would have no room.
            self.tip = None;
        } else {
            self.cut(place);
        }
        self.record(begin, direction, closed, false, place);
        self.turned = true;
        Ok(())
    }

    /// Takes stitches off the needles as they are: so many of those that come next, or all.
    pub fn hold(&mut self, n: Option<usize>, name: &str, place: Place) -> Result<(), Problem> {
        self.prepare();
        self.no_chain(place)?;
        let slots = match n {
            None => {
                let mut all = self.needles.take_all();
                if !self.right_side {
                    all.reverse();
                }
                all
            }
            Some(n) => {
                let left = stitches(&self.needles.left);
                if left < n {
                    return Err(Problem::new(
                        place,
                        format_args!("{left} stitches"),
                        format_args!("the {n} to be held"),
                    ));
                }
                self.pass_loops(n)
            }
        };
        self.put_aside(slots, name, place)
    }

    pub(super) fn put_aside(&mut self, slots: Vec<Slot>, name: &str, place: Place) -> Result<(), Problem> {
        if self.held.contains_key(name) {
            return Err(Problem::new(
                place,
                format_args!("held stitches named '{name}' already"),
                "another name",
            ));
        }
        self.held.insert(name.to_string(), Held { slots });
        Ok(())
    }

    fn held(&mut self, name: &str, place: Place) -> Result<Held, Problem> {
        self.held.remove(name).ok_or_else(|| {
            let known: Vec<&str> = self.held.keys().map(String::as_str).collect();
            let known = if known.is_empty() { "none are held".into() } else { known.join(", ") };
            Problem::new(place, format_args!("'{name}'"), format_args!("the name of held stitches ({known})"))
        })
    }

    /// Puts held stitches onto the left needle, to be worked next.
    pub fn take_up(&mut self, name: &str, place: Place) -> Result<(), Problem> {
        self.prepare();
        let mut slots = self.held(name, place)?.slots;
        if self.right_side {
            slots.reverse();
        }
        self.needles.left.extend(slots);
        Ok(())
    }

    /// Joins two lots of held stitches, both fronts up, with a yarn through both: one of its own, or a tail that was left
    /// before the first stitch of `a`. Then its end is woven in, for where knitting in the round is closed there is
    /// no room for another.
    pub fn graft(&mut self, a: &str, b: &str, tail: Option<&str>, place: Place) -> Result<(), Problem> {
        let mut lots = [self.held(a, place)?, self.held(b, place)?]
            .map(|held| held.slots.iter().filter_map(Slot::as_loop).collect::<Vec<Loop>>());
        let counts = [lots[0].len(), lots[1].len()];
        if counts[0] != counts[1] || counts[0] == 0 {
            return Err(Problem::new(
                place,
                format_args!("{} stitches of '{a}' and {} of '{b}'", counts[0], counts[1]),
                "as many of each",
            ));
        }
        if lots.iter().flatten().any(|l| l.layers != Layers::One) {
            return Err(Problem::new(place, "a tucked stitch", "a row that knits it first"));
        }
        // Face to face, the other piece's stitches run the other way.
        lots[1].reverse();
        let working = self.tip;
        self.tip = match tail {
            None => None,
            Some(name) => match self.tails.remove(name) {
                Some(tip) if tip.direction == Direction::Left => Some(tip),
                Some(_) => {
                    return Err(Problem::new(
                        place,
                        "a tail of a wrong-side row",
                        "one that ends at the left",
                    ));
                }
                None => {
                    let known: Vec<&str> = self.tails.keys().map(String::as_str).collect();
                    let known = if known.is_empty() { "there are none".into() } else { known.join(", ") };
                    return Err(Problem::new(
                        place,
                        format_args!("'{name}'"),
                        format_args!("the name of a tail ({known})"),
                    ));
                }
            },
        };
        let side = std::mem::replace(&mut self.right_side, true);
        for (below, above) in lots[0].iter().zip(&lots[1]) {
            let stitch = NewStitch {
                name: "seam",
                direction: Direction::Left,
                bottoms: 1,
                tops: &["-lX"],
                sides: ["yX", "yX"],
                place,
                colour: self.colour,
            };
            let face = self.fabric.stitch(stitch);
            self.fabric.faces[face as usize].in_row = false;
            self.fabric.join(below.edge, edge(face, 0));
            self.fabric.join(above.edge, edge(face, 2));
            self.go_on(face, Direction::Left, false, place);
            self.made.grafted += 1;
        }
        if tail.is_none() {
            self.cut(place);
        }
        self.tip = working;
        self.right_side = side;
        Ok(())
    }

    /// Draws loops out of a flat piece's edge, one where the yarn turns, and holds them.
    pub fn pick_up(&mut self, name: &str, side: Edge, piece: &str, place: Place) -> Result<(), Problem> {
        let Some(number) = self.fabric.pieces.iter().position(|p| p.name == piece) else {
            let known: Vec<&str> = self.fabric.pieces.iter().map(|p| p.name.as_str()).collect();
            let known = if known.is_empty() { "there are none".into() } else { known.join(", ") };
            return Err(Problem::new(
                place,
                format_args!("'{piece}'"),
                format_args!("the name of a piece ({known})"),
            ));
        };
        let (old, key, out) = match side {
            Edge::Right => ("edge)", "pick-up-edge) x +lX x +y1 -y1", 1),
            Edge::Left => ("edge(", "pick-up-edge( x -y1 +y1 x +lX", 4),
        };
        let mut words = key.split(' ').map(str::to_string);
        let stitch = StitchType { name: words.next().unwrap_or_default(), labels: words.collect() };
        let mut slots = Vec::new();
        for k in 0..self.fabric.turns.len() {
            let (face, of, at) = self.fabric.turns[k];
            let now = self.fabric.faces[face as usize].stitch as usize;
            if of as usize == number && at == side && self.fabric.types[now].name == old {
                self.fabric.faces[face as usize].stitch = self.fabric.stitch_type(stitch.clone());
                slots.push(Slot::Loop(Loop { edge: edge(face, out), layers: Layers::One }));
            }
        }
        if slots.is_empty() {
            return Err(Problem::new(
                place,
                format_args!(
                    "no {} edge of '{piece}' that is free",
                    if side == Edge::Left { "left" } else { "right" }
                ),
                "a flat piece, whose edges can be picked up once",
            ));
        }
        // The right edge is worked from the bottom, the left one from the top.
        if side == Edge::Left {
            slots.reverse();
        }
        self.put_aside(slots, name, place)
    }
}
