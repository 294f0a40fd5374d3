//! Stitch templates in knot form (model section 2) and the library they are found in.
//!
//! Template space: (u, v) in the face plane, u along the course, v along the wale, z out of the front
//! face. The unit is one course spacing: the face of a plain knit is 1 wide.

pub mod check;
pub mod coordinates;
pub mod derive;
pub mod find_knots;
pub mod library;
pub mod transform;

pub use coordinates::Coordinates;
pub use library::TemplateLibrary;

use glam::DVec2;

/// A knot: where two yarns cross twice (Huang et al. 2025, eq. 1). Contacts lie at
/// `center ± half_length * direction`, controls at `center ± yarn_radius * (direction.y, -direction.x)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Centre (u, v), template units.
    pub center: DVec2,
    /// Unit vector d along the contacts.
    pub direction: DVec2,
    /// Half the distance of the two contacts, template units; at least half the yarn radius.
    pub half_length: f64,
}

/// Where a point of a yarn lies in the plane of the face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// On an edge, where the yarn crosses into the neighbouring face.
    Boundary {
        /// The edge; edge k runs from corner k to corner k + 1.
        edge: u32,
        /// Fraction along the edge, strictly between 0 and 1.
        along: f64,
    },
    /// At a contact of a knot: `center + sign * half_length * direction`.
    Contact {
        /// The knot within the template.
        knot: u32,
        /// +1 or -1.
        sign: f64,
    },
    /// At a control of a knot: `center + sign * yarn_radius * (direction.y, -direction.x)`.
    Control {
        /// The knot within the template.
        knot: u32,
        /// +1 or -1.
        sign: f64,
    },
    /// A free point (u, v): interpolated, never optimised.
    Free {
        /// Its place, template units.
        at: DVec2,
    },
}

/// A point of a yarn of a template.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemplatePoint {
    /// Where it lies in the plane.
    pub place: Place,
    /// Height over the face plane, template units.
    pub z: f64,
}

/// A yarn's way through the face. An end that is no boundary point is an end of the yarn.
pub type Strand = Vec<TemplatePoint>;

/// A stitch template.
#[derive(Clone, Debug, PartialEq)]
pub struct Template {
    /// The stitch's name.
    pub name: String,
    /// One label per edge.
    pub labels: Vec<String>,
    /// The polygon, counter-clockwise from the lower left, template units.
    pub corners: Vec<DVec2>,
    /// Yarn radius r, template units.
    pub yarn_radius: f64,
    /// The knots.
    pub knots: Vec<Knot>,
    /// The yarns.
    pub strands: Vec<Strand>,
    /// For templates read from `.sf`: the original polylines (boundary and free points only), which
    /// `embed` uses; one per strand, in the same order.
    pub polylines: Option<Vec<Strand>>,
    /// What the search for knots found or could not use, one line each (`.sf` only).
    pub notes: Vec<String>,
}

impl Template {
    /// Name and labels joined by single spaces.
    pub fn key(&self) -> String {
        std::iter::once(&self.name).chain(&self.labels).map(String::as_str).collect::<Vec<_>>().join(" ")
    }

    /// Where a point lies at rest, in the plane, template units.
    pub fn place(&self, place: Place) -> DVec2 {
        match place {
            Place::Boundary { edge, along } => {
                let n = self.corners.len();
                self.corners[edge as usize % n].lerp(self.corners[(edge as usize + 1) % n], along)
            }
            Place::Contact { knot, sign } => {
                let knot = &self.knots[knot as usize];
                knot.center + knot.direction * (sign * knot.half_length)
            }
            Place::Control { knot, sign } => {
                let knot = &self.knots[knot as usize];
                knot.center - knot.direction.perp() * (sign * self.yarn_radius)
            }
            Place::Free { at } => at,
        }
    }
}
