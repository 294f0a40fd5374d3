//! What is worked in a row.

use super::DEPTH;
use super::cursor::Cursor;
use crate::Result;
use crate::design::expression::Expression;
use crate::design::stitch::Stitch;
use crate::design::syntax::{Content, Item, ItemKind, Times};
use crate::design::token::{Kind, Place};

type Count = Option<(Expression, Place)>;

/// After the colon, to the end of the line.
pub fn content(c: &mut Cursor) -> Result<(Content, Count)> {
    if c.is_word("as") || c.is_word("rep") || c.is_word("repeat") {
        c.skip();
        if !["row", "rows", "rnd", "rnds", "round", "rounds"].iter().any(|word| c.keyword(word)) {
            return Err(c.error("'row' and its number"));
        }
        let from = c.count()?;
        let to = if c.sign('-') || c.keyword("to") { Some(c.count()?) } else { None };
        return Ok((Content::As(from, to), expected_count(c)?));
    }
    let found = items(c, 0, Until::Row)?;
    Ok((Content::Items(found), expected_count(c)?))
}

/// `(18 sts)`
fn expected_count(c: &mut Cursor) -> Result<Count> {
    while c.sign('.') {}
    let place = c.place();
    if !c.sign('(') {
        return Ok(None);
    }
    let n = c.count()?;
    if !c.stitches_word() {
        return Err(c.error("'sts'"));
    }
    c.expect(')')?;
    Ok(Some((n, place)))
}

#[derive(Clone, Copy, PartialEq)]
enum Until {
    Row,
    Sign(char),
    /// `; rep from *`
    Star,
}

fn items(c: &mut Cursor, depth: usize, until: Until) -> Result<Vec<Item>> {
    if depth > DEPTH {
        return Err(c.error(format_args!("groups in at most {DEPTH} others")));
    }
    let mut found = Vec::new();
    loop {
        found.push(item(c, depth)?);
        let separated = c.sign(',') || c.sign(';');
        let ends = match until {
            Until::Row => matches!(c.peek(), None | Some(Kind::End | Kind::Sign('.'))) || is_count(c),
            Until::Sign(sign) => c.peek() == Some(&Kind::Sign(sign)),
            Until::Star => c.is_word("rep") || c.is_word("repeat"),
        };
        if ends {
            return Ok(found);
        }
        if !separated {
            return Err(c.error(match until {
                Until::Row => "a comma and the next instruction, or the end of the row",
                Until::Sign(')') => "a comma and the next instruction, or ')'",
                Until::Sign(_) => "a comma and the next instruction, or ']'",
                Until::Star => "a comma and the next instruction, or '; rep from *'",
            }));
        }
    }
}

/// A bracket that holds a number of stitches, not instructions.
fn is_count(c: &Cursor) -> bool {
    c.peek() == Some(&Kind::Sign('(')) && matches!(c.peek_second(), Some(Kind::Number(_) | Kind::Sign('{')))
}

fn item(c: &mut Cursor, depth: usize) -> Result<Item> {
    let place = c.place();
    let kind = match c.peek() {
        Some(Kind::Sign(open @ ('(' | '['))) => {
            let close = if *open == '(' { ')' } else { ']' };
            c.skip();
            let inner = items(c, depth + 1, Until::Sign(close))?;
            c.expect(close)?;
            let times = if c.keyword("x") {
                c.count()?
            } else {
                match c.peek() {
                    Some(Kind::Number(_) | Kind::Sign('{')) => {
                        let n = c.count()?;
                        if !(c.keyword("times") || c.keyword("time")) {
                            return Err(c.error("'times'"));
                        }
                        n
                    }
                    Some(Kind::Word(word)) if word == "twice" => {
                        c.skip();
                        Expression::Number(2.0)
                    }
                    _ => Expression::Number(1.0),
                }
            };
            ItemKind::Group(inner, times)
        }
        Some(Kind::Sign('*')) => {
            c.skip();
            let inner = items(c, depth + 1, Until::Star)?;
            c.skip();
            if !(c.keyword("from") && c.sign('*')) {
                return Err(c.error("'from *'"));
            }
            ItemKind::Star(inner, star_times(c)?)
        }
        Some(Kind::Word(word)) => {
            c.skip();
            instruction(c, word, place)?
        }
        _ => return Err(c.error("an instruction")),
    };
    Ok(Item { place, kind })
}

fn star_times(c: &mut Cursor) -> Result<Times> {
    if matches!(c.peek(), Some(Kind::Number(_) | Kind::Sign('{'))) {
        let n = c.count()?;
        if !(c.keyword("more") && (c.keyword("times") || c.keyword("time"))) {
            return Err(c.error("'more times'"));
        }
        return Ok(Times::More(n));
    }
    Ok(bound(c)?.unwrap_or(Times::ToEnd))
}

