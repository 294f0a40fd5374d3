//! OBJ meshes with texture coordinates as material.

use super::message;
use crate::common::database::sheet;
use knotmesh::io::obj_mesh;
use knotmesh::mesh::MaterialMesh;
use std::path::Path;

fn read(text: &str) -> knotmesh::Result<MaterialMesh> {
    obj_mesh::read(Path::new("in"), text.as_bytes())?.into_material_mesh()
}

const VERTICES: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 5\nv 2 2 2\nvt 9 9\nvt 0 0\nvt 1 0\n";

/// Seen red with the diagonal chosen by positions.
#[test]
fn quads_are_split_on_the_shorter_diagonal_of_the_material() {
    // Corner 2 of the quad (in material) is moved outwards or inwards along the diagonal from corner 0.
    for (reach, faces, uvs) in [
        (0.9, [[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 4]]),
        (1.0, [[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 4]]),
        (1.1, [[0, 1, 3], [1, 2, 3]], [[1, 2, 4], [2, 3, 4]]),
    ] {
        let mesh = read(&format!("{VERTICES}vt {reach} {reach}\nvt 0 1\nf 1/2 2/3 3/4 4/5\n")).unwrap();
        assert_eq!((mesh.faces, mesh.face_uvs), (faces.to_vec(), uvs.to_vec()), "{reach}");
        assert_eq!((mesh.positions.len(), mesh.uvs.len()), (5, 5));
    }
    let mesh = read(&format!("{VERTICES}f 3/3 -4/1 1/2\n")).unwrap();
    assert_eq!((&mesh.faces[..], &mesh.face_uvs[..]), (&[[2, 1, 0]][..], &[[2, 0, 1]][..]));
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    for (faces, expected) in [
        (
            "f 1/1 2/2 3/3\nf 1 3 4",
            "in:10:1: found a face without texture coordinates, expected 'f i/t j/t k/t' (export with UVs)",
        ),
        (
            "f 1/1 2/1 3/1 4/1 5/1",
            "in:9:1: found a face of 5 corners, expected triangles and quads (triangulate the mesh)",
        ),
    ] {
        assert_eq!(message(Path::new("."), read(&format!("{VERTICES}{faces}\n"))), expected);
    }
}

#[test]
fn meshes_round_trip_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let mut mesh = sheet(3, 2);
    mesh.positions[3].x = 1.0 / 3.0;
    mesh.positions[4].y = -5e-324;
    mesh.uvs[5].y = 1e-7;
    obj_mesh::write(&path, &mesh).unwrap();
    assert_eq!(obj_mesh::read_file(&path).unwrap().into_material_mesh().unwrap(), mesh);
}
