//! Charts: a grid of stitches as the front of the fabric shows them, its first row at the bottom.

use super::stitch::Stitch;
use super::token::Place;

/// A square of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// The stitch as right-side rows work it.
    pub stitch: Stitch,
    /// Number of its colour, if it has one of its own.
    pub colour: Option<u16>,
    /// Where it stands in the chart's file (of pictures: row and column of pixels).
    pub place: Place,
}

/// A chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// `[row][column]` from the bottom, each from left to right as it is drawn.
    pub rows: Vec<Vec<Cell>>,
}

impl Chart {
    /// The stitches of a row in the order of work. Right-side rows are read from right to left, wrong-side rows from left
    /// to right; what the front shows as a knit is purled there. Beyond the last row it begins again.
    pub fn row(&self, row: usize, right_side: bool) -> Vec<(Stitch, Option<u16>)> {
        let Some(cells) = self.rows.get(row % self.rows.len().max(1)) else { return Vec::new() };
        let turned =
            |cell: &Cell| (if right_side { cell.stitch } else { cell.stitch.from_behind() }, cell.colour);
        if right_side { cells.iter().rev().map(turned).collect() } else { cells.iter().map(turned).collect() }
    }
}
