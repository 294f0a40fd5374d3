//! Laying a pattern over the flattened fabric: which of its vertices come to lie in which face.

use super::surface::{NONE, Surface};
use crate::pattern::{Links, Pattern};
use crate::{Error, Result};
use glam::{DVec2, IVec2};
use rayon::prelude::*;
use std::collections::HashMap;

/// How far outside a face, in barycentric coordinates, its border still is.
const BORDER: f64 = 1e-9;
/// Most vertices of a laid pattern.
const MOST: f64 = 4e8;

/// A vertex of the pattern in a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// The face.
    pub face: u32,
    /// Row of [`Laid`]: the pattern's vertex, and in which version.
    pub row: u32,
    /// The period that it belongs to, counted along u and v.
    pub cell: IVec2,
    /// Barycentric coordinates of the face's corners 1 and 2.
    pub barycentric: [f64; 2],
}

/// A pattern laid over a mesh.
#[derive(Clone, Debug, Default)]
pub struct Laid {
    /// Vertices in faces, each place of the fabric once.
    pub instances: Vec<Instance>,
    /// `[row]` the pattern's vertex.
    pub vertices: Vec<u32>,
    /// `[row]` height at rest, metres.
    pub heights: Vec<f64>,
    /// `[row]` twist at rest, radians.
    pub twists: Vec<f64>,
    /// `[pattern vertex]` where its yarn goes on: vertex, and the period relative to its own.
    pub successors: Vec<(u32, IVec2)>,
    /// `[pattern vertex]` the way there in u and v, metres.
    pub ways: Vec<DVec2>,
}

/// Lays a pattern over every face, faces that lie over each other in u and v alike. A vertex on the border of faces
/// belongs to the first of them.
///
/// # Errors
/// More vertices than could be meant.
pub fn lay(surface: &Surface, pattern: &Pattern, links: &Links) -> Result<Laid> {
    let size = pattern.size;
    let area = |c: &[DVec2; 3]| (c[1] - c[0]).perp_dot(c[2] - c[0]).abs() / 2.0;
    let count: f64 =
        surface.corners.iter().map(area).sum::<f64>() / (size.x * size.y) * pattern.vertex_count() as f64;
    let far = surface.corners.iter().flatten().map(|c| (*c / size).abs().max_element()).fold(0.0, f64::max);
    if count > MOST || far > 1e9 {
        return Err(Error::invalid(format_args!(
            "found a mesh whose material coordinates have room for some {count:.0} yarn vertices at up to {far:.0} periods \
             from the origin, expected at most {MOST:.0} and 1000000000: are its units metres? --scale changes them"
        )));
    }
    let found: Vec<Vec<Instance>> =
        (0..surface.face_count()).into_par_iter().map(|face| in_face(surface, pattern, face)).collect();
    let instances = once(surface, size, found.concat());
    let edge = |vertex: usize| pattern.edges[links.leaving[vertex] as usize];
    let n = pattern.vertex_count();
    Ok(Laid {
        instances,
        vertices: (0..n as u32).collect(),
        heights: pattern.places.iter().map(|p| p.z).collect(),
        twists: pattern.twists.clone(),
        successors: (0..n).map(|v| (edge(v).to, edge(v).tile)).collect(),
        ways: (0..n).map(|v| way(pattern, v, edge(v).to as usize, edge(v).tile)).collect(),
    })
}

/// The way from a vertex to another one some periods on.
pub fn way(pattern: &Pattern, from: usize, to: usize, tile: IVec2) -> DVec2 {
    pattern.places[to].truncate() + tile.as_dvec2() * pattern.size - pattern.places[from].truncate()
}

fn in_face(surface: &Surface, pattern: &Pattern, face: usize) -> Vec<Instance> {
    let mut found = Vec::new();
    if !surface.spans(face) {
        return found;
    }
    let corners = &surface.corners[face];
    let (low, high) =
        (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
    let slack = (high - low) * 1e-6;
    for (row, place) in pattern.places.iter().enumerate() {
        let place = place.truncate();
        let first = ((low - slack - place) / pattern.size).ceil().as_ivec2();
        let last = ((high + slack - place) / pattern.size).floor().as_ivec2();
        for j in first.y..=last.y {
            for i in first.x..=last.x {
                let cell = IVec2::new(i, j);
                let all = surface.barycentric(face, place + cell.as_dvec2() * pattern.size);
                if all.iter().all(|b| *b >= -BORDER) {
                    found.push(Instance {
                        face: face as u32,
                        row: row as u32,
                        cell,
                        barycentric: [all[1], all[2]],
                    });
                }
            }
        }
    }
    found
}

/// Leaves one of those that several faces claim.
fn once(surface: &Surface, size: DVec2, mut instances: Vec<Instance>) -> Vec<Instance> {
    let all = |i: &Instance| [1.0 - i.barycentric[0] - i.barycentric[1], i.barycentric[0], i.barycentric[1]];
    let on_border = |i: &Instance| all(i).iter().any(|b| *b <= 2.0 * BORDER);
    let key = |i: &Instance| (i.face, i.row, i.cell);
    let claimed: HashMap<(u32, u32, IVec2), u32> = instances
        .iter()
        .enumerate()
        .filter(|(_, i)| on_border(i))
        .map(|(at, i)| (key(i), at as u32))
        .collect();
    // Neighbours that claim the same are followed from each to the first of them all.
    let mut first = HashMap::with_capacity(claimed.len());
    let mut waiting = Vec::new();
    let mut starts: Vec<u32> = claimed.values().copied().collect();
    starts.sort_unstable();
    for start in starts {
        if first.contains_key(&start) {
            continue;
        }
        // Instances stand in the order of their faces: the first one met is of the lowest face.
        first.insert(start, start);
        waiting.push(start);
        while let Some(at) = waiting.pop() {
            let instance = instances[at as usize];
            let all = all(&instance);
            for (k, across) in surface.across[instance.face as usize].iter().enumerate() {
                if across.face == NONE || all[(k + 2) % 3] > 2.0 * BORDER {
                    continue;
                }
                let Some(periods) = Surface::periods(across, size) else { continue };
                let there = (across.face, instance.row, instance.cell + periods);
                if let Some(other) = claimed.get(&there)
                    && !first.contains_key(other)
                {
                    first.insert(*other, start);
                    waiting.push(*other);
                }
            }
        }
    }
    let mut at = 0;
    instances.retain(|_| {
        at += 1;
        first.get(&(at - 1)).is_none_or(|f| *f == at - 1)
    });
    instances
}
