//! Cloth in motion: what a scene does to a knitted cloth, frame by frame.
//!
//! A [`scene::DrapeScene`] says what is held and how it moves, what is in the way and what blows;
//! [`crate::io::scene_json`] reads it from a file.

pub mod bvh;
pub mod layers;
pub mod motion;
pub mod obstacle;
pub mod scene;
pub mod select;
pub mod solid;
pub mod wind;
