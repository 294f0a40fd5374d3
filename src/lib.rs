//! Knotmesh turns a deformed *stitch mesh* (a polygon mesh whose faces are knit stitches) into
//! physically plausible yarn.
//!
//! Data flows one way: files -> [`mesh`] + [`template`] -> [`scene`] (compiled once) -> positions of
//! each frame -> [`backend`] -> control points -> [`curve`] -> writers in [`io`].
#![deny(missing_docs)]

pub mod backend;
pub mod cloth;
pub mod curve;
pub mod database;
pub mod design;
pub mod drape;
pub mod error;
pub mod ids;
pub mod io;
pub mod knot;
pub mod math;
pub mod measure;
pub mod mesh;
pub mod pattern;
#[cfg(feature = "gpu")]
pub mod render;
pub mod scene;
pub mod template;
#[cfg(feature = "view")]
pub mod view;
pub mod yarn;

pub use error::{Error, Result};
