//! A periodic yarn pattern and how its yarn is displaced under strain: the precomputed data of Sperl, Narain and Wojtan
//! 2021, "Mechanics-Aware Deformation of Yarn Pattern Geometry". Plain data; files are read and written in [`crate::io`].

mod stitches;
mod table;

pub use table::{AXES, StrainTable};

use crate::{Error, Result};
use glam::{DVec2, DVec3, IVec2};

/// The yarn of one period of a fabric. It repeats along u and v.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pattern {
    /// The period along u and v, metres.
    pub size: DVec2,
    /// Yarn radius, metres.
    pub radius: f64,
    /// `[vertex]` places at rest: u, v, and height along the surface's normal, metres. They need not lie within one
    /// period.
    pub places: Vec<DVec3>,
    /// `[vertex]` twist of the edge that leaves the vertex at rest, radians.
    pub twists: Vec<f64>,
    /// `[vertex]` one edge for each, in any order.
    pub edges: Vec<PatternEdge>,
    /// `[vertex]` rest length of the edge that leaves it, metres.
    pub rest_lengths: Vec<f64>,
    /// `[vertex]` reference director of the edge that leaves it: a unit vector across it, before the twist.
    pub directors: Vec<DVec3>,
}

/// A piece of yarn between two vertices of a pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PatternEdge {
    /// The vertex it leaves.
    pub from: u32,
    /// The vertex it reaches, ...
    pub to: u32,
    /// ... so many periods along u and v from the one it left.
    pub tile: IVec2,
}

/// The edges of a pattern by vertex.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Links {
    /// `[vertex]` index of the edge that leaves it.
    pub leaving: Vec<u32>,
    /// `[vertex]` index of the edge that reaches it.
    pub reaching: Vec<u32>,
}

/// A pattern and its displacements.
#[derive(Clone, Debug, PartialEq)]
pub struct YarnModel {
    /// The pattern.
    pub pattern: Pattern,
    /// Displacements of its vertices.
    pub table: StrainTable,
}

impl YarnModel {
    /// A model.
    ///
    /// # Errors
    /// A pattern that [`Pattern::links`] refuses, or a table of another number of vertices.
    pub fn new(pattern: Pattern, table: StrainTable) -> Result<Self> {
        pattern.links()?;
        if table.vertex_count() != pattern.places.len() {
            return Err(Error::invalid(format_args!(
                "found displacements of {} vertices, expected {} as the pattern has",
                table.vertex_count(),
                pattern.places.len()
            )));
        }
        Ok(Self { pattern, table })
    }
}

impl Pattern {
    /// Number of vertices, and of edges.
    pub fn vertex_count(&self) -> usize {
        self.places.len()
    }

    /// The edges by vertex.
    ///
    /// # Errors
    /// What no fabric has: sizes that are not positive, numbers that are not finite, a vertex that not just one edge leaves
    /// and one reaches.
    pub fn links(&self) -> Result<Links> {
        let n = self.places.len();
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let lengths = [
            ("twists", self.twists.len()),
            ("edges", self.edges.len()),
            ("rest lengths", self.rest_lengths.len()),
            ("directors", self.directors.len()),
        ];
        if let Some((name, found)) = lengths.into_iter().find(|(_, found)| *found != n) {
            return Err(Error::invalid(format_args!("found {found} {name}, expected {n}: one a vertex")));
        }
        if n == 0 || n > 1 << 16 {
            return Err(Error::invalid(format_args!("found {n} vertices, expected 1 to {}", 1 << 16)));
        }
        if !(positive(self.size.x) && positive(self.size.y) && positive(self.radius)) {
            return Err(Error::invalid(format_args!(
                "found a pattern of {} x {} with yarn of radius {}, expected positive numbers",
                self.size.x, self.size.y, self.radius
            )));
        }
        for i in 0..n {
            if !(self.places[i].is_finite() && self.twists[i].is_finite() && self.directors[i].is_finite()) {
                return Err(Error::invalid(format_args!(
                    "vertex {i}: found numbers that are not finite, expected finite ones"
                )));
            }
            if !positive(self.rest_lengths[i]) {
                return Err(Error::invalid(format_args!(
                    "vertex {i}: found a rest length of {}, expected a positive number",
                    self.rest_lengths[i]
                )));
            }
        }
        const NONE: u32 = u32::MAX;
        let mut links = Links { leaving: vec![NONE; n], reaching: vec![NONE; n] };
        for (i, edge) in self.edges.iter().enumerate() {
            for (vertex, list, verb) in
                [(edge.from, &mut links.leaving, "leaves"), (edge.to, &mut links.reaching, "reaches")]
            {
                let Some(place) = list.get_mut(vertex as usize) else {
                    return Err(Error::invalid(format_args!(
                        "edge {i}: found vertex {vertex}, expected one below {n}"
                    )));
                };
                if *place != NONE {
                    return Err(Error::invalid(format_args!(
                        "edge {i}: found that it {verb} vertex {vertex} as edge {place} does, expected one edge to and one \
                         from each vertex"
                    )));
                }
                *place = i as u32;
            }
        }
        Ok(links)
    }
}
