//! What is beside the stitches: yarn that turns, begins and ends.

use super::{Knitter, Tip};
use crate::design::expression::Problem;
use crate::design::fabric::{Direction, edge};
use crate::design::needles::{Layers, Loop, Slot};
use crate::design::syntax::Edge;
use crate::design::token::Place;
use crate::mesh::FaceEdge;

impl Knitter {
    /// The yarn goes around the side of flat knitting into the row above.
    pub(super) fn turn_at_edge(&mut self, tip: Tip, place: Place) {
        let (key, side, comes, goes) = match tip.direction {
            Direction::Right => ("edge) x x x +y1 -y1", Edge::Right, 4, 3),
            Direction::Left => ("edge( x -y1 +y1 x x", Edge::Left, 1, 2),
        };
        let face = self.fabric.border(key, place, self.colour);
        self.fabric.join(tip.edge, edge(face, comes));
        let piece = self.fabric.pieces.len().saturating_sub(1) as u32;
        self.fabric.turns.push((face, piece, side));
        self.tip = Some(Tip { edge: edge(face, goes), direction: tip.direction.turned(), chain: false });
    }

    /// A short row turns within the next stitch, whose loop goes on as it is.
    pub(super) fn turn_short(&mut self, place: Place) -> Result<(), Problem> {
        let direction = self.direction();
        let mut markers = Vec::new();
        let next = loop {
            match self.needles.left.pop() {
                Some(Slot::Loop(l)) => break Some(l),
                Some(marker) => markers.push(marker),
                None => break None,
            }
        };
        let Some(next) = next else {
            return Err(Problem::new(
                place,
                "a turn with no stitch ahead",
                "at least one stitch before the row's end",
            ));
        };
        if next.layers != Layers::One {
            return Err(Problem::new(place, "a turn at a tucked stitch", "a plain stitch ahead"));
        }
        let Some(tip) = self.tip else {
            return Err(Problem::new(place, "a turn before the first stitch", "stitches, then the turn"));
        };
        let (key, [comes, goes, out]) = match direction {
            Direction::Left => ("turn))( -lX -yX +yX +lX", [1, 2, 3]),
            Direction::Right => ("turn)(( -lX +lX +yX -yX", [3, 2, 1]),
        };
        let face = self.fabric.border(key, place, self.colour);
        self.fabric.join(next.edge, edge(face, 0));
        self.fabric.join(tip.edge, edge(face, comes));
        self.needles.left.push(Slot::Loop(Loop { edge: edge(face, out), layers: Layers::One }));
        self.needles.left.extend(markers.into_iter().rev());
        self.tip = Some(Tip { edge: edge(face, goes), direction: direction.turned(), chain: false });
        self.needles.turn();
        self.right_side = !self.right_side;
        Ok(())
    }

    /// A new yarn comes in at an edge.
    pub(super) fn yarn_begins(&mut self, at: FaceEdge, direction: Direction, place: Place) {
        let (key, goes) = match direction {
            Direction::Left => ("in- x x +yX", 2),
            Direction::Right => ("in+ x +yX x", 1),
        };
        let face = self.fabric.border(key, place, self.colour);
        self.fabric.join(edge(face, goes), at);
    }

    /// The yarn is cut, long enough for a graft that goes on from here.
    ///
    /// # Errors
    /// There is no yarn, or a tail of this name.
    pub fn leave_tail(&mut self, name: &str, place: Place) -> Result<(), Problem> {
        self.no_chain(place)?;
        if self.tails.contains_key(name) {
            return Err(Problem::new(place, format_args!("a second tail '{name}'"), "another name"));
        }
        match self.tip.take() {
            Some(tip) => self.tails.insert(name.to_string(), tip),
            None => return Err(Problem::new(place, "a tail where no yarn is", "stitches before it")),
        };
        Ok(())
    }

    /// Tails that no graft used are left as they are.
    pub fn trim_tails(&mut self, place: Place) {
        for (_, tip) in std::mem::take(&mut self.tails) {
            let working = self.tip.replace(tip);
            self.cut(place);
            self.tip = working;
        }
    }

    /// The yarn is cut, and its end left.
    pub fn cut(&mut self, place: Place) {
        let Some(tip) = self.tip.take() else { return };
        let (key, comes) = match tip.direction {
            Direction::Left => ("out- x -yX x", 1),
            Direction::Right => ("out+ x x -yX", 2),
        };
        let face = self.fabric.border(key, place, self.colour);
        self.fabric.join(tip.edge, edge(face, comes));
    }
}
