//! Which corners of which faces are one place of the fabric, and the faces around it.

use super::StitchMesh;
use crate::ids::VertexId;

/// Vertices grouped into corners of the fabric: shared vertices are one already, `e` lines join the rest.
#[derive(Clone, Debug, Default)]
pub struct CornerGroups {
    /// `[vertex]` its group.
    pub of_vertex: Vec<u32>,
    /// `[group + 1]` the faces around group g are `faces[offsets[g] .. offsets[g + 1]]`.
    pub offsets: Vec<u32>,
    /// Faces around the groups, each once per group, ascending.
    pub faces: Vec<u32>,
}

impl CornerGroups {
    /// Groups the corners of a mesh.
    pub fn new(mesh: &StitchMesh) -> Self {
        let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        for join in &mesh.joins {
            for [a, b] in joined_corners(mesh, join) {
                unite(&mut parent, a.0, b.0);
            }
        }
        let mut of_vertex = vec![u32::MAX; parent.len()];
        let mut count = 0;
        for v in 0..parent.len() as u32 {
            let root = find(&mut parent, v) as usize;
            if of_vertex[root] == u32::MAX {
                of_vertex[root] = count;
                count += 1;
            }
            of_vertex[v as usize] = of_vertex[root];
        }
        drop(parent);

        // Counting sort of (group, face); a face that meets a group twice counts once.
        let mut offsets = vec![0u32; count as usize + 1];
        let mut last_face = vec![u32::MAX; count as usize];
        let mut pass = |emit: &mut dyn FnMut(u32, u32)| {
            last_face.fill(u32::MAX);
            for face in 0..mesh.face_count() {
                for v in mesh.face(face.into()) {
                    let group = of_vertex[v.index()];
                    if last_face[group as usize] != face as u32 {
                        last_face[group as usize] = face as u32;
                        emit(group, face as u32);
                    }
                }
            }
        };
        pass(&mut |group, _| offsets[group as usize + 1] += 1);
        for g in 0..count as usize {
            offsets[g + 1] += offsets[g];
        }
        let mut next = offsets.clone();
        let mut faces = vec![0; offsets[count as usize] as usize];
        pass(&mut |group, face| {
            faces[next[group as usize] as usize] = face;
            next[group as usize] += 1;
        });
        Self { of_vertex, offsets, faces }
    }

    /// Number of groups.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The two pairs of vertices that a join says coincide.
pub fn joined_corners(mesh: &StitchMesh, join: &super::Join) -> [[VertexId; 2]; 2] {
    let ends = |e: super::FaceEdge| {
        let corners = mesh.face(e.face);
        let k = e.edge as usize;
        [corners[k], corners[(k + 1) % corners.len()]]
    };
    let (a, b) = (ends(join.a), ends(join.b));
    if join.flipped { [[a[0], b[1]], [a[1], b[0]]] } else { [[a[0], b[0]], [a[1], b[1]]] }
}

/// How far apart joined edges lie in the mesh's own positions: `(joins apart, greatest distance)`, where
/// apart means further than 1e-3 of the mean edge length.
pub fn gaps(mesh: &StitchMesh) -> (usize, f64) {
    let (mut total, mut edges) = (0.0, 0);
    for face in 0..mesh.face_count() {
        let corners = mesh.face(face.into());
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            total += mesh.positions[a.index()].distance(mesh.positions[b.index()]);
            edges += 1;
        }
    }
    let tolerance = 1e-3 * total / f64::max(f64::from(edges), 1.0);
    let (mut apart, mut greatest) = (0, 0.0);
    for join in &mesh.joins {
        let distance = joined_corners(mesh, join)
            .map(|[a, b]| mesh.positions[a.index()].distance(mesh.positions[b.index()]));
        let distance = distance[0].max(distance[1]);
        apart += usize::from(distance > tolerance);
        greatest = f64::max(greatest, distance);
    }
    (apart, greatest)
}

fn find(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

fn unite(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parent, a), find(parent, b));
    // The smaller index is the root, so groups do not depend on the order of joins.
    parent[a.max(b) as usize] = a.min(b);
}
