//! Tells the tests whether real files are at hand, so that those which need them count as skipped without.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(knotmesh_data)");
    println!("cargo::rerun-if-env-changed=KNOTMESH_DATA");
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var_os("KNOTMESH_DATA").is_some() {
        println!("cargo::rustc-cfg=knotmesh_data");
    }
}
