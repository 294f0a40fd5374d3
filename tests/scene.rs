//! What compiling promises: order and direction of yarns, the gauge, the misfit; what a warm start is for; which
//! stitches our library must have; pattern lines and rest lengths on their way from the mesh to the yarn.

mod common;

use common::grid::{HEIGHT, Wrap, grid, placed, stitch, tube_place};
use common::run::run;
use glam::DVec3;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running};
use knotmesh::curve::{CurveExtras, FrameCurves};
use knotmesh::ids::FaceId;
use knotmesh::knot::{Settings, Start};
use knotmesh::measure::misfit::misfit;
use knotmesh::mesh::{Checkpoint, FaceEdge, StitchMesh, YarnUnit};
use knotmesh::scene::{Mode, Scene, SceneOptions, find_templates};
use knotmesh::template::TemplateLibrary;
use knotmesh::yarn::CurveSource;
use std::sync::Arc;

const KNIT: &str = "knit+ -lX +yX +lX -yX";
const BACK: &str = "knit- -lX -yX +lX +yX";

fn compile(mesh: &StitchMesh) -> Scene {
    Scene::compile(mesh, &TemplateLibrary::embedded(), SceneOptions::default()).unwrap()
}

/// The faces that a yarn passes, in its order.
fn faces(scene: &Scene, yarn: usize) -> Vec<u32> {
    let range = scene.yarns.range(yarn);
    let mut faces: Vec<u32> = range
        .map(|p| {
            let (batch, index, _) = scene.slot_place(scene.point_slots()[p][0]);
            batch.faces[index].0
        })
        .collect();
    faces.dedup();
    faces
}

/// Seeded faults: votes ignored; yarns begun at the highest strand.
#[test]
fn yarns_run_along_their_labels_in_the_order_of_their_lowest_face() {
    // Rows to the right and back, unconnected at the sides: a yarn each, and loose loops below. The strands of
    // one of the second pair run against its labels, for it derives from the other by its labels alone.
    let (right, left) = ("knit-to-right -l1 +y1 +l1 -y1", "knit-to-left -l1 -y1 +l1 +y1");
    for [out, back] in [[KNIT, BACK], [right, left]] {
        check_rows(&grid(5, 4, Wrap::Flat, true, |k, _| if k % 2 == 0 { out.into() } else { back.into() }));
    }
}

fn check_rows(mesh: &StitchMesh) {
    let scene = compile(mesh);
    let lowest: Vec<u32> = (0..scene.yarns.len()).map(|y| *faces(&scene, y).iter().min().unwrap()).collect();
    assert!(lowest.is_sorted(), "{lowest:?}");
    let mut along = 0;
    for yarn in 0..scene.yarns.len() {
        let passed = faces(&scene, yarn);
        // A row's yarn is in every face of its row, and in the loops' faces above.
        for row in 0..4u32 {
            let of_row: Vec<u32> = passed.iter().copied().filter(|f| f / 5 == row).collect();
            let sides = [row * 5, row * 5 + 4].map(|f| of_row.iter().position(|x| *x == f));
            if let [Some(left), Some(right)] = sides
                && passed[0] / 5 == row
            {
                assert_eq!(left < right, row % 2 == 0, "row {row} runs against its labels");
                along += 1;
            }
        }
    }
    // The top row, whose loops hang open, is in pieces.
    assert_eq!(along, 3);
}

#[test]
fn the_gauge_is_the_root_of_the_mean_ratio_of_areas() {
    let mesh = grid(6, 5, Wrap::Flat, true, |_, _| KNIT.into());
    let wide = placed(mesh.clone(), 6, |u, v| DVec3::new(3.0 * u, 3.0 * HEIGHT * v, 7.0));
    assert!((compile(&wide).gauge - 3.0).abs() < 1e-12);
    // Half of the faces four times as large in area.
    let uneven =
        placed(mesh, 6, |u, v| DVec3::new(if u <= 3.0 { u } else { 4.0 * u - 9.0 }, HEIGHT * v, 0.0));
    assert!((compile(&uneven).gauge - 2.5f64.sqrt()).abs() < 1e-12);
}

#[test]
fn the_misfit_is_the_strain_of_the_faces() {
    let mesh = grid(6, 5, Wrap::Flat, true, |_, _| KNIT.into());
    let strained = placed(mesh.clone(), 6, |u, v| DVec3::new(1.8 * u, 0.5 * HEIGHT * v, 0.0));
    let options = SceneOptions { gauge: Some(1.0), ..SceneOptions::default() };
    let scene = Scene::compile(&mesh, &TemplateLibrary::embedded(), options).unwrap();
    assert!(misfit(&scene, &mesh.positions).warning(&scene, |_| String::new()).is_none());
    let found = misfit(&scene, &strained.positions);
    assert!((found.median_course_strain - 0.8).abs() < 1e-12);
    assert!((found.median_wale_strain + 0.5).abs() < 1e-12);
    assert_eq!((found.share_large, found.faces_without_frame), (1.0, 0));
    let warning = found.warning(&scene, |_| "key".into()).unwrap();
    assert!(warning.contains("+80 % along the course and -50 % along the wale"), "{warning}");
}

