//! The project's own template files (JSON): reading, and printing templates fully expanded.
//!
//! A file holds one template or a list. Points are `{"edge", "along", "z"}`, `{"knot", "contact", "z"}`,
//! `{"knot", "control", "z"}` or `{"at": [u, v], "z"}`; a template may instead `derive` from another.

use crate::io::json::explain;
use crate::io::text::line_and_column;
use crate::template::derive::Operation;
use crate::template::{Knot, Place, Strand, Template, TemplatePoint};
use crate::{Error, Result};
use glam::DVec2;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use std::path::Path;

/// The `format` field of template files.
pub const FORMAT: &str = "knotmesh-template";

/// A template file's entry: a template, or how to derive one.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Line and column where the entry starts, for messages.
    pub place: (usize, usize),
    /// What it says.
    pub kind: EntryKind,
}

/// What an entry of a template file says.
#[derive(Clone, Debug)]
pub enum EntryKind {
    /// The template itself, checked for form but not yet by [`crate::template::check::check`].
    Full(Box<Template>),
    /// Derived from another.
    Derived {
        /// Name of the new template.
        name: String,
        /// Labels that the operations must lead to.
        labels: Vec<String>,
        /// Key of the source.
        from: String,
        /// The operations in order.
        by: Vec<Operation>,
    },
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct FileTemplate {
    #[serde(skip_serializing_if = "Option::is_none")]
    format: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    version: Option<u32>,
    name: String,
    edges: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    corners: Option<Vec<[f64; 2]>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    yarn_radius: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    knots: Option<Vec<FileKnot>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    yarns: Option<Vec<Vec<FilePoint>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    derive: Option<FileDerive>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct FileKnot {
    center: [f64; 2],
    tilt: f64,
    half_length: f64,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct FileDerive {
    from: String,
    by: Vec<String>,
}

#[derive(Deserialize, Serialize, Default)]
#[serde(deny_unknown_fields)]
struct FilePoint {
    #[serde(skip_serializing_if = "Option::is_none")]
    edge: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    along: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    knot: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contact: Option<i32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    control: Option<i32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    at: Option<[f64; 2]>,
    z: f64,
}

/// Reads the entries of a template file.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Vec<Entry>> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let (line, column) = line_and_column(bytes, e.valid_up_to());
        Error::input(path, line, column, "bytes that are not UTF-8", "a JSON text file")
    })?;
    let json_error = |e: serde_json::Error, start: usize| {
        let (line, column) = line_and_column(bytes, start);
        // Lines and columns of an entry are counted from its own start.
        let column = if e.line() <= 1 { column + e.column().saturating_sub(1) } else { e.column().max(1) };
        let line = line + e.line().max(1) - 1;
        let next =
            text.lines().nth(line - 1).and_then(|l| l.get(column - 1..)).and_then(|l| l.chars().next());
        let (found, expected) = explain(&e, next, "a template");
        Error::input(path, line, column, found, expected)
    };
    let raw: Vec<&RawValue> = if text.trim_start().starts_with('[') {
        serde_json::from_str(text).map_err(|e| json_error(e, 0))?
    } else {
        vec![serde_json::from_str(text).map_err(|e| json_error(e, 0))?]
    };
    raw.into_iter()
        .map(|entry| {
            // The entry borrows from the file's text, so its place is known.
            let start = entry.get().as_ptr() as usize - text.as_ptr() as usize;
            let place = line_and_column(bytes, start);
            let file: FileTemplate = serde_json::from_str(entry.get()).map_err(|e| json_error(e, start))?;
            let kind = convert(file)
                .map_err(|(found, expected)| Error::input(path, place.0, place.1, found, expected))?;
            Ok(Entry { place, kind })
        })
        .collect()
}

