//! A row's instructions, written out stitch by stitch for what is on the needle.

use super::chart::Chart;
use super::expression::{Expression, Gauge, Names, Problem};
use super::needles::{Held, Slot, stitches};
use super::stitch::Stitch;
use super::syntax::{Item, ItemKind, Times};
use super::token::Place;
use std::collections::BTreeMap;

/// At most so many steps a row: more is a mistake, and would only fill the memory.
pub const MOST_STEPS: usize = 4_000_000;

/// One thing to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Work a stitch; `Some`: in a colour of its own.
    Work(Stitch, Option<u16>),
    /// Bind off a stitch.
    BindOff,
    /// Make a loop of the yarn.
    CastOn,
    /// Put a marker onto the right needle.
    PlaceMarker(String),
    /// The next marker goes over to the right needle.
    SlipMarker,
    /// The next marker is taken out.
    RemoveMarker,
    /// The row ends here.
    Turn,
    /// So many stitches go off the needle.
    Hold(usize, String),
    /// Held stitches come back.
    From(String),
    /// From here on in this colour.
    With(u16),
}

/// What expressions and names refer to.
pub struct Context<'a> {
    /// Names of numbers.
    pub names: &'a Names,
    /// The size of a stitch.
    pub gauge: Gauge,
    /// Held stitches.
    pub held: &'a BTreeMap<String, Held>,
    /// Colours by name.
    pub colours: &'a BTreeMap<String, u16>,
    /// Charts by name.
    pub charts: &'a BTreeMap<String, Chart>,
    /// Row of charts, counted from 0.
    pub chart_row: usize,
    /// The right side faces the knitter.
    pub right_side: bool,
}

impl Context<'_> {
    /// A whole number that is not negative.
    pub fn count(&self, expression: &Expression, place: Place) -> Result<usize, Problem> {
        let x = expression.value(self.names, self.gauge)?;
        let whole = x.round();
        if (x - whole).abs() > 1e-6 {
            return Err(Problem::new(place, x, "a whole number (round, floor or ceil make one)"));
        }
        if !(0.0..=1e9).contains(&whole) {
            return Err(Problem::new(place, x, "a number from 0 to 1,000,000,000"));
        }
        Ok(whole as usize)
    }

    /// Number of a colour.
    pub fn colour(&self, name: &str, place: Place) -> Result<u16, Problem> {
        self.colours.get(name).copied().ok_or_else(|| {
            let known: Vec<&str> = self.colours.keys().map(String::as_str).collect();
            let known = if known.is_empty() { "there are none".into() } else { known.join(", ") };
            Problem::new(
                place,
                format_args!("the unknown colour '{name}'"),
                format_args!("the name of a colour ({known})"),
            )
        })
    }
}

/// Writes a row out. `left` is the left needle, its last slot the next to be worked.
pub fn expand(items: &[Item], left: &[Slot], context: &Context) -> Result<Vec<(Step, Place)>, Problem> {
    let mut row = Row { context, ahead: left.iter().rev().cloned().collect(), at: 0, steps: Vec::new() };
    row.items(items)?;
    Ok(row.steps)
}

struct Row<'a> {
    context: &'a Context<'a>,
    /// Slots in the order of work; held stitches that come back are put in.
    ahead: Vec<Slot>,
    at: usize,
    steps: Vec<(Step, Place)>,
}