/// One step from the previous frame's end is nearer than one from the affine start, when frames are near.
/// Seeded fault: the start ignored.
#[test]
fn a_warm_start_saves_steps() {
    let mesh = grid(8, 6, Wrap::Helix, false, |_, _| KNIT.into());
    let mesh = placed(mesh, 8, tube_place(8, true));
    let scene = Arc::new(compile(&mesh));
    let energy = |start: Start| {
        let settings = Settings { start, iterations: 1, ..Settings::default() };
        let mut backend =
            CpuBackend::<f64>::new(scene.clone(), &settings, &Running { threads: 1, ..Running::default() })
                .unwrap();
        let mut output = FrameOutput::default();
        for frame in 0..20 {
            let stretch = 1.0 + 0.03 * f64::from(frame);
            let positions: Vec<DVec3> =
                mesh.positions.iter().map(|p| DVec3::new(p.x, p.y, p.z * stretch)).collect();
            backend.frame(&positions, &mut output).unwrap();
        }
        output.faces.iter().map(|f| f.energy).sum::<f64>()
    };
    let converged = {
        let mut last = mesh.clone();
        last.positions.iter_mut().for_each(|p| p.z *= 1.57);
        let options = SceneOptions { gauge: Some(scene.gauge), ..SceneOptions::default() };
        let settings = Settings { iterations: 100, ..Settings::default() };
        let run = run::<f64>(&last, &TemplateLibrary::embedded(), options, &settings, 1);
        run.output.faces.iter().map(|f| f.energy).sum::<f64>()
    };
    let (affine, warm) = (energy(Start::Affine) - converged, energy(Start::Previous) - converged);
    assert!(warm >= -1e-9 && warm < 0.1 * affine, "{warm} against {affine}");
}

/// `N`, `U` and `c` lines reach the curves.
#[test]
fn pattern_lines_and_rest_lengths_reach_the_yarn() {
    let mut mesh = grid(4, 3, Wrap::Flat, true, |_, _| KNIT.into());
    mesh.face_source = (0..12).map(|f| 100 + f).collect();
    mesh.units =
        vec![YarnUnit { name: "1".into(), length: 1.0 }, YarnUnit { name: "inch".into(), length: 2.54 }];
    let at = FaceEdge { face: FaceId(5), edge: 1 };
    mesh.checkpoints = vec![
        Checkpoint { at, crossing: 0, lengths: vec![(3.0, 0), (0.5, 1)] },
        Checkpoint { at, crossing: 7, lengths: vec![(1.0, 0)] },
    ];
    let run =
        run::<f64>(&mesh, &TemplateLibrary::embedded(), SceneOptions::default(), &Settings::default(), 1);
    let extras = CurveExtras::new(&mesh, &run.scene);
    for subdivide in [0, 4] {
        let extras = extras.subdivided(&run.scene, subdivide);
        let curves = FrameCurves::new(&run.scene, &run.output, subdivide, Some(&extras));
        assert_eq!(curves.units(), [("1".to_string(), 1.0), ("inch".to_string(), 2.54)]);
        let found = curves.checkpoints();
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].length, found[0].unit, found[1].length, found[1].unit), (3.0, 0, 0.5, 1));
        let (mut points, mut sources) = (Vec::new(), Vec::new());
        for yarn in 0..curves.yarn_count() {
            points.extend(common::curves::collect(&curves, yarn));
            curves
                .visit_sources(yarn, &mut |s| {
                    sources.extend_from_slice(s);
                    Ok(())
                })
                .unwrap();
        }
        // The middle of face 5's right edge, a quarter up.
        let place = points[found[0].point as usize];
        assert!((place - DVec3::new(2.0, HEIGHT * 1.25, 0.0)).length() < 1e-9, "{place}");
        assert_eq!(sources.len(), points.len());
        assert_eq!(sources[found[0].point as usize], 105);
    }
}

