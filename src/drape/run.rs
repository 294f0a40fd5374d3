//! Frames of a cloth in a scene, one after the other.

use super::check::positions;
use super::scene::DrapeScene;
use super::stage::{ContactReport, Nodes, Stage};
use crate::Result;
use crate::cloth::{
    Cloth, ClothOptions, FrameReport, RelaxOptions, RelaxReport, StepOptions, Stepper, Support, Surroundings,
    relax,
};
use crate::mesh::StitchMesh;
use crate::template::TemplateLibrary;
use glam::DVec3;
use serde::Serialize;

impl Surroundings for Stage {
    fn accelerate(&mut self, time: f64, dt: f64, positions: &[DVec3], velocities: &mut [DVec3]) {
        Stage::accelerate(self, time, dt, positions, velocities);
    }

    fn place(&mut self, time: f64, positions: &mut [DVec3]) {
        Stage::place(self, time, positions);
    }

    fn support(&mut self, step: &Support, forces: &mut [DVec3]) -> usize {
        Stage::support(self, step, forces)
    }

    fn confine(&mut self, time: f64, dt: f64, previous: &[DVec3], positions: &mut [DVec3]) -> usize {
        Stage::confine(self, time, dt, previous, positions)
    }

    fn collide(&mut self, time: f64, dt: f64, previous: &[DVec3], positions: &mut [DVec3]) {
        Stage::collide(self, time, dt, previous, positions);
    }

    fn held(&self) -> &[u32] {
        Stage::held(self)
    }
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct DrapeReport {
    /// Its number, counted from 0.
    pub frame: usize,
    /// Seconds since the start.
    pub time: f64,
    /// J.
    pub kinetic_energy: f64,
    /// J.
    pub elastic_energy: f64,
    /// Substeps that the result took.
    pub substeps: usize,
    /// How often the frame was bad and done again in smaller steps.
    pub cut: u32,
    /// Whether it stayed bad, so that the cloth was left as it was, at rest.
    pub damped: bool,
    /// Collisions.
    #[serde(flatten)]
    pub contact: ContactReport,
}

/// A cloth in a scene, at a frame. Frame 0 is the start.
///
/// ```no_run
/// # fn frames(mesh: &knotmesh::mesh::StitchMesh, library: &knotmesh::template::TemplateLibrary,
/// #     scene: &knotmesh::drape::scene::DrapeScene) -> knotmesh::Result<()> {
/// let mut drape = knotmesh::drape::Drape::new(mesh, library, scene, &Default::default())?;
/// while drape.advance() {
///     println!("{}: {}", drape.report().frame, drape.positions()[0]);
/// }
/// # Ok(())
/// # }
/// ```
pub struct Drape {
    stage: Stage,
    stepper: Stepper,
    frames: usize,
    frame_time: f64,
    unit: f64,
    /// None before frame 0.
    frame: Option<usize>,
    report: DrapeReport,
    relaxed: Option<RelaxReport>,
    /// `[vertex]` in the mesh's units.
    vertices: Vec<DVec3>,
}

impl Drape {
    /// Compiles mesh and scene; relaxes the cloth if the scene says so. `options` are the cloth's: the scene's density goes before.
    ///
    /// # Errors
    /// What [`DrapeScene::check`] refuses, selections that name what is not there, and what [`Cloth::new`] refuses.
    pub fn new(
        mesh: &StitchMesh,
        library: &TemplateLibrary,
        scene: &DrapeScene,
        options: &ClothOptions,
    ) -> Result<Self> {
        scene.check()?;
        let [_, placed] = positions(mesh, scene);
        let gauge = mesh.gauge.map(|size| size.map(|x| x * scene.unit));
        let metric = StitchMesh { positions: placed, gauge, ..mesh.clone() };
        let options = ClothOptions { density: scene.density.unwrap_or(options.density), ..options.clone() };
        let cloth = Cloth::new(&metric, library, &options)?;
        let mut start = cloth.rest_positions().to_vec();
        let relaxed =
            if scene.relax { Some(relax(&cloth, &mut start, &RelaxOptions::default())?) } else { None };
        let nodes = Nodes {
            start: &start,
            masses: cloth.masses(),
            triangles: cloth.triangles(),
            of_vertex: cloth.node_of_vertex(),
        };
        let stage = Stage::new(scene, mesh, nodes)?;
        stage.place_at_start(&mut start);
        let default = StepOptions::default();
        let steps = StepOptions {
            substeps: scene.substeps.map_or(default.substeps, |n| n as usize),
            damping: scene.damping.unwrap_or(default.damping),
            ..default
        };
        let stepper = Stepper::new(cloth, &start, steps, &stage)?;
        Ok(Self {
            stage,
            stepper,
            frames: scene.frames,
            frame_time: scene.frame_time(),
            unit: scene.unit,
            frame: None,
            report: DrapeReport::default(),
            relaxed,
            vertices: mesh.positions.clone(),
        })
    }

    /// Goes on to the next frame, at first to frame 0; false after the last one.
    pub fn advance(&mut self) -> bool {
        let next = self.frame.map_or(0, |f| f + 1);
        if next >= self.frames {
            return false;
        }
        self.frame = Some(next);
        self.report = DrapeReport { frame: next, ..DrapeReport::default() };
        if next > 0 {
            let FrameReport { time, substeps, cut, damped, kinetic, elastic, .. } =
                self.stepper.frame(self.frame_time, &mut self.stage);
            let contact = self.stage.take_report();
            self.report = DrapeReport {
                frame: next,
                time,
                kinetic_energy: kinetic,
                elastic_energy: elastic,
                substeps,
                cut,
                damped,
                contact,
            };
        } else {
            self.report.elastic_energy = self.stepper.cloth().energy(self.stepper.positions());
        }
        self.stepper.cloth().write_back(self.stepper.positions(), &mut self.vertices);
        self.vertices.iter_mut().for_each(|p| *p /= self.unit);
        true
    }

    /// `[vertex]` of the frame, in the mesh's units and its vertices' order.
    pub fn positions(&self) -> &[DVec3] {
        &self.vertices
    }

    /// What became of the frame.
    pub fn report(&self) -> &DrapeReport {
        &self.report
    }

    /// Number of frames.
    pub fn frame_count(&self) -> usize {
        self.frames
    }

    /// What relaxing did, if the scene asked for it.
    pub fn relaxed(&self) -> Option<&RelaxReport> {
        self.relaxed.as_ref()
    }

    /// The scene at work.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// The cloth in motion; its positions are metres, by node.
    pub fn stepper(&self) -> &Stepper {
        &self.stepper
    }
}

/// Steps a cloth through a scene and hands every frame to `each`: its report and its positions `[vertex]`, in the mesh's units.
/// So frames go to a `Backend` without touching the disk. Returns the frames' reports.
///
/// # Errors
/// Those of [`Drape::new`], and what `each` returns, which ends it.
pub fn drape(
    mesh: &StitchMesh,
    library: &TemplateLibrary,
    scene: &DrapeScene,
    mut each: impl FnMut(&DrapeReport, &[DVec3]) -> Result<()>,
) -> Result<Vec<DrapeReport>> {
    let mut drape = Drape::new(mesh, library, scene, &ClothOptions::default())?;
    let mut reports = Vec::new();
    while drape.advance() {
        each(drape.report(), drape.positions())?;
        reports.push(*drape.report());
    }
    Ok(reports)
}
