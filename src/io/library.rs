//! Template libraries from files: the embedded one, `.json` and `.sf` files, directories of them.

use super::sf::{self, PlainPoint, PlainTemplate};
use super::template_json::{self, Entry, EntryKind};
use super::text::{extension, read_bytes};
use crate::mesh::StitchType;
use crate::template::derive::Operation;
use crate::template::{
    Place, Strand, Template, TemplateLibrary, TemplatePoint, check, find_knots, transform,
};
use crate::{Error, Result};
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

/// Radius of a `.sf` library's yarn in its own units: the field's tool has it so, the files do not say.
const SF_YARN_RADIUS: f64 = 0.1;

impl TemplateLibrary {
    /// The library that comes with the program.
    pub fn embedded() -> Self {
        let mut library = Self::default();
        library
            .add_json_files(
                super::embedded::FILES.iter().map(|(name, text)| (name.into(), text.as_bytes().to_vec())),
            )
            .expect("a test reads the embedded library");
        library.stand_in();
        library
    }

    /// Adds a file (`.json` or `.sf`) or all such files of a directory, in the order of their names.
    pub fn add_path(&mut self, path: &Path) -> Result<()> {
        let mut files = vec![path.to_path_buf()];
        if path.is_dir() {
            let entries = std::fs::read_dir(path).map_err(|e| Error::io(path, e))?;
            files = entries
                .map(|e| e.map(|e| e.path()).map_err(|e| Error::io(path, e)))
                .collect::<Result<_>>()?;
            files.retain(|f| matches!(extension(f).as_str(), "json" | "sf"));
            files.sort();
            if files.is_empty() {
                return Err(Error::invalid(format_args!(
                    "{}: found no template files, expected *.json or *.sf",
                    path.display()
                )));
            }
        }
        let mut json_files = Vec::new();
        for file in files {
            let bytes = read_bytes(&file)?;
            match extension(&file).as_str() {
                "sf" => self.add_sf(&file, &bytes)?,
                "json" => json_files.push((file, bytes)),
                _ => {
                    return Err(Error::invalid(format_args!(
                        "{}: found an unknown kind of template file, expected .json or .sf",
                        file.display()
                    )));
                }
            }
        }
        self.add_json_files(json_files)
    }

    /// Adds template files that may derive from each other, or from what the library has.
    fn add_json_files(&mut self, files: impl IntoIterator<Item = (PathBuf, Vec<u8>)>) -> Result<()> {
        let mut waiting: BTreeMap<String, (PathBuf, (usize, usize), Derivation)> = BTreeMap::new();
        let mut seen = HashSet::new();
        for (path, bytes) in files {
            for Entry { place, kind } in template_json::read(&path, &bytes)? {
                let at = |(found, expected): (String, String)| {
                    Error::input(&path, place.0, place.1, found, expected)
                };
                let key = match &kind {
                    EntryKind::Full(template) => template.key(),
                    EntryKind::Derived { name, labels, .. } => {
                        StitchType { name: name.clone(), labels: labels.clone() }.key()
                    }
                };
                if !seen.insert(key.clone()) {
                    return Err(at((format!("a second '{key}'"), "each key once".into())));
                }
                match kind {
                    EntryKind::Full(template) => {
                        check::check(&template).map_err(|(f, e)| at((format!("{f} in '{key}'"), e)))?;
                        self.insert(*template);
                    }
                    EntryKind::Derived { name, labels, from, by } => {
                        waiting.insert(key, (path.clone(), place, Derivation { name, labels, from, by }));
                    }
                }
            }
        }
        // Sources may come later or be derived themselves.
        while !waiting.is_empty() {
            let ready: Vec<String> = waiting
                .iter()
                .filter(|(_, (.., d))| !waiting.contains_key(&d.from))
                .map(|(k, _)| k.clone())
                .collect();
            if ready.is_empty() {
                // Every source waits too, so that as many steps as there are entries end in the circle.
                let mut key = waiting.keys().next().expect("not empty");
                for _ in 0..waiting.len() {
                    key = &waiting[key].2.from;
                }
                let (path, place, d) = &waiting[key];
                return Err(Error::input(
                    path,
                    place.0,
                    place.1,
                    format_args!("'{key}' derived in a circle"),
                    format_args!("'{}' to lead to a template", d.from),
                ));
            }
            for key in ready {
                let (path, place, derivation) = waiting.remove(&key).expect("listed above");
                let template = self.derived(&derivation).map_err(|(found, expected)| {
                    Error::input(&path, place.0, place.1, format_args!("{found} in '{key}'"), expected)
                })?;
                self.insert(template);
            }
        }
        Ok(())
    }

