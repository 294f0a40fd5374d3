//! From OBJ polygons to triangles with material coordinates.

use super::ObjMesh;
use crate::mesh::MaterialMesh;
use crate::{Error, Result};

impl ObjMesh {
    /// Takes texture coordinates as material coordinates (in the unit of the positions). Triangles stay, quads are split along
    /// the diagonal that is shorter in texture coordinates, the one from corner 0 where both are alike.
    ///
    /// # Errors
    /// By line: faces without texture coordinates, faces of more than four corners.
    pub fn into_material_mesh(self) -> Result<MaterialMesh> {
        let mut faces = Vec::with_capacity(self.face_count());
        let mut sources = Vec::with_capacity(self.face_count());
        let mut face_uvs = Vec::with_capacity(self.face_count());
        for face in 0..self.face_count() {
            let error = |found: &str, expected: &str| {
                Error::input(&self.path, self.face_lines[face] as usize, 1, found, expected)
            };
            let Some(uvs) = self.face_uvs(face) else {
                return Err(error("a face without texture coordinates", "'f i/t j/t k/t' (export with UVs)"));
            };
            let corners: &[[usize; 3]] = match uvs.len() {
                3 => &[[0, 1, 2]],
                4 if uvs[0].distance_squared(uvs[2]) <= uvs[1].distance_squared(uvs[3]) => {
                    &[[0, 1, 2], [0, 2, 3]]
                }
                4 => &[[0, 1, 3], [1, 2, 3]],
                n => {
                    let found = format!("a face of {n} corners");
                    return Err(error(&found, "triangles and quads (triangulate the mesh)"));
                }
            };
            let begin = self.face_offsets[face] as usize;
            for triangle in corners {
                faces.push(triangle.map(|k| self.face_vertices[begin + k]));
                face_uvs.push(triangle.map(|k| self.corner_uvs[begin + k]));
                sources.push(face as u32);
            }
        }
        if sources.len() == self.face_offsets.len() - 1 {
            // All triangles: each is its own polygon.
            sources.clear();
        }
        let mesh = MaterialMesh { positions: self.positions, uvs: self.uvs, faces, face_uvs, sources };
        mesh.check().map_err(|e| Error::invalid(format_args!("{}: {e}", self.path.display())))?;
        Ok(mesh)
    }
}
