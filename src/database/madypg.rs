//! Laying a pattern as the authors' program MADYPG does, rounding included: its choice of vertices hangs on single bits
//! of f32.

use super::surface::Surface;
use super::tiling::{Instance, Laid, way};
use crate::pattern::{Links, Pattern};
use crate::{Error, Result};
use glam::{DVec2, IVec2};
use std::collections::HashMap;

/// Share by which vertices are drawn to the origin that rounding has put into a neighbouring period.
const DRAWN: f32 = 0.99;
/// Most periods of the grid.
const MOST_CELLS: f64 = 1e8;

type F2 = [f32; 2];

/// A pattern moved into one period, from its smallest coordinates on.
struct Period {
    size: F2,
    least: F2,
    /// u, v, height, twist.
    places: Vec<[f32; 4]>,
    successors: Vec<(u32, IVec2)>,
}

impl Period {
    fn new(pattern: &Pattern, links: &Links) -> Self {
        let size = [pattern.size.x as f32, pattern.size.y as f32];
        let mut places: Vec<[f32; 4]> = pattern
            .places
            .iter()
            .zip(&pattern.twists)
            .map(|(p, t)| [p.x as f32, p.y as f32, p.z as f32, *t as f32])
            .collect();
        let least = [0, 1].map(|k| places.iter().map(|p| p[k]).fold(f32::INFINITY, f32::min));
        let mut edges = pattern.edges.clone();
        for (vertex, place) in places.iter_mut().enumerate() {
            let whole = [0, 1].map(|k| ((place[k] - least[k]) / size[k]).floor());
            let tiles = IVec2::new(whole[0] as i32, whole[1] as i32);
            for k in 0..2 {
                place[k] -= size[k] * whole[k];
            }
            edges[links.reaching[vertex] as usize].tile += tiles;
            edges[links.leaving[vertex] as usize].tile -= tiles;
        }
        let successors =
            links.leaving.iter().map(|e| (edges[*e as usize].to, edges[*e as usize].tile)).collect();
        Self { size, least, places, successors }
    }
}

/// Periods that cover the mesh.
struct Grid {
    size: F2,
    offset: F2,
    least: F2,
    count: [i32; 2],
}

impl Grid {
    fn new(corners: &[[F2; 3]], period: &Period) -> Result<Self> {
        let (size, least) = (period.size, period.least);
        let all = || corners.iter().flatten();
        let (mut offset, mut count) = ([0.0; 2], [0; 2]);
        let mut cells = 1.0;
        for k in 0..2 {
            let low = all().map(|c| c[k]).fold(f32::INFINITY, f32::min) - 0.1f32 * size[k];
            let high = all().map(|c| c[k]).fold(f32::NEG_INFINITY, f32::max) + 0.1f32 * size[k];
            let first = ((low - least[k]) / size[k]).floor();
            let last = ((high - least[k]) / size[k]).floor();
            offset[k] = first * size[k] + least[k];
            cells *= (last - first + 1.0) as f64;
            if !(cells <= MOST_CELLS && first.abs() < 1e7 && last.abs() < 1e7) {
                return Err(Error::invalid(
                    "found material coordinates that go over too many periods of the pattern: are they metres? --scale \
                     changes them",
                ));
            }
            count[k] = (last - first) as i32 + 1;
        }
        Ok(Self { size, offset, least, count })
    }

    fn index(&self, p: F2) -> IVec2 {
        let [i, j] = [0, 1].map(|k| ((p[k] - self.offset[k]) / self.size[k]).floor() as i32);
        IVec2::new(i, j)
    }

    fn corner(&self, cell: IVec2) -> F2 {
        [self.size[0] * cell.x as f32 + self.offset[0], self.size[1] * cell.y as f32 + self.offset[1]]
    }
}

