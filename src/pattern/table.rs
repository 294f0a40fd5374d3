//! Displacements of a pattern's vertices over a grid of strains.

use crate::{Error, Result};

/// The axes of a table in the order that its values run, the first one fastest: stretch along u, cosine of the angle
/// between deformed u and v, stretch along v.
pub const AXES: [&str; 3] = ["sx", "sa", "sy"];

/// Displacements of a pattern's vertices over stretch and shear (section 3 of the paper).
///
/// `sx = sqrt(C00) - 1`, `sa = C01 / sqrt(C00 C11)`, `sy = sqrt(C11) - 1` of the right Cauchy-Green tensor C (eq. 4).
#[derive(Clone, Debug, PartialEq)]
pub struct StrainTable {
    /// Nodes along sx, sa and sy, rising.
    axes: [Vec<f32>; 3],
    /// `[vertex][sy][sa][sx]` displacement along u, v and height in the undeformed frame, metres, and of the twist, radians.
    values: Vec<[f32; 4]>,
}

impl StrainTable {
    /// Most nodes of an axis.
    pub const MOST_NODES: usize = 32;

    /// A table.
    ///
    /// # Errors
    /// Axes that are empty, too long or do not rise; values that are not finite or not a whole number of vertices.
    pub fn new(axes: [Vec<f32>; 3], values: Vec<[f32; 4]>) -> Result<Self> {
        for (name, axis) in AXES.iter().zip(&axes) {
            if axis.is_empty() || axis.len() > Self::MOST_NODES {
                return Err(Error::invalid(format_args!(
                    "axis {name}: found {} nodes, expected 1 to {}",
                    axis.len(),
                    Self::MOST_NODES
                )));
            }
            if !axis.iter().all(|x| x.is_finite()) || !axis.is_sorted_by(|a, b| a < b) {
                return Err(Error::invalid(format_args!(
                    "axis {name}: found nodes that do not rise, expected rising ones"
                )));
            }
        }
        let nodes: usize = axes.iter().map(Vec::len).product();
        if !values.len().is_multiple_of(nodes) {
            return Err(Error::invalid(format_args!(
                "found {} displacements, expected a multiple of {nodes}: one a node for each vertex",
                values.len()
            )));
        }
        if let Some(bad) = values.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
            return Err(Error::invalid(format_args!(
                "displacement {bad}: found a number that is not finite, expected finite ones"
            )));
        }
        Ok(Self { axes, values })
    }

    /// Nodes along sx, sa and sy.
    pub fn axes(&self) -> &[Vec<f32>; 3] {
        &self.axes
    }

    /// `[vertex][sy][sa][sx]` displacements.
    pub fn values(&self) -> &[[f32; 4]] {
        &self.values
    }

    /// Nodes of a vertex.
    pub fn node_count(&self) -> usize {
        self.axes.iter().map(Vec::len).product()
    }

    /// Number of the pattern's vertices.
    pub fn vertex_count(&self) -> usize {
        self.values.len() / self.node_count()
    }
}
