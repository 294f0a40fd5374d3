//! The converged optimum of a frame: for each face the best end of several starts, in f64.

use crate::Result;
use crate::backend::{Backend, CpuBackend, FrameOutput, Running, Skip};
use crate::knot::{KnotState, Settings, Solver, Start};
use crate::math::V2;
use crate::scene::{Mode, Scene};
use glam::DVec3;
use std::sync::Arc;

/// Steps after which a solve counts as run to its end; nearly all converge before.
pub const TO_THE_END: u32 = 200;
/// Turn of the starts on either side of the affine one, radians (as in [`crate::measure::accuracy`]).
const TURNED: f64 = 0.7;

/// Settings that run solves to their end, with the weights and the knot spacing of `settings` and nothing else
/// of them.
pub(super) fn to_the_end(settings: &Settings) -> Settings {
    Settings {
        solver: Solver::Safeguarded,
        iterations: TO_THE_END,
        beta: settings.beta,
        weight_angle: settings.weight_angle,
        weight_length: settings.weight_length,
        ..Settings::default()
    }
}

/// Finds optima of a scene's frames.
#[derive(Debug)]
pub struct Reference {
    scene: Arc<Scene>,
    start: CpuBackend<f64>,
    solve: FromState,
    polish: FromState,
}

impl Reference {
    /// For a scene of mode `relax`, with the weights and the knot spacing of `settings`.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn new(scene: Arc<Scene>, settings: &Settings) -> Result<Self> {
        let running = Running { skip: Skip::NOTHING, ..Running::default() };
        let backend = |start, iterations| {
            CpuBackend::new(scene.clone(), &Settings { start, iterations, ..to_the_end(settings) }, &running)
        };
        Ok(Self {
            start: backend(Start::Affine, 0)?,
            solve: FromState { backend: backend(Start::Previous, TO_THE_END)?, ran: false },
            polish: FromState { backend: backend(Start::Previous, 1)?, ran: false },
            scene,
        })
    }

    /// The optimum at `positions` (`[vertex]`, world units): of each face the state of least energy among the
    /// ends from the affine start, the template's own state, and the affine one with knots turned inwards and
    /// outwards.
    ///
    /// # Errors
    /// Those of [`Backend::frame`].
    pub fn solve(&mut self, positions: &[DVec3]) -> Result<FrameOutput<f64>> {
        let mut affine = FrameOutput::default();
        self.start.frame(positions, &mut affine)?;
        let mut best = affine.clone();
        self.solve.run(positions, &mut best)?;
        if self.scene.mode != Mode::Relax {
            return Ok(best);
        }
        let mut next = FrameOutput::default();
        for turn in [None, Some(TURNED), Some(-TURNED)] {
            next.clone_from(&affine);
            self.each_knot(|place, k, stencil| {
                let state = &mut next.knots[place];
                *state = match turn {
                    None => KnotState {
                        direction: stencil.knot_direction[k],
                        half_length: stencil.knot_half_length[k],
                    },
                    // Neighbours turn against each other, as the two sides of a loop do.
                    Some(angle) => turned(*state, if k % 2 == 0 { angle } else { -angle }),
                };
            });
            self.solve.run(positions, &mut next)?;
            self.take_better(&mut best, &next);
        }
        // Control points of the chosen states; a step more can only lower the energy.
        self.polish.run(positions, &mut best)?;
        Ok(best)
    }

    /// Calls `work` with each knot's place in batch order, its number within the face and its stencil.
    fn each_knot(&self, mut work: impl FnMut(usize, usize, &crate::scene::Stencil<f64>)) {
        for batch in &self.scene.batches {
            let stencil = &self.scene.stencils[batch.stencil];
            let knots = stencil.knot_count();
            for place in 0..batch.faces.len() * knots {
                work(batch.first_knot + place, place % knots, stencil);
            }
        }
    }

    /// Takes over the faces whose energy is lower.
    fn take_better(&self, best: &mut FrameOutput<f64>, other: &FrameOutput<f64>) {
        for batch in &self.scene.batches {
            let knots = self.scene.stencils[batch.stencil].knot_count();
            for i in 0..batch.faces.len() {
                let face = batch.first_face + i;
                if other.faces[face].energy < best.faces[face].energy {
                    let range = batch.first_knot + i * knots..batch.first_knot + (i + 1) * knots;
                    best.knots[range.clone()].copy_from_slice(&other.knots[range]);
                    best.faces[face] = other.faces[face];
                }
            }
        }
    }
}

/// A backend that starts from the states that stand in the output, which it takes for the frame before.
#[derive(Debug)]
struct FromState {
    backend: CpuBackend<f64>,
    ran: bool,
}

impl FromState {
    fn run(&mut self, positions: &[DVec3], output: &mut FrameOutput<f64>) -> Result<()> {
        if !self.ran {
            // The first frame has none before it.
            self.backend.frame(positions, &mut FrameOutput::default())?;
            self.ran = true;
        }
        *output = FrameOutput::starting_from(std::mem::take(&mut output.knots));
        self.backend.frame(positions, output)
    }
}

/// The state with its knot turned by an angle, radians.
fn turned(state: KnotState<f64>, angle: f64) -> KnotState<f64> {
    let (sin, cos) = angle.sin_cos();
    let d = state.direction;
    KnotState { direction: V2::new(cos * d.u - sin * d.v, sin * d.u + cos * d.v), ..state }
}
