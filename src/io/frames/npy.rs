//! Frames in a `.npy` file, read where they lie.

use crate::io::npy::{self, NpyHeader};
use crate::{Error, Result};
use glam::DVec3;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Bytes read at once.
const WINDOW: u64 = 1 << 16;

/// An open `.npy` file of frames.
#[derive(Debug)]
pub(super) struct Npy {
    path: PathBuf,
    file: File,
    header: NpyHeader,
    frames: usize,
    vertices: usize,
    /// The part of the file read last, and where it begins.
    window: Vec<u8>,
    window_at: u64,
}

impl Npy {
    pub(super) fn open(path: &Path, vertices: usize) -> Result<Self> {
        let io = |e| Error::io(path, e);
        let (mut file, header) = npy::open(path)?;
        let at = header.data_offset;
        let frames = match *header.shape {
            [frames, v, 3] if v == vertices as u64 => frames,
            [v, 3] if v == vertices as u64 => 1,
            _ => {
                let found = format!("an array of shape {:?}", header.shape);
                return Err(Error::binary(
                    path,
                    0,
                    found,
                    format!("[frame, {vertices}, 3] or [{vertices}, 3]"),
                ));
            }
        };
        let numbers = frames.checked_mul(3).and_then(|n| n.checked_mul(vertices as u64));
        let end = numbers.and_then(|n| n.checked_mul(header.size as u64)?.checked_add(at as u64));
        let length = file.seek(SeekFrom::End(0)).map_err(io)?;
        if end.is_none_or(|end| length < end) {
            let expected = format!("{frames} frames of {vertices} vertices");
            return Err(Error::binary(path, length as usize, "the end of the file", expected));
        }
        let frames = usize::try_from(frames).unwrap_or(0);
        if frames == 0 {
            return Err(Error::binary(path, 0, "no frames", "at least one frame"));
        }
        Ok(Self { path: path.into(), file, header, frames, vertices, window: Vec::new(), window_at: 0 })
    }

    pub(super) fn frame_count(&self) -> usize {
        self.frames
    }

    /// Appends the positions of a frame (which exists).
    pub(super) fn read(&mut self, frame: usize, positions: &mut Vec<DVec3>) -> Result<()> {
        self.window.clear();
        let [frames, vertices, frame] = [self.frames, self.vertices, frame].map(|n| n as u64);
        // Distance between coordinates of a vertex, and between vertices, in numbers.
        let (by_axis, by_vertex, first) = if self.header.fortran_order {
            (frames * vertices, frames, frame)
        } else {
            (1, 3, frame * vertices * 3)
        };
        let index = |vertex: usize, axis: usize| first + axis as u64 * by_axis + vertex as u64 * by_vertex;
        positions.resize(self.vertices, DVec3::ZERO);
        if self.header.fortran_order {
            // All x come first, then all y, then all z: one pass through the file.
            for axis in 0..3 {
                for (vertex, position) in positions.iter_mut().enumerate() {
                    let x = self.number(index(vertex, axis), by_vertex)?;
                    position[axis] = self.finite(x, frame, vertex)?;
                }
            }
        } else {
            for (vertex, position) in positions.iter_mut().enumerate() {
                for axis in 0..3 {
                    let x = self.number(index(vertex, axis), 1)?;
                    position[axis] = self.finite(x, frame, vertex)?;
                }
            }
        }
        Ok(())
    }

    /// The number at an index; the next one wanted is likely `stride` further on.
    fn number(&mut self, index: u64, stride: u64) -> Result<(f64, u64)> {
        let size = self.header.size;
        let at = self.header.data_offset as u64 + index * size as u64;
        let inside = at.checked_sub(self.window_at).filter(|d| d + size as u64 <= self.window.len() as u64);
        let begin = match inside {
            Some(begin) => begin as usize,
            None => {
                // Numbers far apart are fetched one by one rather than with all that lies between.
                let wanted = if stride * size as u64 * 8 > WINDOW { size as u64 } else { WINDOW };
                self.fetch(at, wanted)?;
                0
            }
        };
        let Some(bytes) = self.window.get(begin..begin + size) else {
            // The file has become shorter since it was opened.
            let at = self.window_at as usize + self.window.len();
            return Err(Error::binary(&self.path, at, "the end of the file", "more numbers"));
        };
        Ok((self.header.number(bytes), at))
    }

    fn fetch(&mut self, at: u64, wanted: u64) -> Result<()> {
        let io = |e| Error::io(&self.path, e);
        self.window.clear();
        self.window_at = at;
        self.file.seek(SeekFrom::Start(at)).map_err(io)?;
        self.file.by_ref().take(wanted).read_to_end(&mut self.window).map_err(io)?;
        Ok(())
    }

    fn finite(&self, (x, at): (f64, u64), frame: u64, vertex: usize) -> Result<f64> {
        if x.is_finite() {
            return Ok(x);
        }
        let found = format_args!("{x} at vertex {vertex} of frame {frame} (both counted from 0)");
        Err(Error::binary(&self.path, at as usize, found, "a finite coordinate"))
    }
}
