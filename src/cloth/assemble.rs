//! From a mesh and natural sizes to nodes, springs and bends.

use super::natural::{self, Along, Neighbours, Shape};
use super::order::{self, Blocks};
use super::{Bend, Cloth, ClothOptions, Spring, SpringKind};
use crate::mesh::StitchMesh;
use crate::mesh::corners::CornerGroups;
use crate::template::TemplateLibrary;
use crate::{Error, Result};
use glam::{DVec2, DVec3};

/// Positions beyond this, m, are no cloth: squares of them would soon be infinite.
const FAR: f64 = 1e60;

/// Compiles.
pub(super) fn cloth(mesh: &StitchMesh, library: &TemplateLibrary, options: &ClothOptions) -> Result<Cloth> {
    check(mesh, options)?;
    let (shapes, sizes) = natural::shapes(mesh, library, options.sizes)?;
    let groups = CornerGroups::new(mesh);
    let wants = wants(mesh, &groups, &shapes, options);

    let pairs: Vec<[u32; 2]> = wants.iter().map(|w| w.nodes).collect();
    let numbers = order::renumber(groups.len(), &pairs);
    let node_of_vertex: Vec<u32> = groups.of_vertex.iter().map(|g| numbers[*g as usize]).collect();
    let node_count = groups.len();
    let factors = factors(mesh, &groups, &shapes, options);

    let edges = edges(&wants, &numbers);
    let area = |face: usize| shapes[mesh.face_types[face].index()].area * factors[face].x * factors[face].y;
    let mut springs: Vec<Spring> = edges.iter().map(|e| e.spring(options)).collect();
    let force_unit = {
        let count = springs.len().max(1) as f64;
        let length = springs.iter().map(|s| s.length).sum::<f64>() / count;
        0.5 * (options.stiffness.course + options.stiffness.wale) * length
    };
    springs.extend(diagonals(mesh, &shapes, &factors, &node_of_vertex, &edges, options.stiffness.shear));

    let (mut masses, mut areas) = (vec![0.0; node_count], vec![0.0; node_count]);
    let (mut triangles, mut triangle_faces) = (Vec::new(), Vec::new());
    for face in 0..mesh.face_count() {
        let corners: Vec<u32> = mesh.face(face.into()).iter().map(|v| node_of_vertex[v.index()]).collect();
        let shape = &shapes[mesh.face_types[face].index()];
        for node in &corners {
            // The yarn of a stitch weighs the same however it is drawn in.
            masses[*node as usize] += options.density * shape.area / corners.len() as f64;
            areas[*node as usize] += area(face) / corners.len() as f64;
        }
        for k in 2..corners.len() {
            let triangle = [corners[0], corners[k - 1], corners[k]];
            if triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0] {
                triangles.push(triangle);
                triangle_faces.push(face as u32);
            }
        }
    }
    let mut bends = bends(mesh, &shapes, &node_of_vertex, &edges, &areas, options.stiffness.bending);

    let mut blocks = Blocks::new(node_count);
    blocks.springs = order::sort(&mut springs, node_count, blocks.size, |s| {
        [s.nodes[0], s.nodes[1], s.nodes[0], s.nodes[1]]
    });
    blocks.bends = order::sort(&mut bends, node_count, blocks.size, |b| b.nodes);
    let rest = means(&node_of_vertex, &mesh.positions, node_count);
    Ok(Cloth {
        node_of_vertex,
        rest,
        masses,
        triangles,
        triangle_faces,
        springs,
        bends,
        blocks,
        sizes,
        force_unit,
    })
}

fn check(mesh: &StitchMesh, options: &ClothOptions) -> Result<()> {
    check_finite(&mesh.positions)?;
    if mesh.face_count() == 0 {
        return Err(Error::invalid("the mesh has no faces: nothing to do"));
    }
    let s = options.stiffness;
    let fine = |x: f64| x.is_finite() && (1e-12..1e12).contains(&x);
    let factors = options.factors.width.iter().chain(&options.factors.height).flatten();
    let types = options.types.values().flatten();
    let sizes = options.sizes.iter().flat_map(|s| [("natural width", s.course), ("natural height", s.wale)]);
    let positive = [
        ("stiffness along the course", s.course),
        ("stiffness along the wale", s.wale),
        ("density", options.density),
    ];
    let all = positive.into_iter().chain(sizes).chain(factors.chain(types).map(|f| ("factor of a size", *f)));
    for (what, x) in all {
        if !fine(x) {
            return Err(Error::invalid(format_args!("{what} {x}, expected a positive number")));
        }
    }
    for (what, x) in [("shear stiffness", s.shear), ("bending stiffness", s.bending)] {
        if !(x == 0.0 || fine(x)) {
            return Err(Error::invalid(format_args!("{what} {x}, expected 0 or a positive number")));
        }
    }
    Ok(())
}

