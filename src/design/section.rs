//! Rows by their numbers: in what order they are worked, and which are as others.

use super::expand::expand;
use super::expression::Problem;
use super::program::{Failure, MOST_STATEMENTS, Program};
use super::syntax::{Content, Repeat, Row, Until};
use super::token::Place;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// A row, where it stands, and the first number of its statement.
type Numbered = (Rc<Row>, Place, usize);

/// Rows that belong together by their numbers.
#[derive(Default)]
pub(super) struct Section {
    /// Rows by number; `Some` is worked already.
    rows: BTreeMap<usize, Numbered>,
    /// Rows yet to be worked, by number.
    waiting: BTreeSet<usize>,
    /// Number of the last row worked.
    last: usize,
}

impl Program<'_> {
    pub(super) fn row_statement(&mut self, row: &Row, place: Place) -> Result<(), Failure> {
        if row.numbers.is_empty() {
            self.end_section()?;
            return self.one_row(row, 1, true, place);
        }
        let mut numbers = Vec::new();
        for (first, last) in &row.numbers {
            let first = self.count(first, place)?;
            let last = last.as_ref().map_or(Ok(first), |l| self.count(l, place))?;
            // None at all, as in 1-0, may come of what was worked out.
            if first == 0 || last + 1 < first || numbers.len() + (last + 1 - first) > MOST_STATEMENTS {
                return Err(Problem::new(
                    place,
                    format_args!("rows {first} to {last}"),
                    "numbers from 1 upwards",
                )
                .into());
            }
            numbers.extend(first..=last);
        }
        let begins = numbers.first() == Some(&1) && !self.section.rows.is_empty();
        if begins {
            self.end_section()?;
        }
        let row = Rc::new(row.clone());
        let first = numbers.first().copied().unwrap_or(1);
        for number in numbers {
            if self.section.rows.insert(number, (row.clone(), place, first)).is_some() {
                return Err(
                    Problem::new(place, format_args!("row {number} a second time"), "each row once").into()
                );
            }
            self.section.waiting.insert(number);
        }
        Ok(())
    }

    /// Works what waits, in the order of the numbers.
    fn work_waiting(&mut self) -> Result<(), Failure> {
        while let Some(&number) = self.section.waiting.iter().next() {
            let place = self.section.rows[&number].1;
            if number != self.section.last + 1 {
                return Err(Problem::new(
                    place,
                    format_args!("row {number} after row {}", self.section.last),
                    format_args!("row {}", self.section.last + 1),
                )
                .into());
            }
            self.section.waiting.remove(&number);
            self.numbered_row(number, false, place)?;
            self.section.last = number;
        }
        Ok(())
    }

    pub(super) fn end_section(&mut self) -> Result<(), Failure> {
        self.work_waiting()?;
        self.section = Section::default();
        Ok(())
    }

    fn numbered_row(&mut self, number: usize, again: bool, place: Place) -> Result<(), Failure> {
        let mut wanted = number;
        // Rows may be as others, which may be as others again.
        for _ in 0..64 {
            let (row, at, first) = self.section.rows.get(&wanted).cloned().ok_or_else(|| {
                Problem::new(place, format_args!("row {wanted}, which is not there"), "a row of this section")
            })?;
            let Content::As(from, to) = &row.content else {
                return self.one_row(&row, wanted, !again, at);
            };
            let from = self.count(from, at)?;
            let to = to.as_ref().map_or(Ok(from), |t| self.count(t, at))?;
            if from == 0 || to < from {
                return Err(Problem::new(
                    at,
                    format_args!("rows {from} to {to}"),
                    "the numbers of rows before",
                )
                .into());
            }
            // Counted from the first row of the statement.
            let next = from + wanted.saturating_sub(first) % (to - from + 1);
            if next == wanted {
                return Err(Problem::new(at, format_args!("row {wanted} as itself"), "another row").into());
            }
            wanted = next;
        }
        Err(Problem::new(place, "rows that are as each other", "a row with instructions").into())
    }

    fn one_row(&mut self, row: &Row, chart_row: usize, counted: bool, place: Place) -> Result<(), Failure> {
        self.tick(place)?;
        let Content::Items(items) = &row.content else {
            return Err(Problem::new(place, "a row without number as another one", "instructions").into());
        };
        if self.knitter.piece().is_none() {
            self.begin("fabric".into(), [row.round, false], [None; 3], place)?;
        }
        let in_the_round = self.knitter.piece().is_some_and(|p| p.round);
        if row.round && !in_the_round {
            return Err(Problem::new(
                place,
                "a round in a flat piece",
                "rows, or 'join in the round' after the cast-on",
            )
            .into());
        }
        self.knitter.prepare();
        let right_side = self.knitter.right_side;
        let side = |rs| if rs { "RS" } else { "WS" };
        if let Some(wanted) = row.right_side
            && wanted != right_side
        {
            return Err(Problem::new(
                place,
                format_args!("({})", side(wanted)),
                format_args!("({}), the side that faces you now", side(right_side)),
            )
            .into());
        }
        if row.round && !right_side {
            return Err(Problem::new(
                place,
                "a round while the wrong side faces you",
                "a row that turns back first",
            )
            .into());
        }
        let steps = expand(items, &self.knitter.needles.left, &self.context(chart_row - 1))?;
        self.knitter.row(&steps, row.round, place)?;
        // Rows that are repeated make other numbers each time.
        if let Some((count, at)) = row.count.as_ref().filter(|_| counted) {
            let (wanted, found) = (self.count(count, *at)?, self.knitter.needles.stitches());
            if wanted != found {
                return Err(Problem::new(
                    *at,
                    format_args!("{wanted} stitches"),
                    format_args!("{found}, as there are after this row"),
                )
                .into());
            }
        }
        Ok(())
    }

    pub(super) fn repeat(&mut self, repeat: &Repeat, place: Place) -> Result<(), Failure> {
        self.work_waiting()?;
        let from = self.count(&repeat.from, place)?;
        let to = repeat.to.as_ref().map_or(Ok(from), |t| self.count(t, place))?;
        if from == 0
            || to < from
            || !self.section.rows.contains_key(&from)
            || !self.section.rows.contains_key(&to)
        {
            return Err(Problem::new(
                place,
                format_args!("rows {from} to {to}"),
                "rows that were worked just before",
            )
            .into());
        }
        let rows = match &repeat.until {
            Until::More(n) => self.count(n, place)?.saturating_mul(to - from + 1),
            Until::Rows(n) => {
                let wanted = self.count(n, place)?;
                wanted.checked_sub(self.section.last).ok_or_else(|| {
                    Problem::new(
                        place,
                        format_args!("row {} worked already", self.section.last),
                        format_args!("at most {wanted}"),
                    )
                })?
            }
        };
        for k in 0..rows {
            self.numbered_row(from + k % (to - from + 1), true, place)?;
            self.section.last += 1;
        }
        Ok(())
    }
}
