//! Yarn models, a pattern and its displacements: a folder of their own text and `.npy` files, or one `.npz`.
//!
//! The folder holds `pyp` ([`super::pyp`]), `sxsasy/axes.txt` and `sxsasy/data.npy` ([`super::strain_table`]). The `.npz` is
//! laid out by [`write_npz`].

mod npz;

pub use npz::{ARRAYS, write_npz};

use super::output::OutputFolder;
use super::text::extension;
use super::{pyp, strain_table};
use crate::pattern::YarnModel;
use crate::{Error, Result};
use std::path::Path;

/// The pattern's file within a folder.
const PATTERN: &str = "pyp";
/// The folder of displacements within a folder.
const TABLE: &str = "sxsasy";

/// Reads a model: a folder, or an `.npz`.
///
/// # Errors
/// A model that is not whole is refused: with the file, and the place in it where there is one.
pub fn read(path: &Path) -> Result<YarnModel> {
    let kind = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
    if kind.is_dir() {
        read_dir(path)
    } else if extension(path) == "npz" {
        npz::read(path)
    } else {
        let expected = format!("a yarn model: a folder with '{PATTERN}' and '{TABLE}', or an .npz");
        Err(Error::invalid(format_args!(
            "{}: found another kind of file, expected {expected}",
            path.display()
        )))
    }
}

fn read_dir(path: &Path) -> Result<YarnModel> {
    let pattern = pyp::read_file(&path.join(PATTERN))?;
    let folder = path.join(TABLE);
    let table = strain_table::read(&folder)?;
    let (found, expected) = (table.vertex_count(), pattern.vertex_count());
    if found != expected {
        let found = format!("displacements of {found} vertices");
        let expected = format!("{expected} as '{PATTERN}' has");
        return Err(Error::binary(&folder.join(strain_table::FILES[1]), 0, found, expected));
    }
    YarnModel::new(pattern, table).map_err(|e| at(path, &e))
}

/// An error of a model, with its file.
fn at(path: &Path, error: &Error) -> Error {
    Error::invalid(format_args!("{}: {error}", path.display()))
}

/// Writes a model as a folder that must not be there yet. It reads back to the bit.
///
/// # Errors
/// The system's.
pub fn write_dir(path: &Path, model: &YarnModel) -> Result<()> {
    let out = OutputFolder::create(path)?;
    out.put(PATTERN, pyp::write(&model.pattern).as_bytes())?;
    for (name, bytes) in strain_table::FILES.iter().zip(strain_table::write(&model.table)) {
        out.put(&format!("{TABLE}/{name}"), &bytes)?;
    }
    out.commit()
}
