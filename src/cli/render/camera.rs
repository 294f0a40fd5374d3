//! Where pictures are taken from, where nobody says.

use super::source::Source;
use super::{Arguments, Up};
use glam::DVec3;
use knotmesh::render::Strands;
use knotmesh::render::camera::{Axes, Camera, FIELD, View};

/// A box is flat where it is thinner than this, in terms of its second extent.
const THIN: f64 = 0.25;
/// From a little to the side and above.
const SLIGHT: View = View { azimuth: 25.0, elevation: 15.0 };

/// Pictures are filled to this share.
const FILLED: f64 = 0.92;
/// Points that framing looks at, of all frames.
const MOST_POINTS: usize = 200_000;

/// Where yarn is, in all frames.
pub struct Extent {
    bounds: [DVec3; 2],
    /// Some of the points.
    points: Vec<DVec3>,
    /// How far yarn reaches beyond them.
    radius: f64,
}

impl Extent {
    /// Adds a frame of so many.
    pub fn add(extent: &mut Option<Self>, strands: &Strands, frames: usize) {
        let Some([low, high]) = strands.bounds() else { return };
        let all = extent.get_or_insert(Self { bounds: [low, high], points: Vec::new(), radius: 0.0 });
        all.bounds = [all.bounds[0].min(low), all.bounds[1].max(high)];
        let most = (MOST_POINTS / frames.max(1)).max(1000);
        let every = strands.points.len().div_ceil(most).max(1);
        let place = |p: &[f32; 3]| strands.origin + DVec3::from(p.map(f64::from)) * strands.unit;
        all.points.extend(strands.points.iter().step_by(every).map(place));
        let thickest = strands.radius.iter().copied().fold(0.0, f32::max);
        all.radius = all.radius.max(f64::from(thickest) * strands.unit);
    }

    /// The thickest yarn's, world units.
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

/// Cameras of all pictures of a run.
pub struct Framing {
    camera: Camera,
    axes: Axes,
}

impl Framing {
    /// So that all yarn is in a picture of `size`.
    pub fn new(arguments: &Arguments, source: &Source, extent: &Extent, size: [u32; 2]) -> Self {
        let axes = match arguments.up.or_else(|| source.up()) {
            Some(Up::Z) => Axes::Z_UP,
            Some(Up::Y) | None => Axes::Y_UP,
        };
        let view = arguments.camera.unwrap_or_else(|| usual(extent.bounds, &axes, source.front()));
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let start = Camera::framing(extent.bounds, &axes, view, aspect, 1.0);
        let turns = arguments.turntable.map_or(1, |n| n.min(24));
        let angles: Vec<f64> = (0..turns).map(|i| 360.0 * f64::from(i) / f64::from(turns)).collect();
        let mut camera = fitted(extent, start, &axes, aspect, &angles);
        camera.eye = camera.target + (camera.eye - camera.target) / arguments.zoom;
        if let Some(place) = arguments.target {
            let aside = place.0 - camera.target;
            camera = Camera { eye: camera.eye + aside, target: place.0, ..camera };
        }
        Self { camera, axes }
    }

    /// Pixels that a length at the target takes in a picture so many high.
    pub fn pixels(&self, length: f64, height: u32) -> f64 {
        length * f64::from(height)
            / (2.0 * (self.camera.field / 2.0).tan() * self.camera.eye.distance(self.camera.target))
    }

    /// The camera turned by an angle in degrees.
    pub fn camera(&self, turn: f64) -> Camera {
        if turn == 0.0 { self.camera } else { self.camera.turned(&self.axes, turn) }
    }
}

/// A camera that sees as its start does, as near as it can be with all points in its picture, at all angles; their middle is the
/// picture's.
fn fitted(extent: &Extent, start: Camera, axes: &Axes, aspect: f64, angles: &[f64]) -> Camera {
    let tangent = (FIELD / 2.0).tan() * FILLED;
    let mut camera = start;
    // The middle moves with the distance, and the distance with the middle.
    for _ in 0..4 {
        let mut distance = f64::max(4.0 * extent.radius, 1e-9);
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        let from = (camera.eye - camera.target).length();
        for angle in angles {
            let turned = camera.turned(axes, *angle);
            let towards = turned.towards();
            let right = turned.up.cross(towards).normalize_or_zero();
            let up = towards.cross(right);
            for p in &extent.points {
                let p = *p - camera.target;
                let (x, y, depth) = (p.dot(right), p.dot(up), p.dot(towards) + extent.radius);
                let across = ((x.abs() + extent.radius) / aspect).max(y.abs() + extent.radius);
                distance = distance.max(depth + across / tangent);
                let (x, y) = (x / (from - depth).max(1e-9), y / (from - depth).max(1e-9));
                ends = [ends[0].min(x), ends[1].max(x), ends[2].min(y), ends[3].max(y)];
            }
        }
        let towards = camera.towards();
        let up = (camera.up - towards * camera.up.dot(towards)).normalize_or_zero();
        let middle =
            [ends[0] + ends[1], ends[2] + ends[3]].map(|m| if m.is_finite() { m / 2.0 * from } else { 0.0 });
        // What is turned stays on its axis.
        let aside = if angles.len() > 1 {
            axes.up * middle[1]
        } else {
            up.cross(towards) * middle[0] + up * middle[1]
        };
        camera.target += aside;
        camera.eye = camera.target + towards * distance;
    }
    camera
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
    let azimuth = match (axis.dot(right), axis.dot(axes.front)) {
        (side, _) if side.abs() > 0.5 => 90.0 * side.signum(),
        (_, front) if front < 0.0 => 180.0,
        _ => 0.0,
    };
    View { azimuth, elevation: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen red with the fabric's front left out.
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
