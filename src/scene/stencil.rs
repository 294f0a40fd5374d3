//! A template compiled for the kernels: weights, gradients, rest values and the terms of the energy.

use super::Mode;
use super::terms::Terms;
use crate::math::{Scalar, V2};
use crate::template::coordinates::{Coordinates, edge_weights, weights};
use crate::template::{Place, Strand, Template};
use glam::DVec2;

/// How a point moves with its knot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// On an edge; interpolated.
    Boundary,
    /// center + sign * l * d.
    Contact,
    /// center + sign * r * b.
    Control,
    /// Interpolated.
    Free,
}

impl Role {
    /// The role's number in result files.
    pub fn code(self) -> u8 {
        match self {
            Role::Boundary => 0,
            Role::Contact => 1,
            Role::Control => 2,
            Role::Free => 3,
        }
    }
}

/// A point of a stencil.
#[derive(Clone, Copy, Debug)]
pub struct StencilPoint<T> {
    /// What moves it.
    pub role: Role,
    /// The knot of a contact or control.
    pub knot: u32,
    /// +1 or -1 for a contact or control.
    pub sign: T,
    /// Height over the face, template units.
    pub z: T,
}

/// A template compiled for one mode and one kind of coordinates. All lengths in template units.
#[derive(Clone, Debug)]
pub struct Stencil<T> {
    /// Corners of the face.
    pub corner_count: usize,
    /// Points of all strands, one after the other.
    pub points: Vec<StencilPoint<T>>,
    /// `[strand + 1]` strand s is `points[offsets[s] .. offsets[s + 1]]`.
    pub strand_offsets: Vec<usize>,
    /// `[point][corner]` weights of the points' rest places.
    pub weights: Vec<T>,
    /// `[corner]` gradients of the weights at the mean of the corners.
    pub frame_gradients: Vec<V2<T>>,
    /// `[knot]` d at rest.
    pub knot_direction: Vec<V2<T>>,
    /// `[knot]` l at rest.
    pub knot_half_length: Vec<T>,
    /// `[knot][corner]` weights of the centres.
    pub knot_weights: Vec<T>,
    /// `[knot][corner]` gradients of the weights at the centres.
    pub knot_gradients: Vec<V2<T>>,
    /// Root mean square distance of the knot centres to their mean.
    pub rest_spread: T,
    /// r.
    pub yarn_radius: T,
    /// The residuals of the energy.
    pub terms: Terms<T>,
}

impl Stencil<f64> {
    /// Compiles a template.
    pub fn new(template: &Template, mode: Mode, coordinates: Coordinates) -> Self {
        let embed = mode == Mode::Embed;
        let strands = mode.strands(template);
        let corners = &template.corners;
        let n = corners.len();
        let mean = corners.iter().sum::<DVec2>() / n as f64;
        let knots: &[_] = if embed { &[] } else { &template.knots };

        let mut stencil = Stencil {
            corner_count: n,
            points: Vec::new(),
            strand_offsets: vec![0],
            weights: Vec::new(),
            frame_gradients: weights(coordinates, corners, mean).1.into_iter().map(V2::of).collect(),
            knot_direction: knots.iter().map(|k| V2::of(k.direction)).collect(),
            knot_half_length: knots.iter().map(|k| k.half_length).collect(),
            knot_weights: Vec::new(),
            knot_gradients: Vec::new(),
            rest_spread: spread(knots.iter().map(|k| k.center)),
            yarn_radius: template.yarn_radius,
            terms: Terms::default(),
        };
        for knot in knots {
            let (w, g) = weights(coordinates, corners, knot.center);
            stencil.knot_weights.extend(w);
            stencil.knot_gradients.extend(g.into_iter().map(V2::of));
        }
        for strand in strands {
            stencil.add_strand(template, strand, coordinates, embed);
        }
        stencil
    }

    fn add_strand(&mut self, template: &Template, strand: &Strand, coordinates: Coordinates, embed: bool) {
        let first = self.points.len();
        let mut rest = Vec::with_capacity(strand.len());
        for point in strand {
            let at = template.place(point.place);
            rest.push(at.extend(point.z));
            self.weights.extend(match point.place {
                Place::Boundary { edge, along } => edge_weights(self.corner_count, edge as usize, along),
                _ => weights(coordinates, &template.corners, at).0,
            });
            let (role, knot, sign) = match point.place {
                Place::Boundary { .. } => (Role::Boundary, 0, 0.0),
                Place::Free { .. } => (Role::Free, 0, 0.0),
                // Nothing of `embed` is owned by a knot.
                _ if embed => (Role::Free, 0, 0.0),
                Place::Contact { knot, sign } => (Role::Contact, knot, sign),
                Place::Control { knot, sign } => (Role::Control, knot, sign),
            };
            self.points.push(StencilPoint { role, knot, sign, z: point.z });
        }
        self.strand_offsets.push(self.points.len());

        self.terms.add_strand(&self.points, first, &rest, &self.knot_half_length, template.yarn_radius);
    }

    /// The same stencil in another precision.
    pub fn cast<T: Scalar>(&self) -> Stencil<T> {
        let vector = |v: &V2<f64>| V2::new(T::of(v.u), T::of(v.v));
        let scalars = |v: &[f64]| v.iter().map(|x| T::of(*x)).collect::<Vec<_>>();
        Stencil {
            corner_count: self.corner_count,
            points: self
                .points
                .iter()
                .map(|p| StencilPoint { role: p.role, knot: p.knot, sign: T::of(p.sign), z: T::of(p.z) })
                .collect(),
            strand_offsets: self.strand_offsets.clone(),
            weights: scalars(&self.weights),
            frame_gradients: self.frame_gradients.iter().map(vector).collect(),
            knot_direction: self.knot_direction.iter().map(vector).collect(),
            knot_half_length: scalars(&self.knot_half_length),
            knot_weights: scalars(&self.knot_weights),
            knot_gradients: self.knot_gradients.iter().map(vector).collect(),
            rest_spread: T::of(self.rest_spread),
            yarn_radius: T::of(self.yarn_radius),
            terms: self.terms.cast(),
        }
    }
}

impl<T> Stencil<T> {
    /// Number of knots.
    pub fn knot_count(&self) -> usize {
        self.knot_half_length.len()
    }
}

/// Root mean square distance of points to their mean; 0 for none.
fn spread(points: impl Iterator<Item = DVec2> + Clone) -> f64 {
    let n = points.clone().count().max(1) as f64;
    let mean = points.clone().sum::<DVec2>() / n;
    (points.map(|p| (p - mean).length_squared()).sum::<f64>() / n).sqrt()
}
