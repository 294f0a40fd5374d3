//! Wind on the triangles of the cloth: drag along their normals, `drag * area * |u_n| u_n n`, u_n the speed of the air past
//! a node along the normal n of a triangle around it, of which a third is the node's; gusts are value noise over time.

use super::scene::{Gust, Wind};
use glam::DVec3;
use rayon::prelude::*;

/// Nodes, or triangles, a task.
const CHUNK: usize = 2048;

/// A wind and the cloth that it blows on.
#[derive(Clone, Debug)]
pub struct Air {
    wind: Wind,
    /// Of length 1.
    direction: DVec3,
    triangles: Vec<[u32; 3]>,
    /// `[node + 1]` into `around`.
    offsets: Vec<u32>,
    /// Triangles around nodes, rising.
    around: Vec<u32>,
    /// `[triangle]` area times normal, m^2.
    areas: Vec<DVec3>,
}

impl Air {
    /// Wind on the triangles of a cloth of so many nodes.
    pub fn new(wind: Wind, triangles: &[[u32; 3]], node_count: usize) -> Self {
        let mut offsets = vec![0u32; node_count + 1];
        triangles.iter().flatten().for_each(|v| offsets[*v as usize + 1] += 1);
        for node in 0..node_count {
            offsets[node + 1] += offsets[node];
        }
        let mut next = offsets.clone();
        let mut around = vec![0; triangles.len() * 3];
        for (number, t) in triangles.iter().enumerate() {
            for v in t {
                around[next[*v as usize] as usize] = number as u32;
                next[*v as usize] += 1;
            }
        }
        Self {
            direction: wind.direction.normalize_or_zero(),
            wind,
            triangles: triangles.to_vec(),
            offsets,
            around,
            areas: vec![DVec3::ZERO; triangles.len()],
        }
    }

    /// The wind's velocity at a time, m/s.
    pub fn velocity(&self, time: f64) -> DVec3 {
        let gust = self.wind.gust.map_or(0.0, |g| g.strength * noise(&g, time));
        self.direction * (self.wind.speed * (1.0 + gust))
    }

    /// Adds what the wind does in `dt` seconds to velocities. A node is never carried beyond the speed of the air.
    pub fn blow(
        &mut self,
        time: f64,
        dt: f64,
        positions: &[DVec3],
        inverse_mass: &[f64],
        velocities: &mut [DVec3],
    ) {
        let air = self.velocity(time);
        let (drag, triangles) = (self.wind.drag, &self.triangles);
        self.areas.par_iter_mut().zip(triangles).with_min_len(CHUNK).for_each(|(area, t)| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            *area = (b - a).cross(c - a) * 0.5;
        });
        let (areas, offsets, around) = (&self.areas, &self.offsets, &self.around);
        velocities.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(node, velocity)| {
            let of = &around[offsets[node] as usize..offsets[node + 1] as usize];
            let (past, share) = (air - *velocity, dt * inverse_mass[node]);
            // Gains of a triangle's share of the air's speed at most: all of them together do not overtake it.
            let most = 1.0 / of.len().max(1) as f64;
            let mut gain = DVec3::ZERO;
            for t in of {
                let vector = areas[*t as usize];
                let area = vector.length();
                if area > 0.0 {
                    let normal = vector / area;
                    let along = past.dot(normal);
                    gain += normal * (along * (share * drag * area / 3.0 * along.abs()).min(most));
                }
            }
            *velocity += gain;
        });
    }
}

/// Smooth random numbers from -1 to 1 over time.
fn noise(gust: &Gust, time: f64) -> f64 {
    let at = time / gust.period;
    let s = at - at.floor();
    let value = |k: f64| {
        // splitmix64 of seed and number.
        let mut z =
            gust.seed.wrapping_add((k as i64 as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let (a, b) = (value(at.floor()), value(at.floor() + 1.0));
    a + (b - a) * (s * s * (3.0 - 2.0 * s))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles: a square of side 2 in the plane z = 0, nodes of 0.5 kg.
    fn square() -> ([DVec3; 4], [[u32; 3]; 2]) {
        ([DVec3::ZERO, DVec3::X * 2.0, DVec3::new(2.0, 2.0, 0.0), DVec3::Y * 2.0], [[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn the_force_on_a_flat_sheet_is_the_closed_form() {
        // Seen red without the cosine (the wind's speed for u_n), and with the area doubled.
        let (positions, triangles) = square();
        for direction in [DVec3::Z, -DVec3::Z, DVec3::new(1.0, 0.0, 1.0), DVec3::new(0.2, -0.5, 3.0)] {
            let wind = Wind { direction, speed: 3.0, drag: 0.7, gust: None };
            let mut air = Air::new(wind, &triangles, 4);
            let mut velocities = [DVec3::ZERO; 4];
            let dt = 1e-3;
            air.blow(0.0, dt, &positions, &[2.0; 4], &mut velocities);
            let force: DVec3 = velocities.iter().map(|v| *v * 0.5 / dt).sum();
            let cos = direction.normalize().z;
            let expected = DVec3::Z * (0.7 * 4.0 * 9.0 * cos * cos.abs());
            assert!(force.abs_diff_eq(expected, 1e-12), "{direction}: {force}, {expected}");
        }
    }

    #[test]
    fn nothing_is_carried_faster_than_the_air() {
        let (positions, triangles) = square();
        let wind = Wind { direction: DVec3::Z, speed: 3.0, drag: 1e9, gust: None };
        let mut air = Air::new(wind, &triangles, 4);
        let mut velocities = [DVec3::ZERO; 4];
        for _ in 0..100 {
            air.blow(0.0, 0.01, &positions, &[2.0; 4], &mut velocities);
            assert!(velocities.iter().all(|v| v.z <= 3.0 + 1e-12), "{velocities:?}");
        }
        assert!(velocities[1].z > 2.9);
    }

    #[test]
    fn gusts_keep_their_strength_and_seed() {
        let gust = Gust { strength: 0.5, period: 0.3, seed: 4 };
        let wind = Wind { direction: DVec3::X, speed: 2.0, drag: 1.0, gust: Some(gust) };
        let air = Air::new(wind, &[], 0);
        let speeds: Vec<f64> = (0..3000).map(|k| air.velocity(k as f64 * 0.01).x).collect();
        let [low, high] = [f64::min, f64::max].map(|f| speeds.iter().copied().reduce(f).unwrap());
        assert!((1.0..1.3).contains(&low) && (2.7..=3.0).contains(&high), "{low} {high}");
        assert!(speeds.windows(2).all(|w| (w[1] - w[0]).abs() < 0.15));
        let other = Air::new(Wind { gust: Some(Gust { seed: 5, ..gust }), ..wind }, &[], 0);
        assert_ne!(other.velocity(0.4), air.velocity(0.4));
    }
}
