//! What must not matter: where the cloth is, how large, how it is numbered, how it is worked on; and what must hold for any
//! input.

use crate::common::{Random, fabric};
use crate::laid;
use glam::{DQuat, DVec2, DVec3};
use knotmesh::database::{Bending, Compat, FaceWeights, Settings};
use knotmesh::mesh::MaterialMesh;

fn cloth() -> (MaterialMesh, Vec<DVec3>) {
    let mesh = fabric::sheet([14, 12], DVec2::new(0.11, 0.09));
    let positions = fabric::waved(&mesh, 0.4);
    (mesh, positions)
}

/// Seen red with points lifted along z.
#[test]
fn rigid_motions_move_the_yarn_along() {
    let (mesh, positions) = cloth();
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
    let shift = DVec3::new(3.0, -20.0, 7.0);
    let moved: Vec<DVec3> = positions.iter().map(|p| turn * *p + shift).collect();
    let one = laid::<f64>(&mesh, fabric::model(30, 5), Settings::default(), &positions).places();
    let other = laid::<f64>(&mesh, fabric::model(30, 5), Settings::default(), &moved).places();
    for (key, p) in &one {
        assert!((turn * *p + shift - other[key]).length() < 1e-12);
    }
}

/// Everything in other units: the mesh, the pattern and its displacements. Seen red with curvatures fitted in metres.
#[test]
fn units_do_not_matter() {
    const UNIT: f64 = 64.0;
    let (mesh, positions) = cloth();
    let model = fabric::model(30, 5);
    let mut large = model.clone();
    large.pattern.size *= UNIT;
    large.pattern.radius *= UNIT;
    large.pattern.places.iter_mut().for_each(|p| *p *= UNIT);
    large.pattern.rest_lengths.iter_mut().for_each(|l| *l *= UNIT);
    let table = &model.table;
    let scaled = |[u, v, h, t]: &[f32; 4]| [u * UNIT as f32, v * UNIT as f32, h * UNIT as f32, *t];
    let values = table.values().iter().map(scaled).collect();
    large.table = knotmesh::pattern::StrainTable::new(table.axes().clone(), values).unwrap();
    let one = laid::<f64>(&mesh, model, Settings::default(), &positions).places();
    let far: Vec<DVec3> = positions.iter().map(|p| *p * UNIT).collect();
    let other = laid::<f64>(&mesh.scaled(UNIT), large, Settings::default(), &far).places();
    assert_eq!(one.len(), other.len());
    for (key, p) in &one {
        assert!((*p * UNIT - other[key]).length() < 1e-11);
    }
}

/// Seen red with neighbours' places taken from another corner of their face, and with barycentric coordinates exchanged.
#[test]
fn numbering_does_not_matter() {
    let (mesh, positions) = cloth();
    let mut random = Random::new(3);
    let (vertices, uvs, faces) = (
        random.shuffled(mesh.positions.len()),
        random.shuffled(mesh.uvs.len()),
        random.shuffled(mesh.faces.len()),
    );
    let mut other = mesh.clone();
    let mut moved = positions.clone();
    for (i, to) in vertices.iter().enumerate() {
        other.positions[*to] = mesh.positions[i];
        moved[*to] = positions[i];
    }
    for (i, to) in uvs.iter().enumerate() {
        other.uvs[*to] = mesh.uvs[i];
    }
    for (i, to) in faces.iter().enumerate() {
        // Corners turn as well.
        let turn = |mut corners: [u32; 3], names: &[usize]| {
            corners.rotate_left(i % 3);
            corners.map(|v| names[v as usize] as u32)
        };
        other.faces[*to] = turn(mesh.faces[i], &vertices);
        other.face_uvs[*to] = turn(mesh.face_uvs[i], &uvs);
    }
    let one = laid::<f64>(&mesh, fabric::model(30, 5), Settings::default(), &positions);
    let two = laid::<f64>(&other, fabric::model(30, 5), Settings::default(), &moved);
    assert_eq!(one.fabric.yarn_count(), two.fabric.yarn_count());
    let (one, two) = (one.places(), two.places());
    assert_eq!(one.len(), two.len());
    for (key, p) in &one {
        // Barycentric coordinates are rounded to f32 for another corner.
        assert!((*p - two[key]).length() < 3e-8, "{}", (*p - two[key]).length());
    }
}

/// Single precision is near double, at a decimetre's distance from the origin. Measured: 3e-8 m. Seen red with a lane's
/// height taken from its neighbour.
#[test]
fn f32_is_near_f64() {
    let (mesh, positions) = cloth();
    for settings in [Settings::default(), Settings { compat: Compat::Madypg, ..Settings::default() }] {
        let one = laid::<f64>(&mesh, fabric::model(30, 5), settings, &positions);
        let other = laid::<f32>(&mesh, fabric::model(30, 5), settings, &positions);
        let off = (0..one.fabric.point_count())
            .map(|p| (one.frame.world(p) - other.frame.world(p)).length())
            .fold(0.0, f64::max);
        assert!(off < 2e-7, "{off}");
        assert!(off > 0.0);
    }
}

