//! Which faces are wanted, in a `.npy` file: booleans or bytes, `[face]` or `[frame, face]`.

use super::npy::{self, NpyHeader};
use crate::{Error, Result};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// An open mask of faces, in the mesh file's order; a frame of it is read at a time.
#[derive(Debug)]
pub struct FaceMask {
    path: PathBuf,
    file: File,
    header: NpyHeader,
    faces: usize,
    /// None where one mask is for all frames.
    frames: Option<usize>,
    bytes: Vec<u8>,
}

impl FaceMask {
    /// Opens a mask for a mesh of so many faces.
    ///
    /// # Errors
    /// A file that cannot be read, of another kind, shape or type, or shorter than its header says.
    pub fn open(path: &Path, faces: usize) -> Result<Self> {
        let io = |e| Error::io(path, e);
        let (mut file, header) = npy::open(path)?;
        if !matches!((header.kind, header.size), (b'b' | b'u', 1)) {
            let found = format!("numbers of kind '{}{}'", char::from(header.kind), header.size);
            return Err(Error::binary(path, 0, found, "booleans or bytes ('|b1', '|u1')"));
        }
        let frames = match *header.shape {
            [n] if n == faces as u64 => None,
            [frames, n] if n == faces as u64 => Some(usize::try_from(frames).unwrap_or(usize::MAX)),
            _ => {
                let found = format!("an array of shape {:?}", header.shape);
                return Err(Error::binary(path, 0, found, format!("[{faces}] or [frame, {faces}]")));
            }
        };
        let end = header.count().and_then(|n| n.checked_add(header.data_offset as u64));
        let length = file.seek(SeekFrom::End(0)).map_err(io)?;
        if end.is_none_or(|end| length < end) {
            let expected = format!("{} frames of {faces} faces", frames.unwrap_or(1));
            return Err(Error::binary(path, length as usize, "the end of the file", expected));
        }
        Ok(Self { path: path.into(), file, header, faces, frames, bytes: Vec::new() })
    }

    /// Number of frames; none where one mask is for all of them.
    pub fn frames(&self) -> Option<usize> {
        self.frames
    }

    /// Reads a frame's mask (counted from 0) into `mask`, replacing what was there.
    ///
    /// # Errors
    /// A frame that is not there, a file that cannot be read any more.
    pub fn read(&mut self, frame: usize, mask: &mut Vec<bool>) -> Result<()> {
        let frames = self.frames.unwrap_or(1);
        let frame = if self.frames.is_some() { frame } else { 0 };
        if frame >= frames {
            return Err(Error::invalid(format_args!(
                "{}: there is no frame {frame}: it has {frames}",
                self.path.display()
            )));
        }
        // With the frames' axis running fastest, a frame's bytes lie all over the file.
        let scattered = self.header.fortran_order && frames > 1;
        let (first, count) =
            if scattered { (0, frames * self.faces) } else { (frame * self.faces, self.faces) };
        if !scattered || self.bytes.len() != count {
            let io = |e| Error::io(&self.path, e);
            self.bytes.resize(count, 0);
            self.file.seek(SeekFrom::Start((self.header.data_offset + first) as u64)).map_err(io)?;
            self.file.read_exact(&mut self.bytes).map_err(io)?;
        }
        mask.clear();
        let (begin, step) = if scattered { (frame, frames) } else { (0, 1) };
        mask.extend(self.bytes.iter().skip(begin).step_by(step).map(|b| *b != 0));
        Ok(())
    }
}
