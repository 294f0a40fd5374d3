//! Keyframed motion: translation, turn about an axis and scale about a centre, interpolated over time.

use glam::{DMat3, DQuat, DVec3};

/// An affine map: `x -> linear x + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Rotation and scale.
    pub linear: DMat3,
    /// Metres.
    pub offset: DVec3,
}

impl Pose {
    /// Leaves everything where it is.
    pub const IDENTITY: Pose = Pose { linear: DMat3::IDENTITY, offset: DVec3::ZERO };

    /// Where a point goes.
    pub fn apply(&self, point: DVec3) -> DVec3 {
        self.linear * point + self.offset
    }

    /// Where a point of a rigid pose comes from. Wrong if the pose scales.
    pub fn undo_rigid(&self, point: DVec3) -> DVec3 {
        self.linear.transpose() * (point - self.offset)
    }

    /// This pose, then another.
    pub fn then(&self, next: &Pose) -> Pose {
        Pose { linear: next.linear * self.linear, offset: next.apply(self.offset) }
    }
}

/// How values between two keys follow from them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight from key to key.
    Linear,
    /// With zero speed at every key: 3 s^2 - 2 s^3 of the way.
    #[default]
    Smooth,
}

/// A pose at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Seconds.
    pub time: f64,
    /// Metres.
    pub translate: DVec3,
    /// Radians about the motion's axis, counter-clockwise seen from its tip; may go beyond a full turn.
    pub turn: f64,
    /// Factors along x, y and z, before turning.
    pub scale: DVec3,
}

impl Key {
    /// A key that leaves everything where it is.
    pub fn rest(time: f64) -> Self {
        Key { time, translate: DVec3::ZERO, turn: 0.0, scale: DVec3::ONE }
    }
}

/// A motion: `x -> centre + translate + R(axis, turn) (scale * (x - centre))`, the numbers interpolated between keys.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// What turns and scales keep in place, metres; none: the mean of what is moved (for colliders, their own origin).
    pub center: Option<DVec3>,
    /// What is turned about; any length but zero.
    pub axis: DVec3,
    /// Between keys.
    pub interpolation: Interpolation,
    /// Starts again after the last key. Otherwise the last key's pose is kept.
    pub repeat: bool,
    /// With rising times; before the first and after the last, these hold.
    pub keys: Vec<Key>,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            center: None,
            axis: DVec3::Y,
            interpolation: Interpolation::Smooth,
            repeat: false,
            keys: Vec::new(),
        }
    }
}

impl Motion {
    /// The interpolated key at a time in seconds.
    pub fn key(&self, time: f64) -> Key {
        let (Some(first), Some(last)) = (self.keys.first(), self.keys.last()) else {
            return Key::rest(time);
        };
        let mut at = time;
        if self.repeat && last.time > first.time && time > first.time {
            at = first.time + (time - first.time).rem_euclid(last.time - first.time);
        }
        let next = self.keys.partition_point(|k| k.time <= at);
        if next == 0 {
            return *first;
        }
        let Some(b) = self.keys.get(next) else { return *last };
        let a = &self.keys[next - 1];
        let s = (at - a.time) / (b.time - a.time);
        let s = match self.interpolation {
            Interpolation::Linear => s,
            Interpolation::Smooth => s * s * (3.0 - 2.0 * s),
        };
        Key {
            time,
            translate: a.translate.lerp(b.translate, s),
            turn: a.turn + (b.turn - a.turn) * s,
            scale: a.scale.lerp(b.scale, s),
        }
    }

    /// The pose at a time in seconds; `center` stands in where the motion names none.
    pub fn pose(&self, time: f64, center: DVec3) -> Pose {
        let key = self.key(time);
        let center = self.center.unwrap_or(center);
        let turn = DMat3::from_quat(DQuat::from_axis_angle(self.axis.normalize_or(DVec3::Y), key.turn));
        let linear = turn * DMat3::from_diagonal(key.scale);
        Pose { linear, offset: center + key.translate - linear * center }
    }

    /// Whether no key scales.
    pub fn is_rigid(&self) -> bool {
        self.keys.iter().all(|k| k.scale == DVec3::ONE)
    }

    /// Whether nothing ever moves.
    pub fn is_still(&self) -> bool {
        self.keys.iter().all(|k| *k == Key::rest(k.time))
    }
}

/// Several motions, each applied to what the ones before it made: an arm about its shoulder, then with the body.
pub fn pose_of(motions: &[Motion], time: f64, center: DVec3) -> Pose {
    motions.iter().fold(Pose::IDENTITY, |pose, motion| pose.then(&motion.pose(time, center)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(interpolation: Interpolation) -> Motion {
        let end = Key { time: 3.0, translate: DVec3::X, turn: 4.0, scale: DVec3::new(2.0, 1.0, 1.0) };
        Motion { interpolation, keys: vec![Key::rest(1.0), end], ..Motion::default() }
    }

    #[test]
    fn keys_are_met_and_kept() {
        let motion = motion(Interpolation::Smooth);
        assert_eq!(motion.key(-1.0).turn, 0.0);
        assert_eq!(motion.key(2.0).turn, 2.0);
        assert!((motion.key(1.5).turn - 4.0 * 0.15625).abs() < 1e-15);
        assert_eq!(motion.key(9.0).scale.x, 2.0);
        assert_eq!(self::motion(Interpolation::Linear).key(1.5).turn, 1.0);
    }

    #[test]
    fn repeats_begin_again() {
        let motion = Motion { repeat: true, ..motion(Interpolation::Linear) };
        assert!((motion.key(3.5).turn - motion.key(1.5).turn).abs() < 1e-15);
        assert!((motion.key(102.5).turn - motion.key(2.5).turn).abs() < 1e-12);
    }

    #[test]
    fn poses_turn_about_the_centre() {
        let key = Key { turn: std::f64::consts::FRAC_PI_2, ..Key::rest(0.0) };
        let motion = Motion { axis: DVec3::Z * 3.0, keys: vec![key], ..Motion::default() };
        let pose = motion.pose(0.0, DVec3::X);
        assert!(pose.apply(DVec3::new(2.0, 0.0, 5.0)).abs_diff_eq(DVec3::new(1.0, 1.0, 5.0), 1e-14));
        assert!(pose.undo_rigid(pose.apply(DVec3::ONE)).abs_diff_eq(DVec3::ONE, 1e-14));
        let twice = pose_of(&[motion.clone(), motion], 0.0, DVec3::X);
        assert!(twice.apply(DVec3::ZERO).abs_diff_eq(DVec3::X * 2.0, 1e-14));
    }
}
