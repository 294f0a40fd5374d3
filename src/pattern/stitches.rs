//! How many stitches a pattern holds, read off its yarn.

use super::Pattern;
use glam::{DVec3, UVec2};

/// How far a row's yarn goes up and down at least, in heights of a row: loops reach into the next row, woven yarn does not.
const LOOPS: f64 = 0.5;

impl Pattern {
    /// Stitches along the course and rows along the wale of one period, where all yarn is rows of as many loops: plain knits and
    /// ribs. `None` for wovens, and for knits with tucks and slips, whose rows differ.
    pub fn stitches(&self) -> Option<UVec2> {
        let links = self.links().ok()?;
        let mut seen = vec![false; self.vertex_count()];
        let (mut rows, mut columns, mut least) = (0, None, f64::INFINITY);
        for start in 0..self.vertex_count() {
            if seen[start] {
                continue;
            }
            let (mut row, mut at, mut tile) = (Vec::new(), start, glam::IVec2::ZERO);
            loop {
                seen[at] = true;
                row.push(self.places[at] + (tile.as_dvec2() * self.size).extend(0.0));
                let edge = self.edges[links.leaving[at] as usize];
                (at, tile) = (edge.to as usize, tile + edge.tile);
                if at == start {
                    break;
                }
            }
            if tile.x.abs() != 1 || tile.y != 0 {
                return None;
            }
            let loops = loops(&row);
            if columns.is_some_and(|c| c != loops) {
                return None;
            }
            columns = Some(loops);
            let extent = |f: fn(f64, f64) -> f64, from: f64| row.iter().map(|p| p.y).fold(from, f);
            least = least.min(extent(f64::max, f64::NEG_INFINITY) - extent(f64::min, f64::INFINITY));
            rows += 1;
        }
        let columns = columns.filter(|c| *c > 0)?;
        (least > LOOPS * self.size.y / f64::from(rows)).then(|| UVec2::new(columns, rows))
    }
}

/// Heads of loops in a closed row: where it turns back from up to down.
fn loops(row: &[DVec3]) -> u32 {
    let n = row.len();
    (0..n).filter(|i| row[*i].y > row[(i + n - 1) % n].y && row[*i].y >= row[(i + 1) % n].y).count() as u32
}
