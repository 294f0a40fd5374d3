//! A mode that is shown: its scene, a backend that is kept from frame to frame, what is drawn.

use super::fabric::Fabric;
use super::state::Settings;
use crate::backend::{Backend, CpuBackend, FrameOutput, Running, Wanted};
use crate::render::Strands;
use crate::scene::{Mode, Scene};
use crate::{Result, knot};
use glam::DVec3;
use std::sync::Arc;
use std::time::Instant;

/// A mode at work.
#[derive(Debug)]
pub struct Solver {
    /// The mode.
    pub mode: Mode,
    /// What is solved.
    pub scene: Arc<Scene>,
    settings: knot::Settings,
    backend: CpuBackend<f32>,
    /// The last frame.
    pub output: FrameOutput<f32>,
    /// The same as it is drawn.
    pub strands: Strands,
    /// Grows when yarns become others, and when they move.
    pub made: u64,
    /// See `made`.
    pub moved: u64,
    /// What the last frame took, a new backend included, seconds.
    pub seconds: f64,
}

fn running() -> Running {
    Running { energies: false, ..Running::default() }
}

impl Solver {
    /// Solves a fabric's first frame.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn new(
        fabric: &Fabric,
        scene: &Arc<Scene>,
        settings: &Settings,
        places: &[DVec3],
        made: u64,
    ) -> Result<Self> {
        let began = Instant::now();
        let settings = settings.of_solver();
        let mut backend = CpuBackend::new(scene.clone(), &settings, &running())?;
        backend.set_wanted(Wanted { knots: false, ..Wanted::default() })?;
        let mut output = FrameOutput::default();
        backend.frame(places, &mut output)?;
        let seconds = began.elapsed().as_secs_f64();
        let strands = Strands::of_frame(&fabric.mesh, scene, &output);
        let (mode, scene) = (scene.mode, scene.clone());
        Ok(Self { mode, scene, settings, backend, output, strands, made, moved: made, seconds })
    }

    /// Solves another frame, with other settings where they changed.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn frame(&mut self, settings: &Settings, places: &[DVec3], moved: u64) -> Result<()> {
        let began = Instant::now();
        let settings = settings.of_solver();
        if settings != self.settings {
            self.backend = CpuBackend::new(self.scene.clone(), &settings, &running())?;
            self.backend.set_wanted(Wanted { knots: false, ..Wanted::default() })?;
            self.settings = settings;
        }
        self.backend.frame(places, &mut self.output)?;
        self.seconds = began.elapsed().as_secs_f64();
        self.strands.move_to(&self.output);
        self.moved = moved;
        Ok(())
    }
}
