//! A helical tube of stockinette of any number of stitches, unwelded, as the field's tools write them: 200 a
//! round, the last round as far as they go.

pub mod moves;

use glam::DVec3;
use std::fmt::Write;

/// Stitches a round.
pub const COLUMNS: usize = 200;
/// Height of a course over its width.
pub const HEIGHT: f64 = 0.61;

/// `[vertex]` positions, course spacings: four corners a face. The tube stands on z = 0 around the z axis.
pub fn positions(faces: usize) -> Vec<DVec3> {
    let radius = COLUMNS as f64 / std::f64::consts::TAU;
    let mut positions = Vec::with_capacity(4 * faces);
    for face in 0..faces {
        let (k, i) = (face / COLUMNS, face % COLUMNS);
        for (di, dk) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
            let turn = (i + di) as f64 / COLUMNS as f64;
            // A full turn ends where it began, to the bit.
            let (sin, cos) = (std::f64::consts::TAU * ((i + di) % COLUMNS) as f64 / COLUMNS as f64).sin_cos();
            positions.push(DVec3::new(radius * cos, radius * sin, (k as f64 + dk as f64 + turn) * HEIGHT));
        }
    }
    positions
}

/// The tube as a `.smobj` file.
pub fn smobj(faces: usize) -> String {
    let mut text = String::from("L knit+ -lX +yX +lX -yX\n");
    for p in positions(faces) {
        writeln!(text, "v {:.5} {:.5} {:.5}", p.x, p.y, p.z).expect("memory");
    }
    for face in 0..faces {
        let v = 4 * face;
        writeln!(text, "f {} {} {} {}\nT 1\nN {}", v + 1, v + 2, v + 3, v + 4, face / COLUMNS)
            .expect("memory");
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
