//! From OBJ polygons to a stitch mesh.

use super::ObjMesh;
use crate::ids::{FaceId, TypeId, VertexId};
use crate::mesh::{StitchMesh, StitchType};
use crate::{Error, Result};
use glam::DVec2;
use std::collections::HashMap;

/// Finds the stitch of a face: given its name (empty if it has none), the texture coordinates of its
/// corners and the number of corners, the stitch type and which corner becomes corner 0; or what it had
/// expected instead (the end of a message `..., expected {that}`).
pub type Resolve<'a> = dyn FnMut(&str, Option<&[DVec2]>, usize) -> Result<(StitchType, usize), String> + 'a;

impl ObjMesh {
    /// Makes a stitch of every face; `resolve` says which. A refusal names the face's line.
    pub fn into_stitch_mesh(self, resolve: &mut Resolve) -> Result<StitchMesh> {
        let mut numbers: HashMap<StitchType, TypeId> = HashMap::new();
        let mut rotations = Vec::with_capacity(self.face_count());
        let mut mesh = StitchMesh::default();
        for face in 0..self.face_count() {
            let corners = self.face(face);
            let count = corners.len();
            let name = self.face_name(face);
            let error = |expected: String| {
                let expected = expected.replace(char::is_control, " ");
                let named = if name.is_empty() { "without a name".to_owned() } else { format!("'{name}'") };
                let found = format_args!("a face {named} with {count} corners");
                Error::input(&self.path, self.face_lines[face] as usize, 1, found, expected)
            };
            let (stitch, rotation) = resolve(name, self.face_uvs(face).as_deref(), count).map_err(error)?;
            if stitch.labels.len() != count || rotation >= count {
                return Err(error(format!("the {} corners of '{}'", stitch.labels.len(), stitch.key())));
            }
            mesh.face_vertices.extend((0..count).map(|k| VertexId(corners[(k + rotation) % count])));
            rotations.push(rotation as u32);
            let number = *numbers.entry(stitch).or_insert_with_key(|stitch| {
                mesh.types.push(stitch.clone());
                TypeId::from(mesh.types.len() - 1)
            });
            mesh.face_types.push(number);
        }
        mesh.joins = self.joins;
        let turned = |face: FaceId, edge: u32| {
            let [begin, end] = [0, 1].map(|k| self.face_offsets[face.index() + k]);
            let (count, rotation) = (end - begin, rotations[face.index()]);
            (edge + (count - rotation)) % count
        };
        for join in &mut mesh.joins {
            join.a.edge = turned(join.a.face, join.a.edge);
            join.b.edge = turned(join.b.face, join.b.edge);
        }
        mesh.face_offsets = self.face_offsets;
        mesh.positions = self.positions;
        Ok(mesh)
    }
}
