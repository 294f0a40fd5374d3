//! The comparison can fail: a change of 1 % of one number in one shader is found.

use crate::case::{Case, JOINT, agree, agreement, compiled, told};
use crate::common::faces::{faces, motion};
use crate::common::gpu::adapter;
use crate::frames::{chosen, tube};
use knotmesh::backend::gpu::GpuOptions;
use knotmesh::knot::{Settings, Start};
use knotmesh::scene::Mode;
use knotmesh::template::Coordinates;

/// Shader, what stands there, and instead.
const FAULTS: [(&str, &str, &str); 9] = [
    ("frame", "frame.t1 = a * (1.0 / course_or_one)", "frame.t1 = a * (1.01 / course_or_one)"),
    ("start", "let h = angle * 0.5;", "let h = angle * 0.505;"),
    ("table", "2.0 * (frame.f11 - 1.0)", "2.02 * (frame.f11 - 1.0)"),
    ("lift", "let inverse = 1.0 / select(det, 1.0, steep)", "let inverse = 1.01 / select(det, 1.0, steep)"),
    ("energy", "1.0 / select(1.0, length, some)", "1.01 / select(1.0, length, some)"),
    ("sums", "let second = (1.0 - slope * slope)", "let second = (1.01 - slope * slope)"),
    ("factor", "let damp = 1.0 + mu;", "let damp = 1.01 + mu;"),
    (
        "solve",
        "let shortest = stencil.yarn_radius * 0.5;\n    if SAFE",
        "let shortest = stencil.yarn_radius * 0.505;\n    if SAFE",
    ),
    ("stitch", "let share = 1.0 / larger(count, 1.0);", "let share = 1.01 / larger(count, 1.0);"),
];

const SURFACE_FAULTS: [(&str, &str, &str); 2] = [
    ("surface", "let area = sum * 0.5;", "let area = sum * 0.505;"),
    ("surface", "points[a + 3u + i]) * 0.5;", "points[a + 3u + i]) * 0.505;"),
];

fn found(case: &Case, faults: &[(&'static str, &'static str, &'static str)]) {
    let Some(adapter) = adapter() else { return };
    let twin = case.by_twin();
    let (right, exact) = case.by_device(&adapter, &JOINT);
    // Where bits do not agree anyway, a fault must at least be told from that.
    let counts = agreement(&twin, &right);
    assert!(agree(&counts) || !exact, "without a fault: {}", told(&counts));
    for (shader, from, to) in faults {
        let (wrong, _) = case.by_device(&adapter, &GpuOptions { fault: Some((from, to)), ..JOINT });
        let counts = agreement(&right, &wrong);
        let frames = twin.iter().zip(&wrong);
        let worst = frames.flat_map(|(a, b)| case.apart(a, b)).filter(|x| x.is_finite()).fold(0.0, f64::max);
        println!("{shader}, {to}: {}, up to {worst:.1e} r", told(&counts));
        assert!(!agree(&counts), "{shader}: nobody sees {to} instead of {from}");
    }
}

#[test]
fn of_stitches_are_found() {
    let mesh = faces(&chosen(), |_| 33);
    let scene = compiled(&mesh, Mode::Relax, Coordinates::MeanValue);
    let motion = motion(&mesh, 4);
    let settings = Settings { start: Start::Table, ..Settings::default() };
    found(&Case::new(&scene, &motion, settings), &FAULTS);
}

#[test]
fn of_surfaces_are_found() {
    let (mesh, motion) = tube();
    let scene = compiled(&mesh, Mode::Embed, Coordinates::MeanValue);
    found(&Case::new(&scene, &motion, Settings::default()), &SURFACE_FAULTS);
}
