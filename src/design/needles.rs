//! What is on the needles.

use crate::mesh::FaceEdge;

/// How many strands lie over the needle as one stitch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layers {
    /// A loop.
    One,
    /// A loop and a tucked one behind it, seen from the front.
    TuckBehind,
    /// A loop and a tucked one in front of it.
    TuckInFront,
}

/// A stitch on a needle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// The edge it leaves its face by.
    pub edge: FaceEdge,
    /// What it consists of.
    pub layers: Layers,
}

/// A place on a needle.
#[derive(Clone, Debug, PartialEq)]
pub enum Slot {
    /// A stitch.
    Loop(Loop),
    /// A marker and its name.
    Marker(String),
}

impl Slot {
    /// The loop, unless it is a marker.
    pub fn as_loop(&self) -> Option<Loop> {
        match self {
            Slot::Loop(l) => Some(*l),
            Slot::Marker(_) => None,
        }
    }
}

/// Two needles: the next stitch to be worked is the left one's last, the last one worked the right one's last.
#[derive(Clone, Debug, Default)]
pub struct Needles {
    /// Yet to be worked.
    pub left: Vec<Slot>,
    /// Worked, or passed by.
    pub right: Vec<Slot>,
}

impl Needles {
    /// Stitches on both.
    pub fn stitches(&self) -> usize {
        stitches(&self.left) + stitches(&self.right)
    }

    /// The work is turned: what was worked last comes first.
    pub fn turn(&mut self) {
        std::mem::swap(&mut self.left, &mut self.right);
    }

    /// A round is over: the first stitch comes first again.
    pub fn round_ends(&mut self) {
        debug_assert!(self.left.is_empty());
        self.left = std::mem::take(&mut self.right);
        self.left.reverse();
    }

    /// Everything, in the order in which it would be worked from the very first; nothing is left.
    pub fn take_all(&mut self) -> Vec<Slot> {
        let mut all = std::mem::take(&mut self.right);
        all.extend(std::mem::take(&mut self.left).into_iter().rev());
        all
    }
}

/// Stitches among slots.
pub fn stitches(slots: &[Slot]) -> usize {
    slots.iter().filter(|s| matches!(s, Slot::Loop(_))).count()
}

/// Held stitches: off the needles, in the order in which right-side rows work them.
#[derive(Clone, Debug, Default)]
pub struct Held {
    /// The stitches and the markers between them.
    pub slots: Vec<Slot>,
}
