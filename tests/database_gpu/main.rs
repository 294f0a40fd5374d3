//! Fabrics on the GPU against their twin, the f32 CPU backend: made-up models over sheets and tubes, frame by frame.
//!
//! On a software device that runs shaders as they are written, all bits are to agree, and what is skipped too. Elsewhere
//! 99.9 % of the points are to lie within 1e-4 r, and all within a hundredth of one: quotients and roots are as exact as
//! the device makes them.
#![cfg(feature = "gpu")]

mod case;
#[path = "../common/mod.rs"]
mod common;
mod device;
mod errors;
mod faults;
mod frames;
mod garbage;
mod skips;
mod stages;
