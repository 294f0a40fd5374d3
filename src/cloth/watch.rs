//! Whether a frame is one that cloth could make: what is watched so that steps never blow up.

use super::Cloth;
use glam::DVec3;

/// Energy and extent of a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct State {
    /// J
    pub kinetic: f64,
    /// J
    pub elastic: f64,
    /// Greatest distance of a node from the first one, m.
    pub extent: f64,
}

impl State {
    pub fn of(cloth: &Cloth, x: &[DVec3], v: &[DVec3], parts: &mut [f64]) -> Self {
        Self {
            kinetic: kinetic(cloth, v),
            elastic: cloth.energy_in(x, parts),
            extent: x.iter().map(|p| p.distance_squared(x[0])).fold(0.0, f64::max).sqrt(),
        }
    }

    /// Whether `self` may follow on `before`, J of `work` having been done meanwhile by accelerations and moved nodes.
    pub fn may_follow(&self, before: &Self, work: f64, slack: Slack) -> bool {
        let energy = self.kinetic + self.elastic;
        let budget = before.kinetic + before.elastic + work;
        // Not finite compares as false.
        energy <= slack.growth * budget + slack.floor && self.extent <= before.extent + slack.reach
    }
}

/// What energies and extents may rise by without being wrong.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slack {
    /// Factor on the energy that is accounted for.
    pub growth: f64,
    /// J: what collisions may add, which are not accounted for.
    pub floor: f64,
    /// m that two nodes may move apart.
    pub reach: f64,
}

pub(super) fn kinetic(cloth: &Cloth, v: &[DVec3]) -> f64 {
    cloth.masses.iter().zip(v).map(|(m, v)| 0.5 * m * v.length_squared()).sum()
}
