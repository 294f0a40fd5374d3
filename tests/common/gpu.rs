//! The adapter that tests run on.

use knotmesh::backend::gpu::Adapter;

/// The best adapter; none where there is none, unless `KNOTMESH_REQUIRE_GPU` says that this is a failure.
pub fn adapter() -> Option<Adapter> {
    match Adapter::choose(None) {
        Ok(adapter) => Some(adapter),
        Err(e) if std::env::var_os("KNOTMESH_REQUIRE_GPU").is_some() => panic!("{e}"),
        Err(_) => {
            println!("skipped: no GPU adapter");
            None
        }
    }
}
