//! Which device a fabric is worked out on, and what becomes of it when that fails.

use super::{Cpu, Fabric, RunningYarn, Woven, YarnFrame};
use crate::Result;
use crate::backend::DeviceKind;
use crate::math::V3;
use glam::DVec3;
use std::sync::Arc;

/// Something that turns the mesh of a frame into yarn.
pub trait Weaver<T> {
    /// [`Cpu::frame`].
    ///
    /// # Errors
    /// Another number of positions than the mesh has vertices; a device that fails.
    fn frame(&mut self, positions: &[DVec3], output: &mut YarnFrame<T>) -> Result<()>;
    /// [`Cpu::set_visible`].
    ///
    /// # Errors
    /// Another number of faces than the mesh has.
    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()>;
    /// [`Cpu::set_origin`].
    fn set_origin(&mut self, origin: DVec3);
    /// [`Cpu::directors`] of the last frame, whose positions are given once more.
    ///
    /// # Errors
    /// A device that fails.
    fn directors(&mut self, positions: &[DVec3], frame: &YarnFrame<T>) -> Result<Vec<V3<T>>>;
}

impl<T: Woven> Weaver<T> for Cpu<T> {
    fn frame(&mut self, positions: &[DVec3], output: &mut YarnFrame<T>) -> Result<()> {
        Cpu::frame(self, positions, output)
    }
    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        Cpu::set_visible(self, visible)
    }
    fn set_origin(&mut self, origin: DVec3) {
        Cpu::set_origin(self, origin);
    }
    fn directors(&mut self, _: &[DVec3], frame: &YarnFrame<T>) -> Result<Vec<V3<T>>> {
        Ok(Cpu::directors(self, frame))
    }
}

/// Everything that a weaver is made from.
#[derive(Clone, Debug)]
pub struct FabricRecipe {
    /// What is worked out.
    pub fabric: Arc<Fabric>,
    /// How the work is gone about.
    pub running: RunningYarn,
    /// Part of the name of the GPU adapter to take.
    pub adapter: Option<String>,
}

/// A weaver on a GPU.
pub struct WeaverOnGpu<T> {
    weaver: Box<dyn Weaver<T>>,
    adapter: String,
    software: bool,
}

/// What came of looking for a GPU: none, or one and whether a weaver on it could be made.
pub type FoundWeaver<T> = Option<Result<WeaverOnGpu<T>>>;

/// A weaver on the best GPU: of hardware, or of any kind if `software` too.
#[cfg(feature = "gpu")]
pub(super) fn gpu(recipe: &FabricRecipe, software: bool) -> Result<FoundWeaver<f32>> {
    use super::gpu::{Gpu, GpuYarn};
    use crate::backend::gpu::Adapter;
    let name = recipe.adapter.as_deref();
    let adapter = match (software || name.is_some(), Adapter::hardware()) {
        (true, _) => Adapter::choose(name)?,
        (false, Some(adapter)) => adapter,
        (false, None) => return Ok(None),
    };
    let report = adapter.report();
    let options = GpuYarn { skip: recipe.running.skip, ..GpuYarn::default() };
    let made = Gpu::new(recipe.fabric.clone(), &options, &adapter);
    Ok(Some(made.map(|weaver| WeaverOnGpu {
        weaver: Box::new(weaver),
        adapter: report.to_string(),
        software: report.is_software(),
    })))
}

/// The same, in a build that has no GPU backend.
#[cfg(not(feature = "gpu"))]
pub(super) fn gpu(_: &FabricRecipe, software: bool) -> Result<FoundWeaver<f32>> {
    if software {
        return Err(crate::Error::invalid("this build has no GPU backend: expected --device cpu"));
    }
    Ok(None)
}

/// A weaver on the device that was chosen. With [`DeviceKind::Auto`], frames go on on the CPU where the GPU fails.
pub struct FabricDevice<T: Woven> {
    weaver: Box<dyn Weaver<T>>,
    /// The adapter, if a GPU is at work.
    adapter: Option<String>,
    kind: DeviceKind,
    recipe: FabricRecipe,
    visible: Option<Vec<bool>>,
    origin: Option<DVec3>,
    notes: Vec<String>,
}

