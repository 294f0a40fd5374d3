//! The library of our own at rest: no two strands' centrelines nearer than 1.5 r (samples every r / 2, arc within
//! 1.2 pi r on the same yarn excluded), in tiled swatches and for every template on its own.
//!
//! Seen red with the plain knit's half-lengths 20 % shorter.

mod common;
#[path = "../examples/make_stitches.rs"]
mod make_stitches;

use common::grid::{Wrap, grid, single};
use common::run::run;
use knotmesh::curve::FrameCurves;
use knotmesh::knot::Settings;
use knotmesh::measure::clearance::{Clearance, clearance};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::SceneOptions;
use knotmesh::template::TemplateLibrary;

fn measure(mesh: &StitchMesh) -> Clearance {
    let run =
        run::<f64>(mesh, &TemplateLibrary::embedded(), SceneOptions::default(), &Settings::default(), 2);
    let curves = FrameCurves::new(&run.scene, &run.output, 8, None);
    clearance(&curves, run.scene.yarn_radius * run.scene.gauge).unwrap()
}

/// Flat rows, to the right and back; `stitch` gives the stitch's name without its sign.
fn rows(stitch: impl Fn(usize, usize) -> &'static str) -> StitchMesh {
    grid(8, 8, Wrap::Flat, true, |k, i| {
        let name = stitch(k, i);
        if k % 2 == 0 { format!("{name}+ -lX +yX +lX -yX") } else { format!("{name}- -lX -yX +lX +yX") }
    })
}

#[test]
fn strands_keep_clear_in_tiled_swatches() {
    let pick = |knit: bool| if knit { "knit" } else { "purl" };
    let held = |k: usize, i: usize| match (k % 3, i % 3) {
        (0, 1) => "tuck",
        (1, 1) => "knittuck",
        _ => "knit",
    };
    let swatches: Vec<(&str, StitchMesh)> = vec![
        ("stockinette", rows(|_, _| "knit")),
        ("reverse stockinette", rows(|_, _| "purl")),
        ("rib 1x1", rows(|_, i| pick(i % 2 == 0))),
        ("rib 2x2", rows(|_, i| pick(i % 4 < 2))),
        ("garter", rows(|k, _| pick(k % 2 == 0))),
        ("seed", rows(|k, i| pick((k + i) % 2 == 0))),
        ("twisted", rows(|_, _| "knit-twisted")),
        ("twisted every other stitch", rows(|k, i| if (k + i) % 2 == 0 { "knit-twisted" } else { "knit" })),
        ("cast on", rows(|k, _| if k == 0 { "tuck-twist" } else { "knit" })),
        ("slipped", rows(|k, i| if k % 2 == 1 && i % 2 == 0 { "slip" } else { "knit" })),
        (
            "slipped, float in front",
            rows(|k, i| if k % 2 == 1 && i % 2 == 0 { "slip-front" } else { "knit" }),
        ),
        ("tucks", rows(held)),
    ];
    for (name, mesh) in swatches {
        let found = measure(&mesh);
        println!("{name}: smallest {:.2} r, {:.0} % below 2 r", found.smallest, 100.0 * found.share_below_2r);
        assert!(found.smallest >= 1.5, "{name}: {found:?}");
        assert!(found.samples > 1000);
    }
}

#[test]
fn strands_keep_clear_in_every_template() {
    let library = TemplateLibrary::embedded();
    let mut worst = (f64::INFINITY, String::new());
    for template in library.templates().iter().filter(|t| !t.strands.is_empty()) {
        let mesh = single(template);
        let found = measure(&mesh);
        if found.smallest < worst.0 {
            worst = (found.smallest, template.key());
        }
        assert!(found.smallest >= 1.5, "{}: {found:?}", template.key());
    }
    println!("nearest of all templates: {:.2} r in '{}'", worst.0, worst.1);
}

/// Decreases and increases need faces of their own shapes, which a flat mesh only comes near to: the sample's
/// faces are within some per cent of theirs.
#[test]
fn strands_keep_clear_in_lace() {
    let (_, bytes) = make_stitches::samples().into_iter().find(|(n, _)| *n == "lace.smobj").unwrap();
    let mesh = knotmesh::io::smobj::read("lace.smobj".as_ref(), &bytes).unwrap();
    let found = measure(&mesh);
    println!("lace: smallest {:.2} r, {:.0} % below 2 r", found.smallest, 100.0 * found.share_below_2r);
    assert!(found.smallest >= 1.5, "{found:?}");
}

#[test]
fn proportions_are_those_of_knits() {
    let library = TemplateLibrary::embedded();
    for template in library.templates() {
        assert!((0.1..=0.15).contains(&template.yarn_radius), "{}", template.key());
    }
    // A loop about four yarn diameters wide: the widest place of the plain knit's head.
    let knit = library.by_key("knit+ -lX +yX +lX -yX").unwrap();
    let head = knit.strands.iter().max_by_key(|s| s.len()).unwrap();
    let us: Vec<f64> = head.iter().map(|p| knit.place(p.place).x).collect();
    let width = us.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - us.iter().copied().fold(f64::INFINITY, f64::min)
        + 2.0 * knit.yarn_radius;
    let diameters = width / (2.0 * knit.yarn_radius);
    assert!((3.3..4.7).contains(&diameters), "{diameters} diameters");
}