/// Finite positions give finite yarn, whatever they are: `laid` checks. Seen red with places not held back.
#[test]
fn nothing_but_numbers() {
    let mesh = fabric::sheet([10, 8], DVec2::new(0.1, 0.08));
    let flat = &mesh.positions;
    let mut random = Random::new(11);
    let mut jumble = |size: f64| -> Vec<DVec3> {
        flat.iter().map(|_| DVec3::new(random.unit(), random.unit(), random.unit()) * size).collect()
    };
    let mut cases: Vec<Vec<DVec3>> = vec![
        vec![DVec3::ZERO; flat.len()],
        vec![DVec3::splat(1e30); flat.len()],
        flat.iter().map(|p| DVec3::new(p.x, 0.0, 0.0)).collect(),
        flat.iter().map(|p| DVec3::new(-p.x, p.y, 0.0)).collect(),
        flat.iter().map(|p| DVec3::new((p.x - 0.05).abs(), p.y, 0.0)).collect(),
        flat.iter().map(|p| *p * 1e-20).collect(),
        flat.iter().map(|p| *p * 1e10).collect(),
        flat.iter().map(|p| *p * 1e300).collect(),
        flat.iter().map(|p| DVec3::new(p.x * 1e3, p.y * 1e-3, 0.0)).collect(),
    ];
    cases.extend([1e-12, 1e-3, 1.0, 1e6, 1e18, 1e37, 1e308].map(&mut jumble));
    let mut one_astray = flat.clone();
    one_astray[40] = DVec3::new(1e200, -1e300, f64::MAX);
    cases.push(one_astray);
    for positions in &cases {
        for settings in [
            Settings::default(),
            Settings { min_eigenvalue: 0.0, ..Settings::default() },
            Settings { compat: Compat::Madypg, min_eigenvalue: 0.0, ..Settings::default() },
            Settings { bending: Bending::None, weights: FaceWeights::Equal, ..Settings::default() },
        ] {
            laid::<f32>(&mesh, fabric::model(20, 3), settings, positions);
            laid::<f64>(&mesh, fabric::model(20, 3), settings, positions);
        }
    }
}

/// A strain beyond all numbers is that of rest. Seen red with strains not checked.
#[test]
fn strains_that_are_no_numbers_are_rest() {
    let mut mesh = fabric::sheet([10, 8], DVec2::new(0.1, 0.08));
    // Faces too narrow for a point, beside faces that hold some.
    for (i, uv) in mesh.uvs.iter_mut().enumerate() {
        if i % 11 == 5 {
            uv.x = 0.04 + 1e-9;
        }
    }
    let far: Vec<DVec3> = mesh.positions.iter().map(|p| *p * 1e13).collect();
    let laid = laid::<f32>(&mesh, fabric::model(20, 3), Settings::default(), &far);
    let mut count = 0;
    for (_, trace) in laid.cpu.trace() {
        if trace.strain.iter().any(|c| !c.is_finite()) {
            assert_eq!(trace.clamped, [1.0, 0.0, 1.0]);
            count += 1;
        }
    }
    assert!(count > 0);
}

/// Meshes that are none: triangles without area, folded over, three at an edge, on one material vertex. Seen red with
/// triangles without area inverted.
#[test]
fn any_mesh_will_do() {
    let sheet = fabric::sheet([10, 8], DVec2::new(0.1, 0.08));
    let mut random = Random::new(5);
    for case in 0..60 {
        let mut mesh = sheet.clone();
        for _ in 0..1 + case % 7 {
            let face = random.below(mesh.faces.len());
            match random.below(5) {
                0 => mesh.faces[face] = [mesh.faces[face][0]; 3],
                1 => mesh.face_uvs[face] = [mesh.face_uvs[face][1]; 3],
                2 => mesh.face_uvs[face].swap(0, 1),
                3 => {
                    let (faces, uvs) = (mesh.faces[face], mesh.face_uvs[face]);
                    mesh.faces.push(faces);
                    mesh.face_uvs.push(uvs);
                }
                _ => {
                    let uv = random.below(mesh.uvs.len());
                    mesh.uvs[uv] = DVec2::new(random.unit(), random.unit()) * 0.1;
                }
            }
        }
        for compat in [Compat::None, Compat::Madypg] {
            let settings = Settings { compat, ..Settings::default() };
            laid::<f64>(&mesh, fabric::model(20, 3), settings, &sheet.positions);
        }
    }
}
