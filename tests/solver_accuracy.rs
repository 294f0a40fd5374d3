//! How near few iterations come to the optimum under random deformations: 800 symmetric F a row, principal
//! stretches log-uniform in the row's range; the error is the greatest in-plane distance of a control point
//! from its place at the best optimum of four starts, in r.
//!
//! Run with `--nocapture` for the table. Starts are never fallen behind, and what 10 safeguarded iterations
//! must reach lies a little below what they do reach (99.6 and 97.4 % for the prototype's knit in the last two
//! rows, 100 and 96.8 % for ours); the rest ends in another optimum than the best one.
//!
//! Seeded faults, each seen red: every step taken (ends above the start), damping lowered after failures too
//! (93.5 % in the fourth row), no fall back to Gauss-Newton (98.9 and 89.0 %), b on the other side, its
//! derivative negated (96.1 % each).

mod common;

use common::Random;
use glam::DVec2;
use knotmesh::knot::{Settings, Solver};
use knotmesh::measure::accuracy::{Deformation, Trial};
use knotmesh::measure::quantile;
use knotmesh::template::{Knot, Place, Template, TemplateLibrary, TemplatePoint};

const ROWS: [(f64, f64); 5] = [(0.9, 1.1), (0.8, 1.25), (0.7, 1.5), (0.5, 2.0), (0.3, 3.0)];
const SAMPLES: usize = 800;
const METHODS: [(Solver, u32); 5] = [
    (Solver::GaussNewton, 3),
    (Solver::GaussNewton, 10),
    (Solver::Safeguarded, 3),
    (Solver::Safeguarded, 10),
    (Solver::Safeguarded, 60),
];

/// The knit of the method's prototype: a face 1 x 0.8, yarn radius 0.125.
fn prototype_knit() -> Template {
    let r = 0.125;
    let knot = |u: f64, tilt: f64| Knot {
        center: DVec2::new(u, -0.01),
        direction: DVec2::new(tilt.cos(), tilt.sin()),
        half_length: 0.15,
    };
    let contact = |knot, sign, z| TemplatePoint { place: Place::Contact { knot, sign }, z };
    let control = |knot, sign| TemplatePoint { place: Place::Control { knot, sign }, z: 0.0 };
    let boundary = |edge, along| TemplatePoint { place: Place::Boundary { edge, along }, z: 0.0 };
    let leg = |side, along, knot, inner: f64, top| {
        vec![
            boundary(side, along),
            contact(knot, -1.0, -r),
            control(knot, inner),
            contact(knot, 1.0, r),
            boundary(2, top),
        ]
    };
    let mut head = vec![boundary(0, 0.275), contact(0, -1.0, r), control(0, -1.0), contact(0, 1.0, -r)];
    head.extend([contact(1, 1.0, -r), control(1, 1.0), contact(1, -1.0, r), boundary(0, 0.725)]);
    Template {
        name: "knit+".into(),
        labels: ["-lX", "+yX", "+lX", "-yX"].map(String::from).to_vec(),
        corners: [[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]].map(DVec2::from).to_vec(),
        yarn_radius: r,
        knots: vec![knot(-0.225, 1.69), knot(0.225, 1.45)],
        strands: vec![head, leg(3, 0.75, 0, 1.0, 0.725), leg(1, 0.25, 1, -1.0, 0.275)],
        polylines: None,
        notes: Vec::new(),
    }
}

struct Row {
    /// [method] share of the samples within 0.5 r of the best optimum.
    near: Vec<f64>,
    /// [method] how many ended above their start.
    above: Vec<usize>,
}

/// One row of the table.
fn row(trial: &Trial, (low, high): (f64, f64)) -> Row {
    let mut random = Random::new(11);
    let mut errors = vec![Vec::new(); METHODS.len()];
    let mut above = vec![0; METHODS.len()];
    for _ in 0..SAMPLES {
        let mut stretch = || random.between(low.ln(), high.ln()).exp();
        let (first, second) = (stretch(), stretch());
        let f = Deformation::principal(first, second, random.between(0.0, std::f64::consts::PI));
        let best = trial.best(&Settings::default(), &f);
        for (m, (solver, iterations)) in METHODS.into_iter().enumerate() {
            let solved = trial.run::<f64>(&Settings { solver, iterations, ..Settings::default() }, &f, None);
            // False for NaN.
            let kept = solved.result.energy <= solved.result.energy_start;
            above[m] += usize::from(!kept);
            errors[m].push(trial.distance(&solved, &best));
        }
    }
    let near = |e: &Vec<f64>| e.iter().filter(|d| **d <= 0.5).count() as f64 / SAMPLES as f64;
    let near: Vec<f64> = errors.iter().map(near).collect();
    println!("  stretches {low} to {high}");
    for (m, (solver, iterations)) in METHODS.into_iter().enumerate() {
        let [a, b, c] = [0.5, 0.95, 1.0].map(|q| quantile(&mut errors[m], q));
        println!(
            "    {:17} {:2}: median {a:.1e}, 95 % {b:.1e}, worst {c:.1e} r; within 0.5 r {:.1} %; above start {:.1} %",
            format!("{solver:?}"),
            iterations,
            100.0 * near[m],
            100.0 * above[m] as f64 / SAMPLES as f64
        );
    }
    Row { near, above }
}

/// Least share of the samples within 0.5 r after 10 safeguarded iterations, by row.
const LEAST: [f64; 5] = [1.0, 1.0, 0.999, 0.99, 0.95];

fn table(name: &str, template: &Template) {
    println!("{name}, r = {}", template.yarn_radius);
    let trial = Trial::new(template);
    for (range, least) in ROWS.into_iter().zip(LEAST) {
        let row = row(&trial, range);
        for (m, (solver, _)) in METHODS.into_iter().enumerate() {
            if solver == Solver::Safeguarded {
                assert_eq!(row.above[m], 0, "{name} {range:?}: faces above their start");
            }
        }
        assert!(row.near[3] >= least, "{name} {range:?}: {} within 0.5 r, expected {least}", row.near[3]);
    }
}

#[test]
fn the_prototypes_knit() {
    table("prototype's knit", &prototype_knit());
}

#[test]
fn our_knit() {
    let library = TemplateLibrary::embedded();
    table("our knit", library.by_key("knit+ -lX +yX +lX -yX").expect("it is there"));
}