impl<T: Woven> FabricDevice<T> {
    /// A weaver for a recipe.
    ///
    /// # Errors
    /// No adapter of the name given; with [`DeviceKind::Gpu`], no adapter, or one that fails or lacks room; threads that
    /// cannot be started.
    pub fn new(recipe: FabricRecipe, kind: DeviceKind) -> Result<Self> {
        let mut notes = Vec::new();
        let found = match kind {
            DeviceKind::Cpu => None,
            DeviceKind::Gpu => T::gpu(&recipe, true)?.transpose()?,
            DeviceKind::Auto => match T::gpu(&recipe, false)?.transpose() {
                Ok(found) => found,
                Err(e) => {
                    notes.push(format!("{e}; going on on the CPU"));
                    None
                }
            },
        };
        let (weaver, adapter): (Box<dyn Weaver<T>>, _) = match found {
            Some(gpu) => {
                if gpu.software {
                    notes.push(format!("{}: a software adapter, slower than --device cpu", gpu.adapter));
                }
                (gpu.weaver, Some(gpu.adapter))
            }
            None => (Box::new(Cpu::new(recipe.fabric.clone(), recipe.running.clone())?), None),
        };
        Ok(Self { weaver, adapter, kind, recipe, visible: None, origin: None, notes })
    }

    /// The adapter that frames are worked out on; `None` for the CPU.
    pub fn adapter(&self) -> Option<&str> {
        self.adapter.as_deref()
    }

    /// What is worth a warning since this was last asked.
    pub fn notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }

    /// Whether a fault is the GPU's and may be passed over.
    fn passes(&self) -> bool {
        self.adapter.is_some() && self.kind == DeviceKind::Auto
    }

    /// Puts the CPU in the GPU's place.
    fn take_cpu(&mut self, fault: &crate::Error) -> Result<()> {
        let mut cpu = Cpu::<T>::new(self.recipe.fabric.clone(), self.recipe.running.clone())?;
        if let Some(origin) = self.origin {
            cpu.set_origin(origin);
        }
        cpu.set_visible(self.visible.as_deref())?;
        self.weaver = Box::new(cpu);
        self.adapter = None;
        self.notes.push(format!("{fault}; going on on the CPU"));
        Ok(())
    }
}

impl<T: Woven> Weaver<T> for FabricDevice<T> {
    fn frame(&mut self, positions: &[DVec3], output: &mut YarnFrame<T>) -> Result<()> {
        self.recipe.fabric.check_positions(positions)?;
        match self.weaver.frame(positions, output) {
            Err(fault) if self.passes() => {
                self.take_cpu(&fault)?;
                self.weaver.frame(positions, output)?;
            }
            result => result?,
        }
        self.origin = Some(output.origin);
        Ok(())
    }

    fn set_visible(&mut self, visible: Option<&[bool]>) -> Result<()> {
        self.recipe.fabric.check_visible(visible)?;
        self.visible = visible.map(<[bool]>::to_vec);
        match self.weaver.set_visible(visible) {
            Err(fault) if self.passes() => self.take_cpu(&fault),
            result => result,
        }
    }

    fn set_origin(&mut self, origin: DVec3) {
        self.weaver.set_origin(origin);
        self.origin = self.origin.or(Some(origin));
    }

    fn directors(&mut self, positions: &[DVec3], frame: &YarnFrame<T>) -> Result<Vec<V3<T>>> {
        match self.weaver.directors(positions, frame) {
            Err(fault) if self.passes() => {
                self.take_cpu(&fault)?;
                // Where points lie on the mesh is the frame's own business.
                let mut again = YarnFrame::default();
                self.weaver.frame(positions, &mut again)?;
                self.weaver.directors(positions, frame)
            }
            result => result,
        }
    }
}
