//! Generalised barycentric coordinates of points in a template's polygon, with gradients.

use glam::DVec2;
use std::ops::{Add, Div, Mul, Sub};

/// Which generalised barycentric coordinates map a template into a face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Coordinates {
    /// Mean value coordinates (Floater 2003); right for any simple polygon, corners on straight sides included.
    #[default]
    MeanValue,
    /// Wachspress coordinates, which the field's existing tool uses; for convex polygons. A corner on a
    /// straight side gets weight 0 for interior points.
    Wachspress,
}

/// A value with its gradient: forward differentiation.
#[derive(Clone, Copy)]
struct Dual {
    x: f64,
    d: DVec2,
}

impl Dual {
    fn sqrt(self) -> Self {
        let x = self.x.sqrt();
        Self { x, d: self.d / (2.0 * x) }
    }
}
impl Add for Dual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, d: self.d + o.d }
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, d: self.d - o.d }
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { x: self.x * o.x, d: self.d * o.x + o.d * self.x }
    }
}
impl Div for Dual {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let x = self.x / o.x;
        Self { x, d: (self.d - o.d * x) / o.x }
    }
}

/// Weights of the corners at a point of edge `edge`: linear, so that both faces of an edge agree.
pub fn edge_weights(corner_count: usize, edge: usize, along: f64) -> Vec<f64> {
    let mut weights = vec![0.0; corner_count];
    weights[edge] += 1.0 - along;
    weights[(edge + 1) % corner_count] += along;
    weights
}

/// Weights w_i of the corners at `q` (they sum to 1 and reproduce `q`) and their gradients.
///
/// On the polygon's border the weights are those of the edge; gradients are then taken a hair inside.
pub fn weights(kind: Coordinates, corners: &[DVec2], q: DVec2) -> (Vec<f64>, Vec<DVec2>) {
    let n = corners.len();
    let size = corners.iter().map(|c| (*c - corners[0]).length()).fold(0.0, f64::max);
    let near = 1e-9 * size;
    for (e, (a, b)) in corners.iter().zip(corners.iter().cycle().skip(1)).enumerate() {
        let side = *b - *a;
        let along = ((q - *a).dot(side) / side.length_squared()).clamp(0.0, 1.0);
        if (q - (*a + side * along)).length() <= near {
            let inside = corners.iter().sum::<DVec2>() / n as f64 - q;
            let step = inside * (1e-6 * size / inside.length().max(near));
            return (edge_weights(n, e, along), weights(kind, corners, q + step).1);
        }
    }
    let raw = match kind {
        Coordinates::MeanValue => mean_value(corners, q),
        Coordinates::Wachspress => wachspress(corners, q),
    };
    let total = raw.iter().skip(1).fold(raw[0], |a, b| a + *b);
    let scaled: Vec<Dual> = raw.iter().map(|w| *w / total).collect();
    (scaled.iter().map(|w| w.x).collect(), scaled.iter().map(|w| w.d).collect())
}

fn spokes(corners: &[DVec2], q: DVec2) -> Vec<[Dual; 2]> {
    corners
        .iter()
        .map(|c| [Dual { x: c.x - q.x, d: -DVec2::X }, Dual { x: c.y - q.y, d: -DVec2::Y }])
        .collect()
}

/// Floater 2003: w_i = (tan(a_(i-1) / 2) + tan(a_i / 2)) / |v_i - q|, a_i the angle at q between v_i and v_(i+1).
fn mean_value(corners: &[DVec2], q: DVec2) -> Vec<Dual> {
    let n = corners.len();
    let s = spokes(corners, q);
    let r: Vec<Dual> = s.iter().map(|p| (p[0] * p[0] + p[1] * p[1]).sqrt()).collect();
    let tangents: Vec<Dual> = (0..n)
        .map(|i| {
            let (a, b) = (s[i], s[(i + 1) % n]);
            let cross = a[0] * b[1] - a[1] * b[0];
            cross / (r[i] * r[(i + 1) % n] + a[0] * b[0] + a[1] * b[1])
        })
        .collect();
    (0..n).map(|i| (tangents[(i + n - 1) % n] + tangents[i]) / r[i]).collect()
}

/// Meyer et al. 2002: w_i = area(v_(i-1), v_i, v_(i+1)) / (area(q, v_(i-1), v_i) area(q, v_i, v_(i+1))).
fn wachspress(corners: &[DVec2], q: DVec2) -> Vec<Dual> {
    let n = corners.len();
    let s = spokes(corners, q);
    (0..n)
        .map(|i| {
            let (h, j) = ((i + n - 1) % n, (i + 1) % n);
            let area = (corners[i] - corners[h]).perp_dot(corners[j] - corners[i]);
            let first = s[h][0] * s[i][1] - s[h][1] * s[i][0];
            let second = s[i][0] * s[j][1] - s[i][1] * s[j][0];
            Dual { x: area, d: DVec2::ZERO } / (first * second)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygons() -> Vec<Vec<DVec2>> {
        let v = |p: &[[f64; 2]]| p.iter().map(|p| DVec2::from_array(*p)).collect::<Vec<_>>();
        vec![
            v(&[[-0.5, -0.3], [0.5, -0.3], [0.5, 0.3], [-0.5, 0.3]]),
            v(&[[-0.5, -0.5], [0.5, -0.5], [0.8, 0.0], [0.0, 0.6], [-0.8, 0.0]]),
            v(&[[-0.4, -0.6], [0.4, 0.0], [-0.4, 0.6], [-0.4, 0.0]]),
            v(&[[0.0, 0.0], [1.0, 0.1], [0.2, 0.9]]),
        ]
    }

    #[test]
    fn weights_reproduce_the_point_and_gradients_match_differences() {
        for corners in polygons() {
            let q = corners.iter().sum::<DVec2>() / corners.len() as f64 + DVec2::new(0.013, -0.021);
            for kind in [Coordinates::MeanValue, Coordinates::Wachspress] {
                let (w, g) = weights(kind, &corners, q);
                assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-14);
                let p: DVec2 = w.iter().zip(&corners).map(|(w, c)| *c * *w).sum();
                assert!((p - q).length() < 1e-14, "{kind:?} {p} {q}");
                let h = 1e-5;
                for (axis, step) in [DVec2::X * h, DVec2::Y * h].into_iter().enumerate() {
                    let (a, b) = (weights(kind, &corners, q + step).0, weights(kind, &corners, q - step).0);
                    for i in 0..corners.len() {
                        let difference = (a[i] - b[i]) / (2.0 * h);
                        assert!((difference - g[i][axis]).abs() < 1e-8, "{kind:?} {i} {difference} {}", g[i]);
                    }
                }
            }
        }
    }

    #[test]
    fn weights_on_an_edge_are_linear() {
        for corners in polygons() {
            let q = corners[1].lerp(corners[2], 0.25);
            let (w, g) = weights(Coordinates::MeanValue, &corners, q);
            assert_eq!(w.iter().filter(|w| **w != 0.0).count(), 2);
            assert!((w[1] - 0.75).abs() < 1e-12 && (w[2] - 0.25).abs() < 1e-12);
            assert!(g.iter().all(|g| g.is_finite()));
        }
    }
}
