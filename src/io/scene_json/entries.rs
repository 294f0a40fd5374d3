//! The entries of a scene file, as they stand there, and what they mean.

use super::values::{Above, AtLeastZero, Direction, Factors, Number, Vector};
use crate::drape::motion::{Interpolation, Key, Motion, Pose};
use crate::drape::scene::{Border, Collider, Friction, Gust, Held, Selection, Shape, Side, Solid, Wind};
use crate::io::frames::Frames;
use crate::io::obj_mesh;
use crate::io::text::extension;
use crate::{Error, Result};
use glam::DVec3;
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor, value::MapAccessDeserializer};
use std::path::Path;

/// What was found and what was expected.
type Wrong = (String, String);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilePlace {
    #[serde(default)]
    center: Option<Vector>,
    #[serde(default)]
    axis: Option<Direction>,
    #[serde(default)]
    translate: Option<Vector>,
    #[serde(default)]
    turn: Number,
    #[serde(default)]
    scale: Option<Factors>,
}

impl FilePlace {
    pub fn pose(&self) -> Pose {
        let key = Key {
            time: 0.0,
            translate: self.translate.map_or(DVec3::ZERO, |v| v.0),
            turn: self.turn.0.to_radians(),
            scale: self.scale.map_or(DVec3::ONE, |f| f.0),
        };
        let axis = self.axis.map_or(DVec3::Y, |a| a.0);
        let center = self.center.map_or(DVec3::ZERO, |c| c.0);
        Motion { axis, keys: vec![key], ..Motion::default() }.pose(0.0, center)
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FileInterpolation {
    Linear,
    Smooth,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileKey {
    time: AtLeastZero,
    translate: Option<Vector>,
    turn: Option<Number>,
    scale: Option<Factors>,
}

/// At least one key, of rising times; what a key leaves out is that of the one before.
struct Keys(Vec<Key>);

impl<'de> Deserialize<'de> for Keys {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct KeysVisitor;
        impl<'de> Visitor<'de> for KeysVisitor {
            type Value = Keys;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a list of keys")
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut seq: A) -> Result<Keys, A::Error> {
                use serde::de::Error;
                let mut keys: Vec<Key> = Vec::new();
                while let Some(file) = seq.next_element::<FileKey>()? {
                    let before = keys.last().copied();
                    let last = before.unwrap_or(Key::rest(0.0));
                    if before.is_some_and(|b| file.time.0 <= b.time) {
                        return Err(A::Error::custom(format_args!(
                            "time {} after time {}, expected a later one",
                            file.time.0, last.time
                        )));
                    }
                    keys.push(Key {
                        time: file.time.0,
                        translate: file.translate.map_or(last.translate, |v| v.0),
                        turn: file.turn.map_or(last.turn, |t| t.0.to_radians()),
                        scale: file.scale.map_or(last.scale, |f| f.0),
                    });
                }
                if keys.is_empty() {
                    return Err(A::Error::custom("no keys, expected at least one"));
                }
                Ok(Keys(keys))
            }
        }
        from.deserialize_seq(KeysVisitor)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileMotion {
    center: Option<Vector>,
    axis: Option<Direction>,
    interpolation: Option<FileInterpolation>,
    #[serde(default)]
    repeat: bool,
    keys: Keys,
}

impl FileMotion {
    pub fn motion(&self) -> Motion {
        Motion {
            center: self.center.map(|c| c.0),
            axis: self.axis.map_or(DVec3::Y, |a| a.0),
            interpolation: match self.interpolation {
                Some(FileInterpolation::Linear) => Interpolation::Linear,
                _ => Interpolation::Smooth,
            },
            repeat: self.repeat,
            keys: self.keys.0.clone(),
        }
    }
}

/// A motion, or the name of one.
pub enum MotionRef {
    Named(String),
    Own(FileMotion),
}

impl<'de> Deserialize<'de> for MotionRef {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct RefVisitor;
        impl<'de> Visitor<'de> for RefVisitor {
            type Value = MotionRef;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a motion, or the name of one")
            }
            fn visit_str<E>(self, name: &str) -> Result<MotionRef, E> {
                Ok(MotionRef::Named(name.into()))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MotionRef, A::Error> {
                FileMotion::deserialize(MapAccessDeserializer::new(map)).map(MotionRef::Own)
            }
        }
        from.deserialize_any(RefVisitor)
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FileSide {
    Left,
    Right,
    Bottom,
    Top,
    Back,
    Front,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileBox {
    min: Vector,
    max: Vector,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSelect {
    vertices: Option<Vec<u32>>,
    edges: Option<Vec<[u32; 2]>>,
    #[serde(rename = "box")]
    bounds: Option<FileBox>,
    border: Option<FileSide>,
    depth: Option<AtLeastZero>,
    rows: Option<[u32; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileHeld {
    select: FileSelect,
    #[serde(default)]
    pub motion: Vec<MotionRef>,
}

impl FileHeld {
    pub fn held(self, motions: Vec<Motion>, name: String) -> Result<Held, Wrong> {
        let side = |side| match side {
            FileSide::Left => Side::Left,
            FileSide::Right => Side::Right,
            FileSide::Bottom => Side::Bottom,
            FileSide::Top => Side::Top,
            FileSide::Back => Side::Back,
            FileSide::Front => Side::Front,
        };
        let depth = self.select.depth.map(|d| d.0);
        if depth.is_some() && self.select.border.is_none() {
            return Err(("\"depth\" without \"border\"".into(), "both, or neither".into()));
        }
        if let Some(rows) = self.select.rows.filter(|[first, last]| first > last) {
            return Err((format!("rows {} to {}", rows[0], rows[1]), "the lower row first".into()));
        }
        if self.select.bounds.as_ref().is_some_and(|b| !b.min.0.cmple(b.max.0).all()) {
            return Err(("a box whose min lies beyond its max".into(), "the least corner as min".into()));
        }
        let select = Selection {
            vertices: self.select.vertices,
            edges: self.select.edges,
            bounds: self.select.bounds.map(|b| [b.min.0, b.max.0]),
            border: self.select.border.map(|s| Border { side: side(s), depth }),
            rows: self.select.rows,
        };
        if select == Selection::default() {
            let expected = "one or more of vertices, edges, box, border and rows";
            return Err(("a selection without a condition".into(), expected.into()));
        }
        Ok(Held { select, motions, name })
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileFriction {
    #[serde(rename = "static")]
    fixed: Option<AtLeastZero>,
    kinetic: Option<AtLeastZero>,
}

impl FileFriction {
    /// What is left out comes from `default`; one coefficient alone bounds the other.
    pub fn friction(&self, default: Option<Friction>) -> Result<Friction, Wrong> {
        let default = default.unwrap_or_default();
        let fixed = self.fixed.map_or(default.fixed.max(self.kinetic.map_or(0.0, |k| k.0)), |f| f.0);
        let sliding = self.kinetic.map_or(default.sliding.min(fixed), |k| k.0);
        if sliding > fixed {
            let found = format!("kinetic friction {sliding} above the static one, {fixed}");
            return Err((found, "at most the static one".into()));
        }
        Ok(Friction { fixed, sliding })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FilePlane {
    point: Vector,
    normal: Direction,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSphere {
    center: Vector,
    radius: Above,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileCapsule {
    from: Vector,
    to: Vector,
    radius: Above,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileMesh {
    file: String,
    unit: Option<Above>,
    frames: Option<String>,
    fps: Option<Above>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileCollider {
    plane: Option<FilePlane>,
    sphere: Option<FileSphere>,
    capsule: Option<FileCapsule>,
    mesh: Option<FileMesh>,
    #[serde(default)]
    pub motion: Vec<MotionRef>,
    friction: Option<FileFriction>,
    thickness: Option<AtLeastZero>,
}

impl FileCollider {
    /// `wrong` makes errors at the entry's place.
    pub fn collider(
        self,
        motions: Vec<Motion>,
        friction: Friction,
        name: String,
        folder: &Path,
        wrong: impl Fn(String, String) -> Error,
    ) -> Result<Collider> {
        if !motions.iter().all(Motion::is_rigid) {
            return Err(wrong("a motion that scales a collider".into(), "translations and turns".into()));
        }
        let shape = match (self.plane, self.sphere, self.capsule, self.mesh) {
            (Some(p), None, None, None) => Shape::Plane { point: p.point.0, normal: p.normal.0 },
            (None, Some(s), None, None) => Shape::Sphere { center: s.center.0, radius: s.radius.0 },
            (None, None, Some(c), None) => Shape::Capsule { from: c.from.0, to: c.to.0, radius: c.radius.0 },
            (None, None, None, Some(m)) => {
                let solid = m.solid(folder)?;
                solid.check().map_err(|e| wrong(format!("'{}': {}", m.file, e.0), e.1))?;
                Shape::Mesh(solid)
            }
            _ => {
                let expected = "exactly one of \"plane\", \"sphere\", \"capsule\" and \"mesh\"";
                return Err(wrong("a collider of no shape, or of several".into(), expected.into()));
            }
        };
        let friction = self.friction.map_or(Ok(friction), |f| f.friction(Some(friction)));
        let friction = friction.map_err(|(found, expected)| wrong(found, expected))?;
        Ok(Collider { shape, motions, friction, thickness: self.thickness.map(|t| t.0), name })
    }
}

impl FileMesh {
    fn solid(&self, folder: &Path) -> Result<Solid> {
        let path = folder.join(&self.file);
        if extension(&path) != "obj" {
            return Err(Error::invalid(format_args!(
                "{}: found a collider of kind '.{}', expected .obj",
                path.display(),
                extension(&path)
            )));
        }
        let mesh = obj_mesh::read_file(&path)?;
        let unit = self.unit.map_or(1.0, |u| u.0);
        let mut triangles = Vec::new();
        for face in 0..mesh.face_count() {
            let corners = mesh.face(face);
            triangles.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
        }
        let scaled = |mut all: Vec<DVec3>| {
            all.iter_mut().for_each(|p| *p *= unit);
            all
        };
        let mut frames = vec![scaled(mesh.positions)];
        if let Some(pattern) = &self.frames {
            let mut source = Frames::open(&folder.join(pattern).to_string_lossy(), frames[0].len())?;
            frames.clear();
            for frame in 0..source.len() {
                let mut positions = Vec::new();
                source.read(frame, &mut positions)?;
                frames.push(scaled(positions));
            }
        }
        Ok(Solid { frames, fps: self.fps.map_or(30.0, |f| f.0), triangles })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileSelf {
    pub thickness: Option<Above>,
    pub friction: Option<FileFriction>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileGust {
    strength: AtLeastZero,
    period: Above,
    #[serde(default)]
    seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileWind {
    direction: Direction,
    speed: AtLeastZero,
    drag: Option<AtLeastZero>,
    gust: Option<FileGust>,
}

impl From<&FileWind> for Wind {
    fn from(file: &FileWind) -> Self {
        Wind {
            direction: file.direction.0,
            speed: file.speed.0,
            drag: file.drag.map_or(Wind::DRAG, |d| d.0),
            gust: file.gust.as_ref().map(|g| Gust {
                strength: g.strength.0,
                period: g.period.0,
                seed: g.seed,
            }),
        }
    }
}
