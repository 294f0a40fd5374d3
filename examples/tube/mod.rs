//! A helical tube of stockinette of any number of stitches: 200 a round, the last round as far as they go.

pub mod moves;

use glam::DVec3;
use std::fmt::Write;

/// Stitches a round.
pub const COLUMNS: usize = 200;
/// Height of a course over its width.
pub const HEIGHT: f64 = 0.61;

/// Whether faces share the vertices of their common corners, or have four of their own each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vertices {
    Shared,
    Own,
}

/// Along the helix, counted from 0, the corners of a face.
fn corners(face: usize) -> [usize; 4] {
    [face, face + 1, face + COLUMNS + 1, face + COLUMNS]
}

/// A place along the helix, which stands on z = 0 around the z axis; course spacings.
fn place(at: usize) -> DVec3 {
    let radius = COLUMNS as f64 / std::f64::consts::TAU;
    // A full turn ends where it began, to the bit.
    let (sin, cos) = (std::f64::consts::TAU * (at % COLUMNS) as f64 / COLUMNS as f64).sin_cos();
    DVec3::new(radius * cos, radius * sin, at as f64 / COLUMNS as f64 * HEIGHT)
}

/// `[vertex]` positions, course spacings.
pub fn positions(faces: usize, vertices: Vertices) -> Vec<DVec3> {
    match vertices {
        Vertices::Shared => (0..=faces + COLUMNS).map(place).collect(),
        Vertices::Own => (0..faces).flat_map(corners).map(place).collect(),
    }
}

/// The tube as a `.smobj` file.
pub fn smobj(faces: usize, vertices: Vertices) -> String {
    let mut text = String::from("L knit+ -lX +yX +lX -yX\n");
    for p in positions(faces, vertices) {
        writeln!(text, "v {:.5} {:.5} {:.5}", p.x, p.y, p.z).expect("memory");
    }
    for face in 0..faces {
        let own = 4 * face;
        let [a, b, c, d] = match vertices {
            Vertices::Shared => corners(face),
            Vertices::Own => [own, own + 1, own + 2, own + 3],
        }
        .map(|v| v + 1);
        writeln!(text, "f {a} {b} {c} {d}\nT 1\nN {}", face / COLUMNS).expect("memory");
    }
    for face in 1..=faces {
        if face < faces {
            writeln!(text, "e {face}/2 {}/-4", face + 1).expect("memory");
        }
        if face + COLUMNS <= faces {
            writeln!(text, "e {face}/3 {}/-1", face + COLUMNS).expect("memory");
        }
    }
    text
}
