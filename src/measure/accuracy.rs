//! How near a solve comes to the optimum: one stitch under an affine deformation, run from any start.

use crate::backend::Precision;
use crate::knot::table::{Grid, Table};
use crate::knot::tabulate::{Subject, tabulate};
use crate::knot::{FaceResult, Given, Kernel, KnotState, Settings, Solver, Workspace};
use crate::math::{Scalar, V2, V3};
use crate::scene::{Mode, Stencil};
use crate::template::{Coordinates, Template};
use glam::DVec2;

/// Iterations after which a solve counts as run to its end.
pub const TO_THE_END: u32 = 500;
/// Turn of the starts on either side of the affine one, radians.
const TURNED: f64 = 0.7;

/// An in-plane deformation F: template to face, template units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deformation {
    /// F e_u.
    pub course: DVec2,
    /// F e_v.
    pub wale: DVec2,
}

impl Deformation {
    /// The symmetric F with these principal stretches, the first along the direction at `angle` (radians).
    pub fn principal(first: f64, second: f64, angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        Self {
            course: DVec2::new(first * c * c + second * s * s, (first - second) * c * s),
            wale: DVec2::new((first - second) * c * s, first * s * s + second * c * c),
        }
    }

    /// F q.
    pub fn apply(&self, q: DVec2) -> DVec2 {
        self.course * q.x + self.wale * q.y
    }
}

/// The end of a solve.
#[derive(Clone, Debug)]
pub struct Solved<T> {
    /// Energies and status.
    pub result: FaceResult<T>,
    /// `[knot]` the end state.
    pub state: Vec<KnotState<T>>,
    /// `[point]` in the face frame, template units.
    pub points: Vec<V2<T>>,
}

/// A stitch type to try solvers on. Its face has one flat normal; its corners are the template's under F.
#[derive(Clone, Debug)]
pub struct Trial {
    template: Template,
    stencil: Stencil<f64>,
}

impl Trial {
    /// Compiles a template.
    pub fn new(template: &Template) -> Self {
        let stencil = Stencil::new(template, Mode::Relax, Coordinates::MeanValue);
        Self { template: template.clone(), stencil }
    }

    /// The template, compiled.
    pub fn stencil(&self) -> &Stencil<f64> {
        &self.stencil
    }

    /// Runs one face from `start`, or from the affine start.
    pub fn run<T: Precision>(
        &self,
        settings: &Settings,
        deformation: &Deformation,
        start: Option<&[KnotState<T>]>,
    ) -> Solved<T> {
        self.run_kernel(&Kernel::new(&self.stencil, Mode::Relax, settings), deformation, start)
    }

    /// The table of the stitch type under the settings' weights and spacing; `None` without knots.
    pub fn table(&self, settings: &Settings, grid: &Grid) -> Option<Table<f32>> {
        tabulate(Subject::new(&self.stencil, &self.template.corners, settings), grid)
    }

    /// [`Trial::run`] with a kernel made for this stitch type.
    pub fn run_kernel<T: Precision>(
        &self,
        kernel: &Kernel<T>,
        deformation: &Deformation,
        start: Option<&[KnotState<T>]>,
    ) -> Solved<T> {
        let mut work = Workspace::default();
        kernel.fit(&mut work);
        let first = self.template.corners[0];
        for (i, corner) in self.template.corners.iter().enumerate() {
            let at = deformation.apply(*corner - first);
            work.corners[i] = V3::of(at.extend(0.0));
            work.normals[i] = V3::new(T::zero(), T::zero(), T::one());
        }
        let given = Given { start: start.is_some(), ..Given::nothing() };
        work.state.copy_from_slice(start.unwrap_or(&vec![KnotState::default(); self.stencil.knot_count()]));
        let result = T::face(kernel, &mut work, given).lane(0);
        let points = kernel.plane_points(&work).0.to_vec();
        Solved { result, state: work.state, points }
    }

    /// Four starts: affine, the template's own state, and affine with knots turned inwards and outwards.
    pub fn starts(&self, deformation: &Deformation) -> Vec<Vec<KnotState<f64>>> {
        let none = Settings { iterations: 0, ..Settings::default() };
        let affine = self.run::<f64>(&none, deformation, None).state;
        let rest =
            self.stencil.knot_direction.iter().zip(&self.stencil.knot_half_length).map(
                |(direction, half_length)| KnotState { direction: *direction, half_length: *half_length },
            );
        let turned = |angle: f64| {
            let turn = |(k, s): (usize, &KnotState<f64>)| {
                // Neighbours turn against each other, as the two sides of a loop do.
                let (sin, cos) = (if k % 2 == 0 { angle } else { -angle }).sin_cos();
                let d = s.direction;
                KnotState { direction: V2::new(cos * d.u - sin * d.v, sin * d.u + cos * d.v), ..*s }
            };
            affine.iter().enumerate().map(turn).collect()
        };
        vec![affine.clone(), rest.collect(), turned(TURNED), turned(-TURNED)]
    }

    /// The best end of the default solver from the four starts, with the weights and spacing of `settings`.
    pub fn best(&self, settings: &Settings, deformation: &Deformation) -> Solved<f64> {
        let settings = Settings { solver: Solver::Safeguarded, iterations: TO_THE_END, ..*settings };
        self.starts(deformation)
            .iter()
            .map(|start| self.run(&settings, deformation, Some(start)))
            .min_by(|a, b| a.result.energy.total_cmp(&b.result.energy))
            .expect("there are four starts")
    }

    /// The greatest in-plane distance of points between two ends, in yarn radii.
    pub fn distance<A: Scalar, B: Scalar>(&self, a: &Solved<A>, b: &Solved<B>) -> f64 {
        let far = a.points.iter().zip(&b.points).map(|(a, b)| {
            (a.u.to_f64() - b.u.to_f64()).hypot(a.v.to_f64() - b.v.to_f64()) / self.stencil.yarn_radius
        });
        // A NaN is infinitely far.
        far.map(|d| if d.is_nan() { f64::INFINITY } else { d }).fold(0.0, f64::max)
    }
}
