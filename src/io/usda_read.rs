//! USD text (`.usda`), reading: the BasisCurves of a layer, with time samples of their points as frames.
//!
//! Read are linear and cubic curves; of Bezier curves only the points on the curve. Transforms, references and
//! variants are not applied. The writer is in [`super::usda`].

use super::curves::{CurveHeader, UpAxis};
use super::scan::{Kind, Scanner, Token};
use crate::yarn::Curves;
use crate::{Error, Result};
use glam::DVec3;
use std::path::Path;

/// Deepest nesting of prims.
const MAX_DEPTH: usize = 200;
const MODIFIERS: &[&str] =
    &["custom", "uniform", "varying", "config", "prepend", "append", "add", "delete", "reorder"];

/// One BasisCurves prim.
#[derive(Default)]
struct Prim {
    at: usize,
    linear: bool,
    bezier: bool,
    other_basis: Option<String>,
    wrap: Wrap,
    counts: Vec<f64>,
    widths: Vec<f64>,
    yarns: Vec<f64>,
    points: Vec<DVec3>,
    samples: Vec<(f64, Vec<DVec3>)>,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum Wrap {
    #[default]
    Nonperiodic,
    Pinned,
    Periodic,
}

struct Reader<'a, 'b> {
    s: Scanner<'a>,
    path: &'a Path,
    header: &'b mut CurveHeader,
    prims: Vec<Prim>,
    transforms: usize,
}

/// Reads a file: one `Curves` per time sample, or one if the points do not change.
pub fn read(path: &Path, bytes: &[u8], header: &mut CurveHeader) -> Result<Vec<Curves>> {
    let magic = b"#usda 1.";
    if !bytes.starts_with(magic) {
        return Err(Error::input(path, 1, 1, "another first line", "'#usda 1.0'"));
    }
    let mut reader = Reader { s: Scanner::new(path, bytes), path, header, prims: Vec::new(), transforms: 0 };
    reader.layer()?;
    reader.frames()
}

impl Reader<'_, '_> {
    fn layer(&mut self) -> Result<()> {
        if self.s.take(b'(')? {
            self.metadata(true)?;
        }
        loop {
            let token = self.s.next()?;
            match token.kind {
                Kind::End => return Ok(()),
                Kind::Word("def" | "over" | "class") => self.prim(0)?,
                Kind::Word("reorder") => {
                    self.s.word("'nameChildren'")?;
                    self.s.expect(b'=')?;
                    self.s.skip_value()?;
                }
                _ => return Err(self.s.unexpected(token, "a prim ('def')")),
            }
        }
    }

    /// What stands between `(` and `)`, the opening one taken.
    fn metadata(&mut self, layer: bool) -> Result<()> {
        loop {
            let token = self.s.next()?;
            match token.kind {
                Kind::Mark(b')') => return Ok(()),
                Kind::Quoted(_) | Kind::Mark(b';' | b',') => {}
                Kind::Word(word) if MODIFIERS.contains(&word) => {}
                Kind::Word(name) => {
                    self.s.expect(b'=')?;
                    let value = self.s.peek()?;
                    match (name, value.kind) {
                        ("upAxis", Kind::Quoted(axis)) if layer => {
                            self.header.up = match axis {
                                "Y" => Some(UpAxis::Y),
                                "Z" => Some(UpAxis::Z),
                                _ => return Err(self.s.unexpected(value, "\"Y\" or \"Z\"")),
                            };
                            self.header.fact("up axis", axis.to_ascii_lowercase());
                        }
                        ("metersPerUnit", Kind::Word(number)) if layer => {
                            self.header.fact("metres per unit", number)
                        }
                        ("timeCodesPerSecond", Kind::Word(number)) if layer => {
                            self.header.fact("time codes per second", number);
                        }
                        _ => {}
                    }
                    self.s.skip_value()?;
                }
                _ => return Err(self.s.unexpected(token, "a metadata field or ')'")),
            }
        }
    }

    /// A prim after `def`.
    fn prim(&mut self, depth: usize) -> Result<()> {
        let mut token = self.s.next()?;
        if depth == MAX_DEPTH {
            return Err(self.s.unexpected(token, "prims nested less deeply"));
        }
        let mut curves = false;
        if let Kind::Word(schema) = token.kind {
            curves = schema == "BasisCurves";
            token = self.s.next()?;
        }
        if !matches!(token.kind, Kind::Quoted(_)) {
            return Err(self.s.unexpected(token, "a prim's type or quoted name"));
        }
        if self.s.take(b'(')? {
            self.metadata(false)?;
        }
        self.s.expect(b'{')?;
        let mut prim = curves.then(|| Prim { at: token.at, ..Prim::default() });
        loop {
            let token = self.s.next()?;
            match token.kind {
                Kind::Mark(b'}') => break,
                Kind::Mark(b';') => {}
                Kind::Word("def" | "over" | "class") => self.prim(depth + 1)?,
                Kind::Word("variantSet") => {
                    self.s.string("a variant set's name")?;
                    self.s.expect(b'=')?;
                    self.s.skip_value()?;
                }
                Kind::Word(_) => self.property(token, prim.as_mut())?,
                _ => return Err(self.s.unexpected(token, "a property, a prim or '}'")),
            }
        }
        self.prims.extend(prim);
        Ok(())
    }

