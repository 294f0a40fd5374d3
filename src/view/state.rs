//! What a person edits, as plain data: what undo goes back to.

use crate::io::chart;
use crate::io::text::extension;
use crate::mesh::StitchMesh;
use crate::scene::Mode;
use crate::{Error, Result, knot};
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;

/// What is shown, as its file holds it.
#[derive(Clone, Debug)]
pub enum Content {
    /// A pattern, or a chart as text or JSON.
    Text(Arc<str>),
    /// A chart as a PNG picture.
    Picture(Arc<[u8]>),
    /// A stitch mesh, as read.
    Mesh(Arc<StitchMesh>),
}

impl PartialEq for Content {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Content::Text(a), Content::Text(b)) => a == b,
            (Content::Picture(a), Content::Picture(b)) => a == b,
            // Meshes are not edited: equal ones are one.
            (Content::Mesh(a), Content::Mesh(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// What kind of file it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `.knit`
    Pattern,
    /// `.chart`, `.json`
    Chart,
    /// `.png`
    Picture,
    /// `.smobj`, `.obj`
    Mesh,
}

impl Kind {
    /// By the extension.
    ///
    /// # Errors
    /// Another one.
    pub fn of(path: &Path) -> Result<Self> {
        Ok(match extension(path).as_str() {
            "knit" => Self::Pattern,
            "png" => Self::Picture,
            _ if chart::is_chart(path) => Self::Chart,
            "smobj" | "obj" => Self::Mesh,
            other => {
                return Err(Error::invalid(format_args!(
                    "{}: found a file of kind '.{other}', expected a pattern (.knit), a chart (.chart, .json, .png) or a \
                     mesh (.smobj, .obj)",
                    path.display()
                )));
            }
        })
    }

    /// Whether it is knit here: what has no mesh of its own.
    pub fn is_knit(self) -> bool {
        self != Self::Mesh
    }
}

/// What can be set beside the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Patterns and charts: stitches and rows on 10 cm, instead of their own.
    pub gauge: Option<[f64; 2]>,
    /// Meshes: world units per course spacing, instead of what is measured.
    pub unit: Option<f64>,
    /// Which of a pattern's sizes.
    pub size: Option<String>,
    /// Knot spacing.
    pub beta: f64,
    /// Weight of angles.
    pub weight_angle: f64,
    /// Weight of lengths.
    pub weight_length: f64,
    /// Steps of the solve at most.
    pub iterations: u32,
    /// What is done with the templates' points.
    pub mode: Mode,
    /// Whether all modes are shown side by side.
    pub compare: bool,
}

impl Default for Settings {
    fn default() -> Self {
        let knot::Settings { beta, weight_angle, weight_length, .. } = knot::Settings::default();
        // One more than usual: there are no tables to start from while settings change.
        let iterations = 4;
        let (mode, compare) = (Mode::Relax, false);
        Self {
            gauge: None,
            unit: None,
            size: None,
            beta,
            weight_angle,
            weight_length,
            iterations,
            mode,
            compare,
        }
    }
}

impl Settings {
    /// The modes that are shown, from left to right.
    pub fn modes(&self) -> Vec<Mode> {
        if self.compare { vec![Mode::Embed, Mode::Knots, Mode::Relax] } else { vec![self.mode] }
    }

    /// As the solver takes them.
    pub fn of_solver(&self) -> knot::Settings {
        knot::Settings {
            iterations: self.iterations,
            beta: self.beta,
            weight_angle: self.weight_angle,
            weight_length: self.weight_length,
            ..knot::Settings::default()
        }
    }
}

/// A vertex that is pulled somewhere, and the fabric around it along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// The vertex.
    pub vertex: u32,
    /// How far, world units.
    pub by: DVec3,
    /// How far along the fabric others come along, world units.
    pub reach: f64,
    /// Vertices of the mesh it was pulled in: in others it does nothing.
    pub of: usize,
}

/// Everything that edits change.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The file's content.
    pub content: Content,
    /// What is set beside it.
    pub settings: Settings,
    /// What is pulled, one after the other.
    pub pulls: Arc<Vec<Pull>>,
}
