//! Cloth in motion: scenes, colliders, friction, self-collision, wind and frames.

#[path = "../common/mod.rs"]
mod common;

mod cloth;
mod command;
mod contact;
mod parse;
mod solids;
mod wild;