/// Keys of the field's libraries that ours must serve.
#[test]
fn our_library_has_the_stitches_of_the_field() {
    let library = TemplateLibrary::embedded();
    let (right, left) = ("-lX +yX +lX -yX", "-lX -yX +lX +yX");
    let (make_right, make_left) = ("-lX +yX +lX +lX -yX", "-lX -yX +lX +lX +yX");
    let (two_right, two_left) = ("-lX -lX +yX +lX -yX", "-lX -lX -yX +lX +yX");
    let mut keys: Vec<String> = Vec::new();
    for name in ["knit", "purl", "tuck-twist", "knittuck", "knit-twisted", "slip", "slip-front", "tuck"] {
        keys.extend([format!("{name}+ {right}"), format!("{name}- {left}")]);
    }
    for name in [
        "make-left-tuck",
        "make-right-tuck",
        "make-left-tuck-twist",
        "make-right-tuck-twist",
        "make-left-split",
        "make-right-split",
    ] {
        keys.extend([format!("{name}+ {make_right}"), format!("{name}- {make_left}")]);
    }
    for name in ["decrease-left", "decrease-right", "purl-decrease-left", "purl-decrease-right"] {
        keys.extend([format!("{name}+ {two_right}"), format!("{name}- {two_left}")]);
    }
    keys.extend(
        [
            "start> -lX +lX +yX",
            "start< -lX +yX +lX",
            "end< -lX -yX +lX",
            "end> -lX +lX -yX",
            "in+ x +yX x",
            "in- x x +yX",
            "out- x -yX x",
            "out+ x x -yX",
            "edge( x -y1 +y1 x x",
            "edge) x x x +y1 -y1",
            "turn)(( -lX +lX +yX -yX",
            "turn))( -lX -yX +yX +lX",
            "turn-tuck)(( -lX +lX +yX -yX",
            "turn-tuck))( -lX -yX +yX +lX",
            "drop -l1 +y0 +l0 -y0",
            "drop+ -l1 +y0 +l0 -y0",
            "drop- -l1 -y0 +l0 +y0",
            "over -a1 +e1 +a1 -e1",
            "under -a1 +e1 +a1 -e1",
            "loop -l1 x +l1 x",
            "yarn-to-left x -y1 x +y1",
            "yarn-to-right x +y1 x -y1",
            "yarn-left-up-right -y1 x +y1 x",
            "yarn-left-up-left -y1 x +y1 x",
            "yarn-right-up-left -y1 x +y1 x",
            "yarn-right-up-right -y1 x +y1 x",
        ]
        .map(String::from),
    );
    for (side, out, back) in [("left", "-", "+"), ("right", "+", "-")] {
        for name in ["knit", "purl"] {
            for (below, yarn, above) in [(0, 1, 1), (1, 0, 0), (1, 1, 1), (2, 1, 1)] {
                keys.push(format!("{name}-to-{side} -l{below} {out}y{yarn} +l{above} {back}y{yarn}"));
            }
        }
        for name in ["tuck-behind", "tuck-infront"] {
            for (below, above) in [(0, 1), (1, 2)] {
                keys.push(format!("{name}-to-{side} -l{below} {out}y1 +l{above} {back}y1"));
            }
        }
        for (a, b) in [(0, 1), (1, 0), (1, 1)] {
            keys.push(format!("split-back-to-{side} -l{a} -l{b} {out}y0 +l0 +l{} {back}y0", a + b));
            keys.push(format!("split-front-to-{side} -l{a} -l{b} {out}y0 +l{} +l0 {back}y0", a + b));
        }
    }
    for key in &keys {
        assert!(library.by_key(key).is_some(), "no '{key}'");
    }
}

/// The built-in library serves what a given one lacks where its yarn is as thick, and not where it is not.
#[test]
fn the_built_in_library_stands_in_for_like_yarn_only() {
    let mut mesh =
        grid(
            2,
            1,
            Wrap::Flat,
            true,
            |_, i| if i == 0 { KNIT.into() } else { "purl+ -lX +yX +lX -yX".into() },
        );
    let mut library = TemplateLibrary::embedded();
    let mut own = library.by_key(KNIT).unwrap().clone();
    library.insert(own.clone());
    assert!(find_templates(&mesh, &library).iter().all(Option::is_some));
    own.yarn_radius = 0.12;
    library.insert(own);
    assert_eq!(find_templates(&mesh, &library).iter().filter(|f| f.is_some()).count(), 1);
    let error = Scene::compile(&mesh, &library, SceneOptions::default()).unwrap_err().to_string();
    assert!(
        error.contains("'purl+ -lX +yX +lX -yX' (1 face)") && error.contains("another radius"),
        "{error}"
    );
    // Where nothing of the given library is used, the built-in one serves as ever.
    mesh.types[0] = stitch("purl+ -lX +yX +lX -yX");
    assert!(find_templates(&mesh, &library).iter().all(Option::is_some));
}

#[test]
fn one_scene_has_one_yarn_radius() {
    let mesh =
        grid(
            2,
            1,
            Wrap::Flat,
            true,
            |_, i| if i == 0 { KNIT.into() } else { "purl+ -lX +yX +lX -yX".into() },
        );
    let embedded = TemplateLibrary::embedded();
    let mut library = TemplateLibrary::default();
    for (key, radius) in [(KNIT, 0.1), ("purl+ -lX +yX +lX -yX", 0.11)] {
        let mut template = embedded.by_key(key).unwrap().clone();
        template.yarn_radius = radius;
        library.insert(template);
    }
    for mode in [Mode::Relax, Mode::Embed] {
        let options = SceneOptions { mode, ..SceneOptions::default() };
        let error = Scene::compile(&mesh, &library, options).unwrap_err().to_string();
        assert!(error.contains("different yarn radius"), "{error}");
    }
}
