//! The geometry of a face for the baseline, in nalgebra and apart from the kernels: frame, knot seats,
//! interpolated points (model sections 3 and 6).

use super::baseline::Stitch;
use nalgebra::{Matrix2, Matrix3x2, Vector2, Vector3};

/// A face as it stands in a frame: corners relative to the first, template units, and normals at the corners.
#[derive(Debug)]
pub(super) struct Face {
    pub corners: Vec<Vector3<f64>>,
    pub normals: Vec<Vector3<f64>>,
}

/// Course and wale directions and the normal.
#[derive(Debug)]
pub(super) struct Axes {
    course: Vector3<f64>,
    wale: Vector3<f64>,
    normal: Vector3<f64>,
    /// F, in the face plane.
    pub stretch: Matrix2<f64>,
}

/// The surface under a knot.
#[derive(Debug)]
pub(super) struct Seat {
    /// In-plane place of the centre as it is mapped.
    pub center: Vector2<f64>,
    height: f64,
    slope: Vector2<f64>,
    normal: Vector3<f64>,
}

impl Face {
    /// The weighted mean of the corners.
    pub fn at(&self, weights: &[f64]) -> Vector3<f64> {
        weights.iter().zip(&self.corners).map(|(w, corner)| corner * *w).sum()
    }

    /// The unit normal at a weighted mean; zero where there is none.
    pub fn normal(&self, weights: &[f64]) -> Vector3<f64> {
        let sum: Vector3<f64> = weights.iter().zip(&self.normals).map(|(w, n)| n * *w).sum();
        sum.try_normalize(0.0).unwrap_or_else(Vector3::zeros)
    }

    /// An interpolated point at height z.
    pub fn raised(&self, weights: &[f64], z: f64) -> Vector3<f64> {
        self.at(weights) + self.normal(weights) * z
    }

    fn gradient(&self, gradients: &[Vector2<f64>]) -> Matrix3x2<f64> {
        gradients.iter().zip(&self.corners).map(|(g, corner)| corner * g.transpose()).sum()
    }

    /// The frame; none for a face too thin.
    pub fn axes(&self, stitch: &Stitch) -> Option<Axes> {
        let d = self.gradient(&stitch.frame_gradients);
        let (a, b): (Vector3<f64>, Vector3<f64>) = (d.column(0).into(), d.column(1).into());
        let cross = a.cross(&b);
        // Not finite counts as too thin.
        if !(cross.norm() > 1e-6 * d.norm_squared() && cross.norm().is_finite()) {
            return None;
        }
        let (course, normal) = (a.normalize(), cross.normalize());
        let wale = normal.cross(&course);
        let stretch = Matrix2::new(a.dot(&course), b.dot(&course), 0.0, b.dot(&wale));
        Some(Axes { course, wale, normal, stretch })
    }

    /// The seat of knot `k`.
    pub fn seat(&self, stitch: &Stitch, axes: &Axes, k: usize) -> Seat {
        let (weights, gradients) = &stitch.knots[k].mapping;
        let place = self.at(weights);
        let d = self.gradient(gradients);
        let rise = (axes.normal.transpose() * d).transpose();
        let plane = Matrix2::from_rows(&[axes.course.transpose() * d, axes.wale.transpose() * d]);
        let steep = plane.determinant().abs() <= 1e-6 * d.norm_squared();
        let slope = if steep { None } else { plane.transpose().try_inverse().map(|inverse| inverse * rise) };
        Seat {
            center: axes.plane(&place),
            height: place.dot(&axes.normal),
            slope: slope.unwrap_or_else(Vector2::zeros),
            normal: self.normal(weights),
        }
    }
}

impl Axes {
    /// In-plane coordinates.
    pub fn plane(&self, place: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(place.dot(&self.course), place.dot(&self.wale))
    }
}

impl Seat {
    /// A point of the knot, in the plane and at height z, on the surface.
    pub fn lift(&self, axes: &Axes, point: &Vector3<f64>) -> Vector3<f64> {
        let height = self.height + self.slope.dot(&(point.xy() - self.center));
        axes.course * point.x + axes.wale * point.y + axes.normal * height + self.normal * point.z
    }
}
