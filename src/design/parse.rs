//! Statements of a pattern.

mod cursor;
mod row;

use super::expression::Expression;
use super::syntax::{Edge, Piece, Repeat, Row, Statement, StatementKind, Until};
use super::token::{Kind, Place, tokens};
use crate::Result;
use cursor::Cursor;
use std::path::Path;

/// How deep `for` and groups may go.
const DEPTH: usize = 32;

/// Reads a pattern.
///
/// # Errors
/// The first place where it is not one; `path` is only for messages.
pub fn parse(path: &Path, text: &str) -> Result<Vec<Statement>> {
    let tokens = tokens(path, text)?;
    let mut cursor = Cursor::new(path, &tokens);
    let statements = statements(&mut cursor, 0)?;
    match cursor.peek() {
        None => Ok(statements),
        Some(_) => Err(cursor.error("a statement, or the end of the pattern")),
    }
}

/// Statements up to the end, or to the `end` of a `for`.
fn statements(c: &mut Cursor, depth: usize) -> Result<Vec<Statement>> {
    let mut found = Vec::new();
    loop {
        while c.sign('.') || c.end_of_line() {}
        if c.peek().is_none() || c.is_word("end") && depth > 0 {
            return Ok(found);
        }
        let place = c.place();
        if c.keyword("join") {
            in_the_round(c)?;
            c.line_ends()?;
            // It says how the line before it was meant.
            match found.last_mut() {
                Some(Statement { kind: StatementKind::CastOn(_, joined), .. }) if !*joined => *joined = true,
                _ => {
                    return Err(c.error_at(
                        place,
                        "'join'",
                        "it once, right after the cast-on: co N, join in the round",
                    ));
                }
            }
            continue;
        }
        let kind = statement(c, place, depth)?;
        found.push(Statement { place, kind });
    }
}

const STATEMENTS: &str = "a statement: title, gauge, let, size, color, chart, piece, co, join, row, round, rep, for, bo, draw, cut, \
                          tail, with, hold, from, graft or pick up";

fn statement(c: &mut Cursor, place: Place, depth: usize) -> Result<StatementKind> {
    let Some(word) = c.word() else { return Err(c.error(STATEMENTS)) };
    // A number may stand close to its word: co20.
    let (word, attached) = match word.strip_prefix("co").and_then(|n| n.parse::<u32>().ok()) {
        Some(n) => ("co".to_string(), Some(n)),
        None => (word, None),
    };
    if let Some(n) = attached {
        return cast_on(c, Expression::Number(f64::from(n)));
    }
    let kind = match word.as_str() {
        "title" => match c.text() {
            Some(text) => StatementKind::Title(text),
            None => return Err(c.error("a title in double quotes")),
        },
        "gauge" => {
            c.sign(':');
            let stitches = c.number()?;
            let rows = if c.keyword("x") { Some(c.number()?) } else { None };
            StatementKind::Gauge(stitches, rows)
        }
        "let" => {
            let name = c.name("a name")?;
            c.expect('=')?;
            StatementKind::Let(name, c.expression()?)
        }
        "size" => {
            let name = match c.peek() {
                Some(Kind::Number(x)) => {
                    let name = x.to_string();
                    c.skip();
                    name
                }
                _ => c.name("a name of a size")?,
            };
            c.expect(':')?;
            let mut lets = Vec::new();
            loop {
                let name = c.name("a name")?;
                c.expect('=')?;
                lets.push((name, c.expression()?));
                if !c.sign(',') {
                    break;
                }
            }
            StatementKind::Size(name, lets)
        }
        "color" | "colour" => {
            let name = c.name("a name of a colour")?;
            match c.colour() {
                Some(rgb) => StatementKind::Colour(name, rgb),
                None => return Err(c.error("a colour of six hexadecimal digits, such as #c0392b")),
            }
        }
        "chart" => {
            let name = c.name("a name of a chart")?;
            match c.text() {
                Some(file) => StatementKind::Chart(name, file),
                None => return Err(c.error("the chart's file in double quotes")),
            }
        }
        "piece" => piece(c)?,
        "co" | "cast" => {
            if word == "cast" && !c.keyword("on") {
                return Err(c.error("'on'"));
            }
            let n = c.count()?;
            return cast_on(c, n);
        }
        "row" | "rows" | "rnd" | "rnds" | "round" | "rounds" | "short" => {
            if word == "short" && !(c.keyword("row") || c.keyword("rows")) {
                return Err(c.error("'row'"));
            }
            StatementKind::Row(Box::new(row_statement(
                c,
                word.starts_with("rnd") || word.starts_with("round"),
            )?))
        }
        "rep" | "repeat" => StatementKind::Repeat(repeat(c)?),
        "for" => return for_statement(c, place, depth),
        "bo" | "bind" => {
            if word == "bind" && !c.keyword("off") {
                return Err(c.error("'off'"));
            }
            c.keyword("all");
            c.stitches_word();
            StatementKind::BindOff
        }
        "draw" => StatementKind::Draw,
        "cut" => StatementKind::Cut,
        "tail" => StatementKind::Tail(c.name("a name for the tail")?),
        "with" => StatementKind::With(c.name("a name of a colour")?),
        "hold" => {
            let n = if c.keyword("all") || c.is_word("as") { None } else { Some(c.count()?) };
            c.stitches_word();
            if !c.keyword("as") {
                return Err(c.error("'as' and a name for the held stitches"));
            }
            StatementKind::Hold(n, c.name("a name for the held stitches")?)
        }
        "from" => StatementKind::From(c.name("a name of held stitches")?),
        "graft" => {
            let a = c.name("a name of held stitches")?;
            if !(c.keyword("with") || c.keyword("to")) {
                return Err(c.error("'with'"));
            }
            let b = c.name("a name of held stitches")?;
            let tail = if c.keyword("using") { Some(c.name("a name of a tail")?) } else { None };
            StatementKind::Graft(a, b, tail)
        }
        "pick" => {
            if !c.keyword("up") {
                return Err(c.error("'up'"));
            }
            let name = c.name("a name for the picked-up stitches")?;
            c.expect('=')?;
            let edge = match c.word().as_deref() {
                Some("right") => Edge::Right,
                Some("left") => Edge::Left,
                Some(_) => return Err(c.error_before("'right' or 'left'")),
                None => return Err(c.error("'right' or 'left'")),
            };
            if !(c.keyword("edge") && c.keyword("of")) {
                return Err(c.error("'edge of' and the name of a piece"));
            }
            StatementKind::PickUp(name, edge, c.name("the name of a piece")?)
        }
        _ => return Err(c.error_before(STATEMENTS)),
    };
    c.line_ends()?;
    Ok(kind)
}

