//! Where pictures are taken from, where nobody says.

use super::source::Source;
use super::{Arguments, Up};
use glam::DVec3;
use knotmesh::render::camera::{Axes, Camera, View};

/// A box is flat where it is thinner than this, in terms of its second extent.
const THIN: f64 = 0.25;
/// From a little to the side and above.
const SLIGHT: View = View { azimuth: 25.0, elevation: 15.0 };

/// Cameras of all pictures of a run.
pub struct Framing {
    camera: Camera,
    axes: Axes,
}

impl Framing {
    /// So that all of a box is in a picture of `size`.
    pub fn new(arguments: &Arguments, source: &Source, bounds: [DVec3; 2], size: [u32; 2]) -> Self {
        let axes = match arguments.up.or_else(|| source.up()) {
            Some(Up::Z) => Axes::Z_UP,
            Some(Up::Y) | None => Axes::Y_UP,
        };
        let view = arguments.camera.unwrap_or_else(|| usual(bounds, &axes, source.front()));
        let bounds = if arguments.turntable.is_some() { swept(bounds, axes.up) } else { bounds };
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let mut camera = Camera::framing(bounds, &axes, view, aspect, arguments.zoom);
        if let Some(place) = arguments.target {
            let aside = place.0 - camera.target;
            camera = Camera { eye: camera.eye + aside, target: place.0, ..camera };
        }
        Self { camera, axes }
    }

    /// The camera turned by an angle in degrees.
    pub fn camera(&self, turn: f64) -> Camera {
        if turn == 0.0 { self.camera } else { self.camera.turned(&self.axes, turn) }
    }
}

/// What is flat is seen from its front (`front`: the fabric's, where it has one), the rest a little from the side and above.
fn usual(bounds: [DVec3; 2], axes: &Axes, front: Option<DVec3>) -> View {
    let extent = bounds[1] - bounds[0];
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| extent[*a].total_cmp(&extent[*b]));
    if extent[order[0]] > THIN * extent[order[1]] {
        return SLIGHT;
    }
    let axis = DVec3::AXES[order[0]];
    let axis = axis * if front.map_or(1.0, |f| f.dot(axis)) < 0.0 { -1.0 } else { 1.0 };
    let right = axes.up.cross(axes.front);
    if axis.dot(axes.up).abs() > 0.5 {
        return View { azimuth: 0.0, elevation: 90.0 * axis.dot(axes.up).signum() };
    }
    View { azimuth: axis.dot(right).atan2(axis.dot(axes.front)).to_degrees().round(), elevation: 0.0 }
}

/// The box around a box that is turned about an upward axis through its middle.
fn swept(bounds: [DVec3; 2], up: DVec3) -> [DVec3; 2] {
    let middle = (bounds[0] + bounds[1]) / 2.0;
    let half = (bounds[1] - bounds[0]) / 2.0;
    let level = half - up * half.dot(up);
    // The corners of a square box around a circle come nearer than the circle does: seldom by much.
    let around = (DVec3::ONE - up.abs()) * level.length() + up.abs() * half.dot(up).abs();
    [middle - around, middle + around]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen red with the fabric's front left out, and with THIN at 2.
    #[test]
    fn flat_things_are_seen_from_their_front() {
        let around = |x: f64, y: f64, z: f64| [-DVec3::new(x, y, z), DVec3::new(x, y, z)];
        let at = |azimuth, elevation| View { azimuth, elevation };
        assert_eq!(usual(around(3.0, 2.0, 0.1), &Axes::Y_UP, None), View::FRONT);
        assert_eq!(usual(around(3.0, 2.0, 0.1), &Axes::Y_UP, Some(DVec3::NEG_Z)), at(180.0, 0.0));
        assert_eq!(usual(around(3.0, 0.1, 2.0), &Axes::Y_UP, Some(DVec3::Y)), at(0.0, 90.0));
        assert_eq!(usual(around(3.0, 0.1, 2.0), &Axes::Z_UP, Some(DVec3::NEG_Y)), View::FRONT);
        assert_eq!(usual(around(0.1, 3.0, 2.0), &Axes::Y_UP, None), at(90.0, 0.0));
        assert_eq!(usual(around(2.0, 3.0, 2.0), &Axes::Y_UP, None), SLIGHT);
    }
}
