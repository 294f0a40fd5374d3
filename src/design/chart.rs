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
    /// The chart is all there is, no pattern names it: stitches come from its squares' places.
    pub alone: bool,
}

impl Chart {
    /// The squares of a row in the order of work. Right-side rows are read from right to left, wrong-side rows from left
    /// to right; what the front shows as a knit is purled there. Beyond the last row it begins again.
    pub fn row(&self, row: usize, right_side: bool) -> Vec<Cell> {
        let Some(cells) = self.rows.get(row % self.rows.len().max(1)) else { return Vec::new() };
        let behind = |cell: &Cell| Cell { stitch: cell.stitch.from_behind(), ..*cell };
        if right_side { cells.iter().rev().copied().collect() } else { cells.iter().map(behind).collect() }
    }
}
