//! Carries out a pattern's statements.

use super::chart::Chart;
use super::expand::{Context, expand};
use super::expression::{Expression, Gauge, Names, Problem};
use super::fabric::PieceRecord;
use super::syntax::{Content, Item, Piece, Repeat, Row, Statement, StatementKind, Until};
use super::token::Place;
use super::work::Knitter;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// Rows and statements at most: more is a mistake.
const MOST_STATEMENTS: usize = 2_000_000;

/// What may be chosen before a pattern is worked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Stitches and rows on 10 cm, instead of the pattern's own.
    pub gauge: Option<Gauge>,
    /// Which of its sizes; the first unless given.
    pub size: Option<String>,
    /// Faces at most, before a pattern is refused; 20 million unless given, which is also the most there can be.
    pub most_faces: Option<usize>,
}

/// What a pattern refers to beyond itself.
pub trait Files {
    /// Reads a chart; `colour` gives colours their numbers.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn chart(&self, file: &str, colour: &mut dyn FnMut([u8; 3]) -> u16) -> crate::Result<Chart>;
}

/// Why a pattern was not worked to its end.
#[derive(Debug)]
pub enum Failure {
    /// Something in the pattern.
    Pattern(Problem),
    /// Something in a file that it names.
    File(crate::Error),
}

impl From<Problem> for Failure {
    fn from(problem: Problem) -> Self {
        Failure::Pattern(problem)
    }
}

/// A pattern that was worked.
#[derive(Debug)]
pub struct Worked {
    /// Its title.
    pub title: Option<String>,
    /// The gauge it was worked at.
    pub gauge: Gauge,
    /// The size, if it has sizes.
    pub size: Option<String>,
    /// What came off the needles.
    pub knitter: Knitter,
}

/// Works a pattern.
///
/// # Errors
/// The first instruction that cannot be followed.
pub fn work(statements: &[Statement], settings: &Settings, files: &dyn Files) -> Result<Worked, Failure> {
    let mut program = Program {
        files,
        settings,
        names: Names::new(),
        gauge: settings.gauge.unwrap_or_default(),
        title: None,
        size: None,
        sizes: sizes(statements),
        sizes_seen: BTreeSet::new(),
        colours: BTreeMap::new(),
        charts: BTreeMap::new(),
        knitter: Knitter::new(settings.most_faces),
        section: Section::default(),
        done: 0,
    };
    if let Some(size) = &settings.size
        && !program.sizes.contains(size)
    {
        let known: Vec<&str> = program.sizes.iter().map(String::as_str).collect();
        let known = if known.is_empty() { "none: the pattern has no sizes".into() } else { known.join(", ") };
        return Err(Failure::Pattern(Problem::new(
            Place { line: 1, column: 1 },
            format_args!("a wish for size '{size}'"),
            format_args!("one of its sizes ({known})"),
        )));
    }
    program.statements(statements)?;
    program.end_section()?;
    let end = statements.last().map_or(Place { line: 1, column: 1 }, |s| s.place);
    program.knitter.needles_empty(end)?;
    if let Some((name, held)) = program.knitter.held.iter().next() {
        let n = super::needles::stitches(&held.slots);
        return Err(Failure::Pattern(Problem::new(
            end,
            format_args!("{n} stitches still held as '{name}'"),
            "from, graft or another use of them",
        )));
    }
    program.knitter.cut(end);
    program.knitter.trim_tails(end);
    if program.knitter.fabric.faces.is_empty() {
        return Err(Failure::Pattern(Problem::new(end, "a pattern without stitches", "co N and rows")));
    }
    let Program { title, gauge, size, knitter, .. } = program;
    Ok(Worked { title, gauge, size, knitter })
}

/// Names of all sizes.
fn sizes(statements: &[Statement]) -> BTreeSet<String> {
    let name = |s: &Statement| match &s.kind {
        StatementKind::Size(name, _) => Some(name.clone()),
        _ => None,
    };
    statements.iter().filter_map(name).collect()
}

/// A row, where it stands, and the first number of its statement.
type Numbered = (Rc<Row>, Place, usize);

/// Rows that belong together by their numbers.
#[derive(Default)]
struct Section {
    /// Rows by number; `Some` is worked already.
    rows: BTreeMap<usize, Numbered>,
    /// Rows yet to be worked, by number.
    waiting: BTreeSet<usize>,
    /// Number of the last row worked.
    last: usize,
}

