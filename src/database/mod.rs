//! The precomputed method of Sperl, Narain and Wojtan 2021, "Mechanics-Aware Deformation of Yarn Pattern Geometry": a
//! periodic pattern is laid over a triangle mesh, its vertices are displaced by what yarn-level simulation found at the
//! strain there, and follow the surface.
//!
//! [`crate::pattern`] + [`crate::mesh::MaterialMesh`] -> [`Fabric`] (compiled once) -> positions of each frame ->
//! [`Cpu`] -> [`YarnFrame`] -> [`FabricCurves`] -> writers.

mod chunk;
mod cpu;
mod curvature;
mod curves;
mod device;
mod director;

mod fabric;
mod forms;
#[cfg(feature = "gpu")]
pub mod gpu;
mod lookup;
mod madypg;
mod nodes;
mod shell;
mod skip;
mod strain;
mod strands;
mod surface;
mod tiling;

pub use cpu::{Cpu, RunningYarn, SkipYarn, SkippedYarn, Trace, Woven, YarnFrame};

pub use curves::FabricCurves;
pub use device::{FabricDevice, FabricRecipe, FoundWeaver, Weaver, WeaverOnGpu};
pub use fabric::Fabric;
pub use forms::Form;
pub use shell::Place;

use crate::{Error, Result};

/// How a pattern follows its mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Lower bound of the eigenvalues of `C = I - 2 h II` before displacements are looked up (section 4.3): it keeps
    /// compressed yarn from buckling. 0.8 is a stretch of 0.894.
    pub min_eigenvalue: f64,
    /// How bending is taken account of.
    pub bending: Bending,
    /// Share of Phong deformation (James 2020), 0 for flat triangles.
    pub phong: f64,
    /// Factor of the displacements looked up; 0 embeds the pattern.
    pub displacement: f64,
    /// How much of each of its faces a mesh vertex takes.
    pub weights: FaceWeights,
    /// Whose faults are repeated.
    pub compat: Compat,
    /// Yarns shorter than this many radii are left out.
    pub shortest_yarn: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            min_eigenvalue: 0.8,
            bending: Bending::Linearized,
            phong: 0.5,
            displacement: 1.0,
            weights: FaceWeights::Shepard,
            compat: Compat::None,
            shortest_yarn: 16.0,
        }
    }
}

impl Settings {
    /// # Errors
    /// A number out of range.
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("min-eigenvalue", self.min_eigenvalue, 0.0, 1.0),
            ("phong", self.phong, 0.0, 1.0),
            ("displacement", self.displacement, -10.0, 10.0),
            ("shortest yarn", self.shortest_yarn, 0.0, 1e9),
        ];
        for (name, value, least, most) in ranges {
            if !(least..=most).contains(&value) {
                return Err(Error::invalid(format_args!(
                    "{name}: found {value}, expected {least} to {most}"
                )));
            }
        }
        Ok(())
    }
}

/// How bending is taken account of (section 4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bending {
    /// As stretch that differs over the height: `C = I - 2 h II` (eq. 7).
    Linearized,
    /// Not at all.
    None,
}

/// How much of each of its faces a mesh vertex takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceWeights {
    /// Modified Shepard weights (James 2020), which reproduce linear functions.
    Shepard,
    /// All the same.
    Equal,
}

/// Whose results are reproduced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compat {
    /// Nobody's: faults that are known are mended.
    None,
    /// Those of the authors' program MADYPG, faults included: yarns and normals cut at seams, points on borders dropped or
    /// moved, displaced points extrapolated in their triangle, the eigenvalues' clamp that jumps where both are near each
    /// other, and directors that are neither orthonormal nor turned by the twist.
    Madypg,
}
