//! The knot model against yarn-level simulation: the same swatch of plain knit, stretched, sheared and bent, by templates
//! and by a table of the precomputed method, whose displacements are results of simulation.
//!
//! Both methods' curves are read alike. Seen from the front the loops of neighbouring rows cross four times a stitch; a
//! knot's contacts are such crossings by construction, so crossings are what both have in common. What is compared is how
//! they move *off the surface's motion*: `d = x(pose) - F x(rest)`. It is 0 for interpolation, and free of the difference
//! between the methods' rest shapes to first order. `knotmesh measure --against-database` prints and draws what [`run`]
//! returns.

pub mod fitted;
mod panels;
pub mod plot;
pub mod poses;
pub mod rows;
pub mod shape;
pub mod swatch;
pub mod table;

use crate::Result;
use crate::database::Settings;
use crate::pattern::YarnModel;
use crate::template::TemplateLibrary;
use fitted::Cells;
use poses::Pose;
use shape::{Distances, Places, Shape, Window, distances};
use swatch::{Method, Swatch, Weaving};

/// One pose of one method.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The pose.
    pub pose: Pose,
    /// The method.
    pub method: Method,
    /// To the table's yarn, both off the surface's motion; at rest: of the rest shapes as they are.
    pub distances: Distances,
    /// The loops' own measures.
    pub shape: Shape,
    /// Points whose strain lies outside the table.
    pub outside: usize,
    /// Stitches whose rows do not cross as a plain knit's do; they are left out.
    pub lost: usize,
}

/// All figures, and what they were taken of.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The pattern's stitches, and the template made after them.
    pub cells: Cells,
    /// Radii of each method's yarn, metres.
    pub radii: Vec<(Method, f64)>,
    /// Pose after pose, all methods of each: the rest first.
    pub figures: Vec<Figure>,
}

/// Compares on a swatch of a model's own stitches. `library` is where the templates come from that are not made after the
/// pattern.
///
/// # Errors
/// A pattern that is no plain knit; those of compiling and of frames.
pub fn run(
    model: &YarnModel,
    library: &TemplateLibrary,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Comparison> {
    let cells = Cells::new(&model.pattern)?;
    let swatch = Swatch::new(&cells);
    let window = Window { count: cells.count, stitch: cells.stitch };
    let radius = model.pattern.radius;
    let mut poses = vec![Pose::REST];
    poses.extend(Pose::all(model, &Settings::default(), cells.height));
    // A method at a time, `[method][pose]`: its memory is let go before the next.
    let total = Method::ALL.len() * poses.len();
    let (mut all, mut radii) = (Vec::new(), Vec::new());
    for method in Method::ALL {
        let mut weaving = Weaving::new(method, &swatch, &cells, model, library)?;
        radii.push((method, weaving.radius));
        let mut places = Vec::with_capacity(poses.len());
        for pose in &poses {
            let (loops, outside) = weaving.loops(pose)?;
            places.push((Places::new(&loops, swatch.half, window, radius, weaving.radius), outside));
            progress(places.len() + all.len() * poses.len(), total);
        }
        all.push(places);
    }
    let mut figures = Vec::with_capacity(total);
    for (i, pose) in poses.iter().enumerate() {
        for (method, places) in Method::ALL.into_iter().zip(&all) {
            let rests = pose.series.map(|_| [&places[0].0, &all[0][0].0]);
            figures.push(Figure {
                pose: *pose,
                method,
                distances: distances(pose, &places[i].0, &all[0][i].0, rests, radius),
                shape: places[i].0.shape,
                outside: places[i].1,
                lost: places[i].0.lost,
            });
        }
    }
    Ok(Comparison { cells, radii, figures })
}
