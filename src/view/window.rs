//! Opens the window.

use super::app::{App, Failure};
use super::play::Play;
use super::script;
use super::session::{Options, Session};
use super::stage::Stage;
use crate::io::text::read_bytes;
use crate::{Error, Result};
use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use eframe::{egui, wgpu};
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// What else there is to say of a window.
#[derive(Clone, Debug, Default)]
pub struct Launch {
    /// A script to play.
    pub script: Option<std::path::PathBuf>,
    /// Part of the name of the adapter to draw with.
    pub adapter: Option<String>,
    /// Points across and down.
    pub size: Option<[f32; 2]>,
}

/// Opens a window and stays until it is closed.
///
/// # Errors
/// No display, no adapter for it, a file that cannot be read, a script that cannot be played.
pub fn run(path: Option<&Path>, mut options: Options, launch: &Launch) -> Result<()> {
    let there = |name| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    if cfg!(all(unix, not(target_os = "macos"))) && !["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(there) {
        return Err(Error::invalid(
            "found no display, expected DISPLAY or WAYLAND_DISPLAY to name one: a window needs it",
        ));
    }
    let play = match &launch.script {
        Some(path) => {
            let bytes = read_bytes(path)?;
            Some(Play::new(script::parse(path, &String::from_utf8_lossy(&bytes))?))
        }
        None => None,
    };
    let context: Arc<OnceLock<egui::Context>> = Arc::default();
    let shared = context.clone();
    options.wake = Arc::new(move || {
        if let Some(context) = shared.get() {
            context.request_repaint();
        }
    });
    let session = Session::open(path, options)?;
    let [width, height] = launch.size.unwrap_or([1280.0, 800.0]);
    let native = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("knotmesh")
            .with_app_id("knotmesh")
            .with_inner_size([width, height])
            .with_min_inner_size([480.0, 320.0]),
        wgpu_options: WgpuConfiguration { wgpu_setup: setup(launch.adapter.clone()), ..Default::default() },
        ..Default::default()
    };
    let failure = Failure::default();
    let sink = failure.clone();
    let ended = eframe::run_native(
        "knotmesh",
        native,
        Box::new(move |creation| {
            let _ = context.set(creation.egui_ctx.clone());
            creation.egui_ctx.set_theme(egui::Theme::Light);
            let window = creation.wgpu_render_state.as_ref().ok_or("no graphics device")?;
            let stage = Stage::new(window)?;
            Ok(Box::new(App::new(session, stage, play, sink)))
        }),
    );
    if let Some(error) = failure.lock().ok().and_then(|mut f| f.take()) {
        return Err(error);
    }
    ended.map_err(|e| {
        // What comes before the last colon names places in the window library's sources.
        let text = e.to_string();
        let words: Vec<&str> = text.rsplit(": ").next().unwrap_or_default().split_whitespace().collect();
        Error::invalid(format_args!("cannot open a window: {}", words.join(" ")))
    })
}

/// The best adapter that can show something in the window, with all that it has room for.
fn setup(name: Option<String>) -> WgpuSetup {
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    setup.instance_descriptor.backends = wgpu::Backends::from_env().unwrap_or(wgpu::Backends::PRIMARY);
    setup.native_adapter_selector = Some(Arc::new(move |all, surface| {
        let fits = |a: &&wgpu::Adapter| {
            let named = name
                .as_ref()
                .is_none_or(|name| a.get_info().name.to_lowercase().contains(&name.to_lowercase()));
            let computes =
                a.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS);
            named && computes && surface.is_none_or(|s| a.is_surface_supported(s))
        };
        let best = all.iter().filter(fits).min_by_key(|a| match a.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        });
        best.cloned().ok_or_else(|| {
            let names: Vec<String> = all.iter().map(|a| a.get_info().name).collect();
            let names = if names.is_empty() { "none".to_string() } else { names.join(", ") };
            format!("found no adapter that draws in a window (there is: {names}), expected a Vulkan, Metal or DirectX 12 driver")
        })
    }));
    setup.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
        label: Some("knotmesh"),
        required_limits: adapter.limits(),
        memory_hints: wgpu::MemoryHints::Performance,
        ..Default::default()
    });
    WgpuSetup::CreateNew(setup)
}
