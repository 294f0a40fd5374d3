//! The shaders of fabrics, put together from their files.

use super::layout;
use crate::backend::gpu::shader::{file, workgroup};

macro_rules! fabric {
    ($($name:literal)*) => {
        workgroups_and_vectors() $(+ include_str!(concat!("../../../shaders/fabric_", $name, ".wgsl")))*
    };
}

fn workgroups_and_vectors() -> String {
    layout::constants() + file("thread") + file("vector")
}

/// The shader of forms of faces and nodes.
pub fn forms(size: u32) -> String {
    workgroup(size) + &fabric!("settings" "mesh" "forms")
}

/// The shader of face frames, and of what changed of them.
pub fn frames(size: u32) -> String {
    workgroup(size) + &fabric!("settings" "mesh" "frame" "skip")
}

/// The shader of yarn vertices.
pub fn yarn(size: u32) -> String {
    workgroup(size) + &fabric!("settings" "strain" "lookup" "shell" "yarn")
}
