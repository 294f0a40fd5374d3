//! Faces and how they are joined, as they come off the needles, before anything has a place in space.

use super::syntax::Edge;
use super::token::Place;
use crate::ids::FaceId;
use crate::mesh::{FaceEdge, StitchType};
use glam::DVec3;
use std::collections::HashMap;

/// Which way the yarn goes, seen from the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Right-side rows, and all rounds.
    Left,
    /// Wrong-side rows.
    Right,
}

impl Direction {
    /// The other one.
    pub fn turned(self) -> Self {
        match self {
            Direction::Left => Direction::Right,
            Direction::Right => Direction::Left,
        }
    }
}

/// A face: what it is and where in the pattern it comes from. Its corners go around counter-clockwise: along the
/// bottom from left to right, up the right side, along the top from right to left.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Number of its stitch type.
    pub stitch: u32,
    /// Edges along the bottom.
    pub bottoms: u8,
    /// Edges along the top.
    pub tops: u8,
    /// Whether it is one of a row's stitches, else a border.
    pub in_row: bool,
    /// Where its instruction stands.
    pub place: Place,
    /// Number of its colour.
    pub colour: u16,
}

/// How the faces of a row lie.
#[derive(Clone, Debug)]
pub struct RowRecord {
    /// Its faces in the order of work, borders among them.
    pub faces: std::ops::Range<usize>,
    /// Which way it was worked.
    pub direction: Direction,
    /// It goes all the way around.
    pub closed: bool,
    /// A short row: it ends in a turn before the edge.
    pub short: bool,
    /// Number of its piece.
    pub piece: u32,
    /// Loops that it made, was left with, or passed on as they were.
    pub stitches: usize,
    /// Where its statement stands.
    pub place: Place,
}

/// Where a piece lies.
#[derive(Clone, Debug)]
pub struct PieceRecord {
    /// Its name.
    pub name: String,
    /// In the round.
    pub round: bool,
    /// Flat, but rolled into a tube where it is placed, for its sides to be joined.
    pub curled: bool,
    /// The middle of its first row.
    pub at: DVec3,
    /// Where its rows grow, a unit vector.
    pub toward: DVec3,
    /// From the middle to where its rows begin, a unit vector across `toward`.
    pub start: DVec3,
}

/// Everything that was knitted.
#[derive(Clone, Debug)]
pub struct Fabric {
    /// Stitch types.
    pub types: Vec<StitchType>,
    /// Faces in the order of work.
    pub faces: Vec<Face>,
    /// Pairs of edges that are one; each begins where the other ends.
    pub joins: Vec<[FaceEdge; 2]>,
    /// Borders where the yarn turns, in the order of work: face, piece, which side.
    pub turns: Vec<(u32, u32, Edge)>,
    /// Rows in the order of work.
    pub rows: Vec<RowRecord>,
    /// Pieces.
    pub pieces: Vec<PieceRecord>,
    /// Colours; the first is that of yarn without one.
    pub colours: Vec<[u8; 3]>,
    known: HashMap<StitchType, u32>,
}

impl Face {
    /// Number of corners: bottom, sides (two unless the bottom or top is a single point), top.
    pub fn corners(&self) -> usize {
        usize::from(self.bottoms) + usize::from(self.tops) + 2
    }

    /// The edge on its right.
    pub fn right(&self) -> u32 {
        u32::from(self.bottoms)
    }

    /// The edge on its left.
    pub fn left(&self) -> u32 {
        self.corners() as u32 - 1
    }
}

/// Colour of yarn that has none of its own: undyed wool.
const UNDYED: [u8; 3] = [0xc9, 0xc2, 0xb4];

impl Default for Fabric {
    fn default() -> Self {
        Self {
            types: Vec::new(),
            faces: Vec::new(),
            joins: Vec::new(),
            turns: Vec::new(),
            rows: Vec::new(),
            pieces: Vec::new(),
            colours: vec![UNDYED],
            known: HashMap::new(),
        }
    }
}

impl Fabric {
    /// Adds a stitch: its name gets the sign of the direction, its sides the labels of yarn coming in and going out.
    pub fn stitch(&mut self, stitch: NewStitch) -> u32 {
        let NewStitch { name, direction, bottoms, tops, sides: [comes, goes], place, colour } = stitch;
        let (sign, right, left) = match direction {
            Direction::Left => ('-', format!("-{comes}"), format!("+{goes}")),
            Direction::Right => ('+', format!("+{goes}"), format!("-{comes}")),
        };
        let mut labels = vec!["-lX".to_string(); bottoms];
        labels.push(right);
        labels.extend(tops.iter().map(ToString::to_string));
        labels.push(left);
        let stitch = self.stitch_type(StitchType { name: format!("{name}{sign}"), labels });
        let (bottoms, tops) = (bottoms as u8, tops.len() as u8);
        self.faces.push(Face { stitch, bottoms, tops, in_row: true, place, colour });
        self.faces.len() as u32 - 1
    }

    /// Adds a border face by its key.
    pub fn border(&mut self, key: &str, place: Place, colour: u16) -> u32 {
        let mut words = key.split(' ').map(str::to_string);
        let name = words.next().unwrap_or_default();
        let labels: Vec<String> = words.collect();
        let corners = labels.len() as u8;
        let stitch = self.stitch_type(StitchType { name, labels });
        self.faces.push(Face { stitch, bottoms: 1, tops: corners - 3, in_row: false, place, colour });
        self.faces.len() as u32 - 1
    }

    /// Number of a stitch type.
    pub fn stitch_type(&mut self, stitch: StitchType) -> u32 {
        if let Some(&known) = self.known.get(&stitch) {
            return known;
        }
        let number = self.types.len() as u32;
        self.types.push(stitch.clone());
        self.known.insert(stitch, number);
        number
    }

    /// Whether a border holds loops that were picked up.
    pub fn is_pick_up(&self, face: usize) -> bool {
        self.types[self.faces[face].stitch as usize].name.starts_with("pick-up")
    }

    /// Joins two edges.
    pub fn join(&mut self, a: FaceEdge, b: FaceEdge) {
        self.joins.push([a, b]);
    }
}

/// A stitch to be added.
pub struct NewStitch<'a> {
    /// The template's name without the sign of the direction.
    pub name: &'a str,
    /// Which way the yarn goes.
    pub direction: Direction,
    /// Loops that it takes.
    pub bottoms: usize,
    /// Labels of the top edges from right to left.
    pub tops: &'a [&'a str],
    /// Types of the edges where the yarn comes in and goes out.
    pub sides: [&'a str; 2],
    /// Where it stands in the pattern.
    pub place: Place,
    /// Number of its colour.
    pub colour: u16,
}

/// An edge of a face.
pub fn edge(face: u32, edge: u32) -> FaceEdge {
    FaceEdge { face: FaceId(face), edge }
}