/// Refuses positions that are not finite, or too far for their squares to be.
pub(super) fn check_finite(positions: &[DVec3]) -> Result<()> {
    match positions.iter().position(|p| !p.is_finite() || p.abs().max_element() > FAR) {
        Some(i) => Err(Error::invalid(format_args!(
            "position {} of {} is {}, expected finite numbers up to {FAR:e}",
            i + 1,
            positions.len(),
            positions[i]
        ))),
        None => Ok(()),
    }
}

/// `[node]` the mean of the vertices that are one.
pub(super) fn means(node_of_vertex: &[u32], vertices: &[DVec3], nodes: usize) -> Vec<DVec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0); nodes];
    for (node, p) in node_of_vertex.iter().zip(vertices) {
        sums[*node as usize].0 += *p;
        sums[*node as usize].1 += 1.0;
    }
    // One vertex is taken as it is, to the bit.
    sums.into_iter().map(|(sum, count)| if count > 1.0 { sum / count } else { sum }).collect()
}

/// An edge as one face wants it.
struct Want {
    /// Ends, ascending; groups of corners.
    nodes: [u32; 2],
    face: u32,
    /// Number of the edge among the edges of all faces.
    edge: u32,
    along: Along,
    /// Natural length, and how much fabric beside the edge it stands for, m.
    length: f64,
    width: f64,
}

/// The edges of all faces, sorted by their ends. Natural lengths come with factors.
fn wants(mesh: &StitchMesh, groups: &CornerGroups, shapes: &[Shape], options: &ClothOptions) -> Vec<Want> {
    let mut wants = bare(mesh, groups, shapes);
    let factors = factors_of(mesh, shapes, &wants, options);
    for want in &mut wants {
        let shape = &shapes[mesh.face_types[want.face as usize].index()];
        let f = factors[want.face as usize];
        let edge = (want.edge - mesh.face_offsets[want.face as usize]) as usize;
        let n = shape.corners.len();
        want.length = match want.along {
            Along::Course => shape.lengths[edge] * f.x,
            Along::Wale => shape.lengths[edge] * f.y,
            Along::Askew => ((shape.corners[(edge + 1) % n] - shape.corners[edge]) * f).length(),
        };
        let area = shape.area * f.x * f.y;
        let sum = |along| {
            let edges = (0..n).filter(|k| shape.along[*k] == along);
            edges.map(|k| shape.lengths[k]).sum::<f64>()
        };
        let width = 0.5 * f.x * sum(Along::Course);
        let width = if width > 0.0 { width } else { area.sqrt() };
        // Half of the face belongs to the edge before it, half to the one behind.
        want.width = 0.5 * if want.along == Along::Course { area / width } else { width };
    }
    wants
}

fn bare(mesh: &StitchMesh, groups: &CornerGroups, shapes: &[Shape]) -> Vec<Want> {
    let mut wants = Vec::with_capacity(mesh.face_vertices.len());
    for face in 0..mesh.face_count() {
        let corners = mesh.face(face.into());
        let shape = &shapes[mesh.face_types[face].index()];
        for (k, vertex) in corners.iter().enumerate() {
            let [a, b] = [*vertex, corners[(k + 1) % corners.len()]].map(|v| groups.of_vertex[v.index()]);
            if a != b {
                wants.push(Want {
                    nodes: [a.min(b), a.max(b)],
                    face: face as u32,
                    edge: mesh.face_offsets[face] + k as u32,
                    along: shape.along[k],
                    length: 0.0,
                    width: 0.0,
                });
            }
        }
    }
    wants.sort_by_key(|w| (w.nodes, w.edge));
    wants
}

fn factors(mesh: &StitchMesh, groups: &CornerGroups, shapes: &[Shape], options: &ClothOptions) -> Vec<DVec2> {
    factors_of(mesh, shapes, &bare(mesh, groups, shapes), options)
}

fn factors_of(mesh: &StitchMesh, shapes: &[Shape], wants: &[Want], options: &ClothOptions) -> Vec<DVec2> {
    let mut beyond = vec![u32::MAX; mesh.face_vertices.len()];
    for pair in wants.chunk_by(|a, b| a.nodes == b.nodes) {
        if let [a, b] = pair {
            beyond[a.edge as usize] = b.face;
            beyond[b.edge as usize] = a.face;
        }
    }
    let neighbours = Neighbours { offsets: mesh.face_offsets.clone(), beyond };
    let own: Vec<DVec2> = mesh
        .types
        .iter()
        .map(|t| options.types.get(&t.name).map_or(DVec2::ONE, |f| DVec2::from(*f)))
        .collect();
    natural::face_factors(mesh, shapes, &neighbours, &options.factors, &own)
}

