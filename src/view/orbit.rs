//! A camera on an orbit, moved as in Blender.

use crate::render::camera::{Axes, FIELD};
use crate::render::{Camera, View};
use glam::{DVec2, DVec3};

/// Angle of view of what is nearly without perspective.
const FLAT: f64 = 0.02;

/// A camera that looks at a place from some side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    axes: Axes,
    target: DVec3,
    /// To the eye, as with perspective.
    distance: f64,
    view: View,
    flat: bool,
}

impl Default for Orbit {
    fn default() -> Self {
        Self {
            axes: Axes::Y_UP,
            target: DVec3::ZERO,
            distance: 1.0,
            view: View { azimuth: 0.0, elevation: 0.0 },
            flat: false,
        }
    }
}

impl Orbit {
    /// Frames all of a box, in a picture of so much width per height. What lies in a plane is looked at from its front.
    pub fn fit(&mut self, bounds: [DVec3; 2], aspect: f64) {
        let size = bounds[1] - bounds[0];
        self.axes = if size.z < 0.2 * size.x.max(size.y) { Axes::Y_UP } else { Axes::Z_UP };
        let camera = Camera::framing(bounds, &self.axes, self.view, aspect, 1.0);
        (self.target, self.distance) = (camera.target, camera.eye.distance(camera.target));
    }

    /// Looks from a side.
    pub fn look_from(&mut self, azimuth: f64, elevation: f64) {
        self.view = View { azimuth, elevation: elevation.clamp(-90.0, 90.0) };
    }

    /// With perspective, or next to none.
    pub fn toggle_perspective(&mut self) {
        self.flat = !self.flat;
    }

    /// Turns by a drag, in parts of the picture's height.
    pub fn turn(&mut self, by: DVec2) {
        let View { azimuth, elevation } = self.view;
        self.look_from((azimuth - 180.0 * by.x) % 360.0, elevation + 180.0 * by.y);
    }

    /// Moves what is looked at along with a drag, in parts of the picture's height.
    pub fn pan(&mut self, by: DVec2) {
        let high = 2.0 * (FIELD / 2.0).tan() * self.distance;
        let [right, up, _] = self.frame();
        self.target += (up * by.y - right * by.x) * high;
    }

    /// Comes nearer by a factor.
    pub fn zoom(&mut self, factor: f64) {
        if factor.is_finite() && factor > 0.0 {
            self.distance = (self.distance / factor).clamp(1e-9, 1e9);
        }
    }

    /// Right, up, and to the eye.
    pub fn frame(&self) -> [DVec3; 3] {
        let Axes { up, front } = self.axes;
        let right = up.cross(front);
        let (sin, cos) = self.view.azimuth.to_radians().sin_cos();
        let level = front * cos + right * sin;
        let side = right * cos - front * sin;
        let (sin, cos) = self.view.elevation.to_radians().sin_cos();
        [side, up * cos - level * sin, level * cos + up * sin]
    }

    /// The camera.
    pub fn camera(&self) -> Camera {
        let [_, up, towards] = self.frame();
        let (field, far) = if self.flat {
            (FLAT, self.distance * (FIELD / 2.0).tan() / (FLAT / 2.0).tan())
        } else {
            (FIELD, self.distance)
        };
        Camera { eye: self.target + towards * far, target: self.target, up, field }
    }
}

/// Where a camera sees a place in a picture of that many points across and down, and how far in front of the eye it is.
pub fn project(camera: &Camera, size: DVec2, place: DVec3) -> Option<(DVec2, f64)> {
    let at = camera.to_view().transform_point3(place);
    let scale = size.y / 2.0 / (camera.field / 2.0).tan();
    let depth = -at.z;
    (depth > 0.0).then(|| (size / 2.0 + DVec2::new(at.x, -at.y) * scale / depth, depth))
}

/// World units that a point of the picture is across at a depth.
pub fn per_point(camera: &Camera, size: DVec2, depth: f64) -> f64 {
    2.0 * (camera.field / 2.0).tan() * depth / size.y
}

/// Which place is seen next to a point of the picture, at most so many points away; of those as near, the one in front.
pub fn nearest(
    camera: &Camera,
    size: DVec2,
    at: DVec2,
    most: f64,
    places: impl Iterator<Item = DVec3>,
) -> Option<usize> {
    let seen = places.enumerate().filter_map(|(k, place)| {
        let (point, depth) = project(camera, size, place)?;
        let off = point.distance(at);
        (off <= most).then_some((k, off, depth))
    });
    let seen: Vec<(usize, f64, f64)> = seen.collect();
    // The far side of a tube is seen through its near one: half as near again counts as as near.
    let least = seen.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
    let front = seen.iter().filter(|s| s.1 <= least * 1.5 + 2.0).min_by(|a, b| a.2.total_cmp(&b.2))?;
    Some(front.0)
}
