//! What MADYPG does and what is mended here: each fault is shown with `Compat::Madypg`.

use crate::common::{Random, fabric};
use crate::{Laid, laid};
use glam::{DVec2, DVec3};
use knotmesh::database::{Compat, Settings};
use knotmesh::mesh::MaterialMesh;
use nalgebra::{Matrix2, SymmetricEigen};

const COMPAT: Settings = Settings { compat: Compat::Madypg, ..DEFAULT };
const DEFAULT: Settings = Settings {
    min_eigenvalue: 0.8,
    bending: knotmesh::database::Bending::Linearized,
    phong: 0.5,
    displacement: 1.0,
    weights: knotmesh::database::FaceWeights::Shepard,
    compat: Compat::None,
    shortest_yarn: 16.0,
};

/// Positions of a flat sheet under a linear map of u and v.
fn stretched(mesh: &MaterialMesh, u: DVec2, v: DVec2) -> Vec<DVec3> {
    mesh.uvs.iter().map(|uv| (u * uv.x + v * uv.y).extend(0.0)).collect()
}

#[test]
fn defaults_are_the_papers() {
    assert_eq!(Settings::default(), DEFAULT);
}

/// Eigenvalues are those of the strain, none below the bound, eigenvectors kept; and they do not jump where both are
/// near each other, as MADYPG's do. Seen red with the bound applied to the diagonal.
#[test]
fn eigenvalues_are_clamped_exactly() {
    let mesh = fabric::sheet([6, 6], DVec2::splat(0.06));
    let mut random = Random::new(7);
    let mut worst = [0f64; 2];
    for case in 0..40 {
        // Half of them near a multiple of the unit matrix, where MADYPG drops one of the diagonal's values.
        let near = if case % 2 == 0 { 0.004 } else { 0.5 };
        let base = random.between(0.7, 1.2);
        let mut off = || random.between(-near, near);
        let (u, v) = (DVec2::new(base + off(), off()), DVec2::new(off(), base + off()));
        for (settings, worst) in [DEFAULT, COMPAT].into_iter().zip(&mut worst) {
            let laid = laid::<f64>(&mesh, fabric::model(20, 5), settings, &stretched(&mesh, u, v));
            let (_, trace) = laid.cpu.trace()[17];
            let [a, c, b] = trace.strain;
            let eigen = SymmetricEigen::new(Matrix2::new(a, c, c, b));
            let clamped = Matrix2::from_diagonal(&eigen.eigenvalues.map(|l| l.max(0.8)));
            let expected = eigen.eigenvectors * clamped * eigen.eigenvectors.transpose();
            let found = Matrix2::new(trace.clamped[0], trace.clamped[1], trace.clamped[1], trace.clamped[2]);
            *worst = worst.max((found - expected).amax());
        }
    }
    assert!(worst[0] < 1e-12, "{worst:?}");
    assert!(worst[1] > 2e-3, "the fault is there: {worst:?}");
}

/// Sharp folds make `I - 2 h II` indefinite; what is looked up stays a strain, also without a bound of the eigenvalues.
/// Seen red with the bound applied to the diagonal.
#[test]
fn strains_stay_positive() {
    let mesh = fabric::sheet([12, 12], DVec2::splat(0.06));
    // Zigzag pleats of 1 cm.
    let pleat = |uv: &DVec2| {
        let up = (uv.x / 0.01 - (uv.x / 0.01).floor() - 0.5).abs();
        DVec3::new(uv.x * 0.2, uv.y, up * 0.0098)
    };
    let mut model = fabric::model(20, 5);
    model.pattern.places.iter_mut().for_each(|p| p.z *= 4.0);
    let positions: Vec<DVec3> = mesh.uvs.iter().map(pleat).collect();
    for least in [0.0, 0.8] {
        let settings = Settings { min_eigenvalue: least, ..DEFAULT };
        let laid = laid::<f64>(&mesh, model.clone(), settings, &positions);
        let traces = laid.cpu.trace();
        let determinant = |[a, c, b]: [f64; 3]| a * b - c * c;
        let worst = traces.iter().map(|(_, t)| determinant(t.strain)).fold(f64::INFINITY, f64::min);
        assert!(worst < 0.0, "the fault is there: {worst}");
        for (_, trace) in traces {
            assert!(determinant(trace.clamped) > 0.0 && trace.clamped[0] > 0.0);
            assert!(trace.strains.iter().all(|s| s.is_finite()) && trace.strains[1].abs() <= 1.0);
        }
    }
}

