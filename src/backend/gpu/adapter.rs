//! Which adapters there are, and opening one.

use crate::{Error, Result};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// What is known of an adapter.
#[derive(Clone, Debug)]
pub struct AdapterReport {
    /// Its name.
    pub name: String,
    /// The interface it is reached by, such as `vulkan`.
    pub interface: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    /// Its driver, with version.
    pub driver: String,
    /// Bytes of the largest buffer that a shader can see at once.
    pub largest_binding: u64,
    /// Whether shaders are run with their sums as they are written.
    pub exact: bool,
}

impl AdapterReport {
    fn new(adapter: &wgpu::Adapter) -> Self {
        let info = adapter.get_info();
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete",
            wgpu::DeviceType::IntegratedGpu => "integrated",
            wgpu::DeviceType::VirtualGpu => "virtual",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "other",
        };
        Self {
            name: info.name,
            interface: info.backend.to_string(),
            kind,
            driver: [info.driver, info.driver_info].join(" ").trim().to_string(),
            largest_binding: adapter.limits().max_storage_buffer_binding_size,
            exact: takes_spirv(adapter),
        }
    }

    /// Whether it is a program on the CPU.
    pub fn is_software(&self) -> bool {
        self.kind == "software"
    }
}

impl std::fmt::Display for AdapterReport {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} ({}, {}", self.name, self.kind, self.interface)?;
        if !self.driver.is_empty() {
            write!(f, ", {}", self.driver)?;
        }
        write!(f, ")")
    }
}

/// Sums stay as written where the adapter takes SPIR-V as it is.
fn takes_spirv(adapter: &wgpu::Adapter) -> bool {
    adapter.get_info().backend == wgpu::Backend::Vulkan
        && adapter.features().contains(wgpu::Features::PASSTHROUGH_SHADERS)
}

/// An adapter that stitches can be solved on.
#[derive(Clone, Debug)]
pub struct Adapter(wgpu::Adapter);

impl Adapter {
    /// All adapters, hardware first.
    pub fn all() -> Vec<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        all.retain(|a| a.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS));
        all.sort_by_key(|a| match a.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        });
        all.into_iter().map(Self).collect()
    }

    /// The best adapter whose name has `name` in it, upper or lower case.
    ///
    /// # Errors
    /// None, or none of that name.
    pub fn choose(name: Option<&str>) -> Result<Self> {
        let all = Self::all();
        if all.is_empty() {
            return Err(Error::invalid(
                "no GPU adapter: expected a Vulkan, Metal or DirectX 12 driver (or --device cpu)",
            ));
        }
        let Some(name) = name else { return Ok(all[0].clone()) };
        let wanted = name.to_lowercase();
        let found = all.iter().find(|a| a.report().name.to_lowercase().contains(&wanted));
        found.cloned().ok_or_else(|| {
            let names: Vec<_> = all.iter().map(|a| a.report().name).collect();
            Error::invalid(format_args!("--adapter '{name}': expected a part of {}", names.join(", ")))
        })
    }

    /// The best adapter of hardware. Where the system shows no sign of any, drivers are not even loaded: a software one alone
    /// takes 50 MB.
    pub fn hardware() -> Option<Self> {
        if !may_have_hardware() {
            return None;
        }
        Self::all().into_iter().next().filter(|a| !a.report().is_software())
    }

    /// What is known of it.
    pub fn report(&self) -> AdapterReport {
        AdapterReport::new(&self.0)
    }

    /// Opens it.
    pub(crate) fn open(&self) -> Result<Device> {
        let limits = self.0.limits();
        let exact = takes_spirv(&self.0);
        let mut wanted = self.0.features() & wgpu::Features::TIMESTAMP_QUERY;
        wanted.set(wgpu::Features::PASSTHROUGH_SHADERS, exact);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("knotmesh"),
            required_features: wanted,
            required_limits: limits.clone(),
            memory_hints: wgpu::MemoryHints::Performance,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(self.0.request_device(&descriptor))
            .map_err(|e| Error::invalid(format_args!("cannot open {}: {e}", self.report())))?;
        Ok(self.device(device, queue, limits, exact))
    }

    /// An open device of it, whose errors are kept from now on.
    fn device(&self, device: wgpu::Device, queue: wgpu::Queue, limits: wgpu::Limits, exact: bool) -> Device {
        let faults = Arc::new(Mutex::new(None));
        let sink = faults.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| keep(&sink, e.to_string())));
        let sink = faults.clone();
        device.set_device_lost_callback(move |reason, message| {
            keep(&sink, format!("the device was lost ({reason:?}): {message}"));
        });
        let report = self.report();
        let (software, name) = (report.is_software(), report.to_string());
        Device { device, queue, limits, exact, software, faults, name }
    }

    /// A device of it that a window opened.
    #[cfg(feature = "view")]
    pub(crate) fn opened(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Device {
        let exact = device.features().contains(wgpu::Features::PASSTHROUGH_SHADERS);
        self.device(device.clone(), queue.clone(), device.limits(), exact)
    }
}

/// An adapter that a window took.
#[cfg(feature = "view")]
impl From<wgpu::Adapter> for Adapter {
    fn from(adapter: wgpu::Adapter) -> Self {
        Self(adapter)
    }
}

/// Whether the system may have a GPU: on Linux, whether it shows a device of one (DRI, NVIDIA's, Windows' below Linux, those
/// of phones).
fn may_have_hardware() -> bool {
    if !cfg!(target_os = "linux") {
        return true;
    }
    let render = |entry: std::fs::DirEntry| entry.file_name().to_string_lossy().starts_with("renderD");
    let dri = std::fs::read_dir("/dev/dri").is_ok_and(|mut all| all.any(|e| e.is_ok_and(render)));
    dri || ["/dev/nvidiactl", "/dev/dxg", "/dev/kgsl-3d0", "/dev/mali0"].iter().any(|p| Path::new(p).exists())
}

/// Keeps the first fault.
fn keep(faults: &Mutex<Option<String>>, message: String) {
    if let Ok(mut first) = faults.lock() {
        first.get_or_insert(message);
    }
}

/// An open adapter.
#[derive(Clone, Debug)]
pub(crate) struct Device {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub limits: wgpu::Limits,
    /// Whether shaders run as they are written.
    pub exact: bool,
    /// Whether it is a program on the CPU.
    pub software: bool,
    faults: Arc<Mutex<Option<String>>>,
    name: String,
}

impl Device {
    /// The first fault so far, if there was one, as an error.
    pub fn check(&self) -> Result<()> {
        let fault = self.faults.lock().ok().and_then(|f| f.clone());
        fault.map_or(Ok(()), |message| Err(self.fault(&message)))
    }

    /// Whether the driver ends a shader's loops after 65,535 rounds in all, as Mesa's software one does.
    pub fn ends_loops(&self) -> bool {
        self.name.starts_with("llvmpipe")
    }

    /// An error of this device.
    pub fn fault(&self, message: &str) -> Error {
        let line: Vec<&str> = message.split_whitespace().collect();
        Error::invalid(format_args!("{}: {}", self.name, line.join(" ")))
    }
}
