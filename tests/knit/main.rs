//! Patterns: those of `stitches/`, random ones, broken ones, and the meshes they become.

mod broken;
mod counts;
mod mesh;
mod mutated;
mod patterns;
mod random;

use knotmesh::design::expression::Gauge;
use knotmesh::design::{Knitted, Settings, knit};
use knotmesh::io::pattern::{Beside, knit_file};
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::{Path, PathBuf};

fn stitches() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches")
}

/// Stitches and rows on 10 cm, and a size.
fn settings(gauge: Option<(f64, f64)>, size: Option<&str>) -> Settings {
    Settings {
        gauge: gauge.map(|(stitches, rows)| Gauge::per_10_cm(stitches, Some(rows))),
        size: size.map(str::to_string),
        ..Settings::default()
    }
}

fn from_stitches(name: &str, settings: &Settings) -> Knitted {
    knit_file(&stitches().join(format!("{name}.knit")), settings).unwrap_or_else(|e| panic!("{e}"))
}

fn from_text(text: &str, settings: &Settings) -> knotmesh::Result<Knitted> {
    let path = Path::new("a.knit");
    knit(path, text, settings, &Beside::new(path))
}

/// How many yarns there are once strands are chained across faces: one more for each place where a loop is not held.
fn yarns(knitted: &Knitted) -> usize {
    let library = TemplateLibrary::embedded();
    let scene =
        Scene::compile(&knitted.mesh, &library, SceneOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(!scene.yarns.closed.contains(&true), "no yarn is a ring");
    scene.yarns.len()
}
