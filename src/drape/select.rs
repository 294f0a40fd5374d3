//! Which vertices a selection names.

use super::scene::{Border, Selection};
use crate::ids::VertexId;
use crate::mesh::StitchMesh;
use crate::{Error, Result};
use glam::DVec3;

impl Selection {
    /// The vertices of a mesh that meet all conditions, rising. `own` are the mesh's positions in metres, `placed` where the
    /// scene puts them; `name` is for messages.
    ///
    /// # Errors
    /// Numbers of vertices, faces or edges that are not there, and rows of a mesh that names none.
    pub fn vertices(
        &self,
        mesh: &StitchMesh,
        own: &[DVec3],
        placed: &[DVec3],
        name: &str,
    ) -> Result<Vec<VertexId>> {
        let count = mesh.positions.len();
        let mut kept = vec![*self != Self::default(); count];
        let mut keep = |chosen: &dyn Fn(usize) -> bool| {
            kept.iter_mut().enumerate().for_each(|(v, kept)| *kept &= chosen(v));
        };
        if let Some(vertices) = &self.vertices {
            if let Some(bad) = vertices.iter().find(|v| **v as usize >= count) {
                return Err(wrong(name, format_args!("vertex {bad}"), format_args!("one below {count}")));
            }
            let chosen = marked(count, vertices.iter().map(|v| *v as usize));
            keep(&|v| chosen[v]);
        }
        if let Some(edges) = &self.edges {
            let mut ends = Vec::new();
            for [face, edge] in edges {
                if *face as usize >= mesh.face_count() {
                    let expected = format!("one below {}", mesh.face_count());
                    return Err(wrong(name, format_args!("face {face}"), expected));
                }
                let corners = mesh.face((*face as usize).into());
                let Some(from) = corners.get(*edge as usize) else {
                    let expected = format!("one below {}", corners.len());
                    return Err(wrong(name, format_args!("edge {edge} of face {face}"), expected));
                };
                ends.extend([from.index(), corners[(*edge as usize + 1) % corners.len()].index()]);
            }
            let chosen = marked(count, ends.into_iter());
            keep(&|v| chosen[v]);
        }
        if let Some([low, high]) = self.bounds {
            keep(&|v| placed[v].cmpge(low).all() && placed[v].cmple(high).all());
        }
        if let Some(Border { side, depth }) = self.border {
            let depth = depth.unwrap_or_else(|| 0.5 * mean_edge(mesh, own));
            let extreme = own.iter().map(|p| side.reach(*p)).fold(f64::NEG_INFINITY, f64::max);
            keep(&|v| side.reach(own[v]) >= extreme - depth);
        }
        if let Some([first, last]) = self.rows {
            if mesh.face_source.is_empty() {
                return Err(wrong(
                    name,
                    "\"rows\"",
                    "a mesh whose faces name their lines of the pattern (N)",
                ));
            }
            let faces = (0..mesh.face_count()).filter(|f| (first..=last).contains(&mesh.face_source[*f]));
            let corners = faces.flat_map(|f| mesh.face(f.into())).map(|v| v.index());
            let chosen = marked(count, corners);
            keep(&|v| chosen[v]);
        }
        Ok((0..count).filter(|v| kept[*v]).map(VertexId::from).collect())
    }
}

fn wrong(name: &str, found: impl std::fmt::Display, expected: impl std::fmt::Display) -> Error {
    Error::invalid(format_args!("{name}: found {found}, expected {expected}"))
}

fn marked(count: usize, which: impl Iterator<Item = usize>) -> Vec<bool> {
    let mut marked = vec![false; count];
    which.for_each(|v| marked[v] = true);
    marked
}

/// Mean length of the edges of all faces.
pub fn mean_edge(mesh: &StitchMesh, positions: &[DVec3]) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for face in 0..mesh.face_count() {
        let corners = mesh.face(face.into());
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            sum += positions[a.index()].distance(positions[b.index()]);
            count += 1;
        }
    }
    sum / f64::max(f64::from(count), 1.0)
}
