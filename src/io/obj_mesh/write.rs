//! Writes triangles with material coordinates as OBJ.

use crate::Result;
use crate::io::output::Output;
use crate::mesh::MaterialMesh;
use std::fmt::Write;
use std::path::Path;

/// Writes `v`, `vt` and `f a/b` lines: what [`super::ObjMesh::into_material_mesh`] reads back to the bit.
///
/// # Errors
/// The system's.
pub fn write(path: &Path, mesh: &MaterialMesh) -> Result<()> {
    let mut out = Output::create(path)?;
    out.put(b"# cloth with material coordinates, written by knotmesh\n")?;
    let mut text = String::new();
    // One line at a time. Writing to a string cannot fail; `{:?}` is the shortest number that reads back.
    let mut put = |line: std::fmt::Arguments| {
        text.clear();
        let _ = text.write_fmt(line);
        out.put(text.as_bytes())
    };
    for p in &mesh.positions {
        put(format_args!("v {:?} {:?} {:?}\n", p.x, p.y, p.z))?;
    }
    for p in &mesh.uvs {
        put(format_args!("vt {:?} {:?}\n", p.x, p.y))?;
    }
    for (vertices, uvs) in mesh.faces.iter().zip(&mesh.face_uvs) {
        let [a, b, c] = std::array::from_fn(|k| (vertices[k] as u64 + 1, uvs[k] as u64 + 1));
        put(format_args!("f {}/{} {}/{} {}/{}\n", a.0, a.1, b.0, b.1, c.0, c.1))?;
    }
    out.commit()
}
