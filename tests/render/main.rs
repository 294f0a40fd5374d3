//! Pictures: what is drawn against what is known in closed form, against references, and against itself.

#[path = "../common/gpu.rs"]
mod gpu;

mod device;
mod geometry;
mod levels;
mod look;
mod proved;
mod references;
mod scenes;