/// An edge of the cloth.
struct Edge {
    nodes: [u32; 2],
    along: Along,
    length: f64,
    width: f64,
    faces: Vec<u32>,
}

impl Edge {
    fn spring(&self, options: &ClothOptions) -> Spring {
        let s = options.stiffness;
        let (kind, modulus) = match self.along {
            Along::Course => (SpringKind::Course, s.course),
            Along::Wale => (SpringKind::Wale, s.wale),
            Along::Askew => (SpringKind::Wale, 0.5 * (s.course + s.wale)),
        };
        Spring { nodes: self.nodes, length: self.length, stiffness: modulus * self.width / self.length, kind }
    }
}

/// Edges in the cloth's numbers: of faces that want different lengths, the mean.
fn edges(wants: &[Want], numbers: &[u32]) -> Vec<Edge> {
    let mut edges: Vec<Edge> = wants
        .chunk_by(|a, b| a.nodes == b.nodes)
        .map(|faces| {
            let [a, b] = faces[0].nodes.map(|n| numbers[n as usize]);
            Edge {
                nodes: [a.min(b), a.max(b)],
                along: faces.iter().map(|w| w.along).min().unwrap_or(Along::Askew),
                length: faces.iter().map(|w| w.length).sum::<f64>() / faces.len() as f64,
                width: faces.iter().map(|w| w.width).sum(),
                faces: faces.iter().map(|w| w.face).collect(),
            }
        })
        .collect();
    edges.sort_by_key(|e| e.nodes);
    edges
}

fn edge_between(edges: &[Edge], a: u32, b: u32) -> Option<&Edge> {
    let key = [a.min(b), a.max(b)];
    edges.binary_search_by_key(&key, |e| e.nodes).ok().map(|i| &edges[i])
}

/// Corners between which a face has diagonals. Quads have two; pentagons and hexagons connect each vertex of their bottom
/// with each of their top (Huang et al. 2025, section 5.1), where labels tell them apart.
fn diagonal_pairs(along: &[Along]) -> Vec<[usize; 2]> {
    let n = along.len();
    let apart = |i: usize, j: usize| j > i + 1 && !(i == 0 && j == n - 1);
    let all = (0..n).flat_map(|i| (i + 1..n).map(move |j| [i, j])).filter(|[i, j]| apart(*i, *j));
    if n > 6 {
        // Two rows of corners opposite each other.
        return all.filter(|[i, j]| matches!(i + j, s if s == n - 2 || s == n)).collect();
    }
    // Sides of the face: runs of edges along the course.
    let sides: Vec<usize> = (0..n).filter(|k| along[*k] != Along::Course).collect();
    if let ([a, b], true) = (&sides[..], n > 4) {
        // Corners a + 1 ..= b lie on one side, the others on the other.
        let top = |k: usize| k > *a && k <= *b;
        return all.filter(|[i, j]| top(*i) != top(*j)).collect();
    }
    all.collect()
}

fn diagonals(
    mesh: &StitchMesh,
    shapes: &[Shape],
    factors: &[DVec2],
    nodes: &[u32],
    edges: &[Edge],
    shear: f64,
) -> Vec<Spring> {
    if shear == 0.0 {
        return Vec::new();
    }
    let pairs: Vec<Vec<[usize; 2]>> = shapes.iter().map(|s| diagonal_pairs(&s.along)).collect();
    let mut springs = Vec::new();
    for (face, factor) in factors.iter().enumerate() {
        let at = mesh.face_types[face].index();
        let (shape, pairs) = (&shapes[at], &pairs[at]);
        let corners: Vec<u32> = mesh.face(face.into()).iter().map(|v| nodes[v.index()]).collect();
        let n = corners.len();
        let length = |k: usize| edge_between(edges, corners[k], corners[(k + 1) % n]).map(|e| e.length);
        // Ptolemy: the diagonals of an isosceles trapezoid with the edges as they came out.
        let trapezoid = (n == 4 && shape.along.iter().all(|a| *a != Along::Askew))
            .then(|| Some((length(0)? * length(2)? + length(1)? * length(3)?).sqrt()))
            .flatten()
            .filter(|_| shape.along[0] == shape.along[2] && shape.along[1] == shape.along[3]);
        let area = shape.area * factor.x * factor.y;
        for [i, j] in pairs {
            let [a, b] = [corners[*i], corners[*j]];
            let d = trapezoid.unwrap_or_else(|| ((shape.corners[*j] - shape.corners[*i]) * *factor).length());
            if a != b && d > 0.0 {
                // A sheared rectangle of that area has the energy G area angle^2 / 2: each of two diagonals changes by
                // angle x width x height / d.
                let stiffness = shear * d * d / (2.0 * area) * (2.0 / pairs.len() as f64);
                springs.push(Spring {
                    nodes: [a.min(b), a.max(b)],
                    length: d,
                    stiffness,
                    kind: SpringKind::Shear,
                });
            }
        }
    }
    springs
}