    /// `[modifiers] type[[]] name[.timeSamples] [= value] [(metadata)]`, the first word taken.
    fn property(&mut self, first: Token, prim: Option<&mut Prim>) -> Result<()> {
        let mut word = first;
        while matches!(word.kind, Kind::Word(w) if MODIFIERS.contains(&w)) {
            word = self.s.next()?;
        }
        if !matches!(word.kind, Kind::Word(_)) {
            return Err(self.s.unexpected(word, "a property's type"));
        }
        if self.s.take(b'[')? {
            self.s.expect(b']')?;
        }
        let at = self.s.peek()?.at;
        let name = self.s.word("a property's name")?;
        self.transforms += usize::from(name.starts_with("xformOp:"));
        if self.s.take(b'=')? {
            let value = self.s.peek()?;
            let none = value.kind == Kind::Word("None");
            match (prim, name) {
                (Some(prim), "points") if !none => prim.points = self.triples()?,
                (Some(prim), "points.timeSamples") => self.samples(prim)?,
                (Some(prim), "curveVertexCounts") if !none => self.numbers(&mut prim.counts)?,
                (Some(prim), "widths") if !none => self.numbers(&mut prim.widths)?,
                (Some(prim), "knotmesh:yarn") if !none => self.numbers(&mut prim.yarns)?,
                (Some(prim), "type" | "basis" | "wrap") => self.token(prim, name)?,
                (Some(_), "curveVertexCounts.timeSamples") => {
                    return Err(self.s.error(
                        at,
                        "point counts that change over time",
                        "the same counts in all frames",
                    ));
                }
                _ => self.s.skip_value()?,
            }
        }
        if self.s.take(b'(')? {
            self.metadata(false)?;
        }
        Ok(())
    }

    fn token(&mut self, prim: &mut Prim, name: &str) -> Result<()> {
        let token = self.s.next()?;
        let Kind::Quoted(value) = token.kind else {
            return Err(self.s.unexpected(token, "a quoted token"));
        };
        match (name, value) {
            ("type", "linear") => prim.linear = true,
            ("type", "cubic") | ("basis", "catmullRom") => {}
            ("basis", "bezier") => prim.bezier = true,
            ("basis", other) => prim.other_basis = Some(other.into()),
            ("wrap", "nonperiodic") => prim.wrap = Wrap::Nonperiodic,
            ("wrap", "pinned") => prim.wrap = Wrap::Pinned,
            ("wrap", "periodic") => prim.wrap = Wrap::Periodic,
            ("type", _) => return Err(self.s.unexpected(token, "\"linear\" or \"cubic\"")),
            _ => return Err(self.s.unexpected(token, "\"nonperiodic\", \"pinned\" or \"periodic\"")),
        }
        Ok(())
    }

    /// Goes through a bracketed list, a comma after each item but perhaps the last.
    fn list(&mut self, mut item: impl FnMut(&mut Scanner) -> Result<()>) -> Result<()> {
        self.s.expect(b'[')?;
        while !self.s.take(b']')? {
            item(&mut self.s)?;
            if !self.s.take(b',')? {
                return self.s.expect(b']');
            }
        }
        Ok(())
    }

    fn numbers(&mut self, numbers: &mut Vec<f64>) -> Result<()> {
        numbers.clear();
        self.list(|s| {
            numbers.push(s.number("a finite number")?);
            Ok(())
        })
    }

    fn triples(&mut self) -> Result<Vec<DVec3>> {
        let mut points = Vec::new();
        self.list(|s| {
            const EXPECTED: &str = "a point, three finite numbers";
            s.expect(b'(')?;
            let x = s.number(EXPECTED)?;
            s.expect(b',')?;
            let y = s.number(EXPECTED)?;
            s.expect(b',')?;
            points.push(DVec3::new(x, y, s.number(EXPECTED)?));
            s.take(b',')?;
            s.expect(b')')
        })?;
        Ok(points)
    }

    fn samples(&mut self, prim: &mut Prim) -> Result<()> {
        self.s.expect(b'{')?;
        while !self.s.take(b'}')? {
            let token = self.s.next()?;
            // The colon belongs to the number's word.
            let time = match token.kind {
                Kind::Word(word) => word.strip_suffix(':').or(Some(word)).and_then(|w| w.parse::<f64>().ok()),
                _ => None,
            };
            let Some(time) = time.filter(|t| t.is_finite()) else {
                return Err(self.s.unexpected(token, "a time and ':'"));
            };
            if !matches!(token.kind, Kind::Word(w) if w.ends_with(':')) {
                let colon = self.s.next()?;
                if colon.kind != Kind::Word(":") {
                    return Err(self.s.unexpected(colon, "':'"));
                }
            }
            if prim.samples.last().is_some_and(|(last, _)| *last >= time) {
                return Err(self.s.unexpected(token, "a time after the one before"));
            }
            let points = self.triples()?;
            prim.samples.push((time, points));
            if !self.s.take(b',')? {
                return self.s.expect(b'}');
            }
        }
        Ok(())
    }