/// What may follow the number of a cast-on.
fn cast_on(c: &mut Cursor, n: Expression) -> Result<StatementKind> {
    c.stitches_word();
    let more = c.sign(',') || c.keyword("and");
    let joined = c.keyword("join");
    if joined {
        in_the_round(c)?;
    } else if more {
        return Err(c.error("'join in the round'"));
    }
    c.line_ends()?;
    Ok(StatementKind::CastOn(n, joined))
}

/// `in the round`, `to work in the round`, `for working in the round`, after `join`; or nothing.
fn in_the_round(c: &mut Cursor) -> Result<()> {
    let work = c.keyword("to") && c.keyword("work") || c.keyword("for") && c.keyword("working");
    let round = c.keyword("in") && c.keyword("the") && c.keyword("round");
    if work && !round { Err(c.error("'in the round'")) } else { Ok(()) }
}

fn piece(c: &mut Cursor) -> Result<StatementKind> {
    let name = c.name("a name of a piece")?;
    let round = match c.word().as_deref() {
        Some("round") => true,
        Some("flat") => false,
        Some(_) => return Err(c.error_before("'flat' or 'round'")),
        None => return Err(c.error("'flat' or 'round'")),
    };
    let curled = !round && c.keyword("curled");
    let mut piece = Piece { name, round, curled, at: None, toward: None, start: None };
    loop {
        let slot = match c.peek() {
            Some(Kind::Word(word)) if word == "at" => &mut piece.at,
            Some(Kind::Word(word)) if word == "toward" => &mut piece.toward,
            Some(Kind::Word(word)) if word == "start" => &mut piece.start,
            _ => break,
        };
        c.skip();
        c.expect('(')?;
        let x = c.expression()?;
        c.expect(',')?;
        let y = c.expression()?;
        c.expect(',')?;
        let z = c.expression()?;
        c.expect(')')?;
        *slot = Some([x, y, z]);
    }
    Ok(StatementKind::Piece(Box::new(piece)))
}

fn row_statement(c: &mut Cursor, round: bool) -> Result<Row> {
    let mut numbers = Vec::new();
    if matches!(c.peek(), Some(Kind::Number(_) | Kind::Sign('{'))) {
        loop {
            let first = c.count()?;
            let last = if c.sign('-') || c.keyword("to") { Some(c.count()?) } else { None };
            numbers.push((first, last));
            if !(c.sign(',') || c.keyword("and")) {
                break;
            }
            c.keyword("and");
        }
    }
    let mut right_side = None;
    if c.sign('(') {
        right_side = match c.word().as_deref() {
            Some("rs") => Some(true),
            Some("ws") => Some(false),
            Some(_) => return Err(c.error_before("RS or WS")),
            None => return Err(c.error("RS or WS")),
        };
        c.expect(')')?;
    }
    c.expect(':')?;
    let (content, count) = row::content(c)?;
    Ok(Row { round, numbers, right_side, content, count })
}

fn repeat(c: &mut Cursor) -> Result<Repeat> {
    if !(c.keyword("rows")
        || c.keyword("row")
        || c.keyword("rnds")
        || c.keyword("rnd")
        || c.keyword("rounds"))
    {
        return Err(c.error("'rows' and their numbers"));
    }
    let from = c.count()?;
    let to = if c.sign('-') || c.keyword("to") { Some(c.count()?) } else { None };
    let until = if c.keyword("until") {
        let n = c.count()?;
        if !(c.keyword("rows") || c.keyword("rnds") || c.keyword("rounds")) {
            return Err(c.error("'rows'"));
        }
        Until::Rows(n)
    } else {
        let n = c.count()?;
        if !(c.keyword("more") && (c.keyword("times") || c.keyword("time"))) {
            return Err(c.error("'more times'"));
        }
        Until::More(n)
    };
    Ok(Repeat { from, to, until })
}

fn for_statement(c: &mut Cursor, place: Place, depth: usize) -> Result<StatementKind> {
    if depth >= DEPTH {
        return Err(c.error_at(place, "a 'for' in too many others", format_args!("at most {DEPTH}")));
    }
    let name = c.name("a name")?;
    c.expect('=')?;
    let from = c.expression()?;
    if !c.keyword("to") {
        return Err(c.error("'to'"));
    }
    let to = c.expression()?;
    c.line_ends()?;
    let body = statements(c, depth + 1)?;
    if !c.keyword("end") {
        return Err(c.error_at(place, "a 'for' without its end", "'end' on a line of its own"));
    }
    c.line_ends()?;
    Ok(StatementKind::For(name, from, to, body))
}
