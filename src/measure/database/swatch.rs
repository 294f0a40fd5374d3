//! The swatch, and its yarn by each method.

use super::fitted::Cells;
use super::poses::Pose;
use super::rows::{Loops, rows};
use crate::Result;
use crate::backend::{Backend, CpuBackend, FrameOutput, Running, Skip};
use crate::curve::FrameCurves;
use crate::database::{Cpu, Fabric, FabricCurves, RunningYarn, Settings, SkipYarn, YarnFrame};
use crate::ids::VertexId;
use crate::knot;
use crate::mesh::{FaceEdge, Join, MaterialMesh, StitchMesh, StitchType};
use crate::pattern::YarnModel;
use crate::scene::{Mode, Scene, SceneOptions};
use crate::template::TemplateLibrary;
use glam::{DVec2, DVec3, UVec2};
use std::sync::Arc;

/// Stitches along the course and rows of the swatch, at least.
const SIZE: UVec2 = UVec2::new(10, 12);
/// Squares along each side of a stitch, in the mesh that the table's yarn follows.
const FINE: u32 = 4;
/// Extra points between two of a yarn's.
const SUBDIVIDE: usize = 6;
/// Stitches around the middle that are looked at, beyond a period.
const REACH: f64 = 1.5;
/// Steps of a solve, at most; it ends where a step gains nothing.
const STEPS: u32 = 200;

/// How yarn is placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// By the table, on a mesh finer than stitches.
    Table,
    /// The pattern, not displaced, on the same mesh.
    Pattern,
    /// By the table, on a mesh of one square a stitch.
    TableOnStitches,
    /// By templates.
    Knots {
        /// Those made after the pattern, or the library's.
        fitted: bool,
        /// Interpolated, or solved with this knot spacing.
        beta: Option<f64>,
    },
}

impl Method {
    /// All, the reference first.
    pub const ALL: [Self; 9] = [
        Self::Table,
        Self::Pattern,
        Self::TableOnStitches,
        Self::Knots { fitted: true, beta: None },
        Self::Knots { fitted: true, beta: Some(1.0) },
        Self::Knots { fitted: true, beta: Some(0.0) },
        Self::Knots { fitted: false, beta: None },
        Self::Knots { fitted: false, beta: Some(1.0) },
        Self::Knots { fitted: false, beta: Some(0.0) },
    ];

    /// Its name.
    pub fn name(self) -> String {
        match self {
            Self::Table => "table".into(),
            Self::Pattern => "pattern embedded".into(),
            Self::TableOnStitches => "table, a face a stitch".into(),
            Self::Knots { fitted, beta } => {
                let template = if fitted { "fitted knit" } else { "library knit" };
                match beta {
                    None => format!("{template}, embed"),
                    Some(beta) => format!("{template}, relax beta {beta}"),
                }
            }
        }
    }
}

/// A flat swatch of plain knit, a face a stitch of a pattern's size. Its middle is the origin.
#[derive(Clone, Debug)]
pub struct Swatch {
    /// Size of a stitch, metres.
    pub stitch: DVec2,
    /// Half of the swatch's sides, metres.
    pub half: DVec2,
    /// Columns and rows.
    pub size: UVec2,
    mesh: StitchMesh,
    /// The pattern's lower left corner of a cell.
    origin: DVec2,
    /// Stitches of the longer side of a period.
    period: u32,
}

impl Swatch {
    /// A swatch for a pattern.
    pub fn new(cells: &Cells) -> Self {
        let size = SIZE.max(4 * cells.count);
        let half = size.as_dvec2() * cells.stitch / 2.0;
        let mut mesh = StitchMesh {
            face_offsets: vec![0],
            types: vec![StitchType {
                name: cells.template.name.clone(),
                labels: cells.template.labels.clone(),
            }],
            ..StitchMesh::default()
        };
        mesh.positions = grid(size, cells.stitch, half).into_iter().map(|p| p.extend(0.0)).collect();
        for j in 0..size.y {
            for i in 0..size.x {
                let face = j * size.x + i;
                mesh.face_vertices.extend(corners(size, i, j).map(VertexId));
                mesh.face_offsets.push(mesh.face_vertices.len() as u32);
                mesh.face_types.push(0usize.into());
                let mut join = |edge: u32, other: u32, edge_there: u32| {
                    let side = |face: u32, edge: u32| FaceEdge { face: (face as usize).into(), edge };
                    mesh.joins.push(Join { a: side(face, edge), b: side(other, edge_there), flipped: true });
                };
                if i + 1 < size.x {
                    join(1, face + 1, 3);
                }
                if j + 1 < size.y {
                    join(2, face + size.x, 0);
                }
            }
        }
        let period = cells.count.max_element();
        Self { stitch: cells.stitch, half, size, mesh, origin: cells.origin, period }
    }