impl Row<'_> {
    fn items(&mut self, items: &[Item]) -> Result<(), Problem> {
        items.iter().try_for_each(|item| self.item(item))
    }

    fn item(&mut self, item: &Item) -> Result<(), Problem> {
        let place = item.place;
        match &item.kind {
            ItemKind::Work(stitch, times) => self.work(*stitch, times, place),
            ItemKind::Group(items, times) => {
                for _ in 0..self.context.count(times, place)? {
                    let before = self.steps.len();
                    self.items(items)?;
                    if self.steps.len() == before {
                        break;
                    }
                }
                Ok(())
            }
            ItemKind::Star(items, times) => self.star(items, times, place),
            ItemKind::PlaceMarker(name) => self.push(Step::PlaceMarker(name.clone()), place),
            ItemKind::SlipMarker | ItemKind::RemoveMarker => {
                match self.ahead.get(self.at) {
                    Some(Slot::Marker(_)) => self.at += 1,
                    Some(Slot::Loop(_)) => {
                        let to = self
                            .to_marker()
                            .map_or("none follows".into(), |n| format!("{n} stitches before the next one"));
                        return Err(Problem::new(place, format_args!("no marker here ({to})"), "a marker"));
                    }
                    None => return Err(Problem::new(place, "the end of the row", "a marker")),
                }
                let slip = matches!(item.kind, ItemKind::SlipMarker);
                self.push(if slip { Step::SlipMarker } else { Step::RemoveMarker }, place)
            }
            ItemKind::Turn => self.push(Step::Turn, place),
            ItemKind::BindOff(n) => {
                let n = match n {
                    Some(n) => self.context.count(n, place)?,
                    None => self.left(),
                };
                for _ in 0..n {
                    self.take(1, "bo", place)?;
                    self.push(Step::BindOff, place)?;
                }
                Ok(())
            }
            ItemKind::CastOn(n) => {
                let n = self.context.count(n, place)?;
                self.room(n, place)?;
                (0..n).try_for_each(|_| self.push(Step::CastOn, place))
            }
            ItemKind::Hold(n, name) => {
                let n = match n {
                    Some(n) => self.context.count(n, place)?,
                    None => self.left(),
                };
                for _ in 0..n {
                    self.take(1, "hold", place)?;
                }
                self.push(Step::Hold(n, name.clone()), place)
            }
            ItemKind::From(name) => {
                let held = self.context.held.get(name).ok_or_else(|| {
                    let known: Vec<&str> = self.context.held.keys().map(String::as_str).collect();
                    let known = if known.is_empty() { "none are held".into() } else { known.join(", ") };
                    Problem::new(
                        place,
                        format_args!("'{name}'"),
                        format_args!("the name of held stitches ({known})"),
                    )
                })?;
                if self.steps.iter().any(|(step, _)| matches!(step, Step::From(n) if n == name)) {
                    return Err(Problem::new(
                        place,
                        format_args!("'{name}' a second time"),
                        "each held stitch once",
                    ));
                }
                // Held in the order of right-side rows.
                let mut slots = held.slots.clone();
                if !self.context.right_side {
                    slots.reverse();
                }
                self.ahead.splice(self.at..self.at, slots);
                self.push(Step::From(name.clone()), place)
            }
            ItemKind::With(name) => {
                let colour = self.context.colour(name, place)?;
                self.push(Step::With(colour), place)
            }
            ItemKind::Chart(name) => self.chart(name, place),
            ItemKind::Evenly(more, n) => self.evenly(*more, self.context.count(n, place)?, place),
        }
    }

    fn work(&mut self, stitch: Stitch, times: &Times, place: Place) -> Result<(), Problem> {
        let takes = stitch.takes();
        let n = match times {
            Times::Count(n) | Times::More(n) => self.context.count(n, place)?,
            _ => {
                let until = self.until(times, place)?;
                if takes == 0 {
                    return Err(Problem::new(
                        place,
                        "a stitch that uses none, up to a place",
                        "how often it is made",
                    ));
                }
                if until % takes != 0 {
                    return Err(Problem::new(
                        place,
                        format_args!("{until} stitches up to there"),
                        format_args!("a multiple of the {takes} that this one uses"),
                    ));
                }
                until / takes
            }
        };
        self.room(n, place)?;
        for _ in 0..n {
            self.take(takes, "a stitch", place)?;
            self.push(Step::Work(stitch, None), place)?;
        }
        Ok(())
    }

    fn star(&mut self, items: &[Item], times: &Times, place: Place) -> Result<(), Problem> {
        if let Times::More(n) = times {
            for _ in 0..=self.context.count(n, place)? {
                let before = self.steps.len();
                self.items(items)?;
                if self.steps.len() == before {
                    break;
                }
            }
            return Ok(());
        }
        let end = |row: &Self| row.until(times, place);
        // Markers that are on the way do not change what is left behind them.
        let stop = self.left() - end(self)?;
        let first = self.left() - stop;
        let mut used = 0;
        loop {
            let before = self.left();
            let worked = self.items(items);
            let after = self.left();
            // The last repeat lacks stitches: that is said of the whole, not of the stitch that found none.
            if worked.is_err() && before < first + stop && before - stop < used {
                return Err(Problem::new(
                    place,
                    format_args!("{first} stitches, and a repeat of {used}"),
                    "repeats that come out even",
                ));
            }
            worked?;
            used = before.saturating_sub(after);
            if after == before && after > stop {
                return Err(Problem::new(place, "a repeat that uses no stitch", "one that comes to an end"));
            }
            if after < stop {
                return Err(Problem::new(
                    place,
                    format_args!("{first} stitches, and a repeat of {}", before - after),
                    "repeats that come out even",
                ));
            }
            if after == stop {
                return Ok(());
            }
        }
    }

    /// Stitches up to where instructions go.
    fn until(&self, times: &Times, place: Place) -> Result<usize, Problem> {
        let left = self.left();
        match times {
            Times::ToLast(n) => {
                let keep = self.context.count(n, place)?;
                left.checked_sub(keep).ok_or_else(|| {
                    Problem::new(place, format_args!("{left} stitches left"), format_args!("at least {keep}"))
                })
            }
            Times::ToMarker(n) => {
                let before = self.context.count(n, place)?;
                let to = self.to_marker().ok_or_else(|| {
                    Problem::new(place, format_args!("no marker in the {left} stitches ahead"), "a marker")
                })?;
                to.checked_sub(before).ok_or_else(|| {
                    Problem::new(
                        place,
                        format_args!("a marker after {to} stitches"),
                        format_args!("at least {before} before it"),
                    )
                })
            }
            _ => Ok(left),
        }
    }

    /// Stitches not yet used.
    fn left(&self) -> usize {
        stitches(&self.ahead[self.at..])
    }

    /// Stitches before the next marker that is not right here.
    fn to_marker(&self) -> Option<usize> {
        self.ahead[self.at..].iter().position(|s| matches!(s, Slot::Marker(_)))
    }

    fn skip_markers(&mut self) {
        while matches!(self.ahead.get(self.at), Some(Slot::Marker(_))) {
            self.at += 1;
        }
    }

    /// Uses so many stitches. Markers before them are passed on; one between them is an error.
    fn take(&mut self, n: usize, what: &str, place: Place) -> Result<(), Problem> {
        if n == 0 {
            return Ok(());
        }
        self.skip_markers();
        let left = self.left();
        if left < n {
            return Err(Problem::new(
                place,
                format_args!("{what} that uses {n}, with {left} left"),
                "as many stitches as the row before made",
            ));
        }
        for k in 0..n {
            if matches!(self.ahead[self.at + k], Slot::Marker(_)) {
                return Err(Problem::new(
                    place,
                    format_args!("{what} across a marker"),
                    "all its stitches on one side",
                ));
            }
        }
        self.at += n;
        Ok(())
    }

    /// Whether so many more steps are still a row.
    fn room(&self, more: usize, place: Place) -> Result<(), Problem> {
        if self.steps.len().saturating_add(more) > MOST_STEPS {
            return Err(Problem::new(
                place,
                "a row without end",
                format_args!("at most {MOST_STEPS} stitches"),
            ));
        }
        Ok(())
    }

    fn push(&mut self, step: Step, place: Place) -> Result<(), Problem> {
        self.room(1, place)?;
        self.steps.push((step, place));
        Ok(())
    }

    fn chart(&mut self, name: &str, place: Place) -> Result<(), Problem> {
        let chart = self.context.charts.get(name).ok_or_else(|| {
            let known: Vec<&str> = self.context.charts.keys().map(String::as_str).collect();
            let known = if known.is_empty() { "there are none".into() } else { known.join(", ") };
            Problem::new(place, format_args!("'{name}'"), format_args!("the name of a chart ({known})"))
        })?;
        for cell in chart.row(self.context.chart_row, self.context.right_side) {
            let Place { line, column } = cell.place;
            let place = if chart.alone { cell.place } else { place };
            let what = format!("the chart's square at its line {line}, column {column}");
            self.take(cell.stitch.takes(), &what, place)?;
            self.push(Step::Work(cell.stitch, cell.colour), place)?;
        }
        Ok(())
    }

    /// Spreads decreases (k2tog) or increases (m1) over what is left, knit in between.
    fn evenly(&mut self, more: bool, n: usize, place: Place) -> Result<(), Problem> {
        let left = self.left();
        let (stitch, uses) = if more { (Stitch::MakeLeft, 1) } else { (Stitch::KnitTogether, 2) };
        if n * uses > left {
            let what = if more { "increases" } else { "decreases" };
            return Err(Problem::new(
                place,
                format_args!("{n} {what} over {left} stitches"),
                format_args!("at most {}", left / uses),
            ));
        }
        let plain = if self.context.right_side { Stitch::Knit } else { Stitch::Purl };
        let stitch = if !more && !self.context.right_side { Stitch::PurlTogether } else { stitch };
        let mut used = 0;
        for k in 0..n {
            // The k-th one sits in the middle of its share.
            let share = (left * (2 * k + 1) / (2 * n)).max(used);
            let before = if more { share + 1 } else { share.min(left - 2 * (n - k)) };
            let before = before.min(left);
            for _ in used..before {
                self.take(1, "a stitch", place)?;
                self.push(Step::Work(plain, None), place)?;
            }
            used = used.max(before);
            self.take(stitch.takes(), "a decrease", place)?;
            self.push(Step::Work(stitch, None), place)?;
            used += stitch.takes();
        }
        for _ in used..left {
            self.take(1, "a stitch", place)?;
            self.push(Step::Work(plain, None), place)?;
        }
        Ok(())
    }
}
