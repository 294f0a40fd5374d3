//! Derived faces: each is made as soon as its source is there, in whatever order the file has them.

use super::{PlainPoint, PlainTemplate};
use crate::template::derive::{
    Operation, mirror_x_corner, mirror_x_edge, mirror_x_labels, mirror_x_run, reverse_yarn_labels,
};
use crate::{Error, Result};
use glam::{DVec2, DVec3};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// A `face` or `derive` of the file.
pub(super) struct Entry {
    /// Line and column of its name.
    pub(super) place: (usize, usize),
    pub(super) derivation: Option<Derivation>,
    /// None until derived.
    pub(super) face: Option<PlainTemplate>,
}

/// What a `derive` line says.
pub(super) struct Derivation {
    pub(super) name: String,
    /// Empty if the line leaves them out.
    pub(super) labels: Vec<String>,
    pub(super) labels_column: usize,
    pub(super) operations: Vec<Operation>,
    pub(super) source: String,
    pub(super) source_column: usize,
}

pub(super) fn resolve(path: &Path, mut entries: Vec<Entry>) -> Result<Vec<PlainTemplate>> {
    let mut waiting: HashMap<String, Vec<usize>> = HashMap::new();
    let mut done = Vec::new();
    for (n, entry) in entries.iter().enumerate() {
        match &entry.derivation {
            Some(derivation) => waiting.entry(derivation.source.clone()).or_default().push(n),
            None => done.push(n),
        }
    }
    while let Some(n) = done.pop() {
        let Some(source) = entries[n].face.clone() else { continue };
        for waiter in waiting.remove(&source.key()).unwrap_or_default() {
            let entry = &mut entries[waiter];
            let Some(derivation) = &entry.derivation else { continue };
            entry.face = Some(derive(path, entry.place, derivation, source.clone())?);
            done.push(waiter);
        }
    }
    if entries.iter().any(|entry| entry.face.is_none()) {
        return Err(unresolved(path, &entries));
    }
    let mut keys: HashMap<String, usize> = HashMap::new();
    let mut faces = Vec::with_capacity(entries.len());
    for Entry { place: (line, column), face, .. } in entries {
        faces.extend(face);
        let key = faces[faces.len() - 1].key();
        if let Some(first) = keys.insert(key.clone(), line) {
            let found = format_args!("'{key}', which line {first} has already");
            return Err(Error::input(path, line, column, found, "each name with its labels once"));
        }
    }
    Ok(faces)
}

/// Some faces cannot be derived: because a source is missing, or because they derive from each other.
fn unresolved(path: &Path, entries: &[Entry]) -> Error {
    let open = || entries.iter().filter(|entry| entry.face.is_none());
    let mut by_key: HashMap<String, &Entry> = HashMap::new();
    for entry in open() {
        if let Some(d) = &entry.derivation {
            let key = std::iter::once(&d.name).chain(&d.labels).map(String::as_str).collect::<Vec<_>>();
            by_key.entry(key.join(" ")).or_insert(entry);
        }
    }
    let mut visited = HashSet::new();
    let mut next = open().next();
    while let Some(entry) = next {
        let Some(d) = &entry.derivation else { break };
        let error = |found: String, expected: &str| {
            Error::input(path, entry.place.0, d.source_column, found, expected)
        };
        if !visited.insert(entry.place) {
            return error(
                format!("'{}', which derives from this face", d.source),
                "a source without a cycle",
            );
        }
        next = by_key.get(&d.source).copied();
        if next.is_none() {
            return error(format!("'{}'", d.source), "the name and all labels of a face of this file");
        }
    }
    Error::invalid(format_args!("{}: a derived face has no source", path.display()))
}

fn derive(
    path: &Path,
    place: (usize, usize),
    derivation: &Derivation,
    mut face: PlainTemplate,
) -> Result<PlainTemplate> {
    for operation in &derivation.operations {
        match operation {
            Operation::MirrorX => mirror_x(&mut face).ok_or_else(|| {
                let found = format_args!("'{}', whose edges are all alike", derivation.source);
                let expected = "a face with an edge unlike edge 0 for mirror-x";
                Error::input(path, place.0, derivation.source_column, found, expected)
            })?,
            Operation::MirrorZ => mirror_z(&mut face),
            Operation::ReverseYarn => face.labels = reverse_yarn_labels(&face.labels),
        }
    }
    face.name.clone_from(&derivation.name);
    if !derivation.labels.is_empty() && derivation.labels != face.labels {
        let found = format_args!("'{}'", derivation.labels.join(" "));
        let expected = format!("'{}', the labels that result", face.labels.join(" "));
        return Err(Error::input(path, place.0, derivation.labels_column, found, expected));
    }
    Ok(face)
}

fn mirror_x(face: &mut PlainTemplate) -> Option<()> {
    let run = mirror_x_run(&face.labels)?;
    let count = face.labels.len();
    face.labels = mirror_x_labels(&face.labels, run);
    face.corners = (0..count)
        .map(|corner| {
            let source = face.corners[mirror_x_corner(corner, run, count)];
            DVec2::new(negated(source.x), source.y)
        })
        .collect();
    for point in face.strands.iter_mut().flatten() {
        match point {
            PlainPoint::Boundary { edge, along, .. } => {
                *edge = mirror_x_edge(*edge as usize, run, count) as u32;
                // A fraction too small for the subtraction must not become a corner.
                *along = (1.0 - *along).min(1.0 - f64::EPSILON / 2.0);
            }
            PlainPoint::Interior(at) => at.x = negated(at.x),
        }
    }
    Some(())
}

fn mirror_z(face: &mut PlainTemplate) {
    for point in face.strands.iter_mut().flatten() {
        let (PlainPoint::Boundary { z, .. } | PlainPoint::Interior(DVec3 { z, .. })) = point;
        *z = negated(*z);
    }
}

/// -x without making a negative zero.
fn negated(x: f64) -> f64 {
    0.0 - x
}
