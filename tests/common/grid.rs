//! Rows and columns of stitches: swatches, tubes, tori.

use glam::DVec3;
use knotmesh::ids::{TypeId, VertexId};
use knotmesh::mesh::{FaceEdge, Join, StitchMesh, StitchType};
use knotmesh::template::Template;

/// Which borders of a grid meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    Flat,
    /// Columns go round; each row is a closed ring.
    Tube,
    /// Columns go round and each round goes on in the next: one yarn.
    Helix,
    /// Columns and rows go round.
    Torus,
}

pub const WIDTH: f64 = 1.0;
pub const HEIGHT: f64 = 0.61;

/// A stitch type from its full key.
pub fn stitch(key: &str) -> StitchType {
    let mut words = key.split(' ').map(str::to_string);
    StitchType { name: words.next().unwrap(), labels: words.collect() }
}

/// A grid of quads; `key` gives the full key of the face at (row, column). Face (row, column) is number
/// `row * columns + column`; edge 0 is below, 1 right, 2 above, 3 left. Positions are flat, `WIDTH` x `HEIGHT`
/// a face (also where the grid wraps: give positions of your own then).
pub fn grid(
    columns: usize,
    rows: usize,
    wrap: Wrap,
    welded: bool,
    key: impl Fn(usize, usize) -> String,
) -> StitchMesh {
    let mut mesh = StitchMesh { face_offsets: vec![0], ..StitchMesh::default() };
    let lattice = |i: usize, k: usize| (k * (columns + 1) + i) as u32;
    let place = |i: usize, k: usize| DVec3::new(i as f64 * WIDTH, k as f64 * HEIGHT, 0.0);
    if welded {
        assert!(wrap == Wrap::Flat, "wrapped grids are unwelded here");
        for k in 0..=rows {
            mesh.positions.extend((0..=columns).map(|i| place(i, k)));
        }
    }
    for k in 0..rows {
        for i in 0..columns {
            let stitch = stitch(&key(k, i));
            let known = mesh.types.iter().position(|t| *t == stitch);
            mesh.face_types.push(TypeId::from(known.unwrap_or(mesh.types.len())));
            if known.is_none() {
                mesh.types.push(stitch);
            }
            for (di, dk) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                if welded {
                    mesh.face_vertices.push(VertexId(lattice(i + di, k + dk)));
                } else {
                    mesh.face_vertices.push(VertexId::from(mesh.positions.len()));
                    mesh.positions.push(place(i + di, k + dk));
                }
            }
            mesh.face_offsets.push(mesh.face_vertices.len() as u32);
        }
    }
    let mut join = |a: usize, edge_a: u32, b: usize, edge_b: u32| {
        mesh.joins.push(Join {
            a: FaceEdge { face: a.into(), edge: edge_a },
            b: FaceEdge { face: b.into(), edge: edge_b },
            flipped: true,
        });
    };
    for k in 0..rows {
        for i in 0..columns {
            let face = k * columns + i;
            if i + 1 < columns {
                join(face, 1, face + 1, 3);
            } else {
                match wrap {
                    Wrap::Flat => {}
                    Wrap::Tube | Wrap::Torus => join(face, 1, k * columns, 3),
                    Wrap::Helix if k + 1 < rows => join(face, 1, face + 1, 3),
                    Wrap::Helix => {}
                }
            }
            if k + 1 < rows {
                join(face, 2, face + columns, 0);
            } else if wrap == Wrap::Torus {
                join(face, 2, i, 0);
            }
        }
    }
    mesh
}

/// The same mesh with each face's positions given by `place(u, v)`, u in columns, v in rows.
pub fn placed(mut mesh: StitchMesh, columns: usize, place: impl Fn(f64, f64) -> DVec3) -> StitchMesh {
    for face in 0..mesh.face_count() {
        let (k, i) = (face / columns, face % columns);
        for (c, (di, dk)) in [(0, 0), (1, 0), (1, 1), (0, 1)].into_iter().enumerate() {
            let vertex = mesh.face(face.into())[c].index();
            mesh.positions[vertex] = place((i + di) as f64, (k + dk) as f64);
        }
    }
    mesh
}

/// A tube standing upright, its rounds rising by one row each turn when `helix` is set.
pub fn tube_place(columns: usize, helix: bool) -> impl Fn(f64, f64) -> DVec3 {
    let radius = columns as f64 * WIDTH / std::f64::consts::TAU;
    move |u, v| {
        let turn = u / columns as f64;
        let angle = std::f64::consts::TAU * turn;
        DVec3::new(radius * angle.cos(), radius * angle.sin(), (v + if helix { turn } else { 0.0 }) * HEIGHT)
    }
}

/// One face of the template's own shape.
pub fn single(template: &Template) -> StitchMesh {
    let n = template.corners.len();
    StitchMesh {
        positions: template.corners.iter().map(|c| c.extend(0.0)).collect(),
        face_offsets: vec![0, n as u32],
        face_vertices: (0..n).map(VertexId::from).collect(),
        face_types: vec![0usize.into()],
        types: vec![StitchType { name: template.name.clone(), labels: template.labels.clone() }],
        ..StitchMesh::default()
    }
}
