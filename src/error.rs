//! The error type of the whole crate: every message is one line and says where, what and what to do.

use std::fmt::Display;
use std::path::{Path, PathBuf};

/// What can go wrong between files in and files out.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An input file is malformed. For binary formats the line is 1 and the column is the byte offset + 1.
    #[error("{}:{line}:{column}: found {found}, expected {expected}", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// Column (in bytes), counted from 1.
        column: usize,
        /// What was found there.
        found: String,
        /// What would have been right.
        expected: String,
    },
    /// The operating system refused to read or write a file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's own words.
        source: std::io::Error,
    },
    /// The inputs are each well-formed but do not fit together, or an option's value is out of range.
    #[error("{0}")]
    Invalid(String),
}

/// Shorthand for results of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// A malformed input at a line and column, both counted from 1.
    pub fn input(
        path: &Path,
        line: usize,
        column: usize,
        found: impl Display,
        expected: impl Display,
    ) -> Self {
        let one_line = |text: String| {
            let text: String = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
            if text.chars().count() > 160 { text.chars().take(157).collect::<String>() + "..." } else { text }
        };
        Error::Input {
            path: path.into(),
            line,
            column,
            found: one_line(found.to_string()),
            expected: one_line(expected.to_string()),
        }
    }

    /// A malformed binary input at a byte offset (reported as line 1, column offset + 1).
    pub fn binary(path: &Path, offset: usize, found: impl Display, expected: impl Display) -> Self {
        Self::input(path, 1, offset + 1, found, expected)
    }

    /// A failed read or write of `path`.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        Error::Io { path: path.into(), source }
    }

    /// Inputs that do not fit together.
    pub fn invalid(message: impl Display) -> Self {
        Error::Invalid(message.to_string())
    }
}