struct Program<'a> {
    files: &'a dyn Files,
    settings: &'a Settings,
    names: Names,
    gauge: Gauge,
    title: Option<String>,
    size: Option<String>,
    sizes: BTreeSet<String>,
    sizes_seen: BTreeSet<String>,
    colours: BTreeMap<String, u16>,
    charts: BTreeMap<String, Chart>,
    knitter: Knitter,
    section: Section,
    done: usize,
}

impl Program<'_> {
    fn statements(&mut self, statements: &[Statement]) -> Result<(), Failure> {
        statements.iter().try_for_each(|s| self.statement(s))
    }

    fn value(&self, expression: &Expression) -> Result<f64, Problem> {
        expression.value(&self.names, self.gauge)
    }

    fn context(&self, chart_row: usize) -> Context<'_> {
        Context {
            names: &self.names,
            gauge: self.gauge,
            held: &self.knitter.held,
            colours: &self.colours,
            charts: &self.charts,
            chart_row,
            right_side: self.knitter.right_side,
        }
    }

    fn count(&self, expression: &Expression, place: Place) -> Result<usize, Problem> {
        self.context(0).count(expression, place)
    }

    fn tick(&mut self, place: Place) -> Result<(), Problem> {
        self.done += 1;
        if self.done > MOST_STATEMENTS {
            return Err(Problem::new(
                place,
                "a pattern without end",
                format_args!("at most {MOST_STATEMENTS} rows"),
            ));
        }
        Ok(())
    }

    fn statement(&mut self, statement: &Statement) -> Result<(), Failure> {
        let place = statement.place;
        self.tick(place)?;
        match &statement.kind {
            StatementKind::Row(row) => return self.row_statement(row, place),
            StatementKind::Repeat(repeat) => return self.repeat(repeat, place),
            _ => self.end_section()?,
        }
        let knits = !matches!(
            statement.kind,
            StatementKind::Title(_)
                | StatementKind::Gauge(..)
                | StatementKind::Let(..)
                | StatementKind::Size(..)
                | StatementKind::Colour(..)
                | StatementKind::Chart(..)
                | StatementKind::Piece(_)
                | StatementKind::For(..)
                | StatementKind::Graft(..)
                | StatementKind::Tail(_)
                | StatementKind::With(_)
                | StatementKind::PickUp(..)
        );
        if knits && self.knitter.piece().is_none() {
            self.begin("fabric".into(), [false; 2], [None; 3], place)?;
        }
        match &statement.kind {
            StatementKind::Title(title) => self.title = Some(title.clone()),
            StatementKind::Gauge(stitches, rows) => self.set_gauge(stitches, rows.as_ref(), place)?,
            StatementKind::Let(name, expression) => {
                let value = self.value(expression)?;
                self.names.insert(name.clone(), value);
            }
            StatementKind::Size(name, lets) => {
                if !self.sizes_seen.insert(name.clone()) {
                    return Err(
                        Problem::new(place, format_args!("a second size '{name}'"), "another name").into()
                    );
                }
                let wanted = self.settings.size.as_ref().map_or(self.size.is_none(), |size| size == name);
                if wanted {
                    self.size = Some(name.clone());
                    for (name, expression) in lets {
                        let value = self.value(expression)?;
                        self.names.insert(name.clone(), value);
                    }
                }
            }
            StatementKind::Colour(name, rgb) => {
                let number = self.colour(*rgb);
                self.colours.insert(name.clone(), number);
            }
            StatementKind::Chart(name, file) => {
                let colours = &mut self.knitter.fabric.colours;
                let chart =
                    self.files.chart(file, &mut |rgb| colour_number(colours, rgb)).map_err(Failure::File)?;
                self.charts.insert(name.clone(), chart);
            }
            StatementKind::Piece(piece) => self.piece(piece, place)?,
            StatementKind::CastOn(n) => {
                let n = self.count(n, place)?;
                if n == 0 {
                    return Err(Problem::new(place, "a cast-on of no stitches", "1 or more").into());
                }
                self.knitter.cast_on(n, place)?;
            }
            StatementKind::For(name, from, to, body) => {
                let (from, to) = (self.value(from)?, self.value(to)?);
                let outer = self.names.get(name).copied();
                let mut i = from;
                while i <= to + 1e-9 {
                    self.names.insert(name.clone(), i);
                    self.tick(place)?;
                    self.statements(body)?;
                    self.end_section()?;
                    i += 1.0;
                }
                match outer {
                    Some(value) => self.names.insert(name.clone(), value),
                    None => self.names.remove(name),
                };
            }
            StatementKind::BindOff => {
                let item = Item { place, kind: super::syntax::ItemKind::BindOff(None) };
                let round = self.knitter.piece().is_some_and(|p| p.round);
                self.knitter.prepare();
                let steps = expand(&[item], &self.knitter.needles.left, &self.context(0))?;
                self.knitter.row(&steps, round, place)?;
            }
            StatementKind::Draw => self.knitter.draw(place)?,
            StatementKind::Cut => self.knitter.cut(place),
            StatementKind::Hold(n, name) => {
                let n = n.as_ref().map(|n| self.count(n, place)).transpose()?;
                self.knitter.hold(n, name, place)?;
            }
            StatementKind::From(name) => self.knitter.take_up(name, place)?,
            StatementKind::Graft(a, b, tail) => self.knitter.graft(a, b, tail.as_deref(), place)?,
            StatementKind::Tail(name) => self.knitter.leave_tail(name, place)?,
            StatementKind::With(name) => {
                let number = self.context(0).colour(name, place)?;
                self.knitter.take_colour(number);
            }
            StatementKind::PickUp(name, side, piece) => self.knitter.pick_up(name, *side, piece, place)?,
            StatementKind::Row(_) | StatementKind::Repeat(_) => {}
        }
        Ok(())
    }

    fn set_gauge(
        &mut self,
        stitches: &Expression,
        rows: Option<&Expression>,
        place: Place,
    ) -> Result<(), Problem> {
        let stitches = self.value(stitches)?;
        let rows = rows.map(|r| self.value(r)).transpose()?;
        if [Some(stitches), rows].into_iter().flatten().any(|x| !(0.1..=1000.0).contains(&x)) {
            return Err(Problem::new(
                place,
                "a gauge out of bounds",
                "0.1 to 1000 stitches and rows on 10 cm",
            ));
        }
        if self.settings.gauge.is_none() {
            self.gauge = Gauge::per_10_cm(stitches, rows);
        }
        Ok(())
    }

    fn colour(&mut self, rgb: [u8; 3]) -> u16 {
        colour_number(&mut self.knitter.fabric.colours, rgb)
    }

    fn piece(&mut self, piece: &Piece, place: Place) -> Result<(), Problem> {
        let vector = |v: &Option<[Expression; 3]>| -> Result<Option<DVec3>, Problem> {
            let Some(v) = v else { return Ok(None) };
            Ok(Some(DVec3::new(self.value(&v[0])?, self.value(&v[1])?, self.value(&v[2])?)))
        };
        let vectors = [vector(&piece.at)?, vector(&piece.toward)?, vector(&piece.start)?];
        self.begin(piece.name.clone(), [piece.round, piece.curled], vectors, place)
    }

    fn begin(
        &mut self,
        name: String,
        [round, curled]: [bool; 2],
        [at, toward, start]: [Option<DVec3>; 3],
        place: Place,
    ) -> Result<(), Problem> {
        let unit = |v: DVec3, what: &str| match v.try_normalize() {
            Some(v) => Ok(v),
            None => {
                Err(Problem::new(place, format_args!("a {what} of no direction"), "three numbers, not all 0"))
            }
        };
        let toward = unit(toward.unwrap_or(DVec3::Y), "toward")?;
        // Rounds begin at the back, rows at the right.
        let default = if round { -DVec3::Z } else { DVec3::X };
        let start = start.unwrap_or(default);
        let across = start - toward * start.dot(toward);
        let start =
            unit(if across.length() > 1e-9 { across } else { toward.any_orthonormal_vector() }, "start")?;
        let piece = PieceRecord { name, round, curled, at: at.unwrap_or_default(), toward, start };
        self.knitter.begin_piece(piece, place)
    }

    fn row_statement(&mut self, row: &Row, place: Place) -> Result<(), Failure> {
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

    fn end_section(&mut self) -> Result<(), Failure> {
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
            return Err(
                Problem::new(place, "a round in a flat piece", "rows, or 'piece NAME round' before").into()
            );
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

    fn repeat(&mut self, repeat: &Repeat, place: Place) -> Result<(), Failure> {
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

fn colour_number(colours: &mut Vec<[u8; 3]>, rgb: [u8; 3]) -> u16 {
    let known = colours.iter().position(|c| *c == rgb);
    let number = known.unwrap_or_else(|| {
        colours.push(rgb);
        colours.len() - 1
    });
    // Nobody knits in 65,536 colours: further ones look like the last.
    number.min(usize::from(u16::MAX)) as u16
}
