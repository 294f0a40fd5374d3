//! A fabric: a pattern laid over a mesh, compiled once.

use super::nodes::Nodes;
use super::strands::{Joining, Strands, chain};
use super::surface::Surface;
use super::{Compat, Settings, madypg, tiling};
use crate::Result;
use crate::mesh::MaterialMesh;
use crate::pattern::YarnModel;
use glam::{DVec3, IVec2};
use std::collections::HashMap;

/// Periods along u and v that are worked on together: their faces and their part of the table stay near the processor.
const BLOCK: i32 = 8;

/// A pattern laid over a mesh.
#[derive(Clone, Debug)]
pub struct Fabric {
    /// How the pattern follows the mesh.
    pub settings: Settings,
    /// The pattern and its displacements.
    pub model: YarnModel,
    /// Number of the mesh's vertices.
    pub vertex_count: usize,
    /// `[yarn + 1]` yarn i is points `offsets[i] .. offsets[i + 1]`.
    pub yarn_offsets: Vec<u32>,
    /// `[yarn]` closed yarns do not repeat their first point.
    pub yarn_closed: Vec<bool>,
    /// Periods that the pattern was laid over, counted along u and v.
    pub tiles: Vec<IVec2>,
    /// `[point]` the period it belongs to, number into `tiles`.
    pub point_tiles: Vec<u32>,
    pub(super) surface: Surface,
    pub(super) nodes: Nodes,
    /// `[row]` the pattern's vertex, its height and its twist at rest.
    pub(super) rows: Vec<(u32, f64, f64)>,
    /// In the order in which they are worked on.
    pub(super) homes: Vec<Home>,
}

/// Where a point belongs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Home {
    /// The face it lies in at rest.
    pub face: u32,
    /// Which row of the pattern it is.
    pub row: u32,
    /// Its number among the yarns' points.
    pub point: u32,
    /// Barycentric coordinates of the face's corners 1 and 2; the same in every precision.
    pub barycentric: [f32; 2],
}

impl Fabric {
    /// Lays a model's pattern over a mesh.
    ///
    /// # Errors
    /// A mesh with indices out of bounds or numbers that are not finite, settings out of range, or more yarn than could be
    /// meant.
    pub fn new(mesh: &MaterialMesh, model: YarnModel, settings: Settings) -> Result<Self> {
        settings.check()?;
        mesh.check()?;
        let links = model.pattern.links()?;
        let surface = Surface::new(mesh);
        let nodes = Nodes::new(&surface, settings.weights, settings.compat);
        let pattern = &model.pattern;
        let compat = settings.compat == Compat::Madypg;
        let laid = if compat {
            madypg::lay(&surface, pattern, &links)?
        } else {
            tiling::lay(&surface, pattern, &links)?
        };
        let joining =
            Joining { size: pattern.size, seams: !compat, shortest: settings.shortest_yarn * pattern.radius };
        let strands = chain(&surface, &laid, &pattern.rest_lengths, joining);
        let (homes, tiles, point_tiles) = order(&laid, &strands, &surface);
        Ok(Self {
            rows: (0..laid.vertices.len())
                .map(|row| (laid.vertices[row], laid.heights[row], laid.twists[row]))
                .collect(),
            yarn_offsets: strands.offsets,
            yarn_closed: strands.closed,
            vertex_count: mesh.positions.len(),
            settings,
            model,
            tiles,
            point_tiles,
            surface,
            nodes,
            homes,
        })
    }

    /// Number of the yarns' points.
    pub fn point_count(&self) -> usize {
        self.homes.len()
    }

    /// Number of yarns.
    pub fn yarn_count(&self) -> usize {
        self.yarn_closed.len()
    }

    /// Number of the mesh's faces.
    pub fn face_count(&self) -> usize {
        self.surface.face_count()
    }

    /// The points of a yarn.
    pub fn yarn(&self, yarn: usize) -> std::ops::Range<usize> {
        self.yarn_offsets[yarn] as usize..self.yarn_offsets[yarn + 1] as usize
    }

    /// `[point]` the pattern's vertex.
    pub fn point_vertices(&self) -> Vec<u32> {
        self.by_point(|home| self.rows[home.row as usize].0)
    }

    /// `[point]` the face that it lies in at rest.
    pub fn point_faces(&self) -> Vec<u32> {
        self.by_point(|home| home.face)
    }

    fn by_point(&self, value: impl Fn(&Home) -> u32) -> Vec<u32> {
        let mut all = vec![0; self.homes.len()];
        for home in &self.homes {
            all[home.point as usize] = value(home);
        }
        all
    }

    /// `[point]` rest length along its yarn up to it, metres.
    pub fn arclengths(&self) -> Vec<f64> {
        let rest = &self.model.pattern.rest_lengths;
        let vertices = self.point_vertices();
        let mut all = Vec::with_capacity(self.point_count());
        for yarn in 0..self.yarn_count() {
            let mut length = 0.0;
            for point in self.yarn(yarn) {
                all.push(length);
                length += rest[vertices[point] as usize];
            }
        }
        all
    }

    /// Checks a frame.
    ///
    /// # Errors
    /// Another number of positions than the mesh has vertices.
    pub fn check_positions(&self, positions: &[DVec3]) -> Result<()> {
        if positions.len() == self.vertex_count {
            return Ok(());
        }
        Err(crate::Error::invalid(format_args!(
            "found {} positions, expected {} as the mesh has vertices",
            positions.len(),
            self.vertex_count
        )))
    }
}

/// Sorts the points that yarns have into the order in which they are worked on, and numbers the periods.
fn order(laid: &tiling::Laid, strands: &Strands, surface: &Surface) -> (Vec<Home>, Vec<IVec2>, Vec<u32>) {
    let mut tiles = Vec::new();
    let mut numbers = HashMap::new();
    let mut point_tiles = Vec::with_capacity(strands.instances.len());
    for i in &strands.instances {
        let cell = laid.instances[*i as usize].cell;
        point_tiles.push(*numbers.entry(cell).or_insert_with(|| {
            tiles.push(cell);
            tiles.len() as u32 - 1
        }));
    }
    let mut points: Vec<u32> = (0..strands.instances.len() as u32).collect();
    points.sort_by_cached_key(|point| {
        let instance = &laid.instances[strands.instances[*point as usize] as usize];
        let cell = instance.cell;
        let block = (cell.y.div_euclid(BLOCK), cell.x.div_euclid(BLOCK));
        (surface.charts[instance.face as usize], block, instance.row, cell.y, cell.x)
    });
    let home = |point: u32| {
        let instance = &laid.instances[strands.instances[point as usize] as usize];
        Home {
            face: instance.face,
            row: instance.row,
            point,
            barycentric: instance.barycentric.map(|b| b as f32),
        }
    };
    (points.into_iter().map(home).collect(), tiles, point_tiles)
}
