//! The adapter that tests run on.

use knotmesh::backend::gpu::Adapter;

/// Set where a machine is to have an adapter: tests that find none fail there.
pub const REQUIRED: &str = "KNOTMESH_REQUIRE_GPU";

/// The best adapter, or `None` after saying that the test is skipped.
pub fn adapter() -> Option<Adapter> {
    found(Adapter::choose(None).ok(), std::env::var_os(REQUIRED).is_some_and(|v| !v.is_empty()))
}

/// What comes of finding this adapter.
pub fn found(adapter: Option<Adapter>, required: bool) -> Option<Adapter> {
    if adapter.is_none() {
        assert!(!required, "no GPU adapter, and {REQUIRED} is set");
        println!("skipped: no GPU adapter");
    }
    adapter
}
