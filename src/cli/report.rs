//! `--report`: what a run did, as JSON.

use super::relax::Arguments;
use super::skip::SkipReport;
use knotmesh::backend::{FrameOutput, Skipped, TableReport};
use knotmesh::curve::FrameCurves;
use knotmesh::ids::FaceId;
use knotmesh::io::output::Output;
use knotmesh::knot::Status;
use knotmesh::math::Scalar;
use knotmesh::measure::clearance::{Clearance, clearance};
use knotmesh::measure::misfit::Misfit;
use knotmesh::measure::quantile;
use knotmesh::measure::stretch::{Stretch, stretch};
use knotmesh::mesh::StitchMesh;
use knotmesh::mesh::corners::gaps;
use knotmesh::scene::Scene;
use knotmesh::{Error, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The whole report. Faces are counted from 0, as in result files.
#[derive(Serialize)]
pub struct Report {
    /// What was read and compiled.
    #[serde(flatten)]
    pub inputs: Inputs,
    /// What could be left undone.
    pub skip: SkipReport,
    /// The GPU adapter that frames were solved on, at the end; null for the CPU.
    pub adapter: Option<String>,
    /// One per stitch type with a table.
    pub tables: Vec<TableReport>,
    /// One per frame.
    pub frames: Vec<FrameReport>,
    /// Most memory held at once before anything was measured, where the system tells (Linux).
    pub peak_memory_bytes: Option<u64>,
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Wall-clock seconds by stage.
    pub seconds: Seconds,
}

/// What was read and compiled.
#[derive(Serialize)]
pub struct Inputs {
    program: String,
    command: Vec<String>,
    mesh: PathBuf,
    vertices: usize,
    faces: usize,
    faces_skipped: usize,
    joins: usize,
    joins_apart: usize,
    greatest_gap: f64,
    gauge: f64,
    yarn_radius: f64,
    knots: usize,
    yarns: usize,
    yarns_closed: usize,
    control_points: usize,
    stitches: Vec<Stitch>,
    status_values: BTreeMap<u8, Status>,
    misfit: Misfit,
}

#[derive(Serialize)]
struct Stitch {
    key: String,
    faces: usize,
    knots: usize,
    points: usize,
}

impl Inputs {
    pub fn new(arguments: &Arguments, mesh: &StitchMesh, scene: &Scene, misfit: Misfit) -> Self {
        let (joins_apart, greatest_gap) = gaps(mesh);
        Self {
            program: format!("knotmesh {}", env!("CARGO_PKG_VERSION")),
            command: std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect(),
            mesh: arguments.mesh.clone(),
            vertices: mesh.positions.len(),
            faces: mesh.face_count(),
            faces_skipped: scene.skipped_faces(),
            joins: mesh.joins.len(),
            joins_apart,
            greatest_gap,
            gauge: scene.gauge,
            yarn_radius: scene.gauge * scene.yarn_radius,
            knots: scene.knot_count,
            yarns: scene.yarns.len(),
            yarns_closed: scene.yarns.closed.iter().filter(|c| **c).count(),
            control_points: scene.yarns.point_count(),
            stitches: scene
                .batches
                .iter()
                .map(|b| Stitch {
                    key: scene.templates[b.stencil].key(),
                    faces: b.faces.len(),
                    knots: scene.stencils[b.stencil].knot_count(),
                    points: scene.stencils[b.stencil].points.len(),
                })
                .collect(),
            status_values: Status::ALL.into_iter().map(|s| (s as u8, s)).collect(),
            misfit,
        }
    }
}

/// Wall-clock seconds.
#[derive(Default, Serialize)]
pub struct Seconds {
    pub parse: f64,
    pub compile: f64,
    pub tables: f64,
    pub read_frames: f64,
    pub solve: f64,
    pub write: f64,
    pub measure: f64,
    pub total: f64,
}

/// What became of a frame.
#[derive(Serialize)]
pub struct FrameReport {
    frame: usize,
    statuses: BTreeMap<Status, usize>,
    fell_back: Vec<u32>,
    skipped: Skipped,
    energy_start: Energy,
    energy: Energy,
    segment_error: Stretch,
    clearance: Clearance,
}

#[derive(Serialize)]
struct Energy {
    sum: f64,
    median: f64,
    p95: f64,
    max: f64,
}

impl Energy {
    fn new(mut values: Vec<f64>) -> Self {
        Self {
            sum: values.iter().sum(),
            median: quantile(&mut values, 0.5),
            p95: quantile(&mut values, 0.95),
            max: values.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// Extra points a segment that distances between curves are measured on.
const DENSE: usize = 4;

impl FrameReport {
    pub fn new<T: Scalar>(
        scene: &Scene,
        frame: usize,
        output: &FrameOutput<T>,
        fell_back: &[FaceId],
    ) -> Result<Self> {
        let mut statuses = BTreeMap::new();
        for face in 0..scene.face_places.len() {
            *statuses.entry(output.face(scene, face.into()).status).or_default() += 1;
        }
        let curves = FrameCurves::new(scene, output, DENSE, None);
        Ok(Self {
            frame,
            statuses,
            fell_back: fell_back.iter().map(|f| f.0).collect(),
            skipped: output.skipped,
            energy_start: Energy::new(output.faces.iter().map(|f| f.energy_start.to_f64()).collect()),
            energy: Energy::new(output.faces.iter().map(|f| f.energy.to_f64()).collect()),
            segment_error: stretch(scene, output),
            clearance: clearance(&curves, scene.yarn_radius * scene.gauge)?,
        })
    }
}

/// Most memory that this process has held at once.
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}

impl Report {
    /// Writes the report.
    pub fn write(&self, path: &Path) -> Result<()> {
        write_json(path, self)
    }
}

/// Writes a report as JSON.
pub fn write_json(path: &Path, report: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(report)
        .map_err(|e| Error::invalid(format_args!("the report cannot be written: {e}")))?;
    let mut out = Output::create(path)?;
    out.put(text.as_bytes())?;
    out.put(b"\n")?;
    out.commit()
}
