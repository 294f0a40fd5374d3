//! Numbers that a pattern works out: from its sizes, lengths and gauge.

use super::token::Place;
use std::collections::BTreeMap;

/// An expression. Lengths are in metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Expression {
    /// A number, or a length in metres.
    Number(f64),
    /// A name given by `let`, `size` or `for`.
    Name(String, Place),
    /// Minus.
    Negative(Box<Expression>),
    /// Two expressions joined by `+`, `-`, `*` or `/`.
    Binary(char, Box<Expression>, Box<Expression>, Place),
    /// A function of expressions.
    Call(Function, Vec<Expression>, Place),
}

/// What expressions can be put through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// `stitches(length)`: stitches that measure so much, not rounded.
    Stitches,
    /// `rows(length)`: the same of rows.
    Rows,
    /// `width(stitches)`: metres.
    Width,
    /// `height(rows)`: metres.
    Height,
    /// To the nearest whole number.
    Round,
    /// Down.
    Floor,
    /// Up.
    Ceil,
    /// `multiple(x, m)` or `multiple(x, m, plus)`: the nearest number of the form m k + plus.
    Multiple,
    /// The least of two.
    Min,
    /// The greatest of two.
    Max,
    /// `rest(x, m)`: what is left over of x divided by m.
    Rest,
    /// Sine of degrees: where pieces lie is said in directions.
    Sin,
    /// Cosine of degrees.
    Cos,
}

impl Function {
    /// The function of a name, and how many arguments it takes.
    pub fn named(name: &str) -> Option<(Self, std::ops::RangeInclusive<usize>)> {
        Some(match name {
            "stitches" | "sts" => (Function::Stitches, 1..=1),
            "rows" | "rounds" | "rnds" => (Function::Rows, 1..=1),
            "width" => (Function::Width, 1..=1),
            "height" => (Function::Height, 1..=1),
            "round" => (Function::Round, 1..=1),
            "floor" => (Function::Floor, 1..=1),
            "ceil" => (Function::Ceil, 1..=1),
            "multiple" => (Function::Multiple, 2..=3),
            "min" => (Function::Min, 2..=2),
            "max" => (Function::Max, 2..=2),
            "rest" => (Function::Rest, 2..=2),
            "sin" => (Function::Sin, 1..=1),
            "cos" => (Function::Cos, 1..=1),
            _ => return None,
        })
    }
}

/// The size of a plain stitch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    /// Course spacing: the width of a stitch, metres.
    pub width: f64,
    /// Wale spacing: the height of a row, metres.
    pub height: f64,
}

/// Height over width of a plain stitch of the built-in templates.
pub const PLAIN_HEIGHT: f64 = 0.61;

impl Gauge {
    /// So many stitches and rows on 10 cm; without rows, those of the built-in templates.
    pub fn per_10_cm(stitches: f64, rows: Option<f64>) -> Self {
        let width = 0.1 / stitches;
        Self { width, height: rows.map_or(PLAIN_HEIGHT * width, |rows| 0.1 / rows) }
    }
}

impl Default for Gauge {
    /// 22 stitches on 10 cm.
    fn default() -> Self {
        Self::per_10_cm(22.0, None)
    }
}

/// What names stand for.
pub type Names = BTreeMap<String, f64>;

/// Why an expression has no value: its place, what was found, what was expected.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Where.
    pub place: Place,
    /// What was found.
    pub found: String,
    /// What would have been right.
    pub expected: String,
}

impl Problem {
    /// Something found where something else was expected.
    pub fn new(place: Place, found: impl ToString, expected: impl ToString) -> Self {
        Self { place, found: found.to_string(), expected: expected.to_string() }
    }
}

impl Expression {
    /// Its value.
    ///
    /// # Errors
    /// A name that stands for nothing, a division by zero, a number beyond all bounds.
    pub fn value(&self, names: &Names, gauge: Gauge) -> Result<f64, Problem> {
        match self {
            Expression::Number(x) => Ok(*x),
            Expression::Name(name, place) => names.get(name).copied().ok_or_else(|| {
                let known: Vec<&str> = names.keys().map(String::as_str).collect();
                let known = if known.is_empty() { "there are none".into() } else { known.join(", ") };
                Problem::new(
                    *place,
                    format_args!("the unknown name '{name}'"),
                    format_args!("a number or the name of one ({known})"),
                )
            }),
            Expression::Negative(of) => Ok(-of.value(names, gauge)?),
            Expression::Binary(sign, a, b, place) => {
                let (a, b) = (a.value(names, gauge)?, b.value(names, gauge)?);
                finite(
                    match sign {
                        '+' => a + b,
                        '-' => a - b,
                        '*' => a * b,
                        _ => a / b,
                    },
                    *place,
                    format_args!("{a} {sign} {b}"),
                )
            }
            Expression::Call(function, arguments, place) => {
                let x = arguments.iter().map(|a| a.value(names, gauge)).collect::<Result<Vec<f64>, _>>()?;
                let value = match function {
                    Function::Stitches => x[0] / gauge.width,
                    Function::Rows => x[0] / gauge.height,
                    Function::Width => x[0] * gauge.width,
                    Function::Height => x[0] * gauge.height,
                    Function::Round => nearest(x[0]),
                    Function::Floor => (x[0] + 1e-9).floor(),
                    Function::Ceil => (x[0] - 1e-9).ceil(),
                    Function::Multiple => {
                        let plus = x.get(2).copied().unwrap_or(0.0);
                        nearest((x[0] - plus) / x[1]) * x[1] + plus
                    }
                    Function::Min => x[0].min(x[1]),
                    Function::Max => x[0].max(x[1]),
                    Function::Rest => x[0] - (x[0] / x[1] + 1e-9).floor() * x[1],
                    Function::Sin => x[0].to_radians().sin(),
                    Function::Cos => x[0].to_radians().cos(),
                };
                finite(value, *place, format_args!("{function:?} of {x:?}"))
            }
        }
    }
}

/// The nearest whole number. Halves go up, those too that fell short by rounding: 58 cm at 20 stitches are 116.
fn nearest(x: f64) -> f64 {
    (x + 1e-9).round()
}

fn finite(x: f64, place: Place, what: impl std::fmt::Display) -> Result<f64, Problem> {
    if x.is_finite() { Ok(x) } else { Err(Problem::new(place, what, "a finite number")) }
}
