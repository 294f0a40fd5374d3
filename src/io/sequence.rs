//! Cloth over time as MADYPG stores it (`.bin`, little-endian): triangles with material coordinates, and positions a frame.
//!
//! A *size* is one byte below 0x80; else two, whose lower 14 bits are the number, most significant byte first, if bit 6 of
//! the first is clear; else these 14 bits are the upper half of a number whose lower half is a u16 after them. A *matrix* is
//! u32 rows, u32 columns, and 4-byte values row by row. The file is the size of its frames, then for each frame
//!
//! | what | type |
//! |---|---|
//! | positions V | matrix `[vertex, 3]` f32 |
//! | faces F | matrix `[face, 3]` u32, into V |
//! | material coordinates U | matrix `[material vertex, 2]` f32 |
//! | faces Fms | matrix `[face, 3]` u32, into U, corner by corner those of F |
//! | obstacles' motions | a size, and so many of: f32 scale, matrix of a translation, matrix of an angle and an axis |
//! | obstacles' vertices, faces | a size and so many matrices, twice |
//!
//! Matrices without rows are those of the frame before. What is said of obstacles is passed over, and known from
//! descriptions only: no file at hand has any.

mod scan;
mod write;

pub use write::write;

use crate::mesh::MaterialMesh;
use crate::{Error, Result};
use glam::{DVec2, DVec3};
use scan::{Matrix, Scan};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The matrices of a frame and their columns.
const MATRICES: [(&str, u32); 4] =
    [("positions", 3), ("faces", 3), ("material coordinates", 2), ("material faces", 3)];

/// Bytes of a frame in which nothing changes.
const LEAST_FRAME: u64 = 4 * 8 + 3;

/// An open sequence: its mesh in memory, its frames on disk.
#[derive(Debug)]
pub struct Sequence {
    path: PathBuf,
    file: File,
    mesh: MaterialMesh,
    /// `[frame]` where its positions start in the file.
    frames: Vec<u64>,
    /// Positions as the file has them.
    bytes: Vec<u8>,
}

impl Sequence {
    /// Opens a sequence: reads the first frame and walks through the others without reading their numbers.
    ///
    /// # Errors
    /// A file that cannot be read; by byte offset, one that ends early or late, matrices of another shape, faces with corners
    /// that are not there, numbers that are not finite, and frames that change faces or material coordinates.
    pub fn open(path: &Path) -> Result<Self> {
        let mut scan = Scan::open(path)?;
        let count = scan.size("the number of frames")?;
        let most = scan.left() / LEAST_FRAME;
        if count == 0 || count > most {
            let expected = format!("1 to {most} in a file of {} bytes", scan.length());
            return Err(Error::binary(path, 0, format_args!("{count} frames"), expected));
        }
        let mut first: [Vec<u8>; 4] = Default::default();
        let mut shapes = [Matrix::default(); 4];
        let mut frames = Vec::new();
        for frame in 0..count {
            for (kind, (name, columns)) in MATRICES.into_iter().enumerate() {
                let matrix = scan.matrix(name)?;
                let unchanged = frame > 0 && matrix.rows == 0;
                if !unchanged && (matrix.rows == 0 || matrix.columns != columns) {
                    let found = format!("{name} of shape [{}, {}]", matrix.rows, matrix.columns);
                    return Err(Error::binary(path, matrix.at, found, format_args!("rows of {columns}")));
                }
                if frame == 0 {
                    first[kind] = scan.bytes(matrix.bytes(), name)?;
                    shapes[kind] = matrix;
                } else if kind > 0 && !unchanged {
                    let same =
                        matrix.rows == shapes[kind].rows && scan.bytes(matrix.bytes(), name)? == first[kind];
                    if !same {
                        let found = format!("other {name} in frame {frame}");
                        let expected = "those of frame 0: only positions may change";
                        return Err(Error::binary(path, matrix.at, found, expected));
                    }
                } else if kind == 0 {
                    if !unchanged && matrix.rows != shapes[0].rows {
                        let found = format!("{} vertices in frame {frame}", matrix.rows);
                        let expected = format!("{} as in frame 0", shapes[0].rows);
                        return Err(Error::binary(path, matrix.at, found, expected));
                    }
                    scan.skip(matrix.bytes(), name)?;
                }
                if kind == 0 {
                    let before = frames.last().copied();
                    frames.push(before.filter(|_| unchanged).unwrap_or(matrix.data_at()));
                }
            }
            scan.obstacles()?;
        }
        if scan.left() > 0 {
            let found = format!("{} bytes after the last of {count} frames", scan.left());
            return Err(Error::binary(path, scan.at(), found, "the end of the file"));
        }
        let mesh = mesh(path, &first, &shapes)?;
        Ok(Self { path: path.into(), file: scan.into_file(), mesh, frames, bytes: Vec::new() })
    }

