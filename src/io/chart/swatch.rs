//! A chart alone, knit flat: cast on what its first row uses, all rows, bind off.

use super::{Drawing, DrawnRow, read_file};
use crate::design::chart::Chart;
use crate::design::expression::Expression;
use crate::design::stitch::Stitch;
use crate::design::syntax::{Content, Item, ItemKind, Row, Statement, StatementKind, Times};
use crate::design::token::Place;
use crate::design::{Files, Knitted, Settings, knit_statements};
use crate::{Error, Result};
use std::path::Path;

/// Stitches of a swatch at most, its borders among them.
pub const MOST_STITCHES: usize = 50_000_000;

/// How much of a chart is knit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Swatch {
    /// How often the chart is worked side by side.
    pub columns: usize,
    /// How often it is worked one above the other.
    pub rows: usize,
    /// Stitches and rows of garter around it.
    pub border: usize,
}

impl Default for Swatch {
    fn default() -> Self {
        Self { columns: 1, rows: 1, border: 0 }
    }
}

/// Reads a chart and knits it.
///
/// # Errors
/// As [`read_file`] and [`knit`].
pub fn knit_file(path: &Path, settings: &Settings, swatch: Swatch) -> Result<Knitted> {
    knit(path, &read_file(path)?, settings, swatch)
}

/// Knits a chart that was read before; `path` is for messages.
///
/// # Errors
/// The first row that does not use what the row below makes, and stitches that cannot be worked, by line and column of the
/// chart (of pictures: row and column of pixels).
pub fn knit(path: &Path, drawing: &Drawing, settings: &Settings, swatch: Swatch) -> Result<Knitted> {
    let widest = drawing.rows.iter().map(|r| r.squares.len().max(takes(r))).max().unwrap_or(0);
    let wide = widest.saturating_mul(swatch.columns).saturating_add(swatch.border.saturating_mul(2));
    let tall = drawing.rows.len().saturating_mul(swatch.rows).saturating_add(swatch.border.saturating_mul(2));
    if swatch.columns == 0 || swatch.rows == 0 || wide.saturating_mul(tall) > MOST_STITCHES {
        return Err(Error::invalid(format_args!(
            "{}: found a swatch of {wide} stitches x {tall} rows, expected 1 to {MOST_STITCHES} stitches",
            path.display()
        )));
    }
    check(path, drawing, swatch)?;
    let statements = statements(drawing, swatch);
    knit_statements(path, &statements, settings, &Alone { path, drawing })
}

/// Loops that a row uses.
fn takes(row: &DrawnRow) -> usize {
    row.squares.iter().map(|s| s.stitch.takes()).sum()
}

/// Each row uses what the one below makes.
fn check(path: &Path, drawing: &Drawing, swatch: Swatch) -> Result<()> {
    let leaves = |row: &DrawnRow| row.squares.iter().map(|s| s.stitch.leaves()).sum::<usize>();
    let rows = drawing.rows.len();
    let pairs = if swatch.rows > 1 { rows } else { rows - 1 };
    for below in 0..pairs {
        let above = (below + 1) % rows;
        let (made, row) = (leaves(&drawing.rows[below]), &drawing.rows[above]);
        let used = takes(row);
        if made != used {
            return Err(Error::input(
                path,
                row.place.line as usize,
                row.place.column as usize,
                format_args!("row {} that uses {used} stitches", above + 1),
                format_args!("{made}, as row {} makes", below + 1),
            ));
        }
    }
    Ok(())
}

const NAME: &str = "chart";

/// The swatch as a pattern would say it.
fn statements(drawing: &Drawing, swatch: Swatch) -> Vec<Statement> {
    let number = |n: usize| Expression::Number(n as f64);
    let (first, last) = (drawing.rows[0].place, drawing.rows[drawing.rows.len() - 1].place);
    let knit = |times: Times, place: Place| Item { place, kind: ItemKind::Work(Stitch::Knit, times) };
    let row = |place: Place, numbers: Vec<(Expression, Option<Expression>)>, items: Vec<Item>| {
        let content = Content::Items(items);
        let row = Row { round: false, numbers, right_side: None, content, count: None };
        Statement { place, kind: StatementKind::Row(Box::new(row)) }
    };
    let cast_on = takes(&drawing.rows[0]) * swatch.columns + 2 * swatch.border;
    let mut statements = vec![
        Statement { place: first, kind: StatementKind::Chart(NAME.into(), NAME.into()) },
        Statement { place: first, kind: StatementKind::CastOn(number(cast_on), false) },
    ];
    let garter = |place| row(place, Vec::new(), vec![knit(Times::ToEnd, place)]);
    statements.extend((0..swatch.border).map(|_| garter(first)));
    for k in 0..swatch.rows * drawing.rows.len() {
        let place = drawing.rows[k % drawing.rows.len()].place;
        let chart = Item { place, kind: ItemKind::Chart(NAME.into()) };
        let mut items = vec![Item { place, kind: ItemKind::Group(vec![chart], number(swatch.columns)) }];
        if swatch.border > 0 {
            items.insert(0, knit(Times::Count(number(swatch.border)), place));
            items.push(knit(Times::Count(number(swatch.border)), place));
        }
        statements.push(row(place, vec![(number(k + 1), None)], items));
    }
    statements.extend((0..swatch.border).map(|_| garter(last)));
    statements.push(Statement { place: last, kind: StatementKind::BindOff });
    statements
}

/// The chart itself is the only file there is.
struct Alone<'a> {
    path: &'a Path,
    drawing: &'a Drawing,
}

impl Files for Alone<'_> {
    fn chart(&self, _file: &str, colour: &mut dyn FnMut([u8; 3]) -> u16) -> Result<Chart> {
        Ok(Chart { alone: true, ..self.drawing.chart(self.path, colour)? })
    }
}