fn convert(file: FileTemplate) -> Result<EntryKind, (String, String)> {
    let fail = |found: String, expected: &str| (found, expected.to_string());
    if let Some(format) = file.format.as_deref().filter(|f| *f != FORMAT) {
        return Err(fail(format!("format '{format}'"), &format!("'{FORMAT}'")));
    }
    if let Some(version) = file.version.filter(|v| *v != 1) {
        return Err(fail(format!("version {version}"), "version 1"));
    }
    let words = std::iter::once(&file.name).chain(&file.edges);
    if let Some(word) =
        words.into_iter().find(|w| w.is_empty() || w.contains(|c: char| c.is_whitespace() || c.is_control()))
    {
        return Err(fail(format!("the name or label '{word}'"), "a word without blanks"));
    }
    if let Some(derive) = file.derive {
        let by = derive.by.iter().map(|name| {
            Operation::from_name(name)
                .ok_or_else(|| fail(format!("operation '{name}'"), "mirror-x, mirror-z or reverse-yarn"))
        });
        let by = by.collect::<Result<Vec<_>, _>>()?;
        if (1..by.len()).any(|i| by[..i].contains(&by[i])) {
            return Err(fail("an operation given twice".into(), "each operation at most once"));
        }
        return Ok(EntryKind::Derived { name: file.name, labels: file.edges, from: derive.from, by });
    }
    let missing =
        |field: &str| fail(format!("no '{field}'"), "corners, yarn_radius, knots and yarns, or derive");
    let corners = file.corners.ok_or_else(|| missing("corners"))?;
    let knots = file.knots.ok_or_else(|| missing("knots"))?;
    let yarns = file.yarns.ok_or_else(|| missing("yarns"))?;
    let knots = knots.iter().map(|k| Knot {
        center: k.center.into(),
        direction: DVec2::new(k.tilt.cos(), k.tilt.sin()),
        half_length: k.half_length,
    });
    let strands = yarns.iter().map(|yarn| strand(yarn)).collect::<Result<Vec<_>, _>>()?;
    Ok(EntryKind::Full(Box::new(Template {
        name: file.name,
        labels: file.edges,
        corners: corners.into_iter().map(DVec2::from).collect(),
        yarn_radius: file.yarn_radius.ok_or_else(|| missing("yarn_radius"))?,
        knots: knots.collect(),
        strands,
        polylines: None,
        notes: Vec::new(),
    })))
}

fn strand(points: &[FilePoint]) -> Result<Strand, (String, String)> {
    let mut strand = Strand::new();
    for (i, p) in points.iter().enumerate() {
        let sign = |s: i32| match s {
            1 | -1 => Ok(f64::from(s)),
            _ => Err((format!("sign {s} at point {i} of a yarn"), "1 or -1".to_string())),
        };
        let place = match (p.edge, p.along, p.knot, p.contact, p.control, p.at) {
            (Some(edge), Some(along), None, None, None, None) => {
                // A fraction of exactly 0 or 1 marks the end of the yarn, as in `.sf`.
                if (along == 0.0 || along == 1.0) && (i == 0 || i + 1 == points.len()) {
                    continue;
                }
                Place::Boundary { edge, along }
            }
            (None, None, Some(knot), Some(s), None, None) => Place::Contact { knot, sign: sign(s)? },
            (None, None, Some(knot), None, Some(s), None) => Place::Control { knot, sign: sign(s)? },
            (None, None, None, None, None, Some(at)) => Place::Free { at: at.into() },
            _ => {
                return Err((
                    format!("point {i} of a yarn with another set of fields"),
                    "edge and along, knot and contact, knot and control, or at".into(),
                ));
            }
        };
        strand.push(TemplatePoint { place, z: p.z });
    }
    Ok(strand)
}

/// A template fully expanded, in the same schema.
pub fn to_value(template: &Template) -> serde_json::Value {
    let point = |p: &TemplatePoint| {
        let base = FilePoint { z: p.z, ..Default::default() };
        match p.place {
            Place::Boundary { edge, along } => FilePoint { edge: Some(edge), along: Some(along), ..base },
            Place::Contact { knot, sign } => {
                FilePoint { knot: Some(knot), contact: Some(sign as i32), ..base }
            }
            Place::Control { knot, sign } => {
                FilePoint { knot: Some(knot), control: Some(sign as i32), ..base }
            }
            Place::Free { at } => FilePoint { at: Some(at.into()), ..base },
        }
    };
    let file = FileTemplate {
        format: Some(FORMAT.into()),
        version: Some(1),
        name: template.name.clone(),
        edges: template.labels.clone(),
        corners: Some(template.corners.iter().map(|c| (*c).into()).collect()),
        yarn_radius: Some(template.yarn_radius),
        knots: Some(
            template
                .knots
                .iter()
                .map(|k| FileKnot {
                    center: k.center.into(),
                    tilt: k.direction.y.atan2(k.direction.x),
                    half_length: k.half_length,
                })
                .collect(),
        ),
        yarns: Some(template.strands.iter().map(|s| s.iter().map(point).collect()).collect()),
        derive: None,
    };
    serde_json::to_value(file).expect("templates hold finite numbers")
}
