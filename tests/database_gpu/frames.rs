//! Frames of several models, meshes and settings.
//!
//! Seeded faults: `faults.rs`.

use crate::case::{Case, Motion, rolled, tube, uneven};
use crate::common::Random;
use crate::common::data;
use crate::common::fabric::{PERIOD, model, sheet, waved};
use crate::common::gpu::adapter;
use glam::{DVec2, DVec3};
use knotmesh::backend::gpu::GpuOptions;
use knotmesh::database::gpu::GpuYarn;
use knotmesh::database::{Bending, FaceWeights, Settings, SkipYarn};
use knotmesh::io::sequence::Sequence;
use knotmesh::io::yarn_model;
use knotmesh::mesh::MaterialMesh;
use knotmesh::pattern::YarnModel;

fn motions(mesh: &MaterialMesh) -> Vec<Vec<DVec3>> {
    (0..3).map(|i| waved(mesh, 0.7 * f64::from(i))).collect()
}

/// A sheet on which yarn leaves its faces all the time.
pub fn fine() -> MaterialMesh {
    sheet([40, 30], DVec2::new(0.06, 0.05))
}

#[test]
fn of_models_and_sheets() {
    let Some(adapter) = adapter() else { return };
    let models: [(&str, YarnModel); 6] = [
        ("9 nodes", model(50, 9)),
        ("5 nodes", model(20, 5)),
        ("2 nodes", model(7, 2)),
        ("1 node", model(5, 1)),
        ("uneven axes", uneven(11, [4, 1, 3], 5e-4)),
        ("sx of one node", uneven(11, [1, 5, 2], 5e-4)),
    ];
    let sheets = [
        ("sheet", sheet([12, 9], DVec2::new(0.12, 0.1))),
        ("two faces", sheet([1, 1], DVec2::new(0.05, 0.04))),
        ("fine", fine()),
    ];
    for (of, model) in models {
        for (name, mesh) in &sheets {
            let case = Case::new(mesh, model.clone(), Settings::default(), motions(mesh));
            assert!(case.fabric.point_count() > 100, "{name} of {of} has yarn");
            case.agrees(&adapter, &format!("{name}, {of}"));
        }
    }
}

/// Displacements many faces wide, at random: yarn goes across edges and seams, and beyond borders.
#[test]
fn of_yarn_that_leaves_its_faces() {
    let Some(adapter) = adapter() else { return };
    let size = DVec2::new(6.0, 5.0) * PERIOD;
    let mesh = tube([24, 16], size);
    for most in [1e-3, 1e-2, 0.2] {
        let motions = (0..3).map(|i| rolled(&mesh, size, f64::from(i)));
        let case = Case::new(&mesh, uneven(20, [4, 3, 3], most), Settings::default(), motions);
        case.agrees(&adapter, &format!("tube, displaced by up to {most} m"));
    }
}

#[test]
fn with_settings() {
    let Some(adapter) = adapter() else { return };
    let default = Settings::default();
    let all = [
        Settings { phong: 0.0, ..default },
        Settings { phong: 1.0, ..default },
        Settings { bending: Bending::None, ..default },
        Settings { displacement: 0.0, ..default },
        Settings { displacement: -2.0, ..default },
        Settings { weights: FaceWeights::Equal, ..default },
        Settings { min_eigenvalue: 0.0, ..default },
        Settings { min_eigenvalue: 0.5, ..default },
        Settings { min_eigenvalue: 1.0, ..default },
    ];
    let mesh = sheet([12, 9], DVec2::new(0.12, 0.1));
    for settings in all {
        let case = Case::new(&mesh, model(20, 5), settings, motions(&mesh));
        case.agrees(&adapter, &format!("{settings:?}"));
    }
}

