//! How the swatch is deformed: a few series, each over one amount, within what the table was sampled over.

use crate::database::Settings;
use crate::pattern::YarnModel;
use glam::{DMat2, DVec2, DVec3};

/// A series of deformations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Series {
    /// Stretched along the courses by an amount (0.5 is half as long again), as wide as before.
    Course,
    /// Stretched along the wales.
    Wale,
    /// Stretched along both.
    Both,
    /// Sheared: lengths along courses and wales stay, the amount is the cosine of the angle between them.
    Shear,
    /// The same, stretched by [`STRETCHED`] along both.
    ShearStretched,
    /// Courses rolled up, wales straight; the amount is the curvature times the yarn radius, positive towards the front.
    BendCourse,
    /// Wales rolled up.
    BendWale,
}

/// How far [`Series::ShearStretched`] is stretched.
pub const STRETCHED: f64 = 0.3;

impl Series {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Course,
        Self::Wale,
        Self::Both,
        Self::Shear,
        Self::ShearStretched,
        Self::BendCourse,
        Self::BendWale,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        ["course", "wale", "both", "shear", "shear-stretched", "bend-course", "bend-wale"][self as usize]
    }

    /// What it is, in words.
    pub fn title(self) -> &'static str {
        [
            "stretched along courses",
            "stretched along wales",
            "stretched along both",
            "sheared",
            "sheared, stretched by 0.3",
            "courses bent",
            "wales bent",
        ][self as usize]
    }

    /// What the amount is.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Course | Self::Wale | Self::Both => "strain",
            Self::Shear | Self::ShearStretched => "cosine of the angle",
            Self::BendCourse | Self::BendWale => "curvature x yarn radius",
        }
    }

    fn amounts(self) -> &'static [f64] {
        match self {
            Self::Course | Self::Wale | Self::Both => {
                &[-0.1, -0.05, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0]
            }
            Self::Shear => &[-0.2, -0.15, -0.1, -0.05, 0.05, 0.1, 0.15, 0.2],
            Self::ShearStretched => &[-0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5],
            Self::BendCourse | Self::BendWale => &[-0.06, -0.04, -0.02, -0.01, 0.01, 0.02, 0.04, 0.06],
        }
    }

    /// Strains along courses, cosine of the angle, strain along wales.
    fn strains(self, amount: f64) -> [f64; 3] {
        match self {
            Self::Course => [amount, 0.0, 0.0],
            Self::Wale => [0.0, 0.0, amount],
            Self::Both => [amount, 0.0, amount],
            Self::Shear => [0.0, amount, 0.0],
            Self::ShearStretched => [STRETCHED, amount, STRETCHED],
            Self::BendCourse | Self::BendWale => [0.0; 3],
        }
    }
}

/// One deformation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The series that it belongs to; none for the swatch at rest.
    pub series: Option<Series>,
    /// How far along the series.
    pub amount: f64,
    /// Its gradient in the plane, columns along u and v.
    pub gradient: DMat2,
    /// Curvature along u or v, 1 / m.
    curvature: [f64; 2],
}

impl Pose {
    /// Flat and unstrained.
    pub const REST: Self = Self { series: None, amount: 0.0, gradient: DMat2::IDENTITY, curvature: [0.0; 2] };

    /// A pose of a series, for yarn of some radius (metres).
    pub fn new(series: Series, amount: f64, radius: f64) -> Self {
        let [sx, sa, sy] = series.strains(amount);
        let along = DVec2::new(sa, (1.0 - sa * sa).sqrt());
        let curved = amount / radius;
        Self {
            series: Some(series),
            amount,
            gradient: DMat2::from_cols(DVec2::X * (1.0 + sx), along * (1.0 + sy)),
            curvature: match series {
                Series::BendCourse => [curved, 0.0],
                Series::BendWale => [0.0, curved],
                _ => [0.0; 2],
            },
        }
    }

    /// All poses that a table knows: strains within its nodes, and none that the eigenvalues' clamp would change. `height` is
    /// how far the yarn stands off the surface at most, metres.
    pub fn all(model: &YarnModel, settings: &Settings, height: f64) -> Vec<Self> {
        let axes = model.table.axes();
        let radius = model.pattern.radius;
        let known = |series: Series, amount: f64| {
            let strains = series.strains(amount);
            let within = strains.iter().zip(axes).all(|(s, axis)| {
                (f64::from(axis[0]) - 1e-6..=f64::from(axis[axis.len() - 1]) + 1e-6).contains(s)
            });
            let pose = Self::new(series, amount, radius);
            let c = pose.gradient.transpose() * pose.gradient;
            let (mean, half) = ((c.x_axis.x + c.y_axis.y) / 2.0, (c.x_axis.x - c.y_axis.y) / 2.0);
            let bent = 2.0 * height * pose.curvature[0].abs().max(pose.curvature[1].abs());
            let least = mean - half.hypot(c.x_axis.y) - bent;
            (within && least >= settings.min_eigenvalue - 1e-6).then_some(pose)
        };
        let series = Series::ALL.into_iter();
        series.flat_map(|s| s.amounts().iter().filter_map(move |a| known(s, *a))).collect()
    }

    /// Where a point of the fabric comes to lie; the middle of the swatch is the origin. Metres.
    pub fn place(&self, p: DVec2) -> DVec3 {
        let p = self.gradient * p;
        let [u, v] = self.curvature;
        if u != 0.0 {
            let (sin, cos) = (u * p.x).sin_cos();
            DVec3::new(sin / u, p.y, (1.0 - cos) / u)
        } else if v != 0.0 {
            let (sin, cos) = (v * p.y).sin_cos();
            DVec3::new(p.x, sin / v, (1.0 - cos) / v)
        } else {
            p.extend(0.0)
        }
    }

    /// A point in space rolled flat: in the plane of the swatch without its curvature, and its height. It must be nearer to
    /// the surface than its centre of curvature is.
    pub fn flatten(&self, p: DVec3) -> DVec3 {
        let unroll = |x: f64, curvature: f64| {
            let (radius, sign) = (1.0 / curvature, curvature.signum());
            let arm = DVec2::new(sign * x, sign * (radius - p.z));
            (arm.x.atan2(arm.y) / curvature, sign * (radius.abs() - arm.length()))
        };
        let [u, v] = self.curvature;
        if u != 0.0 {
            let (x, height) = unroll(p.x, u);
            DVec3::new(x, p.y, height)
        } else if v != 0.0 {
            let (y, height) = unroll(p.y, v);
            DVec3::new(p.x, y, height)
        } else {
            p
        }
    }

    /// A flattened point or way as it was at rest, had it followed the surface.
    pub fn undone(&self, p: DVec3) -> DVec3 {
        (self.gradient.inverse() * p.truncate()).extend(p.z)
    }

    /// A point or way at rest as it would be, did it follow the surface.
    pub fn done(&self, p: DVec3) -> DVec3 {
        (self.gradient * p.truncate()).extend(p.z)
    }
}