    /// The swatch as cloth, so many squares along each side of a stitch; the pattern's stitches lie in its faces.
    fn cloth(&self, fine: u32) -> MaterialMesh {
        let size = self.size * fine;
        let places = grid(size, self.stitch / f64::from(fine), self.half);
        let mut mesh = MaterialMesh {
            positions: places.iter().map(|p| p.extend(0.0)).collect(),
            uvs: places.iter().map(|p| *p + self.half + self.origin).collect(),
            ..MaterialMesh::default()
        };
        for j in 0..size.y {
            for i in 0..size.x {
                // Diagonals alternate, so that no direction is favoured.
                let c = corners(size, i, j);
                let k = ((i + j) % 2) as usize;
                mesh.faces.extend([1, 2].map(|n| [c[k], c[(k + n) % 4], c[(k + n + 1) % 4]]));
            }
        }
        mesh.face_uvs.clone_from(&mesh.faces);
        mesh
    }
}

fn grid(size: UVec2, step: DVec2, half: DVec2) -> Vec<DVec2> {
    let row = |j: u32| (0..=size.x).map(move |i| DVec2::new(f64::from(i), f64::from(j)) * step - half);
    (0..=size.y).flat_map(row).collect()
}

fn corners(size: UVec2, i: u32, j: u32) -> [u32; 4] {
    let at = |i: u32, j: u32| j * (size.x + 1) + i;
    [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
}

/// A method at work on a swatch.
pub struct Weaving {
    /// Radius of its yarn, metres.
    pub radius: f64,
    swatch: Swatch,
    yarn: Yarn,
}

enum Yarn {
    Fabric { cpu: Box<Cpu<f64>>, rest: Vec<DVec2>, frame: YarnFrame<f64> },
    Knots { scene: Arc<Scene>, backend: Box<CpuBackend<f64>>, output: FrameOutput<f64> },
}

impl Weaving {
    /// Lays the yarn of a method over a swatch. `library` is where templates that are not fitted come from.
    ///
    /// # Errors
    /// Those of compiling.
    pub fn new(
        method: Method,
        swatch: &Swatch,
        cells: &Cells,
        model: &YarnModel,
        library: &TemplateLibrary,
    ) -> Result<Self> {
        let (displacement, fine) = match method {
            Method::Table => (1.0, FINE),
            Method::Pattern => (0.0, FINE),
            Method::TableOnStitches => (1.0, 1),
            Method::Knots { fitted, beta } => return Self::knots(fitted, beta, swatch, cells, library),
        };
        let cloth = swatch.cloth(fine);
        let settings = Settings { displacement, ..Settings::default() };
        let fabric = Arc::new(Fabric::new(&cloth, model.clone(), settings)?);
        let running = RunningYarn { skip: SkipYarn::NOTHING, ..RunningYarn::default() };
        let cpu = Box::new(Cpu::new(fabric, running)?);
        let rest = cloth.positions.iter().map(|p| p.truncate()).collect();
        let yarn = Yarn::Fabric { cpu, rest, frame: YarnFrame::default() };
        Ok(Self { radius: model.pattern.radius, swatch: swatch.clone(), yarn })
    }

    fn knots(
        fitted: bool,
        beta: Option<f64>,
        swatch: &Swatch,
        cells: &Cells,
        library: &TemplateLibrary,
    ) -> Result<Self> {
        let mut own = TemplateLibrary::default();
        own.insert(cells.template.clone());
        let mode = if beta.is_some() { Mode::Relax } else { Mode::Embed };
        let options = SceneOptions { mode, ..SceneOptions::default() };
        let scene = Scene::compile(&swatch.mesh, if fitted { &own } else { library }, options)?;
        let scene = Arc::new(scene);
        let settings =
            knot::Settings { iterations: STEPS, beta: beta.unwrap_or(1.0), ..knot::Settings::default() };
        let backend = Box::new(CpuBackend::new(
            scene.clone(),
            &settings,
            &Running { skip: Skip::NOTHING, ..Running::default() },
        )?);
        let radius = scene.gauge * scene.yarn_radius;
        let yarn = Yarn::Knots { scene, backend, output: FrameOutput::default() };
        Ok(Self { radius, swatch: swatch.clone(), yarn })
    }

    /// The loops of a pose, and how many points of it lie outside the table.
    ///
    /// # Errors
    /// Those of frames.
    pub fn loops(&mut self, pose: &Pose) -> Result<(Loops, usize)> {
        let width = 2.0 * self.swatch.half.x * pose.gradient.x_axis.x;
        let (rows, outside) = match &mut self.yarn {
            Yarn::Fabric { cpu, rest, frame } => {
                let positions: Vec<DVec3> = rest.iter().map(|p| pose.place(*p)).collect();
                cpu.frame(&positions, frame)?;
                (rows(&FabricCurves::new(cpu.fabric(), frame, SUBDIVIDE, 1.0), pose, width)?, frame.outside)
            }
            Yarn::Knots { scene, backend, output } => {
                let rest = &self.swatch.mesh.positions;
                let positions: Vec<DVec3> = rest.iter().map(|p| pose.place(p.truncate())).collect();
                backend.frame(&positions, output)?;
                (rows(&FrameCurves::new(scene, output, SUBDIVIDE, None), pose, width)?, 0)
            }
        };
        let reach = f64::from(self.swatch.period) + REACH;
        Ok((Loops::find(rows, pose, self.swatch.stitch, reach), outside))
    }
}
