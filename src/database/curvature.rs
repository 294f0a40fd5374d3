//! Curvature at nodes: a quadratic in material coordinates through the vertices around each, whose second derivatives along
//! the normal are the second fundamental form. The sheet at rest is flat and does not change, so what a fit takes of each
//! vertex is known beforehand.

use super::nodes::Nodes;
use super::surface::Surface;
use glam::DVec2;

/// Vertices that a fit wants around a node, and rings of faces that it takes at most to find them.
const WANTED: usize = 8;
const MOST_RINGS: usize = 3;
/// Weight, of that of a vertex at the mean distance, with which second derivatives are drawn to 0: it tells where vertices do
/// not.
const RIDGE: f64 = 1e-6;

/// What each vertex around a node adds to its second fundamental form: those of node i stand at
/// `offsets[i] .. offsets[i + 1]`.
#[derive(Clone, Debug, Default)]
pub struct Fits {
    /// `[node + 1]`
    pub offsets: Vec<u32>,
    /// World vertices.
    pub vertices: Vec<u32>,
    /// For uu, uv and vv: times the normal and the vertex' place relative to the node's, one over square metres.
    pub weights: Vec<[f64; 3]>,
}

impl Fits {
    /// Fits for all nodes of a surface.
    pub fn new(surface: &Surface, nodes: &Nodes) -> Self {
        let mut around: Vec<Vec<(u32, u8)>> = vec![Vec::new(); nodes.count()];
        for (face, corners) in nodes.of_faces.iter().enumerate().filter(|(f, _)| surface.spans(*f)) {
            for (k, node) in corners.iter().enumerate() {
                around[*node as usize].push((face as u32, k as u8));
            }
        }
        let mut fits = Self { offsets: vec![0], ..Self::default() };
        let mut found = Vec::new();
        for node in 0..nodes.count() {
            found.clear();
            neighbours(surface, nodes, &around, node as u32, &mut found);
            for ((other, _), weights) in found.iter().zip(fit(&found)) {
                fits.vertices.push(nodes.vertices[*other as usize]);
                fits.weights.push(weights);
            }
            fits.offsets.push(fits.vertices.len() as u32);
        }
        fits
    }
}

/// Nodes around a node and where they lie relative to it, ring after ring until there are enough.
fn neighbours(
    surface: &Surface,
    nodes: &Nodes,
    around: &[Vec<(u32, u8)>],
    node: u32,
    found: &mut Vec<(u32, DVec2)>,
) {
    let mut ring = vec![(node, DVec2::ZERO)];
    for _ in 0..MOST_RINGS {
        let mut next = Vec::new();
        for (at, place) in ring {
            for (face, k) in &around[at as usize] {
                let corners = &surface.corners[*face as usize];
                for (j, other) in nodes.of_faces[*face as usize].iter().enumerate() {
                    if *other == node || found.iter().any(|(known, _)| known == other) {
                        continue;
                    }
                    // Relative within each face, so that seams that shift coordinates are none.
                    let place = place + (corners[j] - corners[usize::from(*k)]);
                    found.push((*other, place));
                    next.push((*other, place));
                }
            }
        }
        if found.len() >= WANTED {
            break;
        }
        ring = next;
    }
}

/// Least squares of `x_j = F d_j + 1/2 d_j^T H d_j`: what H takes of each x_j. Near vertices count more, by one over their
/// distance squared.
fn fit(found: &[(u32, DVec2)]) -> Vec<[f64; 3]> {
    let size =
        (found.iter().map(|(_, d)| d.length_squared()).sum::<f64>() / found.len().max(1) as f64).sqrt();
    if !(size.is_finite() && size > 0.0) {
        return vec![[0.0; 3]; found.len()];
    }
    let row = |d: &DVec2| {
        let d = *d / size;
        [d.x, d.y, 0.5 * d.x * d.x, d.x * d.y, 0.5 * d.y * d.y]
    };
    let near = |d: &DVec2| 1.0 / (d.length_squared() / (size * size)).max(1e-6);
    let mut matrix = [[0.0; 5]; 5];
    for (_, d) in found {
        let (row, near) = (row(d), near(d));
        for i in 0..5 {
            for j in 0..5 {
                matrix[i][j] += near * row[i] * row[j];
            }
        }
    }
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] += if i < 2 { RIDGE * RIDGE } else { RIDGE };
    }
    let factor = cholesky(matrix);
    found
        .iter()
        .map(|(_, d)| {
            let solved = solve(&factor, row(d).map(|x| x * near(d)));
            [solved[2], solved[3], solved[4]].map(|h| h / (size * size))
        })
        .collect()
}

/// The lower factor of a positive definite matrix.
fn cholesky(mut a: [[f64; 5]; 5]) -> [[f64; 5]; 5] {
    for j in 0..5 {
        for k in 0..j {
            for i in j..5 {
                a[i][j] -= a[i][k] * a[j][k];
            }
        }
        let pivot = a[j][j].max(1e-300).sqrt();
        for row in a.iter_mut().skip(j) {
            row[j] /= pivot;
        }
    }
    a
}

fn solve(lower: &[[f64; 5]; 5], mut x: [f64; 5]) -> [f64; 5] {
    for i in 0..5 {
        for k in 0..i {
            x[i] -= lower[i][k] * x[k];
        }
        x[i] /= lower[i][i];
    }
    for i in (0..5).rev() {
        for k in i + 1..5 {
            x[i] -= lower[k][i] * x[k];
        }
        x[i] /= lower[i][i];
    }
    x
}
