//! An error that wgpu, or Vulkan's validation layer through it, logs anywhere ends the tests.
//!
//! Seeded faults, each seen red: a log that keeps what it is told to itself; validation switched off (`WGPU_VALIDATION=0`).

use crate::common::gpu::{LOGGED, adapter};
use knotmesh::backend::gpu::shader;
use std::process::Command;

/// Set where Vulkan's validation layer is to be at hand (Debian's `vulkan-validationlayers`): it checks what wgpu cannot, such
/// as shaders that are handed over as they are.
const REQUIRED: &str = "KNOTMESH_REQUIRE_VALIDATION";

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

/// A shader, handed over as it is, with a buffer that its pipeline knows nothing of.
fn wrong_shader() {
    const TEXT: &str = "@group(0) @binding(0) var<storage, read_write> a: array<u32>;
        @compute @workgroup_size(1) fn main() { a[0] = 1u; }";
    let device = device();
    let how = shader::How { exact: true, rolled: true, free: None };
    let module = shader::compile(&device, how, "wrong", TEXT).expect("naga takes it");
    let layout = device.create_pipeline_layout(&Default::default());
    let _ = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
}

/// Nothing in a process of the ordinary sort.
#[test]
fn mistakes() {
    let Ok(mistake) = std::env::var(MISTAKE) else { return };
    adapter();
    match mistake.as_str() {
        "buffer" => wrong_buffer(),
        "shader" => wrong_shader(),
        _ => {}
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
    if std::env::var_os(REQUIRED).is_some_and(|v| !v.is_empty()) {
        let (fine, said) = process("shader");
        assert!(!fine && said.contains(LOGGED) && said.contains("VUID"), "the layer says nothing: {said}");
    }
}
