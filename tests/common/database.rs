//! A small yarn model, a sheet of cloth and its motion, made up: plain numbers from which formulas can be checked.

use glam::{DVec2, DVec3, IVec2};
use knotmesh::mesh::MaterialMesh;
use knotmesh::pattern::{Pattern, PatternEdge, StrainTable, YarnModel};
use std::f64::consts::TAU;

/// Vertices of each yarn of [`pattern`].
pub const YARN: usize = 6;

/// Two wavy yarns of [`YARN`] vertices each over a period of 12 x 8 mm, the first one along u, the second one against it.
/// Places lie around (0, 0) and not within one period; edges are not in the order of vertices.
pub fn pattern() -> Pattern {
    let size = DVec2::new(0.012, 0.008);
    let place = |yarn: usize, along: f64| {
        let phase = TAU * along + yarn as f64;
        DVec3::new(
            (along - 0.5) * size.x,
            (yarn as f64 - 0.5) * 0.5 * size.y + 0.1 * size.y * phase.sin(),
            0.0006 * phase.cos(),
        )
    };
    let mut pattern = Pattern { size, radius: 0.0008, ..Pattern::default() };
    for yarn in 0..2 {
        for i in 0..YARN {
            let step = if yarn == 0 { 1.0 } else { -1.0 };
            let along = i as f64 / YARN as f64;
            let from = place(yarn, if yarn == 0 { along } else { 1.0 - along });
            let to = place(yarn, (if yarn == 0 { along } else { 1.0 - along }) + step / YARN as f64);
            let vertex = pattern.places.len() as u32;
            let last = i + 1 == YARN;
            pattern.places.push(from);
            pattern.twists.push(0.1 * (vertex as f64 - 5.0));
            pattern.rest_lengths.push((to - from).length());
            pattern.directors.push((to - from).cross(DVec3::Z).normalize());
            pattern.edges.push(PatternEdge {
                from: vertex,
                to: if last { vertex + 1 - YARN as u32 } else { vertex + 1 },
                tile: if last { IVec2::new(step as i32, 0) } else { IVec2::ZERO },
            });
        }
    }
    pattern.edges.rotate_left(5);
    pattern
}

/// So many nodes along sx, sa and sy, unevenly spaced, from -0.2 to 1, -0.7 to 0.7 and -0.2 to 1.
pub fn axes(nodes: [usize; 3]) -> [Vec<f32>; 3] {
    let axis = |count: usize, low: f64, high: f64| {
        (0..count).map(|i| (low + (high - low) * (i as f64 / (count - 1) as f64).powf(1.3)) as f32).collect()
    };
    [axis(nodes[0], -0.2, 1.0), axis(nodes[1], -0.7, 0.7), axis(nodes[2], -0.2, 1.0)]
}

/// The displacement of a vertex of [`model`] at strains `[sx, sa, sy]`: linear in each of them, so that what is
/// interpolated between nodes is right but for rounding. Not zero at rest, and up to about a yarn radius.
pub fn displacement(vertex: usize, [sx, sa, sy]: [f64; 3]) -> [f64; 4] {
    let k = 1.0 + 0.25 * vertex as f64;
    [
        1e-4 * (0.1 * k + 2.0 * sx - sa * k + sx * sy),
        1e-4 * (-0.2 + k * sy + 0.5 * sa - 2.0 * sx * sa),
        1e-4 * (0.3 - k * sx - sy + 4.0 * sx * sa * sy),
        0.02 * (0.5 + k * sa - sx + sy * sa),
    ]
}

/// [`pattern`] and [`displacement`] at the nodes of [`axes`].
pub fn model(nodes: [usize; 3]) -> YarnModel {
    let (pattern, axes) = (pattern(), axes(nodes));
    let mut values = Vec::new();
    for vertex in 0..pattern.vertex_count() {
        for sy in &axes[2] {
            for sa in &axes[1] {
                for sx in &axes[0] {
                    let strain = [sx, sa, sy].map(|s| *s as f64);
                    values.push(displacement(vertex, strain).map(|x| x as f32));
                }
            }
        }
    }
    YarnModel::new(pattern, StrainTable::new(axes, values).unwrap()).unwrap()
}

/// A flat sheet of `columns` x `rows` squares of 1/64 m, each of two triangles, in the plane z = 0. Material vertices are
/// numbered the other way round than vertices. All numbers are f32.
pub fn sheet(columns: usize, rows: usize) -> MaterialMesh {
    let mut mesh = MaterialMesh::default();
    for j in 0..=rows {
        for i in 0..=columns {
            let uv = DVec2::new(i as f64, j as f64) / 64.0;
            mesh.positions.push(uv.extend(0.0));
            mesh.uvs.push(uv);
        }
    }
    mesh.uvs.reverse();
    let last = mesh.positions.len() as u32 - 1;
    for j in 0..rows {
        for i in 0..columns {
            let [a, b] = [0, 1].map(|k| ((j + k) * (columns + 1) + i) as u32);
            for face in [[a, a + 1, b + 1], [a, b + 1, b]] {
                mesh.faces.push(face);
                mesh.face_uvs.push(face.map(|vertex| last - vertex));
            }
        }
    }
    mesh
}

/// Positions of a mesh in a frame: stretched, sheared and waved the more the later, and at rest in frame 0. All numbers
/// are f32.
pub fn moved(mesh: &MaterialMesh, frame: usize) -> Vec<DVec3> {
    let time = frame as f64 / 8.0;
    let place = |p: &DVec3| {
        let wave = 0.01 * time * (40.0 * p.x).sin();
        let moved = DVec3::new(p.x * (1.0 + 0.3 * time) + 0.2 * time * p.y, p.y, p.z + wave);
        moved.as_vec3().as_dvec3()
    };
    mesh.positions.iter().map(place).collect()
}