/// The greatest move of a point as all material coordinates are shifted a little, over the shift.
fn greatest_move(settings: Settings) -> f64 {
    const SHIFT: f64 = 1e-6;
    let mut greatest = 0f64;
    for step in 0..12 {
        let base = DVec2::new(0.00013, 0.00007) * f64::from(step);
        let sheet = |shift: f64| {
            // Squares that fit no period, so that vertices lie anywhere in them.
            let mut mesh = fabric::sheet([19, 21], DVec2::new(0.0777, 0.0809));
            mesh.uvs.iter_mut().for_each(|uv| *uv += base + DVec2::new(shift, 0.3 * shift));
            mesh
        };
        let wave =
            |uv: &DVec2| DVec3::new(1.4 * uv.x, uv.y, 0.01 * (90.0 * uv.x).sin() * (70.0 * uv.y).cos());
        let positions: Vec<DVec3> = sheet(0.0).uvs.iter().map(wave).collect();
        let [one, other] =
            [0.0, SHIFT].map(|s| laid::<f64>(&sheet(s), fabric::model(50, 5), settings, &positions).places());
        let inner = |p: &DVec3| p.x > 0.02 && p.x < 0.09 && p.y > 0.02 && p.y < 0.06;
        for (key, p) in one.iter().filter(|(_, p)| inner(p)) {
            if let Some(q) = other.get(key) {
                greatest = greatest.max((*p - *q).length() / SHIFT);
            }
        }
    }
    greatest
}

/// Points that are displaced beyond their triangle follow the neighbouring one: places depend on material coordinates
/// without a jump. Seen red with `MOST_CROSSED` at 0.
#[test]
fn displaced_points_move_to_the_neighbour() {
    // Flat triangles, whose planes differ.
    let flat = |settings| Settings { phong: 0.0, displacement: 2.0, ..settings };
    let (mended, faulty) = (greatest_move(flat(DEFAULT)), greatest_move(flat(COMPAT)));
    println!("moves over the shift: {mended} {faulty}");
    assert!(mended < 10.0, "{mended} {faulty}");
    assert!(faulty > 100.0, "the fault is there: {mended} {faulty}");
}

/// A model whose vertices all lie on lines that the mesh's edges lie on.
pub fn on_lines() -> knotmesh::pattern::YarnModel {
    let mut model = fabric::model(8, 3);
    model.pattern.size = DVec2::splat(1.0 / 64.0);
    model.pattern.radius = 1e-4;
    for (i, place) in model.pattern.places.iter_mut().enumerate() {
        let at = DVec2::new((i % 8) as f64 / 8.0, (i / 8) as f64 / 2.0) / 64.0;
        *place = at.extend(0.0);
    }
    model
}

/// Points on borders of triangles are there once. Seen red with faces that hold only what lies inside them, and with border
/// points taken where MADYPG drops them.
#[test]
fn border_points_are_there_once() {
    // Edges every 1/512 m, diagonals through the lattice as well: every vertex of the pattern is a vertex of the mesh.
    let mesh = fabric::sheet([64, 64], DVec2::splat(1.0 / 8.0));
    let laid: Laid<f64> = laid(&mesh, on_lines(), DEFAULT, &mesh.positions);
    let places = laid.places();
    // Columns 0 to 64 of rows 0 to 15, and the border row above, each of which is a yarn.
    assert_eq!(places.len(), 65 * 17);
    for ((tile, vertex), place) in &places {
        let at = tile.as_dvec2() / 64.0
            + DVec2::new(f64::from(vertex % 8) / 8.0, f64::from(vertex / 8) / 2.0) / 64.0;
        assert!((place.truncate() - at).length() < 1e-3, "{tile} {vertex}: {place} {at}");
    }
    let faulty: Laid<f64> = crate::laid(&mesh, on_lines(), COMPAT, &mesh.positions);
    assert!(
        faulty.fabric.point_count() < places.len() / 2,
        "the fault is there: {}",
        faulty.fabric.point_count()
    );
}

