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
    /// `[face]` the polygon it is a part of ([`MaterialMesh::sources`]); empty where all are.
    sources: Vec<u32>,
    pub(super) surface: Surface,
    pub(super) nodes: Nodes,
    /// `[row]` the pattern's vertex, its height and its twist at rest.
    pub(super) rows: Vec<(u32, f64, f64)>,
    pub(super) homes: Homes,
}

/// Where points belong, face after face: in the order in which they are worked on.
#[derive(Clone, Debug, Default)]
pub struct Homes {
    /// Faces that points lie in at rest, and the first point of each; at the end no face and the number of points.
    pub runs: Vec<(u32, u32)>,
    /// `[home]` which row of the pattern it is.
    pub rows: Vec<u32>,
    /// `[home]` its number among the yarns' points.
    pub points: Vec<u32>,
    /// `[home]` barycentric coordinates of the face's corners 1 and 2; the same in every precision.
    pub barycentric: [Vec<f32>; 2],
}

impl Homes {
    /// Faces and homes, as far as they lie within a range of homes.
    pub fn runs(&self, range: std::ops::Range<usize>) -> impl Iterator<Item = (u32, std::ops::Range<usize>)> {
        let first = self.runs.partition_point(|(_, begin)| *begin as usize <= range.start).max(1) - 1;
        self.runs[first..].windows(2).take_while(move |pair| (pair[0].1 as usize) < range.end).map(
            move |pair| {
                (pair[0].0, (pair[0].1 as usize).max(range.start)..(pair[1].1 as usize).min(range.end))
            },
        )
    }
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
        let compat = settings.compat == Compat::Madypg;
        let surface = if compat {
            // Single precision is all that MADYPG reads.
            let uvs = mesh.uvs.iter().map(|uv| uv.as_vec2().as_dvec2()).collect();
            Surface::new(&MaterialMesh { uvs, ..mesh.clone() })
        } else {
            Surface::new(mesh)
        };
        let nodes = Nodes::new(&surface, settings.weights, settings.compat);
        let pattern = &model.pattern;
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
            sources: mesh.sources.clone(),
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
        self.homes.points.len()
    }

    /// Number of yarns.
    pub fn yarn_count(&self) -> usize {
        self.yarn_closed.len()
    }

    /// `[face]` nodes of its corners: material vertices, joined across seams that only shift material coordinates.
    pub fn face_nodes(&self) -> &[[u32; 3]] {
        &self.nodes.of_faces
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
        let mut all = vec![0; self.point_count()];
        for (row, point) in self.homes.rows.iter().zip(&self.homes.points) {
            all[*point as usize] = self.rows[*row as usize].0;
        }
        all
    }

    /// `[point]` the face that it lies in at rest.
    pub fn point_faces(&self) -> Vec<u32> {
        let mut all = vec![0; self.point_count()];
        for (face, homes) in self.homes.runs(0..self.point_count()) {
            for point in &self.homes.points[homes] {
                all[*point as usize] = face;
            }
        }
        all
    }

    /// `[point]` the polygon that it lies in at rest, as the mesh's source numbers them.
    pub fn point_polygons(&self) -> Vec<u32> {
        let source = |face: u32| self.sources.get(face as usize).copied().unwrap_or(face);
        self.point_faces().into_iter().map(source).collect()
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

    /// Checks which faces are visible, if that is said.
    pub(super) fn check_visible(&self, visible: Option<&[bool]>) -> Result<()> {
        let Some(wrong) = visible.map(<[bool]>::len).filter(|count| *count != self.face_count()) else {
            return Ok(());
        };
        Err(crate::Error::invalid(format_args!(
            "found {wrong} visible or hidden faces, expected {} as the mesh has",
            self.face_count()
        )))
    }
}

/// Sorts the points that yarns have into the order in which they are worked on, and numbers the periods.
fn order(laid: &tiling::Laid, strands: &Strands, surface: &Surface) -> (Homes, Vec<IVec2>, Vec<u32>) {
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
    let ranks = along_curve(surface);
    let instance = |point: u32| &laid.instances[strands.instances[point as usize] as usize];
    let mut points: Vec<u32> = (0..strands.instances.len() as u32).collect();
    points.sort_by_cached_key(|point| {
        let instance = instance(*point);
        (ranks[instance.face as usize], instance.row, instance.cell.y, instance.cell.x)
    });
    let mut homes = Homes::default();
    for (home, point) in points.iter().enumerate() {
        let instance = instance(*point);
        if homes.runs.last().is_none_or(|(face, _)| *face != instance.face) {
            homes.runs.push((instance.face, home as u32));
        }
        homes.rows.push(instance.row);
        for (all, b) in homes.barycentric.iter_mut().zip(instance.barycentric) {
            all.push(b as f32);
        }
    }
    homes.runs.push((super::surface::NONE, points.len() as u32));
    homes.points = points;
    (homes, tiles, point_tiles)
}

/// `[face]` its rank along a curve that stays near itself (Morton's), so that what neighbours share stays near the processor.
fn along_curve(surface: &Surface) -> Vec<u32> {
    let middles: Vec<glam::DVec2> = surface.corners.iter().map(|c| (c[0] + c[1] + c[2]) / 3.0).collect();
    let least = middles.iter().copied().reduce(glam::DVec2::min).unwrap_or_default();
    let most = middles.iter().copied().reduce(glam::DVec2::max).unwrap_or_default();
    let extent = (most - least).max_element().max(f64::MIN_POSITIVE);
    let spread = |x: f64| {
        let x = (x / extent * 65535.0) as u32;
        (0..16).map(|bit| (x >> bit & 1) << (2 * bit)).sum::<u32>()
    };
    let mut faces: Vec<u32> = (0..surface.face_count() as u32).collect();
    faces.sort_by_cached_key(|face| {
        let place = middles[*face as usize] - least;
        (surface.charts[*face as usize], spread(place.x) | spread(place.y) << 1)
    });
    let mut ranks = vec![0; faces.len()];
    for (rank, face) in faces.iter().enumerate() {
        ranks[*face as usize] = rank as u32;
    }
    ranks
}
