//! Which device frames are solved on, and what becomes of them when it fails.

use super::{Backend, CpuBackend, FrameOutput, Precision, Running, Tables, Wanted};
use crate::knot::{Settings, Start};
use crate::scene::Scene;
use crate::{Error, Result};
use glam::DVec3;
use std::path::PathBuf;
use std::sync::Arc;

/// A kind of device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DeviceKind {
    /// A GPU where there is one of hardware, else the CPU; the CPU also where the GPU fails.
    #[default]
    Auto,
    /// The best GPU adapter, be it software.
    Gpu,
    /// The CPU.
    Cpu,
}

/// Everything that a backend is made from.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// What is solved.
    pub scene: Arc<Scene>,
    /// How.
    pub settings: Settings,
    /// How the work is gone about.
    pub running: Running,
    /// Where tables are kept.
    pub cache: Option<PathBuf>,
    /// Part of the name of the GPU adapter to take.
    pub adapter: Option<String>,
    /// Whether a GPU's own times are taken ([`Backend::device_times`]).
    pub timed: bool,
}

impl Recipe {
    /// A backend on the CPU.
    ///
    /// # Errors
    /// Settings out of range; threads that cannot be started.
    pub fn cpu<T: Precision>(&self) -> Result<CpuBackend<T>> {
        CpuBackend::with_cache(self.scene.clone(), &self.settings, &self.running, self.cache.as_deref())
    }
}

/// A backend on a GPU, and what adapter it is on.
pub struct OnGpu<T: Precision> {
    /// The backend.
    pub backend: Box<dyn Backend<T>>,
    /// The adapter's name.
    pub adapter: String,
    /// Whether that is a program on the CPU.
    pub software: bool,
}

/// What came of looking for a GPU: none, or one and whether a backend on it could be made.
pub type FoundGpu<T> = Option<Result<OnGpu<T>>>;

/// A backend on f32 scenes' best device: a GPU of hardware, or of any kind if `software` too.
#[cfg(feature = "gpu")]
pub(super) fn gpu(recipe: &Recipe, software: bool) -> Result<FoundGpu<f32>> {
    use super::gpu::{Adapter, GpuBackend, GpuOptions, OnCpu};
    let on_cpu = match std::env::var("KNOTMESH_STAGES_ON_GPU") {
        Ok(text) => text.parse().ok().and_then(OnCpu::stages).ok_or_else(|| {
            Error::invalid(format_args!(
                "KNOTMESH_STAGES_ON_GPU={text}: expected 0 to 3, stages left to the CPU"
            ))
        })?,
        Err(_) => OnCpu::Nothing,
    };
    let name = recipe.adapter.as_deref();
    let adapter = match (software || name.is_some(), Adapter::hardware()) {
        (true, _) => Adapter::choose(name)?,
        (false, Some(adapter)) => adapter,
        (false, None) => return Ok(None),
    };
    let report = adapter.report();
    let Recipe { scene, settings, running, cache, .. } = recipe;
    let options = GpuOptions { on_cpu, timed: recipe.timed, ..GpuOptions::default() };
    let made = GpuBackend::new(scene.clone(), settings, running, &options, &adapter, cache.as_deref());
    Ok(Some(made.map(|backend| OnGpu {
        backend: Box::new(backend),
        adapter: report.to_string(),
        software: report.is_software(),
    })))
}

/// The same, in a build that has no GPU backend.
#[cfg(not(feature = "gpu"))]
pub(super) fn gpu(_: &Recipe, software: bool) -> Result<FoundGpu<f32>> {
    if software {
        return Err(Error::invalid("this build has no GPU backend: expected --device cpu"));
    }
    Ok(None)
}

/// A backend on the device that was chosen. With [`DeviceKind::Auto`], frames go on on the CPU where the GPU fails.
pub struct DeviceBackend<T: Precision> {
    gpu: Option<OnGpu<T>>,
    cpu: Option<CpuBackend<T>>,
    recipe: Recipe,
    kind: DeviceKind,
    visible: Option<Vec<bool>>,
    origin: Option<DVec3>,
    /// Whether there was a frame.
    begun: bool,
    /// What went wrong with the GPU since the last frame.
    broken: Option<Error>,
    notes: Vec<String>,
}

