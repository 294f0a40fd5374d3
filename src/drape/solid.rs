//! Closed triangle meshes as obstacles: signed distances by the nearest triangle and angle-weighted pseudonormals
//! (Baerentzen and Aanaes 2005, *Signed distance computation using the angle weighted pseudonormal*).

use super::bvh::{Bvh, Nearest};
use super::scene::Solid;
use glam::DVec3;
use std::collections::HashMap;

impl Solid {
    /// Checks that there are frames of equal length with finite positions, that triangles have three corners that are there,
    /// and that the mesh is closed: every edge is run through once in each direction. It must enclose a volume, inside out is
    /// refused.
    ///
    /// # Errors
    /// What was found and what was expected.
    pub fn check(&self) -> Result<(), (String, String)> {
        let wrong = |found: String, expected: &str| Err((found, expected.to_string()));
        let Some(first) = self.frames.first() else {
            return wrong("no positions".into(), "at least one frame");
        };
        if !(self.fps.is_finite() && self.fps > 0.0) {
            return wrong(format!("{} frames a second", self.fps), "a number above 0");
        }
        if self.triangles.is_empty() {
            return wrong("no triangles".into(), "a closed mesh");
        }
        for (number, frame) in self.frames.iter().enumerate() {
            if frame.len() != first.len() {
                let found = format!("{} vertices in frame {number}", frame.len());
                return wrong(found, &format!("{} as in frame 0", first.len()));
            }
            if let Some(vertex) = frame.iter().position(|p| !p.to_array().iter().all(|x| x.abs() <= 1e9)) {
                return wrong(
                    format!("vertex {vertex} of frame {number} beyond 1e9 m"),
                    "positions nearer than that",
                );
            }
        }
        let mut directed = HashMap::new();
        for (number, t) in self.triangles.iter().enumerate() {
            if let Some(bad) = t.iter().find(|v| **v as usize >= first.len()) {
                return wrong(
                    format!("vertex {bad} in triangle {number}"),
                    &format!("one below {}", first.len()),
                );
            }
            if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
                return wrong(format!("triangle {number} with a corner twice"), "three corners");
            }
            for k in 0..3 {
                if directed.insert((t[k], t[(k + 1) % 3]), number).is_some() {
                    return wrong(
                        format!("the edge from vertex {} to {} twice in one direction", t[k], t[(k + 1) % 3]),
                        "a closed mesh of like orientation",
                    );
                }
            }
        }
        // The least of them, so that the message does not depend on the map's order.
        if let Some((a, b)) = directed.keys().filter(|(a, b)| !directed.contains_key(&(*b, *a))).min() {
            return wrong(format!("an open edge between vertices {a} and {b}"), "a closed mesh");
        }
        let volume: f64 = self
            .triangles
            .iter()
            .map(|t| t.map(|v| first[v as usize] - first[0]))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        if volume > 0.0 {
            Ok(())
        } else {
            wrong(
                format!("a mesh of volume {volume:e}"),
                "triangles counter-clockwise seen from outside, around a volume",
            )
        }
    }
}

/// A solid at two times, with what distances need.
#[derive(Clone, Debug)]
pub struct SolidState {
    solid: Solid,
    /// `[vertex]` now.
    now: Vec<DVec3>,
    /// `[vertex]` at the time before.
    before: Vec<DVec3>,
    bvh: Bvh,
    face_normals: Vec<DVec3>,
    vertex_normals: Vec<DVec3>,
    /// `[triangle][side]` sum of the normals on both sides of the edge.
    edge_normals: Vec<[DVec3; 3]>,
    /// `[triangle][side]` the triangle across the edge from corner k to k + 1.
    across: Vec<[u32; 3]>,
    /// Greatest distance that a vertex has moved since the start.
    travelled: f64,
    times: [f64; 2],
}

/// Where a point is relative to a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Metres, negative inside.
    pub distance: f64,
    /// Away from the surface, of length 1.
    pub normal: DVec3,
    /// How the surface moved there, beyond the rigid motion of the whole, since the time before.
    pub slide: DVec3,
    /// The triangle nearest, for meshes.
    pub triangle: u32,
}

impl SolidState {
    /// The solid at time 0. It has passed [`Solid::check`].
    pub fn new(solid: Solid) -> Self {
        let now = solid.frames[0].clone();
        let mut sides = HashMap::new();
        for (number, t) in solid.triangles.iter().enumerate() {
            for k in 0..3 {
                sides.insert((t[k], t[(k + 1) % 3]), number as u32);
            }
        }
        let across = solid.triangles.iter().enumerate().map(|(number, t)| {
            std::array::from_fn(|k| sides.get(&(t[(k + 1) % 3], t[k])).copied().unwrap_or(number as u32))
        });
        let across = across.collect();
        let bvh = Bvh::new(&now, &solid.triangles);
        let count = solid.triangles.len();
        let mut state = Self {
            before: now.clone(),
            vertex_normals: vec![DVec3::ZERO; now.len()],
            now,
            bvh,
            face_normals: vec![DVec3::ZERO; count],
            edge_normals: vec![[DVec3::ZERO; 3]; count],
            across,
            solid,
            travelled: 0.0,
            times: [0.0; 2],
        };
        state.normals();
        state
    }