    fn derived(&self, derivation: &Derivation) -> Result<Template, (String, String)> {
        let Some(source) = self.by_key(&derivation.from) else {
            return Err((
                format!("the unknown source '{}'", derivation.from),
                "the key of a template".into(),
            ));
        };
        let mut template = source.clone();
        for operation in &derivation.by {
            template = transform::apply(&template, *operation).ok_or_else(|| {
                ("a mirror of edges all alike".to_string(), "edges of two kinds".to_string())
            })?;
        }
        if template.labels != derivation.labels {
            return Err((
                format!("edges '{}'", derivation.labels.join(" ")),
                format!("'{}', as the operations give", template.labels.join(" ")),
            ));
        }
        template.name = derivation.name.clone();
        // A fraction may have been rounded to the end of its edge.
        check::check(&template)?;
        Ok(template)
    }

    fn add_sf(&mut self, path: &Path, bytes: &[u8]) -> Result<()> {
        let plain = sf::read(path, bytes)?;
        let width = sf_unit(&plain);
        for face in &plain {
            let template = from_plain(face, width);
            check::check(&template).map_err(|(found, expected)| {
                Error::input(path, 1, 1, format_args!("{found} in '{}'", template.key()), expected)
            })?;
            self.insert(template);
        }
        Ok(())
    }
}

struct Derivation {
    name: String,
    labels: Vec<String>,
    from: String,
    by: Vec<Operation>,
}

/// The width of a `.sf` library's plain knit (else of its first quad, else of its first face): one course
/// spacing.
fn sf_unit(faces: &[PlainTemplate]) -> f64 {
    let plain_knit =
        |f: &&PlainTemplate| f.name.starts_with("knit") && f.corners.len() == 4 && f.strands.len() == 3;
    let face = faces
        .iter()
        .find(plain_knit)
        .or_else(|| faces.iter().find(|f| f.corners.len() == 4))
        .or_else(|| faces.first());
    let extent = |f: &PlainTemplate| {
        let u = f.corners.iter().map(|c| c.x);
        u.clone().fold(f64::NEG_INFINITY, f64::max) - u.fold(f64::INFINITY, f64::min)
    };
    face.map(extent).filter(|w| *w > 0.0).unwrap_or(1.0)
}

fn from_plain(face: &PlainTemplate, unit: f64) -> Template {
    let corners: Vec<_> = face.corners.iter().map(|c| *c / unit).collect();
    let point = |p: &PlainPoint| match *p {
        PlainPoint::Boundary { edge, along, z } => {
            TemplatePoint { place: Place::Boundary { edge, along }, z: z / unit }
        }
        PlainPoint::Interior(p) => {
            TemplatePoint { place: Place::Free { at: p.truncate() / unit }, z: p.z / unit }
        }
    };
    // A strand of one point (its end dropped on an edge) is no yarn.
    let strands = face.strands.iter().filter(|s| s.len() > 1);
    let polylines: Vec<Strand> = strands.map(|s| s.iter().map(point).collect()).collect();
    find_knots::find_knots(&face.name, &face.labels, &corners, &polylines, SF_YARN_RADIUS / unit)
}
