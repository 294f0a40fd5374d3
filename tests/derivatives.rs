//! The energy's derivatives against central differences in f64, for every template.
//!
//! A central difference D(h) is wrong by a term in h^2: D(2h) - D(h) is three times that, so it bounds
//! D(h)'s error wherever h is small. Rounding adds the last bits of a residual over h.
//!
//! Seeded faults, each seen red here in both tests: b on the other side in `place` (b off by 0.17), d b /
//! d theta = -d in `moves` (b off by 0.56), the sign of de . df in `mixed` (A + C off by 1), no `p.sign` in the
//! mixed derivative of `add_turning` (A + C off by 60).

mod common;

use common::Random;
use knotmesh::knot::KnotState;
use knotmesh::knot::energy::{Points, Weights};
use knotmesh::knot::solve::stepped;
use knotmesh::math::V2;
use knotmesh::scene::{Mode, Stencil};
use knotmesh::template::{Coordinates, Template, TemplateLibrary};

const H: f64 = 1e-4;
/// Rounding of a difference, as a share of what is compared: a few 1e-16 over H, and the sums of them.
const ROUNDING: f64 = 1e-9;
const STATES: usize = 5;

struct Case {
    stencil: Stencil<f64>,
    weights: Weights<f64>,
    points: Points<f64>,
    state: Vec<KnotState<f64>>,
}

impl Case {
    /// A random deformation, each interpolated point off it by up to r, each knot turned and stretched.
    fn random(template: &Template, random: &mut Random) -> Self {
        let stencil = Stencil::new(template, Mode::Relax, Coordinates::MeanValue);
        let mut points = Points::default();
        points.fit(&stencil);
        let f = [(); 4].map(|()| random.between(-0.4, 0.4));
        let r = template.yarn_radius;
        let mut moved = |q: glam::DVec2, off: f64| {
            V2::new(
                q.x * (1.0 + f[0]) + q.y * f[1] + off * random.between(-r, r),
                q.x * f[2] + q.y * (1.0 + f[3]) + off * random.between(-r, r),
            )
        };
        for (i, p) in template.strands.iter().flatten().enumerate() {
            points.plane[i] = moved(template.place(p.place), 1.0);
        }
        for (k, knot) in template.knots.iter().enumerate() {
            points.centers[k] = moved(knot.center, 0.0);
        }
        let state = template
            .knots
            .iter()
            .map(|k| {
                let state = KnotState { direction: V2::of(k.direction), half_length: k.half_length };
                stepped(state, random.between(-1.0, 1.0), k.half_length * random.between(-0.4, 0.6))
            })
            .collect();
        Self { stencil, weights: Weights { angle: 1.0, length: 10.0 }, points, state }
    }

    /// The state with unknown `i` moved by `h`.
    fn moved(&self, i: usize, h: f64) -> Vec<KnotState<f64>> {
        let mut state = self.state.clone();
        let [turn, lengthening] = if i.is_multiple_of(2) { [h, 0.0] } else { [0.0, h] };
        state[i / 2] = stepped(state[i / 2], turn, lengthening);
        state
    }

    fn residuals(&mut self, state: &[KnotState<f64>]) -> Vec<f64> {
        self.points.place(&self.stencil, state);
        self.points.residuals(&self.stencil, &self.weights)
    }

    /// E, A, C and b at a state.
    fn assembled(&mut self, state: &[KnotState<f64>]) -> (f64, Vec<f64>, Vec<f64>, Vec<f64>) {
        let n = 2 * state.len();
        let (mut a, mut c, mut b) = (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n]);
        self.points.place(&self.stencil, state);
        let (points, stencil, weights) = (&mut self.points, &self.stencil, &self.weights);
        let e = points.assemble(stencil, weights, state, (&mut a, Some(&mut c), &mut b));
        (e, a, c, b)
    }

    /// Central differences of a vector-valued function by each unknown, with steps h and 2 h.
    fn differences(&mut self, of: impl Fn(&mut Self, &[KnotState<f64>]) -> Vec<f64>) -> [Vec<Vec<f64>>; 2] {
        [H, 2.0 * H].map(|h| {
            let unknowns = 0..2 * self.state.len();
            unknowns
                .map(|i| {
                    let (after, before) = (self.moved(i, h), self.moved(i, -h));
                    let (after, before) = (of(self, &after), of(self, &before));
                    after.iter().zip(before).map(|(x, y)| (x - y) / (2.0 * h)).collect()
                })
                .collect()
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Compares a value with its differences of step H and 2 H.
fn check(found: f64, differences: [f64; 2], scale: f64, what: &str) {
    let tolerance = (differences[1] - differences[0]).abs() + ROUNDING * scale;
    let error = (found - differences[0]).abs();
    assert!(error <= tolerance, "{what}: {found}, differences say {differences:?}, off by {error:.2e}");
}

/// Checks a template at random states; returns how many knots it has.
fn check_template(template: &Template, random: &mut Random) -> usize {
    let key = template.key();
    for _ in 0..STATES {
        let mut case = Case::random(template, random);
        let state = case.state.clone();
        let n = 2 * state.len();
        let r = case.residuals(&state);
        let (e, a, c, b) = case.assembled(&state);
        assert!((dot(&r, &r) - e).abs() <= 1e-12 * (1.0 + e), "{key}: E {e}");
        if n == 0 {
            continue;
        }
        let norm = |v: &[f64]| dot(v, v).sqrt();
        assert!(norm(&b) > 1e-3 && norm(&a) > 1e-3 && norm(&c) > 1e-3, "{key}: nothing to compare");
        let jacobian = case.differences(|case, state| case.residuals(state));
        let gradient = case.differences(|case, state| case.assembled(state).3);
        let scale = 1.0 + norm(&a) + norm(&c) + norm(&b);
        for i in 0..n {
            check(b[i], [0, 1].map(|s| dot(&jacobian[s][i], &r)), scale, &format!("{key}: b {i}"));
            for j in 0..=i {
                let what = format!("{key}: {i} {j}");
                let first = [0, 1].map(|s| dot(&jacobian[s][i], &jacobian[s][j]));
                check(a[i * n + j], first, scale, &format!("A of {what}"));
                let second = [0, 1].map(|s| gradient[s][i][j]);
                check(a[i * n + j] + c[i * n + j], second, scale, &format!("A + C of {what}"));
            }
        }
        // Gauss-Newton's own matrix is the same one.
        let (mut plain_a, mut plain_b) = (vec![0.0; n * n], vec![0.0; n]);
        case.points.place(&case.stencil, &state);
        case.points.assemble(&case.stencil, &case.weights, &state, (&mut plain_a, None, &mut plain_b));
        assert!(plain_a == a && plain_b == b, "{key}");
    }
    template.knots.len()
}

fn check_library(library: &TemplateLibrary, least: usize) {
    let mut random = Random::new(1);
    let templates = library.templates();
    let with_knots = templates.iter().filter(|t| check_template(t, &mut random) > 0).count();
    println!("{} templates, {with_knots} with knots", templates.len());
    assert!(with_knots >= least, "only {with_knots} templates with knots");
}

#[test]
fn every_embedded_template() {
    check_library(&TemplateLibrary::embedded(), 40);
}

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn every_template_of_the_fields_libraries() {
    let Some(data) = common::data() else { return };
    for (name, least) in [("illustration", 15), ("knitout", 10), ("weave", 0)] {
        let mut library = TemplateLibrary::default();
        library.add_path(&data.join(format!("smobj/{name}.sf"))).expect("reads");
        println!("{name}");
        check_library(&library, least);
    }
}
