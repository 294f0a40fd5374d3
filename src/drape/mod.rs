//! Cloth in motion: what a scene does to a knitted cloth, frame by frame.
//!
//! A [`scene::DrapeScene`] says what is held and how it moves, what is in the way and what blows;
//! [`crate::io::scene_json`] reads it from a file.

pub mod bvh;
mod check;
pub mod layers;
pub mod motion;
pub mod obstacle;
mod refuse;
pub mod scene;
pub mod select;
pub mod solid;
mod stage;
pub mod wind;

pub use check::{SceneCheck, check};
pub use stage::{COLLIDER_THICKNESS, ContactReport, Nodes, SELF_THICKNESS, Stage};
