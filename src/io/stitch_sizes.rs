//! Factors of natural sizes by stitch type, for `relax-mesh --sizes`:
//!
//! ```json
//! { "tuck+": { "course": 1.2, "wale": 0.8 }, "slip+": { "wale": 0.9 } }
//! ```
//!
//! A factor that is not given is 1. Names are those of stitch types, without labels.

use super::json::explain;
use super::text::line_and_column;
use crate::{Error, Result};
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// Factors `[along the course, along the wale]` by name.
pub type StitchSizes = BTreeMap<String, [f64; 2]>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    course: Option<Factor>,
    wale: Option<Factor>,
}

struct Factor(f64);

impl<'de> Deserialize<'de> for Factor {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        let x = f64::deserialize(from)?;
        if (0.01..=100.0).contains(&x) {
            Ok(Self(x))
        } else {
            Err(serde::de::Error::custom(format_args!("factor {x}, expected a number from 0.01 to 100")))
        }
    }
}

/// A map in which no name comes twice.
struct Sizes(StitchSizes);

impl<'de> Deserialize<'de> for Sizes {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct Names;
        impl<'de> Visitor<'de> for Names {
            type Value = Sizes;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an object: the names of stitch types and their factors")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Sizes, A::Error> {
                let mut sizes = StitchSizes::new();
                while let Some(name) = map.next_key::<String>()? {
                    if sizes.contains_key(&name) {
                        return Err(serde::de::Error::custom(format_args!(
                            "'{name}' a second time, expected each name once"
                        )));
                    }
                    let entry: Entry = map.next_value()?;
                    let factor = |f: Option<Factor>| f.map_or(1.0, |f| f.0);
                    sizes.insert(name, [factor(entry.course), factor(entry.wale)]);
                }
                Ok(Sizes(sizes))
            }
        }
        from.deserialize_map(Names)
    }
}

/// Reads a file of factors.
///
/// # Errors
/// A file that cannot be read, or that is not as above: with line and column.
pub fn read_file(path: &Path) -> Result<StitchSizes> {
    read(path, &super::text::read_bytes(path)?)
}

/// Reads factors; `path` is for messages.
///
/// # Errors
/// Text that is not as above: with line and column.
pub fn read(path: &Path, bytes: &[u8]) -> Result<StitchSizes> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let (line, column) = line_and_column(bytes, e.valid_up_to());
        Error::input(path, line, column, "bytes that are not UTF-8", "a JSON text file")
    })?;
    let sizes: Sizes = serde_json::from_str(text).map_err(|e| {
        let (line, column) = (e.line().max(1), e.column().max(1));
        let next =
            text.lines().nth(line - 1).and_then(|l| l.get(column - 1..)).and_then(|l| l.chars().next());
        let message = e.to_string();
        let what = message.rsplit_once(" at line ").map_or(message.as_str(), |(what, _)| what);
        let (found, expected) = match what.split_once(", expected ") {
            Some((found, expected)) if e.is_data() => (found.to_string(), expected.to_string()),
            _ => explain(&e, next, "stitch sizes"),
        };
        Error::input(path, line, column, found, expected)
    })?;
    Ok(sizes.0)
}
