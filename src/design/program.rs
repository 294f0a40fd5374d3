//! Carries out a pattern's statements.

use super::chart::Chart;
use super::expand::{Context, expand};
use super::expression::{Expression, Gauge, Names, Problem};
use super::fabric::PieceRecord;
use super::section::Section;
use super::syntax::{Item, Piece, Statement, StatementKind};
use super::token::Place;
use super::work::Knitter;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// Rows and statements at most: more is a mistake.
pub(super) const MOST_STATEMENTS: usize = 2_000_000;

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
            format_args!("no size '{size}'"),
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

pub(super) struct Program<'a> {
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
    pub(super) knitter: Knitter,
    pub(super) section: Section,
    done: usize,
}

impl Program<'_> {
    fn statements(&mut self, statements: &[Statement]) -> Result<(), Failure> {
        statements.iter().try_for_each(|s| self.statement(s))
    }

    fn value(&self, expression: &Expression) -> Result<f64, Problem> {
        expression.value(&self.names, self.gauge)
    }

    pub(super) fn context(&self, chart_row: usize) -> Context<'_> {
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

    pub(super) fn count(&self, expression: &Expression, place: Place) -> Result<usize, Problem> {
        self.context(0).count(expression, place)
    }

    pub(super) fn tick(&mut self, place: Place) -> Result<(), Problem> {
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
            let round = matches!(statement.kind, StatementKind::CastOn(_, true));
            self.begin("fabric".into(), [round, false], [None; 3], place)?;
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
            StatementKind::CastOn(n, joined) => {
                if *joined && !self.knitter.piece().is_some_and(|p| p.round) {
                    return Err(
                        Problem::new(place, "a join in a flat piece", "'piece NAME round' before").into()
                    );
                }
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

    pub(super) fn begin(
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
