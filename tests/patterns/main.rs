//! From patterns to stitch meshes: counts as on paper, one yarn, every loop held, messages with their place.

mod invalid;
mod shape;

use knotmesh::design::expression::Gauge;
use knotmesh::design::{Knitted, Settings, knit};
use knotmesh::io::pattern::{Beside, knit_file};
use std::path::{Path, PathBuf};

/// Works a pattern that stands in the test.
fn worked(text: &str) -> knotmesh::Result<Knitted> {
    let path = Path::new("test.knit");
    knit(path, text, &Settings::default(), &Beside::new(path))
}

/// A sample of `stitches/`.
fn sample(name: &str, stitches: f64, rows: Option<f64>, size: Option<&str>) -> Knitted {
    let gauge = (stitches > 0.0).then(|| Gauge::per_10_cm(stitches, rows));
    let settings = Settings { gauge, size: size.map(str::to_string), ..Settings::default() };
    knit_file(&folder().join(format!("{name}.knit")), &settings).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches")
}