/// Bending along courses and along wales, as the squared curvature of three nodes in a row (a quadratic energy on strips of
/// quads; isometric bending of Bergou et al. 2006 on a curve). Where a row ends at the tip of a decrease or an increase, it
/// goes on to the middle of the edges opposite.
fn bends(
    mesh: &StitchMesh,
    shapes: &[Shape],
    nodes: &[u32],
    edges: &[Edge],
    areas: &[f64],
    stiffness: f64,
) -> Vec<Bend> {
    if stiffness == 0.0 {
        return Vec::new();
    }
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); areas.len()];
    for (i, edge) in edges.iter().enumerate() {
        edge.nodes.iter().for_each(|n| around[*n as usize].push(i as u32));
    }
    let far = |e: &Edge, n: u32| if e.nodes[0] == n { e.nodes[1] } else { e.nodes[0] };
    let mut bends = Vec::new();
    for (node, incident) in around.iter().enumerate() {
        for (i, e) in incident.iter().enumerate() {
            for f in &incident[i + 1..] {
                let (e, f) = (&edges[*e as usize], &edges[*f as usize]);
                let beside = e.faces.iter().any(|face| f.faces.contains(face));
                if e.along != f.along || beside {
                    continue;
                }
                let ends = [far(e, node as u32), far(f, node as u32)];
                if ends[0] != ends[1] {
                    let to = [(ends[0], e.length, 1.0), (ends[1], f.length, 1.0)];
                    bends.push(bend(node as u32, &to, stiffness * areas[node]));
                }
            }
        }
    }
    // Tips: corners between two edges along the course of one face.
    for face in 0..mesh.face_count() {
        let shape = &shapes[mesh.face_types[face].index()];
        let n = shape.along.len();
        if !(5..=6).contains(&n) {
            continue;
        }
        let corners: Vec<u32> = mesh.face(face.into()).iter().map(|v| nodes[v.index()]).collect();
        for tip in (0..n).filter(|k| [*k, (*k + n - 1) % n].iter().all(|e| shape.along[*e] == Along::Course))
        {
            let node = corners[tip];
            // The edge of the rows beyond.
            let wale = |e: &&u32| {
                let e = &edges[**e as usize];
                e.along == Along::Wale && !e.faces.contains(&(face as u32))
            };
            let Some(behind) = around[node as usize].iter().find(wale).map(|e| &edges[*e as usize]) else {
                continue;
            };
            let ahead = (0..n).filter(|k| {
                let [p, q] = [*k, (*k + 1) % n];
                shape.along[*k] == Along::Course && p != tip && q != tip
            });
            // The middle of the run opposite: of several edges the middle one.
            let opposite: Vec<usize> = ahead.filter(|k| opposite_side(&shape.along, tip, *k)).collect();
            let Some(k) = opposite.get(opposite.len() / 2) else { continue };
            let [p, q] = [corners[*k], corners[(*k + 1) % n]];
            let back = far(behind, node);
            let middle = 0.5 * (shape.corners[*k] + shape.corners[(*k + 1) % n]);
            let height = (middle - shape.corners[tip]).length();
            let distinct = [back, p, q].iter().all(|x| *x != node) && p != q && back != p && back != q;
            if distinct && height > 0.0 {
                let to = [(back, behind.length, 1.0), (p, height, 0.5), (q, height, 0.5)];
                bends.push(bend(node, &to, stiffness * areas[node as usize]));
            }
        }
    }
    bends
}

/// Whether an edge lies in another run of course edges than a corner.
fn opposite_side(along: &[Along], corner: usize, edge: usize) -> bool {
    let n = along.len();
    // Going on from the corner, edges along the wale are passed once on the way to the other side.
    let passed = (0..n).map(|k| (corner + k) % n).take_while(|k| *k != edge);
    passed.filter(|k| along[*k] != Along::Course).count() == 1
}

/// `(sum of share (x - node) / length) / mean length`, which is the curvature of a line through the nodes.
fn bend(node: u32, to: &[(u32, f64, f64)], stiffness: f64) -> Bend {
    let mean = 0.5 * to.iter().map(|(_, length, share)| length * share).sum::<f64>();
    let mut bend = Bend { nodes: [node; 4], weights: [0.0; 4], stiffness };
    for (k, (other, length, share)) in to.iter().enumerate() {
        let weight = share / (length * mean);
        bend.nodes[k + 1] = *other;
        bend.weights[k + 1] = weight;
        bend.weights[0] -= weight;
    }
    bend
}
