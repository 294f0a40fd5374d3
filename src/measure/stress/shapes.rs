//! Random shapes of faces, beyond what cloth does: each by the number of its face and the seed alone.

use glam::{DMat2, DMat3, DQuat, DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Families of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Principal stretches of [`MILD`], moved rigidly: what garments do.
    Mild,
    /// Principal stretches of 1e-3 to 1e3.
    Stretched,
    /// The two directions of the fabric drawn together, up to 1e-9 of a radian.
    Sheared,
    /// Turned over by a reflection, and stretched by 0.1 to 10.
    Inverted,
    /// Two corners swapped, a corner beyond the opposite side, or folded along a line through the middle.
    Folded,
    /// Corners off the plane by up to 10 faces.
    NonPlanar,
    /// One direction shrunk by 1e-12 to 1e-3.
    Sliver,
    /// Corners that coincide, some or all, or that lie on one line.
    Coincident,
    /// Corners anywhere, at scales of 0.01 to 100.
    Scattered,
    /// Mild, up to 1e6 faces from the origin.
    Far,
    /// Mild, of 1e-12 to 1e12 times the gauge.
    Scaled,
    /// Coordinates below the smallest normal numbers, or replaced by numbers at the ends of f32 and f64.
    Denormal,
    /// NaN or infinities among the coordinates.
    NotFinite,
    /// What it was in the frame before, but moved a little, turned over, turned round or scaled by 1e-3 or 1e3.
    Jump,
}

impl Kind {
    /// All of them.
    pub const ALL: [Kind; 14] = [
        Kind::Mild,
        Kind::Stretched,
        Kind::Sheared,
        Kind::Inverted,
        Kind::Folded,
        Kind::NonPlanar,
        Kind::Sliver,
        Kind::Coincident,
        Kind::Scattered,
        Kind::Far,
        Kind::Scaled,
        Kind::Denormal,
        Kind::NotFinite,
        Kind::Jump,
    ];

    /// As printed.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Mild => "mild",
            Kind::Stretched => "stretched",
            Kind::Sheared => "sheared",
            Kind::Inverted => "inverted",
            Kind::Folded => "folded",
            Kind::NonPlanar => "non-planar",
            Kind::Sliver => "sliver",
            Kind::Coincident => "coincident",
            Kind::Scattered => "scattered",
            Kind::Far => "far",
            Kind::Scaled => "scaled",
            Kind::Denormal => "denormal",
            Kind::NotFinite => "not finite",
            Kind::Jump => "jump",
        }
    }
}

/// Principal stretches of mild faces.
pub const MILD: (f64, f64) = (0.8, 1.25);
/// Numbers that arithmetic trips over.
const POISON: [f64; 12] = [
    0.0,
    -0.0,
    1e-30,
    -1e-30,
    1e30,
    -1e30,
    5e-324,
    f64::MIN_POSITIVE,
    f32::MIN_POSITIVE as f64,
    f32::MAX as f64,
    1e300,
    -1.7e308,
];

/// A generator for a thing of a run: the same numbers whatever was drawn before.
pub fn random(seed: u64, stream: u64, number: u64) -> fastrand::Rng {
    // splitmix64's finaliser, so that neighbouring numbers give unlike generators.
    let mix = |x: u64| {
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    fastrand::Rng::with_seed(mix(mix(mix(seed) ^ stream.wrapping_add(1)) ^ number))
}

/// A face's kind and its corners, template units, relative to the origin. `rest` are the template's corners;
/// `before` gives the corners of the frame before.
pub fn shape(
    random: &mut fastrand::Rng,
    rest: &[DVec2],
    before: impl FnOnce() -> Vec<DVec3>,
) -> (Kind, Vec<DVec3>) {
    let mut draw = Draw(random);
    let kind = Kind::ALL[draw.0.usize(..Kind::ALL.len())];
    let corners = draw.corners(kind, rest, before);
    // What f32 holds it is to get without rounding, so that both precisions see the same face.
    let round = |x: f64| {
        let near = x as f32;
        if near.is_finite() && (near != 0.0 || x == 0.0) { f64::from(near) } else { x }
    };
    (kind, corners.into_iter().map(|p| DVec3::new(round(p.x), round(p.y), round(p.z))).collect())
}

struct Draw<'a>(&'a mut fastrand::Rng);