    /// The mesh, with the positions of frame 0.
    pub fn mesh(&self) -> &MaterialMesh {
        &self.mesh
    }

    /// Number of frames, at least one.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Number of vertices of each frame.
    pub fn vertex_count(&self) -> usize {
        self.mesh.positions.len()
    }

    /// Reads a frame (counted from 0, in any order) into `positions`, metres, replacing what was there.
    ///
    /// # Errors
    /// A frame that is not there; by byte offset, positions that are not finite, and a file that has become shorter.
    pub fn read(&mut self, frame: usize, positions: &mut Vec<DVec3>) -> Result<()> {
        positions.clear();
        let Some(&at) = self.frames.get(frame) else {
            return Err(Error::invalid(format_args!(
                "{}: there is no frame {frame}: frames are 0 to {}",
                self.path.display(),
                self.len() - 1
            )));
        };
        self.bytes.resize(self.vertex_count() * 12, 0);
        let read = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(&mut self.bytes));
        read.map_err(|e| Error::io(&self.path, e))?;
        positions.reserve(self.vertex_count());
        for vertex in 0..self.vertex_count() {
            let numbers = floats(&self.path, &self.bytes, vertex, at)?;
            positions.push(DVec3::from_array(numbers));
        }
        Ok(())
    }
}

/// A row of floats; `at` is where the first row starts in the file.
fn floats<const N: usize>(path: &Path, bytes: &[u8], row: usize, at: u64) -> Result<[f64; N]> {
    let words = bytes[row * 4 * N..][..4 * N].as_chunks::<4>().0;
    let numbers = std::array::from_fn(|k| f32::from_le_bytes(words[k]) as f64);
    match numbers.iter().position(|x| !x.is_finite()) {
        None => Ok(numbers),
        Some(bad) => {
            let at = at as usize + (row * N + bad) * 4;
            Err(Error::binary(path, at, format_args!("{} in row {row}", numbers[bad]), "a finite number"))
        }
    }
}

/// The mesh of frame 0.
fn mesh(path: &Path, first: &[Vec<u8>; 4], shapes: &[Matrix; 4]) -> Result<MaterialMesh> {
    let [v, f, u, fms] = first;
    let rows = shapes.map(|matrix| matrix.rows);
    if rows[3] != rows[1] {
        let found = format!("{} material faces", rows[3]);
        return Err(Error::binary(path, shapes[3].at, found, format_args!("{} as there are faces", rows[1])));
    }
    let triangles = |kind: usize, bytes: &[u8], vertices: u32| -> Result<Vec<[u32; 3]>> {
        let words = bytes.as_chunks::<4>().0;
        if let Some(bad) = words.iter().position(|w| u32::from_le_bytes(*w) >= vertices) {
            let found = format!("{} in {}", u32::from_le_bytes(words[bad]), MATRICES[kind].0);
            let at = shapes[kind].data_at() as usize + bad * 4;
            return Err(Error::binary(path, at, found, format_args!("a number below {vertices}")));
        }
        Ok(words.as_chunks::<3>().0.iter().map(|corners| corners.map(u32::from_le_bytes)).collect())
    };
    let place = |row: u32| floats(path, v, row as usize, shapes[0].data_at()).map(DVec3::from_array);
    let uv = |row: u32| floats(path, u, row as usize, shapes[2].data_at()).map(DVec2::from_array);
    Ok(MaterialMesh {
        positions: (0..rows[0]).map(place).collect::<Result<_>>()?,
        uvs: (0..rows[2]).map(uv).collect::<Result<_>>()?,
        faces: triangles(1, f, rows[0])?,
        face_uvs: triangles(3, fms, rows[2])?,
        sources: Vec::new(),
    })
}
