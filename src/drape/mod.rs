//! Cloth in motion: what a scene does to a knitted cloth, frame by frame.
//!
//! A [`scene::DrapeScene`] says what is held and how it moves, what is in the way and what blows;
//! `io::scene_json` reads it from a file. [`Drape`] steps a cloth through it; [`Stage`] is the scene at work.

pub mod bvh;
mod check;
mod groove;
mod layers;
pub mod motion;
pub mod obstacle;
mod refuse;
mod run;
pub mod scene;
pub mod select;
pub mod solid;
mod stage;
pub mod wind;

pub use check::{SceneCheck, check};
pub use run::{Drape, DrapeReport, drape};
pub use stage::{COLLIDER_THICKNESS, ContactReport, Nodes, SELF_THICKNESS, Stage};
