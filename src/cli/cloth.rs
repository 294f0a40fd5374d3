//! Cloth with material coordinates as `--backend database` takes it, and its frames.

use super::inputs;
use super::relax::Arguments;
use glam::{DVec3, UVec2};
use knotmesh::io::frames::Frames;
use knotmesh::io::obj_mesh;
use knotmesh::io::sequence::Sequence;
use knotmesh::io::text::extension;
use knotmesh::mesh::MaterialMesh;
use knotmesh::pattern::Pattern;
use knotmesh::scene::{laid_flat, natural_unit};
use knotmesh::{Error, Result};

/// `COLUMNSxROWS`.
#[derive(Clone, Copy, Debug)]
pub struct Count(UVec2);

impl std::str::FromStr for Count {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let numbers =
            text.split_once('x').and_then(|(a, b)| Some(UVec2::new(a.parse().ok()?, b.parse().ok()?)));
        numbers
            .filter(|n| n.min_element() > 0 && n.max_element() <= 10_000)
            .map(Self)
            .ok_or_else(|| "expected stitches along the course and rows, such as 2x2".into())
    }
}

/// A mesh that a pattern is laid over, and where its frames come from.
pub struct Cloth {
    /// Material coordinates and positions in metres.
    pub mesh: MaterialMesh,
    /// Metres of a world unit, for positions.
    pub unit: f64,
    source: Source,
}

enum Source {
    /// The mesh's own positions.
    Mesh(Vec<DVec3>),
    Sequence(Sequence),
    Frames(Frames),
}

impl Cloth {
    /// Reads the mesh and opens its frames: those of `--frames`, else those of the file itself. The pattern tells how large a
    /// stitch is.
    pub fn open(arguments: &Arguments, pattern: &Pattern) -> Result<Self> {
        let path = &arguments.mesh;
        let scale = arguments.database.scale;
        if let Some(scale) = scale.filter(|s| !(s.is_finite() && *s > 0.0)) {
            return Err(Error::invalid(format_args!("--scale: found {scale}, expected a positive number")));
        }
        if extension(path) == "smobj" {
            return Self::stitches(arguments, pattern, scale);
        }
        if arguments.database.pattern_stitches.is_some() {
            return Err(Error::invalid(
                "--pattern-stitches: expected a stitch mesh (.smobj), whose stitches these are",
            ));
        }
        let (mesh, source) = match extension(path).as_str() {
            "bin" => {
                let sequence = Sequence::open(path)?;
                (sequence.mesh().clone(), Source::Sequence(sequence))
            }
            "obj" => {
                let mesh = obj_mesh::read_file(path)?.into_material_mesh()?;
                let positions = mesh.positions.clone();
                (mesh, Source::Mesh(positions))
            }
            other => {
                return Err(Error::invalid(format_args!(
                    "{}: found a file of kind '.{other}', expected cloth: .obj with UVs, .bin or .smobj",
                    path.display()
                )));
            }
        };
        let source = match &arguments.frames {
            Some(pattern) => Source::Frames(Frames::open(pattern, mesh.positions.len())?),
            None => source,
        };
        let unit = scale.unwrap_or(1.0);
        Ok(Self { mesh: mesh.scaled(unit), unit, source })
    }

    /// A stitch mesh laid flat, a stitch of the pattern a face; in units in which it has, at rest, the pattern's area.
    fn stitches(arguments: &Arguments, pattern: &Pattern, scale: Option<f64>) -> Result<Self> {
        let path = &arguments.mesh;
        let (mesh, library, rest) =
            inputs::all(path, &arguments.templates, &arguments.map, arguments.rest.as_deref())?;
        let count = match arguments.database.pattern_stitches {
            Some(Count(count)) => count,
            None => pattern.stitches().ok_or_else(|| {
                Error::invalid(format_args!(
                    "{}: the pattern's rows are not all loops alike: expected --pattern-stitches COLUMNSxROWS",
                    path.display()
                ))
            })?,
        };
        let mut flat = laid_flat(&mesh, &library, pattern.size / count.as_dvec2());
        if let Some(rest) = rest.filter(|r| r.len() == flat.positions.len()) {
            flat.positions = rest;
        }
        let unit = scale.or_else(|| natural_unit(&flat)).ok_or_else(|| {
            Error::invalid(format_args!(
                "{}: its faces have no area, so its unit is unknown: give one with --scale",
                path.display()
            ))
        })?;
        flat.positions = mesh.positions.iter().map(|p| *p * unit).collect();
        let source = match &arguments.frames {
            Some(pattern) => Source::Frames(Frames::open(pattern, mesh.positions.len())?),
            None => Source::Mesh(mesh.positions),
        };
        Ok(Self { mesh: flat, unit, source })
    }

    /// Number of frames, at least one.
    pub fn frame_count(&self) -> usize {
        match &self.source {
            Source::Mesh(_) => 1,
            Source::Sequence(sequence) => sequence.len(),
            Source::Frames(frames) => frames.len(),
        }
    }

    /// Whether frames are those of a sequence.
    pub fn moves(&self) -> bool {
        !matches!(self.source, Source::Mesh(_))
    }

    /// Reads a frame into `positions`, metres.
    pub fn read(&mut self, frame: usize, positions: &mut Vec<DVec3>) -> Result<()> {
        match &mut self.source {
            Source::Mesh(own) => positions.clone_from(own),
            Source::Sequence(sequence) => sequence.read(frame, positions)?,
            Source::Frames(frames) => frames.read(frame, positions)?,
        }
        positions.iter_mut().for_each(|p| *p *= self.unit);
        Ok(())
    }

    /// `[face]` from `[polygon of the file]`.
    pub fn by_face(&self, polygons: &[bool], faces: &mut Vec<bool>) {
        faces.clear();
        faces.extend((0..self.mesh.faces.len()).map(|f| polygons[self.mesh.source(f) as usize]));
    }
}