    /// Whether its vertices move.
    pub fn is_deforming(&self) -> bool {
        self.solid.frames.len() > 1
    }

    /// Vertices at two times (seconds).
    pub fn set_times(&mut self, before: f64, now: f64) {
        if !self.is_deforming() || self.times == [before, now] {
            return;
        }
        let mut most = 0.0;
        for (time, to) in [(before, &mut self.before), (now, &mut self.now)] {
            let frames = &self.solid.frames;
            let at = (time * self.solid.fps).clamp(0.0, (frames.len() - 1) as f64);
            let first = (at.floor() as usize).min(frames.len() - 2);
            let s = at - first as f64;
            most = 0.0;
            for ((p, a), b) in to.iter_mut().zip(&frames[first]).zip(&frames[first + 1]) {
                let next = a.lerp(*b, s);
                most = f64::max(most, next.distance_squared(*p));
                *p = next;
            }
        }
        // Of the latest positions against those they replace.
        self.travelled += most.sqrt();
        self.times = [before, now];
        self.bvh.refit(&self.now, &self.solid.triangles);
        self.normals();
    }

    /// A bound on how far any point of the surface has moved since the start.
    pub fn travelled(&self) -> f64 {
        self.travelled
    }

    fn normals(&mut self) {
        self.vertex_normals.fill(DVec3::ZERO);
        for (t, normal) in self.solid.triangles.iter().zip(&mut self.face_normals) {
            let p = t.map(|v| self.now[v as usize]);
            *normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
            for k in 0..3 {
                let (u, v) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                // Robust where both are nearly parallel, and no error where one is zero.
                let angle = u.cross(v).length().atan2(u.dot(v));
                self.vertex_normals[t[k] as usize] += *normal * angle;
            }
        }
        for (number, sides) in self.edge_normals.iter_mut().enumerate() {
            for (normal, beyond) in sides.iter_mut().zip(&self.across[number]) {
                *normal = self.face_normals[number] + self.face_normals[*beyond as usize];
            }
        }
    }

    /// The surface near a point; none if it is further than `within`, as long as `within` is positive. `first` is a triangle
    /// that may be near.
    pub fn touch(&self, point: DVec3, within: f64, first: u32) -> Option<Touch> {
        let triangles = &self.solid.triangles;
        let Nearest { triangle, weights, point: at, squared } =
            self.bvh.nearest(&self.now, triangles, point, within * within, first)?;
        let corners = triangles[triangle as usize];
        let pseudo = match weights.map(|w| w > 0.0) {
            [true, false, false] => self.vertex_normals[corners[0] as usize],
            [false, true, false] => self.vertex_normals[corners[1] as usize],
            [false, false, true] => self.vertex_normals[corners[2] as usize],
            [true, true, false] => self.edge_normals[triangle as usize][0],
            [false, true, true] => self.edge_normals[triangle as usize][1],
            [true, false, true] => self.edge_normals[triangle as usize][2],
            _ => self.face_normals[triangle as usize],
        };
        let away = point - at;
        let outside = away.dot(pseudo) >= 0.0;
        let distance = squared.sqrt();
        // On the surface itself the difference has no direction.
        let normal = if distance > 1e-12 {
            if outside { away / distance } else { -away / distance }
        } else {
            pseudo.normalize_or(DVec3::Y)
        };
        let slide = if self.is_deforming() {
            (0..3)
                .map(|k| (self.now[corners[k] as usize] - self.before[corners[k] as usize]) * weights[k])
                .sum()
        } else {
            DVec3::ZERO
        };
        Some(Touch { distance: if outside { distance } else { -distance }, normal, slide, triangle })
    }

    /// The first triangle that a segment enters from outside: where, and its normal.
    pub fn enters(&self, from: DVec3, to: DVec3) -> Option<(DVec3, DVec3)> {
        let (triangle, s) = self.bvh.enters(&self.now, &self.solid.triangles, from, to)?;
        Some((from + (to - from) * s, self.face_normals[triangle as usize]))
    }

    /// The extents of all frames.
    pub fn extents(&self) -> [DVec3; 2] {
        let all = self.solid.frames.iter().flatten();
        all.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)])
    }
}