/// Lays a pattern as MADYPG does: each place goes to the first face of its period that holds it strictly inside.
///
/// # Errors
/// A mesh of too many periods.
pub fn lay(surface: &Surface, pattern: &Pattern, links: &Links) -> Result<Laid> {
    let period = Period::new(pattern, links);
    let corners: Vec<[F2; 3]> = surface.corners.iter().map(|c| c.map(|p| [p.x as f32, p.y as f32])).collect();
    let n = pattern.vertex_count();
    let mut laid = Laid {
        // Drawn vertices are drawn in height and twist as well.
        vertices: (0..n as u32).chain(0..n as u32).collect(),
        successors: period.successors.clone(),
        ways: vec![DVec2::ZERO; n],
        ..Laid::default()
    };
    for factor in [1.0, DRAWN] {
        laid.heights.extend(period.places.iter().map(|p| f64::from(p[2] * factor)));
        laid.twists.extend(period.places.iter().map(|p| f64::from(p[3] * factor)));
    }
    for (vertex, (to, tile)) in period.successors.iter().enumerate() {
        laid.ways[vertex] = way(pattern, vertex, *to as usize, *tile);
    }
    if corners.is_empty() {
        return Ok(laid);
    }
    let grid = Grid::new(&corners, &period)?;
    let inverses: Vec<[f32; 4]> = corners.iter().map(inverse).collect();
    let barycentric = |face: usize, p: F2| {
        let [a, b, c, d] = inverses[face];
        let q = [p[0] - corners[face][0][0], p[1] - corners[face][0][1]];
        let (s, t) = (a * q[0] + b * q[1], c * q[0] + d * q[1]);
        [1.0 - s - t, s, t]
    };
    let (cells, faces) = overlaps(&corners, &grid);
    let numbers: HashMap<IVec2, usize> = cells.iter().enumerate().map(|(k, c)| (*c, k)).collect();
    for cell in &cells {
        let corner = grid.corner(*cell);
        let shift = [corner[0] - grid.least[0], corner[1] - grid.least[1]];
        for (vertex, place) in period.places.iter().enumerate() {
            let mut p = [place[0] + shift[0], place[1] + shift[1]];
            let mut row = vertex;
            if grid.index(p) != *cell {
                p = [place[0] * DRAWN + shift[0], place[1] * DRAWN + shift[1]];
                row += n;
            }
            let Some(number) = numbers.get(&grid.index(p)) else { continue };
            let found = faces[*number].iter().find_map(|face| {
                let all = barycentric(*face as usize, p);
                all.iter().all(|b| *b > 0.0).then_some((*face, all))
            });
            if let Some((face, all)) = found {
                laid.instances.push(Instance {
                    face,
                    row: row as u32,
                    cell: *cell,
                    barycentric: [all[1].into(), all[2].into()],
                });
            }
        }
    }
    Ok(laid)
}

/// Rows of the inverse of the material edges.
fn inverse(corners: &[F2; 3]) -> [f32; 4] {
    let (a, b) = (
        [corners[1][0] - corners[0][0], corners[1][1] - corners[0][1]],
        [corners[2][0] - corners[0][0], corners[2][1] - corners[0][1]],
    );
    let scale = 1.0 / (a[0] * b[1] - b[0] * a[1]);
    [b[1] * scale, -b[0] * scale, -a[1] * scale, a[0] * scale]
}

/// Periods that faces overlap, in the order in which faces touch them, and the faces of each, ascending.
fn overlaps(corners: &[[F2; 3]], grid: &Grid) -> (Vec<IVec2>, Vec<Vec<u32>>) {
    let slack = 1e-3f32 * ((grid.size[0] + grid.size[1]) * 0.5);
    let (mut cells, mut faces) = (Vec::new(), Vec::<Vec<u32>>::new());
    let mut numbers = HashMap::new();
    for (face, corners) in corners.iter().enumerate() {
        let low = [0, 1].map(|k| corners[0][k].min(corners[1][k]).min(corners[2][k]));
        let high = [0, 1].map(|k| corners[0][k].max(corners[1][k]).max(corners[2][k]));
        let (first, last) = (grid.index(low), grid.index(high));
        for j in first.y.max(0)..=last.y.min(grid.count[1] - 1) {
            for i in first.x.max(0)..=last.x.min(grid.count[0] - 1) {
                let cell = IVec2::new(i, j);
                if !touches(corners, grid.corner(cell), grid.size, slack) {
                    continue;
                }
                let number = *numbers.entry(cell).or_insert_with(|| {
                    cells.push(cell);
                    faces.push(Vec::new());
                    cells.len() - 1
                });
                faces[number].push(face as u32);
            }
        }
    }
    (cells, faces)
}

/// Whether a face overlaps a period grown by `slack`, by separating axes along the face's edges.
fn touches(corners: &[F2; 3], corner: F2, size: F2, slack: f32) -> bool {
    let low = [corner[0] - slack, corner[1] - slack];
    let high = [corner[0] + size[0] + slack, corner[1] + size[1] + slack];
    let half = [0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1])];
    let middle = [low[0] + half[0], low[1] + half[1]];
    (0..3).all(|k| {
        let (p, q, r) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let axis = [-(q[1] - p[1]), q[0] - p[0]];
        let along = |v: F2| v[0] * axis[0] + v[1] * axis[1];
        let (one, other) = (along(r), along(p));
        let radius = half[0] * axis[0].abs() + half[1] * axis[1].abs();
        let center = along(middle);
        !(one.min(other) > center + radius || one.max(other) < center - radius)
    })
}
