//! The GPU backend against its twin, the f32 CPU backend one stitch at a time: every template, mode, solver and start,
//! stage by stage.
//!
//! On a device that runs shaders as they are written, all bits are to agree. Elsewhere 99 % of the faces are to lie
//! within 1e-4 r, and no face further off than a change of one unit in the last place of the input moves the twin.
//!
//! Set `KNOTMESH_PARITY` to a file for the shares of equal floats, stage by stage and template by template, as CSV.
#![cfg(feature = "gpu")]

mod case;
#[path = "../common/mod.rs"]
mod common;
mod curves;
mod errors;
mod faults;
mod frames;
mod garbage;
mod independence;
mod parts;
mod record;
mod stages;
mod twin;

use common::gpu::found;

#[test]
#[should_panic(expected = "no GPU adapter")]
fn where_one_is_required_none_is_a_failure() {
    found(None, true);
}

#[test]
fn elsewhere_tests_without_an_adapter_are_skipped() {
    assert!(found(None, false).is_none());
}
