//! Triangles with material coordinates: a cloth whose every point knows where it lies in the undeformed fabric.

use crate::{Error, Result};
use glam::{DVec2, DVec3};

/// A triangle mesh with texture coordinates that are lengths: the undeformed fabric, laid flat.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaterialMesh {
    /// `[vertex]` world positions.
    pub positions: Vec<DVec3>,
    /// `[material vertex]` (u, v): along the courses and along the wales. A vertex on a seam has several.
    pub uvs: Vec<DVec2>,
    /// `[face]` numbers into `positions`.
    pub faces: Vec<[u32; 3]>,
    /// `[face]` numbers into `uvs`, corner by corner those of `faces`.
    pub face_uvs: Vec<[u32; 3]>,
    /// `[face]` the polygon that it is a part of, as its source numbers them; empty where all were triangles.
    pub sources: Vec<u32>,
}

impl MaterialMesh {
    /// Checks that indices are within bounds and numbers finite.
    ///
    /// # Errors
    /// The first that is not, by name and number.
    pub fn check(&self) -> Result<()> {
        if self.faces.len() != self.face_uvs.len() {
            return Err(Error::invalid(format_args!(
                "found {} faces with material coordinates, expected {}",
                self.face_uvs.len(),
                self.faces.len()
            )));
        }
        if !self.sources.is_empty() && self.sources.len() != self.faces.len() {
            return Err(Error::invalid(format_args!(
                "found {} faces of known source, expected {}",
                self.sources.len(),
                self.faces.len()
            )));
        }
        let lists = [
            ("vertex", &self.faces, self.positions.len()),
            ("material vertex", &self.face_uvs, self.uvs.len()),
        ];
        for (name, faces, count) in lists {
            for (face, corners) in faces.iter().enumerate() {
                if let Some(bad) = corners.iter().find(|v| **v as usize >= count) {
                    return Err(Error::invalid(format_args!(
                        "face {face}: found {name} {bad}, expected one below {count}"
                    )));
                }
            }
        }
        if let Some(bad) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(Error::invalid(format_args!("vertex {bad}: found a position that is not finite")));
        }
        if let Some(bad) = self.uvs.iter().position(|p| !p.is_finite()) {
            return Err(Error::invalid(format_args!(
                "material vertex {bad}: found a place that is not finite"
            )));
        }
        Ok(())
    }

    /// The polygon that a face is a part of.
    pub fn source(&self, face: usize) -> u32 {
        self.sources.get(face).copied().unwrap_or(face as u32)
    }

    /// Number of polygons.
    pub fn source_count(&self) -> usize {
        self.sources.iter().max().map_or(self.faces.len(), |most| *most as usize + 1)
    }

    /// The same in other units: both positions and material coordinates are multiplied.
    pub fn scaled(mut self, scale: f64) -> Self {
        self.positions.iter_mut().for_each(|p| *p *= scale);
        self.uvs.iter_mut().for_each(|p| *p *= scale);
        self
    }
}
