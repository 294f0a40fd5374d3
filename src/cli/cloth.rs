//! Cloth with material coordinates as `--backend database` takes it, and its frames.

use super::relax::Arguments;
use glam::DVec3;
use knotmesh::io::frames::Frames;
use knotmesh::io::obj_mesh;
use knotmesh::io::sequence::Sequence;
use knotmesh::io::text::extension;
use knotmesh::mesh::MaterialMesh;
use knotmesh::{Error, Result};

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
    /// Reads the mesh and opens its frames: those of `--frames`, else those of the file itself.
    pub fn open(arguments: &Arguments) -> Result<Self> {
        let path = &arguments.mesh;
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
        let scale = arguments.database.scale;
        if !(scale.is_finite() && scale > 0.0) {
            return Err(Error::invalid(format_args!("--scale: found {scale}, expected a positive number")));
        }
        Ok(Self { mesh: mesh.scaled(scale), unit: scale, source })
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
