//! Writes sequences.

use crate::io::output::Output;
use crate::mesh::MaterialMesh;
use crate::{Error, Result};
use glam::DVec3;
use std::path::Path;

/// Most frames that can be stated.
const MOST_FRAMES: usize = (1 << 30) - 1;

/// Writes a sequence: frame 0 is the mesh with its own positions, `frames` are the positions of those after it. All numbers
/// are rounded to f32.
///
/// # Errors
/// The system's; a mesh that [`MaterialMesh::check`] refuses; numbers beyond f32, frames of another number of vertices, or
/// not as many as the iterator said.
pub fn write<I>(path: &Path, mesh: &MaterialMesh, frames: I) -> Result<()>
where
    I: ExactSizeIterator<Item: AsRef<[DVec3]>>,
{
    let invalid = |what: std::fmt::Arguments| Error::invalid(format_args!("{}: {what}", path.display()));
    mesh.check().map_err(|e| invalid(format_args!("{e}")))?;
    if mesh.positions.is_empty() || mesh.faces.is_empty() || mesh.uvs.is_empty() {
        return Err(invalid(format_args!("found a mesh without faces, expected at least one")));
    }
    let count = frames.len().saturating_add(1);
    if count > MOST_FRAMES {
        return Err(invalid(format_args!("found {count} frames, expected at most {MOST_FRAMES}")));
    }
    let mut out = Output::create(path)?;
    out.put(&size(count as u32))?;
    let positions = |frame: usize, list: &[DVec3]| {
        if list.len() != mesh.positions.len() {
            let (found, expected) = (list.len(), mesh.positions.len());
            return Err(invalid(format_args!(
                "found {found} vertices in frame {frame}, expected {expected}"
            )));
        }
        floats(list.iter().flat_map(|p| p.to_array())).map(|numbers| matrix(3, &numbers)).ok_or_else(|| {
            invalid(format_args!("found a position in frame {frame} beyond f32, expected finite numbers"))
        })
    };
    let uvs = floats(mesh.uvs.iter().flat_map(|p| p.to_array())).ok_or_else(|| {
        invalid(format_args!("found material coordinates beyond f32, expected finite numbers"))
    })?;
    let triangles = |faces: &[[u32; 3]]| -> Vec<u8> {
        matrix(3, &faces.iter().flatten().flat_map(|i| i.to_le_bytes()).collect::<Vec<_>>())
    };
    out.put(&positions(0, &mesh.positions)?)?;
    out.put(&triangles(&mesh.faces))?;
    out.put(&matrix(2, &uvs))?;
    out.put(&triangles(&mesh.face_uvs))?;
    // No motions, vertices and faces of obstacles.
    out.put(&[0; 3])?;
    let mut written = 1;
    for list in frames {
        out.put(&positions(written, list.as_ref())?)?;
        // Three matrices without rows: nothing else changes.
        out.put(&[0; 3 * 8 + 3])?;
        written += 1;
    }
    if written != count {
        return Err(invalid(format_args!("found {written} frames to write, expected {count}")));
    }
    out.commit()
}

fn size(n: u32) -> Vec<u8> {
    let [a, b, c, d] = n.to_be_bytes();
    match n {
        0..0x80 => vec![d],
        0x80..0x4000 => vec![0x80 | c, d],
        _ => vec![0xc0 | a, b, d, c],
    }
}

/// Rounds to f32; none if a number is not finite then.
fn floats(numbers: impl Iterator<Item = f64>) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    for x in numbers {
        let x = x as f32;
        if !x.is_finite() {
            return None;
        }
        bytes.extend(x.to_le_bytes());
    }
    Some(bytes)
}

/// A matrix of 4-byte values with its head.
fn matrix(columns: u32, values: &[u8]) -> Vec<u8> {
    let rows = values.len() / (4 * columns as usize);
    let mut bytes = Vec::with_capacity(8 + values.len());
    bytes.extend((rows as u32).to_le_bytes());
    bytes.extend(columns.to_le_bytes());
    bytes.extend(values);
    bytes
}
