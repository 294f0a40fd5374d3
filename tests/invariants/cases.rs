//! Random meshes: mixed stitches, welded or not, bent and strained.

use crate::common::Random;
use crate::common::grid::{Wrap, grid, placed, tube_place};
use glam::DVec3;
use knotmesh::ids::VertexId;
use knotmesh::mesh::{FaceEdge, StitchMesh};

const RIGHTWARD: [&str; 6] = [
    "knit+ -lX +yX +lX -yX",
    "purl+ -lX +yX +lX -yX",
    "knit-twisted+ -lX +yX +lX -yX",
    "slip+ -lX +yX +lX -yX",
    "tuck+ -lX +yX +lX -yX",
    "knittuck+ -lX +yX +lX -yX",
];
/// A tuck holds two loops on its upper edge, off the surface; a knit through both must follow.
const TUCK: usize = 4;
const LEFTWARD: [&str; 6] = [
    "knit- -lX -yX +lX +yX",
    "purl- -lX -yX +lX +yX",
    "knit-twisted- -lX -yX +lX +yX",
    "slip- -lX -yX +lX +yX",
    "tuck- -lX -yX +lX +yX",
    "knittuck- -lX -yX +lX +yX",
];

/// A grid of random size, wrap and stitches, at rest.
pub fn random_grid(random: &mut Random) -> StitchMesh {
    let wrap = [Wrap::Flat, Wrap::Flat, Wrap::Tube, Wrap::Helix, Wrap::Torus][random.below(5)];
    let flat = wrap == Wrap::Flat;
    let (columns, rows) = (2 + random.below(4), 2 + random.below(4));
    let columns = if flat { columns } else { columns + 3 };
    // Around a ring of two rows the normals would cancel.
    let rows = if wrap == Wrap::Torus { rows + 2 } else { rows };
    let welded = flat && random.below(2) == 0;
    let mut picks: Vec<usize> = Vec::new();
    for face in 0..columns * rows {
        let below = face.checked_sub(columns).map(|f| picks[f]);
        let last_row = face + columns >= columns * rows;
        picks.push(match below {
            Some(TUCK) => TUCK + 1,
            _ => random.below(if last_row { TUCK } else { TUCK + 1 }),
        });
    }
    let mesh = grid(columns, rows, wrap, welded, |k, i| {
        let rightward = !flat || k % 2 == 0;
        (if rightward { RIGHTWARD } else { LEFTWARD })[picks[k * columns + i]].to_string()
    });
    match wrap {
        Wrap::Flat => mesh,
        Wrap::Tube | Wrap::Helix => placed(mesh, columns, tube_place(columns, wrap == Wrap::Helix)),
        Wrap::Torus => placed(mesh, columns, |u, v| {
            let (a, b) =
                (u / columns as f64 * std::f64::consts::TAU, v / rows as f64 * std::f64::consts::TAU);
            let (big, small) = (2.0 + columns as f64 / 3.0, 0.6 + rows as f64 / 12.0);
            let ring = big + small * b.cos();
            DVec3::new(ring * a.cos(), ring * a.sin(), small * b.sin())
        }),
    }
}

/// The same mesh under a random smooth deformation with some noise; `strength` 0.3 is a strained garment, 1 is
/// beyond what cloth does. Vertices that coincide stay together.
pub fn deform(mesh: &mut StitchMesh, strength: f64, random: &mut Random) {
    let mut row = || {
        DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0))
            * 0.5
            * strength
    };
    let linear = glam::DMat3::IDENTITY + glam::DMat3::from_cols(row(), row(), row());
    let waves: Vec<(DVec3, DVec3)> = (0..3).map(|_| (row() * 3.0, row())).collect();
    let salt = random.bits();
    for p in &mut mesh.positions {
        let at = *p;
        // Noise by place, so that unwelded corners of one place move alike.
        let key = (at * 1024.0).round();
        let seed = salt
            ^ (key.x as i64 as u64).wrapping_mul(0x9e37_79b9)
            ^ (key.y as i64 as u64).wrapping_mul(0x85eb_ca6b_1234_5679)
            ^ (key.z as i64 as u64).wrapping_mul(0xc2b2_ae35_7654_3211);
        let mut noise = Random::new(seed);
        *p = linear * at;
        for (wave, shift) in &waves {
            *p += *shift * wave.dot(at).sin();
        }
        let mut jitter = || noise.between(-0.08, 0.08) * strength;
        *p += DVec3::new(jitter(), jitter(), jitter());
    }
}

/// A mesh at rest and the same mesh deformed, for a seed.
pub fn case(seed: u64, strength: f64) -> (StitchMesh, StitchMesh, Random) {
    let mut random = Random::new(seed);
    let rest = random_grid(&mut random);
    let mut deformed = rest.clone();
    deform(&mut deformed, strength, &mut random);
    (rest, deformed, random)
}

/// The mesh with vertices and faces renumbered and each face's corners (with its key) turned; and which face
/// each of the new ones was.
pub fn renumbered(mesh: &StitchMesh, random: &mut Random) -> (StitchMesh, Vec<usize>) {
    let vertices = random.shuffled(mesh.positions.len());
    let faces = random.shuffled(mesh.face_count());
    let mut new_vertex = vec![0; vertices.len()];
    for (new, old) in vertices.iter().enumerate() {
        new_vertex[*old] = new;
    }
    let mut new = StitchMesh { face_offsets: vec![0], ..StitchMesh::default() };
    new.positions = vertices.iter().map(|v| mesh.positions[*v]).collect();
    let mut turns = Vec::new();
    for old in &faces {
        let corners = mesh.face((*old).into());
        let n = corners.len();
        let turn = random.below(n);
        turns.push(turn);
        new.face_vertices.extend((0..n).map(|c| VertexId::from(new_vertex[corners[(c + turn) % n].index()])));
        new.face_offsets.push(new.face_vertices.len() as u32);
        let mut stitch = mesh.face_type((*old).into()).clone();
        stitch.labels.rotate_left(turn);
        let known = new.types.iter().position(|t| *t == stitch);
        new.face_types.push(known.unwrap_or(new.types.len()).into());
        if known.is_none() {
            new.types.push(stitch);
        }
    }
    let mut new_face = vec![0; faces.len()];
    for (n, old) in faces.iter().enumerate() {
        new_face[*old] = n;
    }
    let edge = |e: FaceEdge| {
        let face = new_face[e.face.index()];
        let n = mesh.face(e.face).len() as u32;
        FaceEdge { face: face.into(), edge: (e.edge + n - turns[face] as u32) % n }
    };
    for i in random.shuffled(mesh.joins.len()) {
        let mut join = mesh.joins[i];
        (join.a, join.b) = (edge(join.a), edge(join.b));
        if random.below(2) == 0 {
            std::mem::swap(&mut join.a, &mut join.b);
        }
        new.joins.push(join);
    }
    (new, faces)
}
