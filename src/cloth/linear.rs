//! The linear system of a Newton step: the energy's second derivatives times a vector, and conjugate gradients.

use super::Cloth;
use glam::{DMat3, DVec3};

/// What the preconditioner's diagonal has at least, of the stiffest spring's stiffness. Steps are measured by it too: with 1e-4 a node
/// that hardly anything holds across went round on its springs, and the region of trust shrank for all.
const SOFTEST: f64 = 0.1;

/// Workspaces of conjugate gradients, and the matrix in pieces.
pub(super) struct System {
    /// `[spring]` direction and stiffness across it, N/m. A compressed spring's is negative; left out, the matrix is positive.
    springs: Vec<(DVec3, f64)>,
    /// `[node]` inverse of the matrix's diagonal block.
    inverse: Vec<DMat3>,
    stiffest: f64,
    residual: Vec<DVec3>,
    direction: Vec<DVec3>,
    product: Vec<DVec3>,
}

impl System {
    pub fn new(cloth: &Cloth) -> Self {
        let nodes = vec![DVec3::ZERO; cloth.node_count()];
        let stiffest = cloth.springs.iter().map(|s| s.stiffness).fold(0.0, f64::max);
        Self {
            stiffest,
            springs: Vec::with_capacity(cloth.springs.len()),
            inverse: Vec::with_capacity(nodes.len()),
            residual: nodes.clone(),
            direction: nodes.clone(),
            product: nodes,
        }
    }

    /// The matrix at positions; `exact` with what is negative.
    pub fn set(&mut self, cloth: &Cloth, x: &[DVec3], exact: bool) {
        let shift = SOFTEST * self.stiffest;
        self.springs.clear();
        self.springs.extend(cloth.springs.iter().map(|s| {
            let [a, b] = s.nodes.map(|n| x[n as usize]);
            let (n, l) = s.stretched(a, b);
            // Below a tenth of its length a spring turns with any step: its exact derivative says little.
            let across = 1.0 - s.length / l.max(0.1 * s.length);
            (n, s.stiffness * if exact { across } else { across.max(0.0) })
        }));
        self.inverse.clear();
        self.inverse.resize(x.len(), DMat3::from_diagonal(DVec3::splat(shift)));
        for (s, (n, across)) in cloth.springs.iter().zip(&self.springs) {
            // The preconditioner stays positive.
            let across = across.max(0.0);
            let along = *n * (s.stiffness - across);
            let block = DMat3::from_cols(along * n.x, along * n.y, along * n.z)
                + DMat3::from_diagonal(DVec3::splat(across));
            s.nodes.iter().for_each(|k| self.inverse[*k as usize] += block);
        }
        for b in &cloth.bends {
            for (k, w) in b.nodes.iter().zip(&b.weights) {
                self.inverse[*k as usize] += DMat3::from_diagonal(DVec3::splat(b.stiffness * w * w));
            }
        }
        for m in &mut self.inverse {
            // A node that nothing holds has no entries and takes no step.
            let inverse = m.inverse();
            *m = if inverse.is_finite() { inverse } else { DMat3::ZERO };
        }
    }

    /// The matrix times `direction`, into `product`.
    fn multiply(&mut self, cloth: &Cloth) {
        let (p, springs) = (&self.direction, &self.springs);
        self.product.fill(DVec3::ZERO);
        cloth.scatter(
            &mut self.product,
            |i, s| {
                let d = p[s.nodes[0] as usize] - p[s.nodes[1] as usize];
                let (n, across) = springs[i];
                d * across + n * ((s.stiffness - across) * n.dot(d))
            },
            |b| b.curvature(p) * b.stiffness,
        );
    }

    /// The step that lessens the model `-forces s + s H s / 2` most within `radius` of the preconditioner's norm, by conjugate
    /// gradients (Steihaug 1983): until the residual has shrunk to a share `tolerance` of `forces`, for `most` rounds, or until the
    /// radius is reached, as it is along directions in which the matrix is not positive. `keep` leaves of a vector what may
    /// move. Without a radius, the first step is as long as the preconditioner says.
    pub fn solve(
        &mut self,
        cloth: &Cloth,
        forces: &[DVec3],
        step: &mut [DVec3],
        (tolerance, most, radius): (f64, usize, Option<f64>),
        keep: &impl Fn(&mut [DVec3]),
    ) -> Solved {
        step.fill(DVec3::ZERO);
        self.residual.copy_from_slice(forces);
        let target = tolerance * dot(forces, forces).sqrt();
        let mut rho = self.precondition(keep);
        self.direction.copy_from_slice(&self.product);
        let radius = radius.unwrap_or_else(|| rho.sqrt());
        let mut solved = Solved { radius, ..Solved::default() };
        // Products in the preconditioner's norm: of the step, of it with the direction, of the direction.
        let (mut ss, mut sp, mut pp) = (0.0, 0.0, rho);
        while solved.rounds < most && rho > 0.0 && rho.is_finite() {
            solved.rounds += 1;
            self.multiply(cloth);
            keep(&mut self.product);
            let curvature = dot(&self.direction, &self.product);
            let alpha = rho / curvature;
            let further: f64 = ss + 2.0 * alpha * sp + alpha * alpha * pp;
            if curvature.is_nan() || curvature <= 0.0 || further >= radius * radius {
                let room = (radius * radius - ss).max(0.0);
                let tau = room / (sp + (sp * sp + pp * room).sqrt());
                step.iter_mut().zip(&self.direction).for_each(|(x, p)| *x += *p * tau);
                solved.predicted += tau * rho - 0.5 * tau * tau * curvature;
                solved.bounded = true;
                break;
            }
            for (((x, r), p), q) in
                step.iter_mut().zip(&mut self.residual).zip(&self.direction).zip(&self.product)
            {
                *x += *p * alpha;
                *r -= *q * alpha;
            }
            solved.predicted += 0.5 * alpha * rho;
            ss = further;
            if dot(&self.residual, &self.residual).sqrt() <= target {
                break;
            }
            let before = rho;
            rho = self.precondition(keep);
            let beta = rho / before;
            sp = beta * (sp + alpha * pp);
            pp = rho + beta * beta * pp;
            for (p, z) in self.direction.iter_mut().zip(&self.product) {
                *p = *z + *p * beta;
            }
        }
        solved
    }

    /// The preconditioned residual, into `product`, and its product with the residual.
    fn precondition(&mut self, keep: &impl Fn(&mut [DVec3])) -> f64 {
        for ((z, m), r) in self.product.iter_mut().zip(&self.inverse).zip(&self.residual) {
            *z = *m * *r;
        }
        keep(&mut self.product);
        dot(&self.residual, &self.product)
    }
}

/// How a system was solved.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Solved {
    /// Rounds of conjugate gradients.
    pub rounds: usize,
    /// By what the model is lessened, J.
    pub predicted: f64,
    /// The radius.
    pub radius: f64,
    /// Whether the step goes as far as that.
    pub bounded: bool,
}

/// Sums in order: the same on any number of threads.
pub(super) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
