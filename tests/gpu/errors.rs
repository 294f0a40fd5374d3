//! An error that wgpu, or Vulkan's validation layer through it, logs anywhere ends the tests.
//!
//! Seeded fault, seen red: a log that keeps what it is told to itself.

use crate::common::gpu::{LOGGED, adapter};
use std::process::Command;

/// Set for the process that is to make a mistake, which one.
const MISTAKE: &str = "KNOTMESH_TEST_MISTAKE";

/// Runs the test `mistakes` alone; how it ended, and what it said.
fn process(mistake: &str) -> (bool, String) {
    let output = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "errors::mistakes"])
        .env(MISTAKE, mistake)
        .output()
        .expect("it starts");
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn device() -> wgpu::Device {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).expect("an adapter");
    let features = adapter.features() & wgpu::Features::PASSTHROUGH_SHADERS;
    let descriptor = wgpu::DeviceDescriptor { required_features: features, ..Default::default() };
    pollster::block_on(adapter.request_device(&descriptor)).expect("a device").0
}

/// A buffer that can be mapped and is a uniform too, which wgpu does not allow; in a thread whose panic nobody hears of.
fn wrong_buffer() {
    let descriptor = wgpu::BufferDescriptor {
        label: None,
        size: 16,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::UNIFORM,
        mapped_at_creation: false,
    };
    let made = std::thread::spawn(move || device().create_buffer(&descriptor)).join();
    assert!(made.is_err(), "wgpu allows it");
}

/// Nothing in a process of the ordinary sort.
#[test]
fn mistakes() {
    let Ok(mistake) = std::env::var(MISTAKE) else { return };
    adapter();
    if mistake == "buffer" {
        wrong_buffer();
    }
}

#[test]
fn end_the_tests() {
    if adapter().is_none() {
        return;
    }
    let (fine, said) = process("none");
    assert!(fine && !said.contains(LOGGED), "{said}");
    let (fine, said) = process("buffer");
    assert!(!fine && said.contains(LOGGED), "nobody hears of an error: {said}");
}
