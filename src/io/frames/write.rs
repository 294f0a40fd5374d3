//! Frames as files: an array `[frame, vertex, 3]` of f32 that grows frame by frame, or an OBJ mesh a frame.

use crate::io::npy::header_bytes;
use crate::io::output::{FramePattern, Output};
use crate::io::text::extension;
use crate::mesh::StitchMesh;
use crate::{Error, Result};
use glam::DVec3;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A sequence of frames being written. Files appear whole or not at all.
#[derive(Debug)]
pub struct FramesWriter {
    target: Target,
    bytes: Vec<u8>,
    files: Vec<PathBuf>,
}

#[derive(Debug)]
enum Target {
    Npy { output: Output, left: usize, vertices: usize },
    Objs { pattern: FramePattern, faces: String },
}

impl FramesWriter {
    /// Begins a `.npy` of so many frames, or `.obj` files, numbered as the file name says (`out.%04d.obj`).
    ///
    /// # Errors
    /// Another extension, a file name with other signs after `%`, and the system's.
    pub fn create(path: &Path, frame_count: usize, mesh: &StitchMesh) -> Result<Self> {
        let target = match extension(path).as_str() {
            "npy" => {
                let vertices = mesh.positions.len();
                let mut output = Output::create(path)?;
                output.put(&header_bytes("<f4", &[frame_count as u64, vertices as u64, 3]))?;
                Target::Npy { output, left: frame_count, vertices }
            }
            "obj" => {
                let mut faces = String::new();
                for face in 0..mesh.face_count() {
                    faces.push('f');
                    for vertex in mesh.face(face.into()) {
                        let _ = write!(faces, " {}", vertex.0 + 1);
                    }
                    faces.push('\n');
                }
                Target::Objs { pattern: FramePattern::new(path, frame_count > 1)?, faces }
            }
            other => {
                let found = if other.is_empty() {
                    "no extension".into()
                } else {
                    format!("the extension '.{other}'")
                };
                return Err(Error::invalid(format_args!(
                    "{}: found {found}, expected .npy (all frames) or .obj (a file a frame)",
                    path.display()
                )));
            }
        };
        Ok(Self { target, bytes: Vec::new(), files: Vec::new() })
    }

    /// Writes a frame: positions by vertex. Those of a `.npy` follow one another, `number` is for names.
    ///
    /// # Errors
    /// Another number of vertices than the mesh has, more frames than were announced, and the system's.
    pub fn frame(&mut self, number: usize, positions: &[DVec3]) -> Result<()> {
        match &mut self.target {
            Target::Npy { output, left, vertices } => {
                if positions.len() != *vertices || *left == 0 {
                    return Err(Error::invalid(format_args!(
                        "frame {number}: found {} positions with {left} frames to come, expected {vertices} of a frame \
                         to come",
                        positions.len()
                    )));
                }
                *left -= 1;
                self.bytes.clear();
                let numbers = positions.iter().flat_map(|p| p.as_vec3().to_array());
                self.bytes.extend(numbers.flat_map(f32::to_le_bytes));
                output.put(&self.bytes)
            }
            Target::Objs { pattern, faces } => {
                let path = pattern.path(number);
                let mut output = Output::create(&path)?;
                let mut text = String::new();
                for p in positions {
                    let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
                }
                output.put(text.as_bytes())?;
                output.put(faces.as_bytes())?;
                output.commit()?;
                self.files.push(path);
                Ok(())
            }
        }
    }

    /// Puts the last files in place, and names all.
    ///
    /// # Errors
    /// Fewer frames than were announced, and the system's.
    pub fn finish(mut self) -> Result<Vec<PathBuf>> {
        if let Target::Npy { output, left, .. } = self.target {
            if left > 0 {
                return Err(Error::invalid(format_args!("{left} frames are missing, expected none to be")));
            }
            self.files.push(output.path().to_path_buf());
            output.commit()?;
        }
        Ok(self.files)
    }
}
