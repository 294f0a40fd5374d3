//! A pattern as it was written: statements, rows, and what rows are made of.

use super::expression::Expression;
use super::stitch::Stitch;
use super::token::Place;

/// A statement and its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// Where it begins.
    pub place: Place,
    /// What it says.
    pub kind: StatementKind,
}

/// What a statement says.
#[derive(Clone, Debug, PartialEq)]
pub enum StatementKind {
    /// `title "..."`
    Title(String),
    /// `gauge 22 x 36`: stitches and rows on 10 cm.
    Gauge(Expression, Option<Expression>),
    /// `let name = expression`
    Let(String, Expression),
    /// `size NAME: name = expression, ...`
    Size(String, Vec<(String, Expression)>),
    /// `color NAME #rrggbb`
    Colour(String, [u8; 3]),
    /// `chart NAME "file"`
    Chart(String, String),
    /// `piece NAME flat` or `piece NAME round`, and where it lies.
    Piece(Box<Piece>),
    /// `co N`: a cast-on, or more of it; whether it is joined in the round.
    CastOn(Expression, bool),
    /// `Row 1 (RS): ...`
    Row(Box<Row>),
    /// `rep rows 1-4 6 more times`
    Repeat(Repeat),
    /// `for i = 1 to n` ... `end`
    For(String, Expression, Expression, Vec<Statement>),
    /// `bo`: everything that is left.
    BindOff,
    /// `draw`: the yarn is cut and drawn through what is left.
    Draw,
    /// `cut`: the yarn is cut.
    Cut,
    /// `hold N as NAME`, `hold as NAME` (all).
    Hold(Option<Expression>, String),
    /// `from NAME`: held loops come back, to be worked next.
    From(String),
    /// `graft NAME with NAME`, `graft NAME with NAME using TAIL`
    Graft(String, String, Option<String>),
    /// `tail NAME`: the yarn is cut, long enough for a graft that goes on from where it is.
    Tail(String),
    /// `with COLOUR`: what is cast on next, too, is in this colour.
    With(String),
    /// `pick up NAME = right edge of PIECE`
    PickUp(String, Edge, String),
}

/// Which side edge of a flat piece, seen from its front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// Where right-side rows begin.
    Right,
    /// Where they end.
    Left,
}

/// A piece of knitting.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Its name.
    pub name: String,
    /// In the round, else flat.
    pub round: bool,
    /// `flat curled`: rolled into a tube where it is placed.
    pub curled: bool,
    /// `at (x, y, z)`: the middle of its first row.
    pub at: Option<[Expression; 3]>,
    /// `toward (x, y, z)`: where rows grow.
    pub toward: Option<[Expression; 3]>,
    /// `start (x, y, z)`: from the middle to where rounds begin; of flat pieces, to the right edge.
    pub start: Option<[Expression; 3]>,
}

/// A row or round, or several alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// A round.
    pub round: bool,
    /// First and last number of each range; none of a row without number.
    pub numbers: Vec<(Expression, Option<Expression>)>,
    /// `(RS)`, `(WS)`: right side.
    pub right_side: Option<bool>,
    /// What is worked.
    pub content: Content,
    /// `(18 sts)`: what must be on the needles afterwards.
    pub count: Option<(Expression, Place)>,
}

/// What a row consists of.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Its own instructions.
    Items(Vec<Item>),
    /// Those of other rows, one after the other.
    As(Expression, Option<Expression>),
}

/// `rep rows A-B ...`
#[derive(Clone, Debug, PartialEq)]
pub struct Repeat {
    /// First row.
    pub from: Expression,
    /// Last row, if there are several.
    pub to: Option<Expression>,
    /// How often, or until how many.
    pub until: Until,
}

/// How long rows are repeated.
#[derive(Clone, Debug, PartialEq)]
pub enum Until {
    /// `N more times`
    More(Expression),
    /// `until N rows`: rows of this section altogether.
    Rows(Expression),
}

/// An instruction and its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Where it begins.
    pub place: Place,
    /// What it says.
    pub kind: ItemKind,
}

/// What an instruction says.
#[derive(Clone, Debug, PartialEq)]
pub enum ItemKind {
    /// Stitches of one kind.
    Work(Stitch, Times),
    /// `(...) x N`
    Group(Vec<Item>, Expression),
    /// `*...; rep from * ...`
    Star(Vec<Item>, Times),
    /// `pm`, `pm NAME`
    PlaceMarker(String),
    /// `sm`
    SlipMarker,
    /// `rm`
    RemoveMarker,
    /// `w&t`, `turn`: the row ends here, before the next stitch.
    Turn,
    /// `bo N`, `bo`
    BindOff(Option<Expression>),
    /// `co N`
    CastOn(Expression),
    /// `hold N as NAME`
    Hold(Option<Expression>, String),
    /// `from NAME`
    From(String),
    /// `with COLOUR`
    With(String),
    /// `chart NAME`: the chart's row once.
    Chart(String),
    /// `dec N evenly`, `inc N evenly`, over what is left of the row.
    Evenly(bool, Expression),
}

/// How often.
#[derive(Clone, Debug, PartialEq)]
pub enum Times {
    /// So often.
    Count(Expression),
    /// To the end of the row.
    ToEnd,
    /// `to last N sts`
    ToLast(Expression),
    /// `to m`, `to N before m`
    ToMarker(Expression),
    /// Of a star: once and N more times.
    More(Expression),
}
