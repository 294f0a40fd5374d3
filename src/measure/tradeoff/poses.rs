//! Frames to measure, where nobody gave any: a mesh under deformations of the space it lies in.

use glam::DVec3;

/// The positions of a frame.
#[derive(Clone, Debug)]
pub struct Pose {
    /// What stands in tables.
    pub name: String,
    /// `[vertex]` world units.
    pub positions: Vec<DVec3>,
}

/// The bend's whole angle, radians.
const BEND: f64 = std::f64::consts::FRAC_PI_2;

/// The mesh as it is; stretched by 1.3 along its longest side, by 1.3 along its second longest; sheared by 0.2
/// (the longest side along the second); bent by a quarter turn (the longest side towards the shortest).
/// Sides are those of the box around `positions` (`[vertex]`, world units).
pub fn standard(positions: &[DVec3]) -> Vec<Pose> {
    let low = positions.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = positions.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let (middle, size) = ((low + high) * 0.5, high - low);
    let mut sides = [0, 1, 2];
    sides.sort_by(|a, b| size[*b].total_cmp(&size[*a]));
    let [long, second, short] = sides;
    let radius = size[long] / BEND;
    let bend = |mut p: DVec3| {
        if radius > 0.0 {
            let (sin, cos) = (p[long] / radius).sin_cos();
            let arm = radius + p[short];
            (p[long], p[short]) = (arm * sin, arm * cos - radius);
        }
        p
    };
    let scaled = |axis: usize| {
        move |mut p: DVec3| {
            p[axis] *= 1.3;
            p
        }
    };
    let sheared = |mut p: DVec3| {
        p[long] += 0.2 * p[second];
        p
    };
    let pose = |name: &str, place: &dyn Fn(DVec3) -> DVec3| Pose {
        name: name.into(),
        positions: positions.iter().map(|p| middle + place(*p - middle)).collect(),
    };
    vec![
        pose("as it is", &|p| p),
        pose("longest side x 1.3", &scaled(long)),
        pose("second side x 1.3", &scaled(second)),
        pose("sheared by 0.2", &sheared),
        pose("bent by 90 degrees", &bend),
    ]
}
