//! Charts as JSON: `{"format": "knotmesh-chart", "version": 1, "colors": {...}, "key": {...}, "rows": [...]}`; rows as in
//! text, the top one first.

use super::key::Key;
use super::{Drawing, SymbolRow, resolve};
use crate::design::token::Place;
use crate::io::json::explain;
use crate::io::text::line_and_column;
use crate::{Error, Result};
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::value::RawValue;
use std::path::Path;

/// The `format` field of chart files.
pub const FORMAT: &str = "knotmesh-chart";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File<'a> {
    #[serde(borrow)]
    format: &'a RawValue,
    #[serde(borrow)]
    version: &'a RawValue,
    #[serde(borrow, default)]
    colors: Pairs<'a>,
    #[serde(borrow, default)]
    key: Pairs<'a>,
    #[serde(borrow)]
    rows: Vec<&'a RawValue>,
}

/// An object's entries, equal names among them.
#[derive(Default)]
struct Pairs<'a>(Vec<(String, &'a RawValue)>);

impl<'de: 'a, 'a> Deserialize<'de> for Pairs<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = Vec<(String, &'de RawValue)>;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(entries)
            }
        }
        deserializer.deserialize_map(Entries).map(Pairs)
    }
}

/// Reads a chart.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Drawing> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let (line, column) = line_and_column(bytes, e.valid_up_to());
        Error::input(path, line, column, "bytes that are not UTF-8", "a JSON text file")
    })?;
    let file: File = serde_json::from_str(text).map_err(|e| {
        let (line, column) = (e.line().max(1), e.column().max(1));
        let next =
            text.lines().nth(line - 1).and_then(|l| l.get(column - 1..)).and_then(|l| l.chars().next());
        let (found, expected) = explain(&e, next, "a chart");
        Error::input(path, line, column, found, expected)
    })?;
    // Raw values borrow from the file's text, so their places are known.
    let start = |raw: &RawValue| raw.get().as_ptr() as usize - text.as_ptr() as usize;
    let error = |at: usize, found: String, expected: String| {
        let (line, column) = line_and_column(bytes, at);
        Error::input(path, line, column, found, expected)
    };
    let string = |raw: &RawValue, what: &str| {
        serde_json::from_str::<String>(raw.get())
            .map_err(|_| error(start(raw), raw.get().chars().take(40).collect(), what.into()))
    };
    if string(file.format, "the format as text")? != FORMAT {
        return Err(error(start(file.format), file.format.get().into(), format!("\"{FORMAT}\"")));
    }
    if file.version.get() != "1" {
        return Err(error(start(file.version), file.version.get().into(), "version 1".into()));
    }
    let mut key = Key::default();
    for (name, raw) in &file.colors.0 {
        let rgb = string(raw, "a colour as text, such as \"#c0392b\"")?;
        key.name_colour(name, &rgb).map_err(|(found, expected)| error(start(raw), found, expected))?;
    }
    for (symbol, raw) in &file.key.0 {
        let meaning = string(raw, "a stitch, a colour, or none, as text")?;
        key.define(symbol, &meaning).map_err(|(_, found, expected)| error(start(raw), found, expected))?;
    }
    let mut texts = Vec::with_capacity(file.rows.len());
    for raw in &file.rows {
        texts.push((string(raw, "a row as text")?, *raw));
    }
    if texts.is_empty() {
        return Err(Error::input(path, 1, 1, "a chart without rows", "one or more in \"rows\""));
    }
    let rows: Vec<SymbolRow> = texts
        .iter()
        .map(|(row, raw)| {
            let (line, column) = line_and_column(bytes, start(raw));
            let offsets = offsets(raw.get(), row);
            let places = Box::new(move |at: usize| Place {
                line: line as u32,
                column: (column + offsets.get(at).copied().unwrap_or(0)) as u32,
            });
            SymbolRow { text: row, places }
        })
        .collect();
    if let Some((k, _)) = texts.iter().enumerate().find(|(_, (t, _))| t.trim().is_empty()) {
        let number = texts.len() - k;
        return Err(error(start(texts[k].1), format!("row {number} without stitches"), "one or more".into()));
    }
    Ok(Drawing { rows: resolve(path, &key, &rows)? })
}

/// Where each byte of a string stands in its JSON text, in which some characters are escaped.
fn offsets(raw: &str, text: &str) -> Vec<usize> {
    let (bytes, mut at) = (raw.as_bytes(), 1);
    let mut found = Vec::with_capacity(text.len());
    for c in text.chars() {
        found.resize(found.len() + c.len_utf8(), at);
        at += match (bytes.get(at), bytes.get(at + 1)) {
            (Some(b'\\'), Some(b'u')) if c.len_utf16() == 2 => 12,
            (Some(b'\\'), Some(b'u')) => 6,
            (Some(b'\\'), _) => 2,
            _ => c.len_utf8(),
        };
    }
    found
}