/// `to end`, `to last N sts`, `to m`, `to N before m`, `across`, `around`.
fn bound(c: &mut Cursor) -> Result<Option<Times>> {
    if c.keyword("across") || c.keyword("around") {
        return Ok(Some(Times::ToEnd));
    }
    if !c.keyword("to") {
        return Ok(None);
    }
    c.keyword("the");
    if c.keyword("end") {
        if c.keyword("of") {
            ["the", "row", "rnd", "round"].iter().for_each(|word| {
                c.keyword(word);
            });
        }
        return Ok(Some(Times::ToEnd));
    }
    if c.keyword("last") {
        let n = if matches!(c.peek(), Some(Kind::Number(_) | Kind::Sign('{'))) {
            c.count()?
        } else {
            Expression::Number(1.0)
        };
        if !c.stitches_word() {
            return Err(c.error("'sts'"));
        }
        return Ok(Some(Times::ToLast(n)));
    }
    if c.keyword("m") || c.keyword("marker") {
        return Ok(Some(Times::ToMarker(Expression::Number(0.0))));
    }
    if matches!(c.peek(), Some(Kind::Number(_) | Kind::Sign('{'))) {
        let n = c.count()?;
        c.stitches_word();
        if !(c.keyword("before") && (c.keyword("m") || c.keyword("marker"))) {
            return Err(c.error("'before m'"));
        }
        return Ok(Some(Times::ToMarker(n)));
    }
    Err(c.error("'end', 'last N sts', 'm' or 'N before m'"))
}

fn instruction(c: &mut Cursor, word: &str, place: Place) -> Result<ItemKind> {
    Ok(match word {
        "pm" => {
            let name = match c.peek() {
                Some(Kind::Word(name)) => {
                    c.skip();
                    name.clone()
                }
                _ => String::new(),
            };
            ItemKind::PlaceMarker(name)
        }
        "sm" => ItemKind::SlipMarker,
        "rm" => ItemKind::RemoveMarker,
        "w&t" | "turn" => ItemKind::Turn,
        "bo" => {
            let n = match c.peek() {
                Some(Kind::Number(_) | Kind::Sign('{')) => Some(c.count()?),
                _ => None,
            };
            c.stitches_word();
            ItemKind::BindOff(n)
        }
        "co" => {
            let n = c.count()?;
            c.stitches_word();
            ItemKind::CastOn(n)
        }
        "hold" => {
            let n = if c.keyword("all") || c.is_word("as") { None } else { Some(c.count()?) };
            c.stitches_word();
            if !c.keyword("as") {
                return Err(c.error("'as' and a name for the held stitches"));
            }
            ItemKind::Hold(n, c.name("a name for the held stitches")?)
        }
        "from" => ItemKind::From(c.name("a name of held stitches")?),
        "with" => ItemKind::With(c.name("a name of a colour")?),
        "chart" => ItemKind::Chart(c.name("a name of a chart")?),
        "dec" | "inc" => {
            let n = c.count()?;
            c.stitches_word();
            if !c.keyword("evenly") {
                return Err(c.error("'evenly'"));
            }
            let _ = c.keyword("across") || c.keyword("around");
            ItemKind::Evenly(word == "inc", n)
        }
        _ => return stitches(c, word, place),
    })
}

/// A stitch, and how often: `k`, `k5`, `k {n}`, `k to last 2 sts`, `bo5`.
fn stitches(c: &mut Cursor, word: &str, place: Place) -> Result<ItemKind> {
    let digits = word.trim_end_matches(|d: char| d.is_ascii_digit());
    let count = word[digits.len()..].parse::<u32>().ok();
    if let ("bo", Some(n)) = (digits, count) {
        c.stitches_word();
        return Ok(ItemKind::BindOff(Some(Expression::Number(f64::from(n)))));
    }
    if let ("co", Some(n)) = (digits, count) {
        c.stitches_word();
        return Ok(ItemKind::CastOn(Expression::Number(f64::from(n))));
    }
    if let Some(stitch) = Stitch::named(word) {
        let times = match c.peek() {
            Some(Kind::Number(_) | Kind::Sign('{')) => {
                let n = c.count()?;
                c.stitches_word();
                Times::Count(n)
            }
            _ => match bound(c)? {
                Some(times) => times,
                // A bare k or p is the whole row; yo, k2tog and the like are one.
                None if matches!(stitch, Stitch::Knit | Stitch::Purl) => Times::ToEnd,
                None => Times::Count(Expression::Number(1.0)),
            },
        };
        return Ok(ItemKind::Work(stitch, times));
    }
    if let (Some(stitch), Some(n)) = (Stitch::named(digits), count) {
        c.stitches_word();
        return Ok(ItemKind::Work(stitch, Times::Count(Expression::Number(f64::from(n)))));
    }
    Err(c.error_at(
        place,
        format_args!("'{word}'"),
        format_args!(
            "a stitch ({}), pm, sm, rm, turn, bo, co, hold, from, with, chart, dec, inc, '(' or '*'",
            Stitch::NAMES
        ),
    ))
}
