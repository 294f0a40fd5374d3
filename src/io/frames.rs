//! Vertex positions over time: a NumPy array, or OBJ files named by a pattern.
//!
//! One frame is read at a time, so that a long sequence takes no more memory than a short one.

mod npy;
mod order;
mod range;
mod write;

pub use range::frame_range;
pub use write::FramesWriter;

use super::obj_mesh;
use super::text::read_bytes;
use crate::{Error, Result};
use glam::DVec3;
use npy::Npy;
use std::path::{Path, PathBuf};

/// A sequence of frames, each with a position for every vertex of a mesh, in the mesh file's order.
#[derive(Debug)]
pub struct Frames {
    source: Source,
    vertex_count: usize,
}

#[derive(Debug)]
enum Source {
    Npy(Npy),
    Objs(Vec<PathBuf>),
}

impl Frames {
    /// Opens a `.npy` file (an array `[frame, vertex, 3]`, or `[vertex, 3]` for one frame, of floats or
    /// integers) or the OBJ files that match a pattern such as `frame*.obj`, in natural order: `frame2`
    /// before `frame10`. `vertex_count` is the mesh's.
    pub fn open(pattern: &str, vertex_count: usize) -> Result<Self> {
        let path = Path::new(pattern);
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy")) {
            return Ok(Self { source: Source::Npy(Npy::open(path, vertex_count)?), vertex_count });
        }
        // A name that exists is that file, even with signs in it that mean something in a pattern.
        let paths = if path.exists() { vec![path.into()] } else { order::matching(pattern)? };
        Ok(Self { source: Source::Objs(paths), vertex_count })
    }

    /// Number of frames, at least one.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        match &self.source {
            Source::Npy(npy) => npy.frame_count(),
            Source::Objs(paths) => paths.len(),
        }
    }

    /// Number of vertices in each frame.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Reads a frame (counted from 0) into `positions`, world units, replacing what was there.
    pub fn read(&mut self, frame: usize, positions: &mut Vec<DVec3>) -> Result<()> {
        positions.clear();
        let count = self.len();
        if frame >= count {
            return Err(Error::invalid(format_args!(
                "there is no frame {frame}: frames are 0 to {}",
                count - 1
            )));
        }
        match &mut self.source {
            Source::Npy(npy) => npy.read(frame, positions),
            Source::Objs(paths) => {
                let path = &paths[frame];
                obj_mesh::read_positions(path, &read_bytes(path)?, positions)?;
                if positions.len() == self.vertex_count {
                    return Ok(());
                }
                let found = format_args!("{} vertices in frame {frame}", positions.len());
                positions.clear();
                let expected = format!("{} as in the mesh", self.vertex_count);
                Err(Error::input(path, 1, 1, found, expected))
            }
        }
    }
}
