//! The adapter that tests run on.

use knotmesh::backend::gpu::Adapter;
use std::io::Write;
use std::sync::Once;

/// Set where a machine is to have an adapter: tests that find none fail there.
pub const REQUIRED: &str = "KNOTMESH_REQUIRE_GPU";

/// What the log of errors says before it ends the process.
pub const LOGGED: &str = "an error in wgpu's log";

/// The best adapter, or `None` after saying that the test is skipped. From here on, an error in wgpu's log is the end.
pub fn adapter() -> Option<Adapter> {
    static STRICT: Once = Once::new();
    STRICT.call_once(|| {
        log::set_logger(&Strict).expect("there is no other log");
        log::set_max_level(log::LevelFilter::Error);
    });
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

/// What Debian 12's validation layer says of every shader that wgpu writes in a debug build: it is too old to know WGSL among
/// the languages that a shader can be written in.
const TOO_OLD: &str = "Invalid source language operand: 10";

/// Ends the tests at errors that wgpu, naga or, through them, Vulkan's validation layer logs. It cannot panic: errors come
/// from any thread, and from callbacks that keep panics to themselves.
struct Strict;

impl log::Log for Strict {
    fn enabled(&self, of: &log::Metadata) -> bool {
        of.level() == log::Level::Error && ["wgpu", "naga"].iter().any(|name| of.target().starts_with(name))
    }

    fn log(&self, record: &log::Record) {
        let message = record.args().to_string();
        // Objects that a message is about are logged after it, further in.
        let whole = !message.starts_with('\t');
        if self.enabled(record.metadata()) && whole && !message.contains(TOO_OLD) {
            // Not by a macro: what those print is kept back while a test runs.
            let _ = writeln!(std::io::stderr(), "{LOGGED}: {}: {message}", record.target());
            std::process::abort();
        }
    }

    fn flush(&self) {}
}