    /// Puts the prims' curves together, frame by frame.
    fn frames(mut self) -> Result<Vec<Curves>> {
        let mut times: Vec<f64> = self.prims.iter().flat_map(|p| p.samples.iter().map(|s| s.0)).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let (mut phantoms, mut bezier, mut odd_basis) = (0, 0, None);
        for prim in &mut self.prims {
            if prim.counts.iter().any(|&n| !(n >= 0.0 && n.fract() == 0.0 && n <= i32::MAX as f64)) {
                return Err(self.s.error(
                    prim.at,
                    "a point count that is no count",
                    "whole numbers of at least 0",
                ));
            }
            let total: f64 = prim.counts.iter().sum();
            let frames = prim.samples.iter().map(|s| s.1.len());
            let still = prim.samples.is_empty().then_some(prim.points.len());
            if let Some(found) = frames.chain(still).find(|&n| n as f64 != total) {
                let expected = format!("{total}, the sum of curveVertexCounts");
                return Err(self.s.error(prim.at, format_args!("{found} points"), expected));
            }
            if prim.widths.iter().any(|&w| w < 0.0) {
                return Err(self.s.error(prim.at, "a negative width", "widths of at least 0"));
            }
            if !prim.linear {
                phantoms += usize::from(prim.wrap == Wrap::Nonperiodic && !prim.bezier);
                bezier += usize::from(prim.bezier);
                odd_basis = odd_basis.or(prim.other_basis.take());
            }
        }
        if times.len() > 1 {
            self.header.fact("time codes", format_args!("{} to {}", times[0], times[times.len() - 1]));
        }
        self.header.note(self.transforms, |n| format!("{n} transforms are not applied"));
        self.header.note(phantoms, |n| {
            format!("{n} prims are nonperiodic cubic curves, which do not reach their end points; all points are kept")
        });
        self.header
            .note(bezier, |n| format!("{n} prims are Bezier curves; only the points on the curve are kept"));
        if let Some(basis) = odd_basis {
            self.header
                .notes
                .push(format!("the basis is '{basis}'; its control points are taken as they are"));
        }
        if times.is_empty() {
            return Ok(vec![self.frame(f64::INFINITY)]);
        }
        // Every frame of several prims holds all of their points, so the frames must not outgrow the file.
        let uneven = self.prims.iter().any(|p| !p.samples.is_empty() && p.samples.len() != times.len());
        if uneven {
            return Err(Error::input(
                self.path,
                1,
                1,
                "prims with different time codes",
                "the same time codes for all curves",
            ));
        }
        let still: usize = self.prims.iter().filter(|p| p.samples.is_empty()).map(|p| p.points.len()).sum();
        if still.saturating_mul(times.len()) > 1 << 28 {
            let found = format!("{still} points that do not move in {} frames", times.len());
            return Err(Error::input(self.path, 1, 1, found, "moving curves"));
        }
        Ok(times.iter().map(|&time| self.frame(time)).collect())
    }

    /// The curves at a time code.
    fn frame(&self, time: f64) -> Curves {
        let mut curves = Curves::empty();
        for prim in &self.prims {
            let held = prim.samples.partition_point(|s| s.0 <= time).max(1);
            let points = prim.samples.get(held - 1).map_or(&prim.points, |s| &s.1);
            let closed = prim.wrap == Wrap::Periodic;
            let mut begin = 0;
            for (i, &count) in prim.counts.iter().enumerate() {
                let end = begin + count as usize;
                let step = if prim.bezier && !prim.linear { 3 } else { 1 };
                curves.points.extend(points[begin..end].iter().step_by(step));
                curves.end_yarn(closed, prim.radius(i, begin));
                begin = end;
            }
        }
        let order: Vec<f64> = self.prims.iter().flat_map(|p| p.yarns.iter().copied()).collect();
        reorder(curves, &order)
    }
}

impl Prim {
    /// Half the width of a curve: one for all, one per curve, or the one at its first point.
    fn radius(&self, curve: usize, first_point: usize) -> Option<f64> {
        let per_curve = self.widths.len() == self.counts.len();
        let at = match self.widths.len() {
            0 => return None,
            1 => 0,
            _ if per_curve => curve,
            _ => first_point,
        };
        self.widths.get(at).map(|w| 0.5 * w)
    }
}

/// Puts the yarns back into the order that the writer noted, if it is one.
fn reorder(curves: Curves, order: &[f64]) -> Curves {
    let count = curves.closed.len();
    let mut places = vec![usize::MAX; count];
    for (yarn, &place) in order.iter().enumerate() {
        if yarn < count && place >= 0.0 && place < count as f64 && place.fract() == 0.0 {
            places[place as usize] = yarn;
        }
    }
    if order.len() != count || places.contains(&usize::MAX) {
        return curves;
    }
    let mut sorted = Curves::empty();
    for yarn in places {
        sorted.points.extend_from_slice(&curves.points[curves.offsets[yarn]..curves.offsets[yarn + 1]]);
        sorted.end_yarn(curves.closed[yarn], curves.radius[yarn]);
    }
    sorted
}
