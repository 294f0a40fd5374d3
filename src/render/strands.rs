//! What is drawn: yarns by their control points, as plain data.

use crate::{Error, Result};
use glam::DVec3;

/// Yarns as they are drawn. Places are relative to `origin` in units of `unit`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strands {
    /// World position that places are relative to.
    pub origin: DVec3,
    /// World units per unit of places, radii and lengths.
    pub unit: f64,
    /// `[point]` control points of centripetal Catmull-Rom curves, one yarn after the other.
    pub points: Vec<[f32; 3]>,
    /// `[yarn + 1]` yarn i is `points[offsets[i] .. offsets[i + 1]]`.
    pub offsets: Vec<u32>,
    /// `[yarn]` closed yarns do not repeat their first point.
    pub closed: Vec<bool>,
    /// `[yarn]` radius.
    pub radius: Vec<f32>,
    /// `[point]` length at rest of the segment that begins there (its chord); 0 where it is not known: then what it is at first.
    pub rest: Vec<f32>,
    /// `[point]` colours, sRGB.
    pub colours: Vec<[u8; 3]>,
}

impl Strands {
    /// Number of yarns.
    pub fn yarn_count(&self) -> usize {
        self.closed.len()
    }

    /// The box around all points and their radius, world units; `None` without points.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for (yarn, ends) in self.offsets.windows(2).enumerate() {
            let radius = f64::from(self.radius[yarn]);
            for p in &self.points[ends[0] as usize..ends[1] as usize] {
                let p = DVec3::from(p.map(f64::from));
                bounds = [bounds[0].min(p - radius), bounds[1].max(p + radius)];
            }
        }
        (bounds[0].x <= bounds[1].x).then(|| bounds.map(|p| self.origin + p * self.unit))
    }

    /// Checks that the parts fit each other.
    ///
    /// # Errors
    /// Lengths that do not match; radii that are not positive; places that are not finite.
    pub fn check(&self) -> Result<()> {
        let fault = |what: std::fmt::Arguments| Err(Error::invalid(what));
        let (points, yarns) = (self.points.len(), self.closed.len());
        if self.offsets.len() != yarns + 1 || self.radius.len() != yarns {
            return fault(format_args!("strands: found other numbers of offsets, radii and closed flags"));
        }
        let rising = self.offsets.windows(2).all(|o| o[0] <= o[1]);
        if self.offsets[0] != 0 || !rising || self.offsets[yarns] as usize != points {
            return fault(format_args!("strands: found offsets that do not divide the {points} points"));
        }
        if self.rest.len() != points || self.colours.len() != points {
            return fault(format_args!(
                "strands: expected a rest length and a colour for each of {points} points"
            ));
        }
        if let Some(yarn) = self.radius.iter().position(|r| !(r.is_finite() && *r > 0.0)) {
            return fault(format_args!(
                "yarn {}: found a radius of {}, expected a positive one",
                yarn + 1,
                self.radius[yarn]
            ));
        }
        if !(self.unit.is_finite() && self.unit > 0.0 && self.origin.is_finite()) {
            return fault(format_args!("strands: expected a positive unit and a finite origin"));
        }
        match self.points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            Some(i) => {
                fault(format_args!("point {}: found {:?}, expected finite places", i + 1, self.points[i]))
            }
            None => Ok(()),
        }
    }
}