/// What no cloth does: strains beyond the table, triangles of no area and of none left, numbers that squares do not hold.
#[test]
fn of_wild_meshes() {
    let Some(adapter) = adapter() else { return };
    let mesh = sheet([12, 9], DVec2::new(0.12, 0.1));
    let still = waved(&mesh, 0.4);
    let each = |to: &dyn Fn(DVec3) -> DVec3| still.iter().map(|p| to(*p)).collect::<Vec<_>>();
    let mut random = Random::new(3);
    let mut spoilt = |value: f64| {
        let mut all = still.clone();
        for _ in 0..9 {
            let at = random.below(all.len());
            all[at][random.below(3)] = value;
        }
        all
    };
    let mut frames = vec![
        ("stretched", each(&|p| p * 4.0)),
        ("shrunk", each(&|p| p * 0.05)),
        ("sheared", each(&|p| DVec3::new(p.x + 2.0 * p.y, p.y, p.z))),
        ("in one place", each(&|_| DVec3::new(1.0, 2.0, 3.0))),
        ("in a line", each(&|p| DVec3::new(p.x, 0.0, 0.0))),
        ("folded", each(&|p| DVec3::new((p.x - 0.05).abs(), p.y, 0.0))),
        ("crumpled", each(&|p| DVec3::new((90.0 * p.x).sin(), (80.0 * p.y).cos(), (70.0 * p.x * p.y).sin()))),
        ("tiny", each(&|p| p * 1e-20)),
        ("subnormal", each(&|p| p * 1e-40)),
    ];
    for huge in [1e6, 1e9, 1e12, 1e20, 1e300] {
        frames.push(("huge", each(&|p| p * huge)));
        frames.push(("one huge", spoilt(huge)));
    }
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -1e38] {
        frames.push(("spoilt", spoilt(value)));
    }
    let mut outside = 0;
    for (name, positions) in frames {
        // Before and after, the same device goes on as ever.
        let motions = [still.clone(), positions, still.clone()];
        let mut case = Case::new(&mesh, model(20, 5), Settings::default(), motions);
        let report = adapter.report();
        for skip in [SkipYarn::NOTHING, SkipYarn::default()] {
            case.skip = skip;
            let found = case.by_gpu(&adapter, GpuYarn::default());
            assert!(found.iter().all(crate::case::Found::finite), "{name}");
            outside += found[1].outside;
            // Elsewhere such numbers hang on single bits.
            if report.exact && report.is_software() {
                case.agrees(&adapter, name);
            }
        }
    }
    assert!(outside > 0, "some strains are outside the table");
}

/// Cloth of the authors, where `KNOTMESH_DATA` names its folder.
#[test]
fn of_real_files() {
    let (Some(adapter), Some(data)) = (adapter(), data()) else { return };
    let data = data.join("madypg");
    for (model, name) in [
        ("stock", "stock_stretchX"),
        ("rib", "rib_stretchX"),
        ("honey", "honey_stretchY"),
        ("stock", "synth_twist"),
        ("stock", "synth_sleeve"),
        ("basket", "shear_grid_x"),
    ] {
        let model = yarn_model::read(&data.join(format!("models/model_{model}_9"))).unwrap();
        let mut sequence = Sequence::open(&data.join(format!("sequences/{name}.bin"))).unwrap();
        let last = sequence.len() - 1;
        let mesh = sequence.mesh().clone();
        let motions = [0, last / 2, last].map(|frame| {
            let mut positions = Vec::new();
            sequence.read(frame, &mut positions).unwrap();
            positions
        });
        Case::new(&mesh, model, Settings::default(), motions).agrees(&adapter, name);
    }
}

#[test]
fn of_any_workgroup() {
    let Some(adapter) = adapter() else { return };
    let mesh = sheet([12, 9], DVec2::new(0.12, 0.1));
    let mut case = Case::new(&mesh, model(20, 5), Settings::default(), motions(&mesh));
    case.skip = SkipYarn::default();
    for workgroup in [1, 7, 32, 256] {
        let device = GpuOptions { workgroup, ..GpuOptions::default() };
        case.agrees_with(&adapter, GpuYarn { device, ..GpuYarn::default() }, &format!("by {workgroup}"));
    }
}

/// Sums left to the driver stay within the bound.
#[test]
fn left_to_the_driver() {
    let Some(adapter) = adapter() else { return };
    let device = GpuOptions { exact: false, ..GpuOptions::default() };
    for mesh in [sheet([12, 9], DVec2::new(0.12, 0.1)), fine()] {
        let case = Case::new(&mesh, model(20, 5), Settings::default(), motions(&mesh));
        case.agrees_with(&adapter, GpuYarn { device, ..GpuYarn::default() }, "left to the driver");
    }
}

#[test]
fn of_meshes_without_yarn() {
    let Some(adapter) = adapter() else { return };
    let mesh = sheet([2, 2], DVec2::splat(1e-4));
    let case = Case::new(&mesh, model(5, 2), Settings::default(), motions(&mesh));
    assert_eq!(case.fabric.point_count(), 0);
    case.agrees(&adapter, "no yarn");
    let empty = MaterialMesh::default();
    let case = Case::new(&empty, model(5, 2), Settings::default(), [Motion::default()]);
    case.agrees(&adapter, "no mesh");
}
