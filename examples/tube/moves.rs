//! Ways in which a tube moves, from how it stands at time 0 to time 1.

use glam::{DMat3, DVec3};

/// A way of moving.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Nothing moves.
    Still,
    /// The whole turns and travels.
    Rigid,
    /// The upper 40 % bend by a quarter turn, the rest stands.
    Sleeve,
    /// Everything grows longer, to 1.3, and narrower, to 0.9.
    Stretch,
    /// Every corner trembles on its own, up to 0.05 course spacings each way.
    Noise,
}

impl Motion {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Still, Self::Rigid, Self::Sleeve, Self::Stretch, Self::Noise];

    /// In lower case.
    pub fn name(self) -> &'static str {
        ["still", "rigid", "sleeve", "stretch", "noise"][self as usize]
    }

    /// Where frame `frame` of `frames` has a point of a tube of some height, standing on z = 0.
    pub fn place(self, p: DVec3, height: f64, frame: usize, frames: usize) -> DVec3 {
        let t = frame as f64 / (frames - 1).max(1) as f64;
        match self {
            Self::Still => p,
            Self::Rigid => {
                DMat3::from_rotation_y(1.5 * t) * DMat3::from_rotation_z(2.0 * t) * p
                    + DVec3::new(40.0, 5.0, 10.0) * t
            }
            Self::Sleeve => bent(p, t, height),
            Self::Stretch => p * DVec3::new(1.0 - 0.1 * t, 1.0 - 0.1 * t, 1.0 + 0.3 * t),
            Self::Noise => p + tremble(p, frame),
        }
    }
}

/// The upper 40 % of the tube bent towards x: an arc over half of that, straight beyond.
fn bent(p: DVec3, t: f64, height: f64) -> DVec3 {
    let (begin, arc) = (0.6 * height, 0.2 * height);
    let whole = t * std::f64::consts::FRAC_PI_2;
    let up = p.z - begin;
    if up <= 0.0 || whole == 0.0 {
        return p;
    }
    let radius = arc / whole;
    let (sin, cos) = (whole * (up / arc).min(1.0)).sin_cos();
    let beyond = (up - arc).max(0.0);
    // Around the centre of the arc, at x = radius.
    let arm = radius - p.x;
    DVec3::new(radius - arm * cos + beyond * sin, p.y, begin + arm * sin + beyond * cos)
}

/// A random offset, the same for corners at the same place.
fn tremble(p: DVec3, frame: usize) -> DVec3 {
    let cell = (p * 1e4).round();
    let mut bits = 0x9e37_79b9_7f4a_7c15u64.wrapping_mul(frame as u64 + 1);
    for x in cell.to_array() {
        bits = (bits ^ (x as i64 as u64)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        bits ^= bits >> 32;
    }
    let mut next = || {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (bits >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    DVec3::new(next(), next(), next()) * 0.05
}
