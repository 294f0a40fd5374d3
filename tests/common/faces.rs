//! Faces of every shape, folded, degenerate and not finite ones among them: the corpus that backends are compared on.

use super::Random;
use glam::DVec3;
use knotmesh::ids::VertexId;
use knotmesh::mesh::{StitchMesh, StitchType};
use knotmesh::template::Template;

/// Faces on their own, so many of each template, of the templates' own shapes.
pub fn faces(templates: &[Template], count: impl Fn(usize) -> usize) -> StitchMesh {
    let mut mesh = StitchMesh { face_offsets: vec![0], ..StitchMesh::default() };
    for (t, template) in templates.iter().enumerate() {
        mesh.types.push(StitchType { name: template.name.clone(), labels: template.labels.clone() });
        for i in 0..count(t) {
            for c in &template.corners {
                mesh.face_vertices.push(VertexId::from(mesh.positions.len()));
                mesh.positions.push(c.extend(0.0) + DVec3::new(2.0 * i as f64, 2.0 * t as f64, 0.0));
            }
            mesh.face_offsets.push(mesh.face_vertices.len() as u32);
            mesh.face_types.push(t.into());
        }
    }
    mesh
}

/// Deforms every face on its own, from none at all to beyond sense.
pub fn deformed(mesh: &StitchMesh, random: &mut Random) -> Vec<DVec3> {
    let mut positions = mesh.positions.clone();
    for face in 0..mesh.face_count() {
        let corners = mesh.face(face.into());
        let wildness = [0.0, 0.02, 0.1, 0.3, 0.6, 1.5][random.below(6)];
        let mut vector = |size: f64| {
            DVec3::new(random.between(-size, size), random.between(-size, size), random.between(-size, size))
        };
        let first = positions[corners[0].index()];
        let (x, y) = (DVec3::X + vector(wildness), DVec3::Y + vector(wildness));
        for v in corners {
            let p = positions[v.index()] - first;
            positions[v.index()] = first + x * p.x + y * p.y + vector(0.3 * wildness);
        }
        let at = |k: usize| corners[k % corners.len()].index();
        let k = random.below(corners.len());
        match random.below(24) {
            0 => positions[at(k)] = positions[at(k + 1)],
            1 => corners.iter().for_each(|v| positions[v.index()] = first),
            2 => corners.iter().for_each(|v| positions[v.index()].y = first.y),
            3 => positions[at(k)].x = f64::NAN,
            4 => corners.iter().for_each(|v| positions[v.index()].z = f64::INFINITY),
            5 => positions[at(k)] *= 1e30,
            6 => corners.iter().for_each(|v| positions[v.index()] *= 1e18),
            7 => positions.swap(at(k), at(k + 1)),
            8 => corners
                .iter()
                .for_each(|v| positions[v.index()] = first + (positions[v.index()] - first) * 1e-5),
            _ => {}
        }
    }
    positions
}

/// At rest, deformed, deformed otherwise, and partly moved on.
pub fn motion(mesh: &StitchMesh, seed: u64) -> Vec<Vec<DVec3>> {
    let mut random = Random::new(seed);
    let mut frames = vec![mesh.positions.clone(), deformed(mesh, &mut random), deformed(mesh, &mut random)];
    let mut last = frames[2].clone();
    for face in 0..mesh.face_count() {
        let by = match random.below(3) {
            0 => DVec3::ZERO,
            1 => DVec3::new(0.25, 0.5, -0.125),
            _ => DVec3::NAN,
        };
        for v in mesh.face(face.into()) {
            let p = &mut last[v.index()];
            *p = if by.is_nan() { *p + DVec3::splat(0.01 * random.unit()) } else { *p + by };
        }
    }
    frames.push(last);
    frames
}
