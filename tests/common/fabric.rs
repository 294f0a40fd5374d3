//! Made-up yarn models and sheets: smooth, of any size, of no physics.

use glam::{DVec2, DVec3, IVec2};
use knotmesh::mesh::MaterialMesh;
use knotmesh::pattern::{Pattern, PatternEdge, StrainTable, YarnModel};
use std::f64::consts::TAU;

/// Size of [`model`]'s period, metres.
pub const PERIOD: DVec2 = DVec2::new(0.015, 0.008);

/// Two rows a period that meander along u, `points` vertices each, and displacements that are 0 at rest and smooth in the
/// strain, over `nodes` nodes an axis. Numbers that files hold: places are f32.
pub fn model(points: usize, nodes: usize) -> YarnModel {
    let n = 2 * points;
    let single = |x: f64| f64::from(x as f32);
    let mut pattern = Pattern { size: PERIOD.as_vec2().as_dvec2(), radius: 0.001, ..Pattern::default() };
    for row in 0..2 {
        for i in 0..points {
            let s = (i as f64 + 0.3) / points as f64;
            let angle = TAU * 2.0 * s;
            pattern.places.push(DVec3::new(
                single(PERIOD.x * (s - 0.45) + 0.0009 * (2.0 * angle).sin()),
                single(PERIOD.y * (0.5 * f64::from(row) - 0.4) + 0.0025 * angle.cos()),
                single(0.0012 * (2.0 * angle).cos()),
            ));
            pattern.twists.push(single(0.1 * angle.sin()));
            let last = i + 1 == points;
            let to = if last { row as usize * points } else { row as usize * points + i + 1 };
            pattern.edges.push(PatternEdge {
                from: (row as usize * points + i) as u32,
                to: to as u32,
                tile: IVec2::new(last.into(), 0),
            });
        }
    }
    for i in 0..n {
        let edge = pattern.edges[i];
        let way = pattern.places[edge.to as usize] - pattern.places[i]
            + DVec3::new(f64::from(edge.tile.x) * pattern.size.x, 0.0, 0.0);
        pattern.rest_lengths.push(single(way.length()));
        pattern.directors.push(way.cross(DVec3::Z).normalize());
    }
    let axis = |low: f64, high: f64| -> Vec<f32> {
        (0..nodes).map(|i| (low + (high - low) * i as f64 / (nodes - 1).max(1) as f64) as f32).collect()
    };
    let axes = [axis(-0.2, 1.0), axis(-0.7, 0.7), axis(-0.2, 1.0)];
    let mut values = Vec::with_capacity(n * nodes.pow(3));
    for i in 0..n {
        let angle = TAU * i as f64 / points as f64;
        for sy in &axes[2] {
            for sa in &axes[1] {
                for sx in &axes[0] {
                    let (x, a, y) = (f64::from(*sx), f64::from(*sa), f64::from(*sy));
                    values.push([
                        (0.001 * (x * angle.sin() + a * angle.cos())) as f32,
                        (0.001 * (y * (2.0 * angle).cos() - x * a)) as f32,
                        (-0.0008 * (x + y + x * y) * (2.0 * angle).cos()) as f32,
                        (0.2 * (x - y + a) * angle.cos()) as f32,
                    ]);
                }
            }
        }
    }
    YarnModel::new(pattern, StrainTable::new(axes, values).unwrap()).unwrap()
}

/// A flat sheet of so many squares, each of two triangles, in the xy plane; u and v are x and y.
pub fn sheet(squares: [usize; 2], size: DVec2) -> MaterialMesh {
    let mut mesh = MaterialMesh::default();
    for j in 0..=squares[1] {
        for i in 0..=squares[0] {
            let uv = DVec2::new(i as f64 / squares[0] as f64, j as f64 / squares[1] as f64) * size;
            mesh.uvs.push(uv);
            mesh.positions.push(uv.extend(0.0));
        }
    }
    let at = |i: usize, j: usize| (j * (squares[0] + 1) + i) as u32;
    for j in 0..squares[1] {
        for i in 0..squares[0] {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            // Diagonals alternate, so that no direction is favoured.
            let k = (i + j) % 2;
            for (a, b) in [(1, 2), (2, 3)] {
                mesh.faces.push([corners[k], corners[(k + a) % 4], corners[(k + b) % 4]]);
            }
        }
    }
    mesh.face_uvs.clone_from(&mesh.faces);
    mesh
}

/// The positions of a sheet stretched, sheared and waved at a time.
pub fn waved(mesh: &MaterialMesh, time: f64) -> Vec<DVec3> {
    let wave = |uv: &DVec2| {
        let (u, v) = (uv.x, uv.y);
        let stretch = 1.0 + 0.3 * (6.0 * u + time).sin() * 0.5;
        DVec3::new(
            u * 1.15 + 0.02 * (12.0 * v + time).sin(),
            v * 1.05 + 0.01 * (9.0 * u - time).cos() * stretch,
            0.03 * (14.0 * u + 5.0 * v + 2.0 * time).sin(),
        )
    };
    mesh.uvs.iter().map(wave).collect()
}
