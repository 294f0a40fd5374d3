//! Scenes for `knotmesh drape` (`SCENE.json`, described in docs/scenes.md): strict JSON to a [`DrapeScene`].
//!
//! Numbers that are out of range are errors at their place; what is wrong with an entry as a whole is an error where the
//! entry starts. Files that a scene names are relative to its folder.

mod entries;
mod values;

use super::json;
use super::text::{line_and_column, read_bytes};
use crate::drape::motion::Motion;
use crate::drape::scene::{DrapeScene, Friction, SelfCollision, Wind};
use crate::{Error, Result};
use entries::{FileCollider, FileFriction, FileHeld, FileMotion, FilePlace, FileSelf, FileWind, MotionRef};
use serde::Deserialize;
use serde_json::value::RawValue;
use std::collections::BTreeMap;
use std::path::Path;
use values::{Above, AtLeastZero, Count, Vector};

/// The `format` field of scene files.
pub const FORMAT: &str = "knotmesh-scene";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileScene<'a> {
    format: Option<String>,
    version: Option<u32>,
    unit: Option<Above>,
    frames: Count<1_000_000>,
    fps: Option<Above>,
    substeps: Option<Count<10_000>>,
    gravity: Option<Vector>,
    place: Option<FilePlace>,
    relax: Option<bool>,
    density: Option<Above>,
    damping: Option<AtLeastZero>,
    #[serde(borrow, default)]
    motions: BTreeMap<String, &'a RawValue>,
    #[serde(borrow, default)]
    pins: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    moves: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    colliders: Vec<&'a RawValue>,
    self_collision: Option<FileSelf>,
    friction: Option<FileFriction>,
    wind: Option<FileWind>,
}

/// Reads a scene and the collider files that it names.
///
/// # Errors
/// A file that cannot be read; by line and column, what is no scene.
pub fn read_file(path: &Path) -> Result<DrapeScene> {
    read(path, &read_bytes(path)?)
}

/// Reads a scene from memory; files that it names are relative to the folder of `path`.
///
/// # Errors
/// As [`read_file`].
pub fn read(path: &Path, bytes: &[u8]) -> Result<DrapeScene> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let file: FileScene = json::read(path, bytes, "a scene")?;
    if let Some(format) = file.format.as_deref().filter(|f| *f != FORMAT) {
        return Err(Error::input(path, 1, 1, format_args!("format '{format}'"), format_args!("'{FORMAT}'")));
    }
    if let Some(version) = file.version.filter(|v| *v != 1) {
        return Err(Error::input(path, 1, 1, format_args!("version {version}"), "version 1"));
    }
    let reader = Reader { path, bytes };
    let mut motions = BTreeMap::new();
    for (name, raw) in &file.motions {
        motions.insert(name.as_str(), reader.entry::<FileMotion>(raw, "a motion")?.motion());
    }
    let friction = file.friction.map_or(Ok(Friction::default()), |f| f.friction(None));
    let friction = friction.map_err(|(found, expected)| Error::input(path, 1, 1, found, expected))?;
    let resolve = |raw: &RawValue, list: &[MotionRef]| -> Result<Vec<Motion>> {
        let one = |motion: &MotionRef| match motion {
            MotionRef::Own(motion) => Ok(motion.motion()),
            MotionRef::Named(name) => motions.get(name.as_str()).cloned().ok_or_else(|| {
                reader.error(raw, format_args!("motion '{name}'"), "a name of one under \"motions\"")
            }),
        };
        list.iter().map(one).collect()
    };
    let mut held = Vec::new();
    for (list, moves, entries) in [("pins", false, &file.pins), ("moves", true, &file.moves)] {
        for (number, raw) in entries.iter().enumerate() {
            let entry: FileHeld = reader.entry(raw, "a group of vertices with \"select\"")?;
            let motions = resolve(raw, &entry.motion)?;
            if moves == motions.is_empty() {
                let [found, expected] = if moves {
                    ["an entry without \"motion\"", "one, or the entry under \"pins\""]
                } else {
                    ["a pin with \"motion\"", "the entry under \"moves\""]
                };
                return Err(reader.error(raw, found, expected));
            }
            let entry = entry.held(motions, format!("{list}[{number}]"));
            held.push(entry.map_err(|(found, expected)| reader.error(raw, found, expected))?);
        }
    }
    let mut colliders = Vec::new();
    for (number, raw) in file.colliders.iter().enumerate() {
        let entry: FileCollider = reader.entry(raw, "a collider")?;
        let motions = resolve(raw, &entry.motion)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let name = format!("colliders[{number}]");
        let collider = entry.collider(motions, friction, name, folder, |found, expected| {
            reader.error(raw, found, expected)
        })?;
        colliders.push(collider);
    }
    let at_top = |(found, expected)| Error::input(path, 1, 1, found, expected);
    let self_collision = match &file.self_collision {
        None => None,
        Some(own) => Some(SelfCollision {
            thickness: own.thickness.map(|t| t.0),
            friction: own.friction.map_or(Ok(friction), |f| f.friction(Some(friction))).map_err(at_top)?,
        }),
    };
    let default = DrapeScene::default();
    Ok(DrapeScene {
        unit: file.unit.map_or(default.unit, |u| u.0),
        frames: file.frames.0 as usize,
        fps: file.fps.map_or(default.fps, |f| f.0),
        substeps: file.substeps.map(|s| s.0),
        gravity: file.gravity.map_or(default.gravity, |g| g.0),
        place: file.place.map_or(default.place, |p| p.pose()),
        relax: file.relax.unwrap_or(default.relax),
        density: file.density.map(|d| d.0),
        damping: file.damping.map(|d| d.0),
        held,
        colliders,
        self_collision,
        wind: file.wind.map(|w| Wind::from(&w)),
    })
}

struct Reader<'a> {
    path: &'a Path,
    bytes: &'a [u8],
}

impl Reader<'_> {
    /// Line and column where an entry starts. Its text is borrowed from the file's.
    fn place(&self, raw: &RawValue) -> (usize, usize) {
        line_and_column(self.bytes, raw.get().as_ptr() as usize - self.bytes.as_ptr() as usize)
    }

    fn error(
        &self,
        raw: &RawValue,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
    ) -> Error {
        let (line, column) = self.place(raw);
        Error::input(self.path, line, column, found, expected)
    }

    /// Reads an entry; errors are at their place in the file.
    fn entry<'a, T: Deserialize<'a>>(&self, raw: &'a RawValue, what: &str) -> Result<T> {
        serde_json::from_str(raw.get()).map_err(|e| {
            let (line, column) = self.place(raw);
            let column =
                if e.line() <= 1 { column + e.column().saturating_sub(1) } else { e.column().max(1) };
            let (found, expected) = json::explain(&e, None, what);
            Error::input(self.path, line + e.line().max(1) - 1, column, found, expected)
        })
    }
}
