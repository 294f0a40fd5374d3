//! The `knotmesh` command.
fn main() {}
