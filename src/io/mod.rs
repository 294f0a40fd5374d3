//! Readers and writers, one file per format.

pub mod frames;
pub mod obj_mesh;
pub mod sf;
pub mod smobj;
pub mod text;