/// Directors are of unit length, across their edges, and turned by the twist from the reference director. Seen red with the
/// twist's sign changed.
#[test]
fn directors_are_turned_by_the_twist() {
    let mesh = fabric::sheet([12, 12], DVec2::splat(0.09));
    let model = fabric::model(30, 5);
    let positions = fabric::waved(&mesh, 0.3);
    let found = laid::<f64>(&mesh, model.clone(), DEFAULT, &positions);
    let directors = found.cpu.directors(&found.frame);
    let mut untwisted = model.clone();
    untwisted.pattern.twists.iter_mut().for_each(|t| *t = 0.0);
    let table = &model.table;
    let values = table.values().iter().map(|[u, v, h, _]| [*u, *v, *h, 0.0]).collect();
    untwisted.table = knotmesh::pattern::StrainTable::new(table.axes().clone(), values).unwrap();
    let plain = laid::<f64>(&mesh, untwisted, DEFAULT, &positions);
    let references = plain.cpu.directors(&plain.frame);
    let fabric = &found.fabric;
    let mut greatest = 0f64;
    for yarn in 0..fabric.yarn_count() {
        let range = fabric.yarn(yarn);
        for point in range.start..range.end - 1 {
            let tangent = (found.frame.world(point + 1) - found.frame.world(point)).normalize();
            let (director, reference) = (directors[point].to_f64(), references[point].to_f64());
            assert!((director.length() - 1.0).abs() < 1e-12);
            assert!(director.dot(tangent).abs() < 1e-12);
            let angle = tangent.dot(reference.cross(director)).atan2(reference.dot(director));
            assert!((angle - found.frame.twists[point]).abs() < 1e-9, "{angle}");
            greatest = greatest.max(angle.abs());
        }
    }
    assert!(greatest > 0.1);
    // MADYPG's are neither of unit length nor across.
    let faulty = laid::<f64>(&mesh, model, COMPAT, &positions);
    let lengths = faulty.cpu.directors(&faulty.frame);
    assert!(lengths.iter().any(|d| (d.to_f64().length() - 1.0).abs() > 0.05));
}

/// At rest nothing but the table's displacement at zero strain (none here) is added: the pattern lies as it was laid. Seen red
/// with barycentric coordinates exchanged.
#[test]
fn rest_is_the_pattern() {
    let mesh = fabric::sheet([12, 12], DVec2::splat(0.09));
    let model = fabric::model(30, 7);
    let laid = laid::<f64>(&mesh, model.clone(), DEFAULT, &mesh.positions);
    for ((tile, vertex), place) in laid.places() {
        let at = model.pattern.places[vertex as usize] + (tile.as_dvec2() * model.pattern.size).extend(0.0);
        // Barycentric coordinates are kept in single precision, of triangles of 7.5 mm.
        assert!((place - at).length() < 2e-9, "{place} {at}");
    }
    assert_eq!(laid.frame.outside, 0);
}

/// Points beyond the table's strains are counted. Seen red with those above it left out.
#[test]
fn strains_outside_are_counted() {
    let mesh = fabric::sheet([12, 12], DVec2::splat(0.09));
    let far = stretched(&mesh, DVec2::new(2.5, 0.0), DVec2::new(0.0, 1.0));
    let found = laid::<f64>(&mesh, fabric::model(30, 7), DEFAULT, &far);
    assert_eq!(found.frame.outside, found.fabric.point_count());
    // As far as the table goes: the displacement is that of its last node.
    let border = stretched(&mesh, DVec2::new(2.0, 0.0), DVec2::new(0.0, 1.0));
    let known = laid::<f64>(&mesh, fabric::model(30, 7), DEFAULT, &border);
    let far: std::collections::HashMap<u32, [f64; 4]> =
        found.cpu.trace().into_iter().map(|(p, t)| (p, t.displacement)).collect();
    for (point, trace) in known.cpu.trace() {
        for (a, b) in trace.displacement.iter().zip(far[&point]) {
            assert!((a - b).abs() < 1e-9);
        }
    }
}
