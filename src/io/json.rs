//! Strict JSON: errors of the parser as line, column, what was found and what was expected.

use super::text::line_and_column;
use crate::{Error, Result};
use serde::Deserialize;
use std::path::Path;

/// Reads a whole file's text as one value; `what` says what the file should hold ("a scene").
///
/// # Errors
/// Text that is not UTF-8, not JSON, or not such a value, at its line and column.
pub fn read<'a, T: Deserialize<'a>>(path: &Path, bytes: &'a [u8], what: &str) -> Result<T> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let (line, column) = line_and_column(bytes, e.valid_up_to());
        Error::input(path, line, column, "bytes that are not UTF-8", "a JSON text file")
    })?;
    serde_json::from_str(text).map_err(|e| {
        let (line, column) = (e.line().max(1), e.column().max(1));
        let next =
            text.lines().nth(line - 1).and_then(|l| l.get(column - 1..)).and_then(|l| l.chars().next());
        let (found, expected) = explain(&e, next, what);
        Error::input(path, line, column, found, expected)
    })
}

/// A JSON error as what was found and what was expected; `next` is the character at its place, `what` the whole.
pub(super) fn explain(error: &serde_json::Error, next: Option<char>, what: &str) -> (String, String) {
    let message = error.to_string();
    let said = message.rsplit_once(" at line ").map_or(message.as_str(), |(said, _)| said);
    if let Some(part) = said.strip_prefix("EOF while parsing ") {
        return ("the end of the file".into(), format!("the rest of {part}"));
    }
    if let Some(expected) = said.strip_prefix("expected ") {
        return (next.map_or("the end of the line".into(), |c| format!("'{c}'")), expected.into());
    }
    let found = said.strip_prefix("invalid type: ").or(said.strip_prefix("invalid value: ")).unwrap_or(said);
    match found.rsplit_once(", expected ") {
        Some((found, expected)) => (found.into(), expected.into()),
        None => (found.into(), format!("{what} as JSON")),
    }
}