impl Draw<'_> {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.f64()
    }

    /// 10^x, x uniform.
    fn power(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(self.between(low, high))
    }

    fn vector(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.between(-size, size), self.between(-size, size), self.between(-size, size))
    }

    /// The symmetric matrix with these stretches along random axes.
    fn principal(&mut self, first: f64, second: f64) -> DMat2 {
        let turn = DMat2::from_angle(self.between(0.0, PI));
        turn * DMat2::from_diagonal(DVec2::new(first, second)) * turn.transpose()
    }

    fn stretch(&mut self, low: f64, high: f64) -> DMat2 {
        let [first, second] = [0, 1].map(|_| self.power(low.log10(), high.log10()));
        self.principal(first, second)
    }

    fn turn(&mut self) -> DMat3 {
        // One in eight stays in the plane, where rotations round nothing.
        if self.0.u8(..8) == 0 {
            return DMat3::IDENTITY;
        }
        let q = [0; 4].map(|_| self.between(-1.0, 1.0));
        let q = DQuat::from_array(q);
        if q.length() > 0.1 { DMat3::from_quat(q.normalize()) } else { DMat3::IDENTITY }
    }

    fn corners(&mut self, kind: Kind, rest: &[DVec2], before: impl FnOnce() -> Vec<DVec3>) -> Vec<DVec3> {
        let n = rest.len();
        let middle = rest.iter().sum::<DVec2>() / n as f64;
        let plane = |f: DMat2| rest.iter().map(|c| (f * (*c - middle)).extend(0.0)).collect::<Vec<_>>();
        let mut corners = match kind {
            Kind::Stretched => plane(self.stretch(1e-3, 1e3)),
            Kind::Sheared => {
                let angle = self.power(-9.0, 0.0) * PI * 0.5;
                let angle = if self.0.bool() { PI - angle } else { angle };
                plane(DMat2::from_cols(DVec2::X, DVec2::new(angle.cos(), angle.sin())))
            }
            Kind::Inverted => plane(self.stretch(0.1, 10.0) * DMat2::from_diagonal(DVec2::new(-1.0, 1.0))),
            Kind::NonPlanar => {
                let height = self.power(-3.0, 1.0);
                let mut corners = plane(self.stretch(0.5, 2.0));
                corners.iter_mut().for_each(|c| c.z = self.between(-height, height));
                corners
            }
            Kind::Sliver => {
                let (first, second) = (self.power(-1.0, 1.0), self.power(-12.0, -3.0));
                plane(self.principal(first, second))
            }
            Kind::Scattered => {
                let size = self.power(-2.0, 2.0);
                (0..n).map(|_| self.vector(size)).collect()
            }
            _ => plane(self.stretch(MILD.0, MILD.1)),
        };
        match kind {
            Kind::Folded => self.fold(&mut corners),
            Kind::Coincident => self.join(&mut corners),
            Kind::Jump => return self.jump(before()),
            _ => {}
        }
        let turn = self.turn();
        let away = match kind {
            Kind::Far => {
                let far = self.power(2.0, 6.0);
                self.vector(far)
            }
            _ => self.vector(10.0),
        };
        let scale = match kind {
            Kind::Scaled => self.power(-12.0, 12.0),
            Kind::Denormal => match self.0.u8(..4) {
                0 => self.power(-45.0, -37.0),
                1 => self.power(-323.0, -307.0),
                _ => 1.0,
            },
            _ => 1.0,
        };
        for corner in &mut corners {
            *corner = (turn * *corner + away) * scale;
        }
        if kind == Kind::Denormal && scale == 1.0 {
            self.poison(&mut corners, &POISON);
        }
        if kind == Kind::NotFinite {
            self.poison(&mut corners, &[f64::NAN, f64::INFINITY, f64::NEG_INFINITY]);
        }
        corners
    }

    fn fold(&mut self, corners: &mut [DVec3]) {
        let n = corners.len();
        let k = self.0.usize(..n);
        match self.0.u8(..3) {
            0 => corners.swap(k, (k + 1) % n),
            1 => corners[k] = -corners[k] * self.power(-1.0, 1.0),
            _ => {
                // What lies on one side of a line through the middle turns about it.
                let axis = DVec2::from_angle(self.between(0.0, TAU));
                let turn = DMat3::from_axis_angle(axis.extend(0.0), self.between(0.0, PI));
                for c in corners.iter_mut().filter(|c| axis.perp_dot(c.truncate()) > 0.0) {
                    *c = turn * *c;
                }
            }
        }
    }

    fn join(&mut self, corners: &mut [DVec3]) {
        let n = corners.len();
        let k = self.0.usize(..n);
        match self.0.u8(..4) {
            0 => corners[k] = corners[(k + 1) % n],
            1 => corners[k] = corners[(k + 2) % n],
            2 => corners.fill(corners[k]),
            _ => {
                let (a, b) = (corners[k], corners[(k + 1) % n]);
                corners.iter_mut().for_each(|c| *c = a.lerp(b, self.between(-1.0, 2.0)));
            }
        }
    }

    fn poison(&mut self, corners: &mut [DVec3], numbers: &[f64]) {
        for _ in 0..self.0.usize(1..=3) {
            let (corner, axis) = (self.0.usize(..corners.len()), self.0.usize(..3));
            corners[corner][axis] = numbers[self.0.usize(..numbers.len())];
        }
    }

    fn jump(&mut self, mut corners: Vec<DVec3>) -> Vec<DVec3> {
        let first = corners[0];
        let how = self.0.u8(..5);
        let small = self.power(-6.0, -1.0);
        for c in &mut corners {
            let off = *c - first;
            *c = match how {
                0 => *c,
                1 => *c + off.length().min(1e30) * self.vector(small),
                2 => first + off * DVec3::new(-1.0, 1.0, 1.0),
                3 => first - off,
                _ if small < 1e-3 => first + off * 1e-3,
                _ => first + off * 1e3,
            };
        }
        corners
    }
}
