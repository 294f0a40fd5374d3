//! A stitch mesh laid flat: courses and wales are its material coordinates.

use super::find_templates;
use crate::mesh::corners::CornerGroups;
use crate::mesh::{MaterialMesh, StitchMesh};
use crate::template::TemplateLibrary;
use glam::DVec2;
use std::collections::{HashMap, VecDeque};

/// Edges this near, in stitches, are one.
const NEAR: f64 = 1e-6;

/// Triangles of a stitch mesh, its faces as sources. Along u run the courses, along v the wales, a stitch being `stitch` (u, v;
/// metres) wide and high; faces of more or fewer corners are as their templates have them. Faces go on from each other across
/// joined edges as far as a shift allows; elsewhere coordinates jump, as they do where a tube closes. Corners that are joined are
/// one vertex: the first of them.
///
/// Quads that the library lacks count from their first corner; other faces without a template are left out.
pub fn laid_flat(mesh: &StitchMesh, library: &TemplateLibrary, stitch: DVec2) -> MaterialMesh {
    let polygons = polygons(mesh, library);
    let groups = CornerGroups::new(mesh);
    let mut first = vec![u32::MAX; groups.len()];
    for (vertex, group) in groups.of_vertex.iter().enumerate() {
        first[*group as usize] = first[*group as usize].min(vertex as u32);
    }
    let (places, charts) = spread(mesh, &polygons);
    let mut flat = MaterialMesh { positions: mesh.positions.clone(), ..MaterialMesh::default() };
    let mut numbers = HashMap::new();
    for (face, polygon) in polygons.iter().enumerate() {
        let corners: Vec<(u32, u32)> = polygon
            .iter()
            .zip(mesh.face(face.into()))
            .map(|(corner, vertex)| {
                let (vertex, uv) = (first[groups.of_vertex[vertex.index()] as usize], *corner + places[face]);
                // Material vertices are shared within a chart where they are one place of mesh and plane.
                let at = (uv / (10.0 * NEAR)).round().as_i64vec2();
                let next = flat.uvs.len() as u32;
                let number = *numbers.entry((charts[face], vertex, at)).or_insert(next);
                if number == next {
                    flat.uvs.push(uv * stitch);
                }
                (vertex, number)
            })
            .collect();
        for triangle in triangles(polygon, places[face]) {
            flat.faces.push(triangle.map(|k| corners[k].0));
            flat.face_uvs.push(triangle.map(|k| corners[k].1));
            flat.sources.push(face as u32);
        }
    }
    flat
}

/// Metres of a world unit so that a mesh laid flat has, over all, the area that it has in space.
pub fn natural_unit(flat: &MaterialMesh) -> Option<f64> {
    let (mut plane, mut space) = (0.0, 0.0);
    for (face, uvs) in flat.faces.iter().zip(&flat.face_uvs) {
        let [a, b, c] = uvs.map(|uv| flat.uvs[uv as usize]);
        let [p, q, r] = face.map(|v| flat.positions[v as usize]);
        plane += (b - a).perp_dot(c - a).abs();
        space += (q - p).cross(r - p).length();
    }
    let unit = f64::sqrt(plane / space);
    (unit.is_finite() && unit > 0.0).then_some(unit)
}

