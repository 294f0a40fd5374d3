//! Pressure from within, as an inner form would give it: what encloses room is kept open and convex.
//!
//! Openings are closed by a fan to the mean of their edge, so that the room `V` is that of a closed surface wherever it lies; the
//! pressure's energy is `-p V`, and its forces are the gradient of `V`, caps and all.

use super::{Cloth, Spring, SpringKind};
use glam::DVec3;
use std::collections::HashMap;

/// Least radius (twice the room over the area), relative to the root of the area, of what encloses room: a tube ten times as long as wide
/// has 0.09, a sheet that is bowed a little next to nothing.
const LEAST_RADIUS: f64 = 0.04;

/// Pressure on a cloth.
pub(super) struct Inflation<'a> {
    cloth: &'a Cloth,
    /// Pa; negative where fronts face inwards.
    pressure: f64,
    /// What places are taken relative to: rounding aside, it does not matter.
    origin: DVec3,
    /// Edges of openings, seen from outside counter-clockwise around the cap; `[opening]` after `[opening]`.
    edges: Vec<[u32; 2]>,
    /// `[opening + 1]` prefix sums over `edges`. Each node of an opening begins as many of its edges as it ends.
    openings: Vec<usize>,
}

impl<'a> Inflation<'a> {
    /// The pressure that widens a round tube of the cloth's room and area by `strain`; `None` for what encloses no room at `x`, or has no
    /// inside.
    pub(super) fn new(cloth: &'a Cloth, x: &[DVec3], strain: f64) -> Option<Self> {
        let origin = x[cloth.triangles.first()?[0] as usize];
        let mut inflation = Self { cloth, pressure: 0.0, origin, edges: Vec::new(), openings: vec![0] };
        inflation.find_openings();
        let cross = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|n| x[n as usize]);
            (b - a).cross(c - a)
        };
        let area = cloth.triangles.iter().map(|t| cross(t).length() / 2.0).sum::<f64>();
        let radius = 2.0 * inflation.room(x).abs() / area;
        // Closed surfaces push in no direction: else fronts meet backs somewhere.
        inflation.pressure = 1.0;
        let mut forces = vec![DVec3::ZERO; x.len()];
        inflation.add_forces(x, &mut forces);
        let push = forces.iter().sum::<DVec3>().length();
        if !(radius > LEAST_RADIUS * area.sqrt() && push < 1e-6 * area) {
            return None;
        }
        // Tension of an even strain along the courses, relative to it: diagonals bear a part.
        let bears = |s: &Spring| {
            let along = match s.kind {
                SpringKind::Course => s.length,
                SpringKind::Shear => (s.length.powi(2) - cloth.sizes.wale.powi(2)).max(0.0) / s.length,
                SpringKind::Wale => 0.0,
            };
            s.stiffness * along * along
        };
        let stiffness = cloth.springs.iter().map(bears).sum::<f64>() / area;
        inflation.pressure = inflation.room(x).signum() * strain * stiffness / radius;
        inflation.pressure.is_finite().then_some(inflation)
    }

    /// Edges that one triangle has, gathered by what hangs together.
    fn find_openings(&mut self) {
        let mut once: HashMap<[u32; 2], bool> = HashMap::new();
        for t in &self.cloth.triangles {
            for k in 0..3 {
                let [a, b] = [t[k], t[(k + 1) % 3]];
                if once.remove(&[a.min(b), a.max(b)]).is_none() {
                    once.insert([a.min(b), a.max(b)], a < b);
                }
            }
        }
        // Around the cap they run the other way.
        let mut edges: Vec<[u32; 2]> =
            once.into_iter().map(|([low, high], up)| if up { [high, low] } else { [low, high] }).collect();
        edges.sort_unstable();
        let mut next: HashMap<u32, Vec<u32>> = HashMap::new();
        edges.iter().rev().for_each(|[a, b]| next.entry(*a).or_default().push(*b));
        for [first, _] in edges {
            let mut at = first;
            while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
                self.edges.push([at, to]);
                at = to;
            }
            if self.edges.len() > self.openings[self.openings.len() - 1] {
                self.openings.push(self.edges.len());
            }
        }
    }

    fn openings(&self) -> impl Iterator<Item = &[[u32; 2]]> {
        self.openings.windows(2).map(|ends| &self.edges[ends[0]..ends[1]])
    }

    /// What is enclosed, m3; negative where fronts face inwards.
    fn room(&self, x: &[DVec3]) -> f64 {
        let at = |n: u32| x[n as usize] - self.origin;
        let body: f64 = self.cloth.triangles.iter().map(|[a, b, c]| at(*a).dot(at(*b).cross(at(*c)))).sum();
        let cap = |edges: &[[u32; 2]]| {
            let middle = edges.iter().map(|[a, _]| at(*a)).sum::<DVec3>() / edges.len() as f64;
            edges.iter().map(|[a, b]| middle.dot(at(*a).cross(at(*b)))).sum::<f64>()
        };
        (body + self.openings().map(cap).sum::<f64>()) / 6.0
    }

    /// J.
    pub(super) fn energy(&self, x: &[DVec3]) -> f64 {
        -self.pressure * self.room(x)
    }

    /// Adds its forces, N.
    pub(super) fn add_forces(&self, x: &[DVec3], out: &mut [DVec3]) {
        let at = |n: u32| x[n as usize] - self.origin;
        let p = self.pressure / 6.0;
        for t in &self.cloth.triangles {
            let [a, b, c] = t.map(at);
            out[t[0] as usize] += b.cross(c) * p;
            out[t[1] as usize] += c.cross(a) * p;
            out[t[2] as usize] += a.cross(b) * p;
        }
        for edges in self.openings() {
            let share = 1.0 / edges.len() as f64;
            let middle = edges.iter().map(|[a, _]| at(*a)).sum::<DVec3>() * share;
            let of_middle: DVec3 = edges.iter().map(|[a, b]| at(*a).cross(at(*b))).sum();
            for [a, b] in edges {
                out[*a as usize] += (at(*b).cross(middle) + of_middle * share) * p;
                out[*b as usize] += middle.cross(at(*a)) * p;
            }
        }
    }
}
