//! `.knit` patterns and what they refer to.

use super::text::read_bytes;
use crate::design::chart::Chart;
use crate::design::{Files, Knitted, Settings, knit};
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// Reads a pattern and works it.
///
/// # Errors
/// As [`knit`]; and files that cannot be read.
pub fn knit_file(path: &Path, settings: &Settings) -> Result<Knitted> {
    let bytes = read_bytes(path)?;
    let text = std::str::from_utf8(&bytes).map_err(|e| {
        let (line, column) = super::text::line_and_column(&bytes, e.valid_up_to());
        Error::input(path, line, column, "bytes that are not UTF-8", "a text file")
    })?;
    knit(path, text, settings, &Beside::new(path))
}

/// Files named in a pattern, beside it.
#[derive(Clone, Debug)]
pub struct Beside {
    folder: PathBuf,
}

impl Beside {
    /// Those of a pattern's file.
    pub fn new(pattern: &Path) -> Self {
        Self { folder: pattern.parent().map(Path::to_path_buf).unwrap_or_default() }
    }
}

impl Files for Beside {
    fn chart(&self, file: &str, colour: &mut dyn FnMut([u8; 3]) -> u16) -> Result<Chart> {
        let path = self.folder.join(file);
        super::chart::read_file(&path)?.chart(&path, colour)
    }
}