/// `[face]` corners in stitches: one wide, one high.
fn polygons(mesh: &StitchMesh, library: &TemplateLibrary) -> Vec<Vec<DVec2>> {
    let templates = find_templates(mesh, library);
    let extent = |corners: &[DVec2]| {
        let low = corners.iter().copied().reduce(DVec2::min).unwrap_or_default();
        corners.iter().copied().reduce(DVec2::max).unwrap_or_default() - low
    };
    // Templates of one library share a scale: that of its plain cells, four corners that fill their rectangle.
    let cell = templates.iter().flatten().map(|(id, _)| &library.get(*id).corners).find_map(|corners| {
        let size = extent(corners);
        let fills = corners.len() == 4
            && corners.iter().all(|c| {
                let at = (*c - corners[0]) / size;
                at.to_array().iter().all(|x| x.abs() < NEAR || (x - 1.0).abs() < NEAR)
            });
        (fills && size.min_element() > 0.0).then_some(size)
    });
    let square = || vec![DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
    let of_type: Vec<Vec<DVec2>> = mesh
        .types
        .iter()
        .zip(templates)
        .map(|(stitch, found)| match found {
            Some((id, rotation)) => {
                let mut corners = library.get(id).corners.clone();
                let cell = cell.unwrap_or_else(|| extent(&corners)).max(DVec2::splat(f64::MIN_POSITIVE));
                corners.iter_mut().for_each(|c| *c /= cell);
                // Corner 0 of the template is this corner of the face.
                corners.rotate_right(rotation);
                corners
            }
            None if stitch.labels.len() == 4 => square(),
            None => Vec::new(),
        })
        .collect();
    (0..mesh.face_count()).map(|f| of_type[mesh.face_types[f].index()].clone()).collect()
}

/// `[face]` where its polygon is shifted to, and the piece of the plane that it belongs to.
fn spread(mesh: &StitchMesh, polygons: &[Vec<DVec2>]) -> (Vec<DVec2>, Vec<u32>) {
    let mut around: Vec<Vec<(u32, u32, u32)>> = vec![Vec::new(); mesh.face_count()];
    for join in mesh.joins.iter().filter(|j| j.flipped) {
        for (a, b) in [(join.a, join.b), (join.b, join.a)] {
            around[a.face.index()].push((a.edge, b.face.0, b.edge));
        }
    }
    let edge = |face: usize, k: u32| {
        let (corners, k) = (&polygons[face], k as usize);
        Some([*corners.get(k)?, corners[(k + 1) % corners.len()]])
    };
    let mut places = vec![DVec2::ZERO; mesh.face_count()];
    let mut charts = vec![u32::MAX; mesh.face_count()];
    let mut waiting = VecDeque::new();
    for start in 0..mesh.face_count() {
        if charts[start] != u32::MAX {
            continue;
        }
        charts[start] = start as u32;
        waiting.push_back(start);
        // Wide first, so that seams run between what is far apart.
        while let Some(face) = waiting.pop_front() {
            for (k, there, edge_there) in &around[face] {
                let other = *there as usize;
                let (Some(here), Some(beyond)) = (edge(face, *k), edge(other, *edge_there)) else { continue };
                if charts[other] != u32::MAX {
                    continue;
                }
                let (shift, check) = (here[0] - beyond[1], here[1] - beyond[0]);
                if (shift - check).abs().max_element() <= NEAR {
                    places[other] = places[face] + shift;
                    charts[other] = charts[start];
                    waiting.push_back(other);
                }
            }
        }
    }
    (places, charts)
}

/// Ears cut off a polygon, the best shaped first; quads that could be split either way alternate like a chessboard's squares.
fn triangles(polygon: &[DVec2], place: DVec2) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..polygon.len()).collect();
    let mut out = Vec::new();
    let odd = place.round().as_i64vec2().element_sum().rem_euclid(2) == 1;
    while left.len() > 3 {
        let n = left.len();
        let ear = |i: usize| [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
        let quality = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|k| polygon[k]);
            let area = (b - a).perp_dot(c - a);
            let blocked = left.iter().any(|k| !t.contains(k) && inside(polygon[*k], [a, b, c]));
            let longest =
                (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
            if blocked { f64::NEG_INFINITY } else { area / longest }
        };
        let begin = usize::from(odd);
        let best = (begin..begin + n)
            .map(|i| i % n)
            .reduce(|best, i| if quality(&ear(i)) > quality(&ear(best)) + 1e-9 { i } else { best });
        let Some(best) = best else { break };
        out.push(ear(best));
        left.remove(best);
    }
    if let [a, b, c] = left[..] {
        out.push([a, b, c]);
    }
    out.retain(|t| {
        let [a, b, c] = t.map(|k| polygon[k]);
        (b - a).perp_dot(c - a) > 0.0
    });
    out
}

fn inside(p: DVec2, [a, b, c]: [DVec2; 3]) -> bool {
    [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).perp_dot(p - *from) >= 0.0)
}
