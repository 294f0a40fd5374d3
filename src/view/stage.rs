//! The knit as it is seen: a canvas for each mode, painted when something changed.

use super::solver::Solver;
use crate::Result;
use crate::backend::gpu::Adapter;
use crate::render::{Camera, Canvas, Look, Painter, Picture, Yarn};
use eframe::egui::TextureId;
use eframe::egui_wgpu::RenderState;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Instant;

/// Paints for a window.
pub struct Stage {
    painter: Painter,
    window: RenderState,
    panes: Vec<Pane>,
    /// The adapter's name, and whether it is a program on the CPU.
    pub adapter: String,
    /// See `adapter`.
    pub software: bool,
    /// Nanoseconds that the last picture took.
    nanos: Arc<AtomicU64>,
}

struct Pane {
    canvas: Canvas,
    texture: TextureId,
    yarn: Yarn,
    made: u64,
    moved: u64,
    shown: Option<(Camera, Look)>,
}

impl Stage {
    /// Paints on a window's device.
    ///
    /// # Errors
    /// A device that refuses a shader.
    pub fn new(window: &RenderState) -> Result<Self> {
        let adapter = Adapter::from(window.adapter.clone());
        let report = adapter.report();
        Ok(Self {
            painter: Painter::on(adapter.opened(&window.device, &window.queue))?,
            window: window.clone(),
            panes: Vec::new(),
            software: report.is_software(),
            adapter: report.name,
            nanos: Arc::default(),
        })
    }

    /// Seconds that the last picture took on the device.
    pub fn seconds(&self) -> f64 {
        self.nanos.load(Relaxed) as f64 * 1e-9
    }

    /// Drops panes from a number on.
    pub fn keep(&mut self, count: usize) {
        for pane in self.panes.drain(count.min(self.panes.len())..) {
            self.window.renderer.write().free_texture(&pane.texture);
        }
    }

    /// Paints a mode, where anything changed.
    ///
    /// # Errors
    /// A device that fails; yarn without points.
    pub fn show(
        &mut self,
        number: usize,
        solver: &Solver,
        camera: &Camera,
        look: &Look,
        size: [u32; 2],
    ) -> Result<TextureId> {
        if self.panes.get(number).is_none_or(|p| p.canvas.size() != size) {
            let canvas = self.painter.canvas(size[0], size[1])?;
            let view = canvas.texture().create_view(&wgpu::TextureViewDescriptor::default());
            let (device, nearest) = (&self.window.device, wgpu::FilterMode::Nearest);
            let mut renderer = self.window.renderer.write();
            if let Some(pane) = self.panes.get_mut(number) {
                renderer.update_egui_texture_from_wgpu_texture(device, &view, nearest, pane.texture);
                (pane.canvas, pane.shown) = (canvas, None);
            } else {
                let texture = renderer.register_native_texture(device, &view, nearest);
                let yarn = self.painter.yarn(&solver.strands)?;
                let (made, moved) = (solver.made, solver.moved);
                self.panes.push(Pane { canvas, texture, yarn, made, moved, shown: None });
            }
        }
        let number = number.min(self.panes.len() - 1);
        let pane = &mut self.panes[number];
        if pane.made != solver.made {
            pane.yarn = self.painter.yarn(&solver.strands)?;
            pane.shown = None;
        } else if pane.moved != solver.moved {
            self.painter.update(&mut pane.yarn, &solver.strands)?;
            pane.shown = None;
        }
        (pane.made, pane.moved) = (solver.made, solver.moved);
        if pane.shown != Some((*camera, *look)) {
            let began = Instant::now();
            self.painter.paint(&pane.canvas, &mut pane.yarn, camera, look)?;
            pane.shown = Some((*camera, *look));
            let nanos = self.nanos.clone();
            self.window.queue.on_submitted_work_done(move || {
                nanos.store(began.elapsed().as_nanos() as u64, Relaxed);
            });
        }
        Ok(pane.texture)
    }

    /// A picture of a mode by itself, of any size.
    ///
    /// # Errors
    /// A device that fails or lacks room.
    pub fn picture(&self, solver: &Solver, camera: &Camera, look: &Look, size: [u32; 2]) -> Result<Picture> {
        let canvas = self.painter.canvas(size[0], size[1])?;
        let mut yarn = self.painter.yarn(&solver.strands)?;
        self.painter.paint(&canvas, &mut yarn, camera, look)?;
        self.painter.picture(&canvas)
    }
}
