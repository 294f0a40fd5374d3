//! The precomputed method on made-up models: what its mends mend, invariants, stability. `tests/database_reference.rs`
//! compares with the authors' program.

#[path = "../common/mod.rs"]
mod common;

mod bending;
