//! Where a picture is taken from.

use crate::{Error, Result};
use glam::{DMat4, DVec3};

/// A perspective camera, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it stands.
    pub eye: DVec3,
    /// What is in the middle of its picture.
    pub target: DVec3,
    /// What points upwards in its picture, about.
    pub up: DVec3,
    /// Angle of view from bottom to top, radians.
    pub field: f64,
}

/// Angle of view from bottom to top unless asked otherwise, radians: that of a lens that knitwear is photographed with.
pub const FIELD: f64 = 0.4;

/// From which side things are looked at: turned about the upward axis, then raised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Degrees; 0 looks from the front, 90 from the right side of what is looked at.
    pub azimuth: f64,
    /// Degrees above the horizon, -90 to 90.
    pub elevation: f64,
}

impl View {
    /// From the front.
    pub const FRONT: Self = Self { azimuth: 0.0, elevation: 0.0 };

    /// Views by name.
    pub const NAMES: [(&'static str, Self); 7] = [
        ("front", Self::FRONT),
        ("back", Self { azimuth: 180.0, elevation: 0.0 }),
        ("left", Self { azimuth: -90.0, elevation: 0.0 }),
        ("right", Self { azimuth: 90.0, elevation: 0.0 }),
        ("top", Self { azimuth: 0.0, elevation: 90.0 }),
        ("bottom", Self { azimuth: 0.0, elevation: -90.0 }),
        ("quarter", Self { azimuth: 35.0, elevation: 25.0 }),
    ];
}

impl std::str::FromStr for View {
    type Err = Error;

    /// A name of [`View::NAMES`], or `AZIMUTH,ELEVATION` in degrees.
    fn from_str(text: &str) -> Result<Self> {
        if let Some((_, view)) = Self::NAMES.iter().find(|(name, _)| *name == text) {
            return Ok(*view);
        }
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|x| x.abs() <= 3600.0);
        let both = text.split_once(',').and_then(|(a, e)| Some((number(a)?, number(e)?)));
        match both {
            Some((azimuth, elevation)) if elevation.abs() <= 90.0 => Ok(Self { azimuth, elevation }),
            _ => {
                let names = Self::NAMES.map(|(name, _)| name).join(", ");
                Err(Error::invalid(format_args!(
                    "found view '{text}', expected {names}, or degrees around and above: 35,25"
                )))
            }
        }
    }
}

/// Which way things stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Upwards.
    pub up: DVec3,
    /// Towards the viewer of their front, at right angles to `up`.
    pub front: DVec3,
}

impl Axes {
    /// y upwards, z to the front: how fabric lies in a plane, and what most programs take.
    pub const Y_UP: Self = Self { up: DVec3::Y, front: DVec3::Z };
    /// z upwards, -y to the front, as in Blender.
    pub const Z_UP: Self = Self { up: DVec3::Z, front: DVec3::NEG_Y };

    /// The direction from what is looked at to the eye, and what is up in the picture.
    fn towards(&self, view: View) -> (DVec3, DVec3) {
        let right = self.up.cross(self.front);
        let (sin, cos) = view.azimuth.to_radians().sin_cos();
        let level = self.front * cos + right * sin;
        let (sin, cos) = view.elevation.to_radians().sin_cos();
        (level * cos + self.up * sin, self.up * cos - level * sin)
    }
}

impl Camera {
    /// A camera at which all of a box (its two corners) is in a picture of so much width per height, seen from a side;
    /// `zoom` 2 shows half of it.
    pub fn framing(bounds: [DVec3; 2], axes: &Axes, view: View, aspect: f64, zoom: f64) -> Self {
        let (towards, up) = axes.towards(view);
        let right = up.cross(towards);
        let middle = (bounds[0] + bounds[1]) / 2.0;
        let (mut distance, tangent) = (1e-9, (FIELD / 2.0).tan() * 0.92);
        for corner in 0..8 {
            let pick = |axis: usize| bounds[corner >> axis & 1][axis];
            let at = DVec3::new(pick(0), pick(1), pick(2)) - middle;
            // In the picture where |across| <= tangent (distance - depth).
            let depth = at.dot(towards);
            let across = at.dot(up).abs().max(at.dot(right).abs() / aspect);
            distance = f64::max(distance, depth + across / tangent);
        }
        Self { eye: middle + towards * (distance / zoom), target: middle, up, field: FIELD }
    }

    /// The same, turned about the upward axis through its target by an angle in degrees.
    pub fn turned(&self, axes: &Axes, degrees: f64) -> Self {
        let turn = glam::DQuat::from_axis_angle(axes.up, degrees.to_radians());
        let eye = self.target + turn * (self.eye - self.target);
        Self { eye, up: turn * self.up, ..*self }
    }

    /// From the target to the eye; length 1.
    pub fn towards(&self) -> DVec3 {
        (self.eye - self.target).normalize_or(DVec3::Z)
    }

    /// World to the camera's own axes: x right, y up, z towards the viewer.
    pub fn to_view(&self) -> DMat4 {
        let towards = self.towards();
        let right = self.up.cross(towards).normalize_or(towards.any_orthonormal_vector());
        let up = towards.cross(right);
        let turn = glam::DMat3::from_cols(right, up, towards).transpose();
        DMat4::from_mat3(turn) * DMat4::from_translation(-self.eye)
    }
}
