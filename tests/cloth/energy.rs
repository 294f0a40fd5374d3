//! Energy and forces: differences, closed forms.

use super::{HEIGHT, SAMPLES, WIDTH, cloth, fabric, options, sample, shaken};
use crate::grid::Wrap;
use glam::{DQuat, DVec3};
use knotmesh::cloth::{RelaxOptions, SpringKind, Stiffness, relax};

/// Seen red with a factor 1.01 on the force of springs, and on that of bends.
#[test]
fn forces_are_minus_the_gradient() {
    for name in SAMPLES {
        let cloth = cloth(&sample(name), &options());
        let x = shaken(cloth.rest_positions(), 0.2 * WIDTH, 5);
        let mut forces = vec![DVec3::ZERO; x.len()];
        cloth.forces(&x, &mut forces);
        let greatest = forces.iter().map(|f| f.length()).fold(0.0, f64::max);
        assert!(greatest > 1e-3, "{name}: forces are there: {greatest}");
        let step = 1e-6 * WIDTH;
        for node in (0..x.len()).step_by(1 + x.len() / 40) {
            for axis in 0..3 {
                let at = |d: f64| {
                    let mut x = x.clone();
                    x[node][axis] += d;
                    cloth.energy(&x)
                };
                let slope = (at(step) - at(-step)) / (2.0 * step);
                let off = (forces[node][axis] + slope).abs();
                assert!(off < 1e-5 * greatest, "{name}, node {node}: {} {slope}", forces[node][axis]);
            }
        }
    }
}

/// A patch stretched by sx and sy: with strains e = s - 1 each face holds
/// `W H (Kc ex^2 + Kw ey^2) / 2 + k (d' - d)^2`, k = G d^2 / (2 W H), d' the stretched diagonal; forces on its sides follow by
/// virtual work. Seen red with the width beside edges doubled, and with the shear stiffness halved.
#[test]
fn a_uniformly_stretched_patch() {
    let (columns, rows) = (9, 7);
    let mesh = fabric(columns, rows, Wrap::Flat, |_, _| true);
    let cloth = cloth(&mesh, &options());
    let s = Stiffness::default();
    let (sx, sy) = (1.07, 0.98);
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    let flat = cloth.rest_positions();
    let x: Vec<DVec3> = flat.iter().map(|p| turn * (*p * DVec3::new(sx, sy, 1.0))).collect();
    let d = f64::hypot(WIDTH, HEIGHT);
    let stretched = f64::hypot(WIDTH * sx, HEIGHT * sy);
    let k = s.shear * d * d / (2.0 * WIDTH * HEIGHT);
    let area = WIDTH * HEIGHT;
    let faces = (columns * rows) as f64;
    let face = 0.5 * area * (s.course * (sx - 1.0_f64).powi(2) + s.wale * (sy - 1.0_f64).powi(2))
        + k * (stretched - d).powi(2);
    let energy = cloth.energy(&x);
    assert!((energy / (faces * face) - 1.0).abs() < 1e-9, "{energy} {}", faces * face);

    let mut forces = vec![DVec3::ZERO; x.len()];
    cloth.forces(&x, &mut forces);
    let slope =
        faces * (area * s.course * (sx - 1.0) + 2.0 * k * (stretched - d) * WIDTH * WIDTH * sx / stretched);
    let want = -slope / (columns as f64 * WIDTH);
    let right = columns as f64 * WIDTH;
    let (mut side, mut inside) = (0.0, 0.0_f64);
    for (p, f) in flat.iter().zip(&forces) {
        if (p.x - right).abs() < 1e-9 {
            side += (turn.inverse() * *f).x;
        } else if p.x > 1e-9 && p.y > 1e-9 && p.y < rows as f64 * HEIGHT - 1e-9 {
            inside = inside.max(f.length());
        }
    }
    assert!((side / want - 1.0).abs() < 1e-9, "{side} {want}");
    assert!(inside < 1e-9 * want.abs(), "{inside}");
}

/// A strip one stitch wide hangs from its top: each side edge carries the weight of its side below it, so that it is longer than
/// natural by weight over stiffness. Seen red with half of gravity, and with the width beside edges doubled.
#[test]
fn a_hanging_chain() {
    let rows = 30;
    let mut options = options();
    options.stiffness.shear = 0.0;
    options.stiffness.bending = 0.0;
    let cloth = cloth(&fabric(1, rows, Wrap::Flat, |_, _| true), &options);
    let mut x = cloth.rest_positions().to_vec();
    let top = rows as f64 * HEIGHT;
    let held = (0..x.len() as u32).filter(|n| (x[*n as usize].y - top).abs() < 1e-9).collect();
    let g = 9.81;
    let relaxed = relax(
        &cloth,
        &mut x,
        &RelaxOptions { held, acceleration: DVec3::NEG_Y * g, residual: 1e-9, ..RelaxOptions::default() },
    );
    assert!(relaxed.unwrap().converged);
    // From the definition: a node has a quarter of each face around it, and half of a stitch's width lies beside an edge.
    let stitch = options.density * WIDTH * HEIGHT;
    let k = options.stiffness.wale * 0.5 * WIDTH / HEIGHT;
    let mut seen = 0;
    for s in cloth.springs().iter().filter(|s| s.kind == SpringKind::Wale) {
        let [a, b] = s.nodes.map(|n| n as usize);
        let lower = cloth.rest_positions()[a].y.min(cloth.rest_positions()[b].y);
        let rows_below = (lower / HEIGHT).round();
        let weight = g * stitch * (0.5 * rows_below + 0.25);
        let want = HEIGHT + weight / k;
        let length = x[a].distance(x[b]);
        assert!((length - want).abs() < 1e-7 * HEIGHT, "{rows_below}: {length} {want}");
        seen += 1;
    }
    assert_eq!(seen, 2 * rows);
}

/// A strip rolled up to radius R holds `B area / (2 R^2)`: nodes on a circle of chords h have the curvature 1 / R exactly.
/// Seen red with a curvature divided by the sum of the lengths.
#[test]
fn a_rolled_strip() {
    let columns = 40;
    let mut options = options();
    options.stiffness.bending = 1.0;
    let mesh = fabric(columns, 3, Wrap::Tube, |_, _| true);
    let cloth = cloth(&mesh, &options);
    let radius = WIDTH / (2.0 * (std::f64::consts::PI / columns as f64).sin());
    let scale = radius / (columns as f64 * WIDTH / std::f64::consts::TAU);
    let x: Vec<DVec3> =
        cloth.rest_positions().iter().map(|p| DVec3::new(p.x * scale, p.y, p.z * scale)).collect();
    let want = 0.5 * columns as f64 * 3.0 * WIDTH * HEIGHT / (radius * radius);
    let energy = cloth.energy(&x);
    assert!((energy / want - 1.0).abs() < 1e-9, "{energy} {want}");
}