impl<T: Precision> DeviceBackend<T> {
    /// A backend for a recipe.
    ///
    /// # Errors
    /// Settings out of range; no adapter of the name given; with [`DeviceKind::Gpu`], no adapter, or one that fails or
    /// lacks room.
    pub fn new(recipe: Recipe, kind: DeviceKind) -> Result<Self> {
        super::check(&recipe.settings, &recipe.running)?;
        let mut made = Self {
            gpu: None,
            cpu: None,
            recipe,
            kind,
            visible: None,
            origin: None,
            begun: false,
            broken: None,
            notes: Vec::new(),
        };
        match kind {
            DeviceKind::Cpu => {}
            DeviceKind::Gpu => made.gpu = T::gpu(&made.recipe, true)?.transpose()?,
            DeviceKind::Auto => match T::gpu(&made.recipe, false)? {
                None => {}
                Some(Ok(gpu)) => made.gpu = Some(gpu),
                Some(Err(e)) => made.notes.push(format!("{e}; solving on the CPU")),
            },
        }
        match &made.gpu {
            Some(gpu) if gpu.software => {
                made.notes.push(format!("{}: a software adapter, slower than --device cpu", gpu.adapter));
            }
            Some(_) => {}
            None => made.cpu = Some(made.recipe.cpu()?),
        }
        Ok(made)
    }

    /// The adapter that frames are solved on; `None` for the CPU.
    pub fn adapter(&self) -> Option<&str> {
        self.gpu.as_ref().map(|g| &*g.adapter)
    }

    /// What is worth a warning since this was last asked.
    pub fn notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }

    /// The backend at work.
    fn backend(&mut self) -> &mut dyn Backend<T> {
        match &mut self.gpu {
            Some(gpu) => &mut *gpu.backend,
            None => self.cpu.as_mut().expect("there is one or the other"),
        }
    }
}

impl<T: Precision> Backend<T> for DeviceBackend<T> {
    fn frame(&mut self, positions: &[DVec3], output: &mut FrameOutput<T>) -> Result<()> {
        let result = match self.broken.take() {
            Some(e) => Err(e),
            None => self.backend().frame(positions, output),
        };
        let fault = match result {
            Ok(()) => {
                self.origin = Some(output.origin);
                self.begun = true;
                return Ok(());
            }
            Err(e) if self.gpu.is_some() && self.kind == DeviceKind::Auto => e,
            result => return result,
        };
        let mut cpu = self.recipe.cpu()?;
        if let Some(origin) = self.origin {
            cpu.set_origin(origin);
        }
        cpu.take_over(output);
        cpu.set_visible(self.visible.as_deref())?;
        // Where the frame itself is at fault, the CPU says so too.
        cpu.frame(positions, output)?;
        self.notes.push(format!("{fault}; going on on the CPU"));
        (self.gpu, self.cpu) = (None, Some(cpu));
        Ok(())
    }

    fn ahead(&mut self, positions: &[DVec3]) -> Result<()> {
        match self.backend().ahead(positions) {
            // The frame itself will fail as well, and then be solved on the CPU.
            Err(_) if self.gpu.is_some() && self.kind == DeviceKind::Auto => Ok(()),
            result => result,
        }
    }

    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        match self.backend().set_visible(visible) {
            // The next frame goes on on the CPU, unless it is the mask that is at fault.
            Err(e) if self.gpu.is_some() && self.kind == DeviceKind::Auto => {
                let faces = self.recipe.scene.face_places.len();
                if visible.is_some_and(|v| v.len() != faces) {
                    return Err(e);
                }
                self.broken = Some(e);
            }
            result => result?,
        }
        self.visible = visible.map(<[bool]>::to_vec);
        Ok(())
    }

    fn set_wanted(&mut self, wanted: Wanted) -> Result<()> {
        // The CPU would have to go on from them.
        let starts = self.kind == DeviceKind::Auto && self.recipe.settings.start == Start::Previous;
        let wanted = Wanted { knots: wanted.knots || starts, ..wanted };
        // Curves take several times the room of points; where there is too little, the CPU samples them.
        let result = self.backend().set_wanted(wanted);
        result.or_else(|_| self.backend().set_wanted(Wanted { curves: 0, ..wanted }))
    }

    #[cfg(feature = "gpu")]
    fn device_points(&self) -> Option<super::gpu::DevicePoints<'_>> {
        self.gpu.as_ref().and_then(|gpu| gpu.backend.device_points())
    }

    fn device_times(&self) -> &[(&'static str, f64)] {
        self.gpu.as_ref().map_or(&[], |gpu| gpu.backend.device_times())
    }

    fn set_origin(&mut self, origin: DVec3) {
        if !self.begun {
            self.backend().set_origin(origin);
            self.origin = Some(origin);
        }
    }

    fn tables(&self) -> &Tables {
        match (&self.gpu, &self.cpu) {
            (Some(gpu), _) => gpu.backend.tables(),
            (None, cpu) => cpu.as_ref().expect("there is one or the other").tables(),
        }
    }

    fn lose(&mut self) {
        self.backend().lose();
    }
}
