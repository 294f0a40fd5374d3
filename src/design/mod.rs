//! From what knitters write to a stitch mesh: patterns of rows and rounds, charts, garments.
//!
//! Data flows one way: text -> tokens -> statements ([`syntax`]) -> rows written out stitch by stitch (`expand`) ->
//! faces and joins (`work`, [`fabric`]) -> places (`place`) -> [`StitchMesh`]. Faces are those of Yuksel et al. 2012,
//! *Stitch Meshes for Modeling Knitted Clothing with Yarn-level Detail*: quads, pentagons where stitches are made or
//! taken together, triangles where yarn begins, ends or is bare.

pub mod chart;
pub mod expression;
pub mod fabric;
pub mod program;
pub mod stitch;
pub mod syntax;
pub mod token;

mod assemble;
mod expand;
mod needles;
mod parse;
mod place;
mod section;
mod work;

pub use parse::parse;
pub use program::{Files, Settings};
pub use work::Made;

use crate::mesh::StitchMesh;
use crate::{Error, Result};
use expression::Gauge;
use program::Failure;
use std::path::Path;

/// What became of a pattern.
#[derive(Clone, Debug)]
pub struct Knitted {
    /// The mesh, metres, front out; `face_source` and `face_origins` say where in the pattern each face comes from.
    pub mesh: StitchMesh,
    /// Its title, if it has one.
    pub title: Option<String>,
    /// The size that was worked, if it has sizes.
    pub size: Option<String>,
    /// The gauge it was worked at.
    pub gauge: Gauge,
    /// Stitches by how they came about.
    pub made: Made,
    /// Its pieces.
    pub pieces: Vec<PieceSummary>,
    /// Edges that a loop leaves through and nothing holds; there are none.
    pub loose_loops: usize,
}

/// A piece, in numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PieceSummary {
    /// Its name.
    pub name: String,
    /// Worked in the round.
    pub round: bool,
    /// Rows or rounds, cast-on and bind-off among them.
    pub rows: usize,
    /// The most stitches there were on the needles after a row.
    pub widest: usize,
}

/// Works a pattern: `text` is what `path` holds (which is only for messages).
///
/// # Errors
/// The first place that is not a pattern, or whose instruction cannot be followed, by line and column.
pub fn knit(path: &Path, text: &str, settings: &Settings, files: &dyn Files) -> Result<Knitted> {
    let statements = parse(path, text)?;
    knit_statements(path, &statements, settings, files)
}

/// The same from statements that were read or made before.
pub fn knit_statements(
    path: &Path,
    statements: &[syntax::Statement],
    settings: &Settings,
    files: &dyn Files,
) -> Result<Knitted> {
    let worked = program::work(statements, settings, files).map_err(|failure| match failure {
        Failure::File(error) => error,
        Failure::Pattern(p) => {
            Error::input(path, p.place.line as usize, p.place.column as usize, p.found, p.expected)
        }
    })?;
    let fabric = &worked.knitter.fabric;
    let corners = assemble::Corners::new(fabric);
    let positions = place::place(fabric, &corners, worked.gauge);
    let mut mesh = assemble::stitch_mesh(fabric, &corners, positions);
    mesh.gauge = Some([worked.gauge.width, worked.gauge.height]);
    let pieces = fabric.pieces.iter().enumerate().map(|(number, piece)| {
        let rows = fabric.rows.iter().filter(|r| r.piece as usize == number);
        PieceSummary {
            name: piece.name.clone(),
            round: piece.round,
            rows: rows.clone().count(),
            widest: rows.map(|r| r.stitches).max().unwrap_or(0),
        }
    });
    Ok(Knitted {
        mesh,
        title: worked.title.clone(),
        size: worked.size.clone(),
        gauge: worked.gauge,
        made: worked.knitter.made,
        pieces: pieces.collect(),
        loose_loops: assemble::loose_loops(fabric, &corners).len(),
    })
}
