//! Stitch types on the device: their shaders, their words, their tables.

use super::adapter::Device;
use super::buffers::Maker;
use super::layout::{self, Counts, Variant};
use super::pipeline::{Kind, bind_group_layout, pipeline};
use super::shader::{self, How};
use super::shared::how;
use super::{GpuOptions, counters, counting};
use crate::Result;
use crate::backend::Running;
use crate::knot::Kernel;
use crate::knot::table::Grid;
use std::collections::HashMap;

/// Shaders of stitch types; those of the same text are compiled once.
#[derive(Debug)]
pub(super) struct Shaders {
    pub stitch_layout: wgpu::BindGroupLayout,
    pub choose_layout: wgpu::BindGroupLayout,
    options: GpuOptions,
    energies: bool,
    most: Counts,
    grid: Option<Grid>,
    how: How,
    compiled: HashMap<String, wgpu::ComputePipeline>,
}

/// A stitch type.
#[derive(Debug)]
pub(super) struct StitchType {
    pub stitch: wgpu::ComputePipeline,
    /// Made when something is to be chosen.
    pub choose: Option<wgpu::ComputePipeline>,
    pub stencil: wgpu::Buffer,
    pub table: wgpu::Buffer,
    /// What is counted of it.
    pub segments: Option<Vec<counters::Segment>>,
}

impl Shaders {
    pub fn new(device: &Device, running: &Running, options: &GpuOptions, kernels: &[Kernel<f32>]) -> Self {
        use Kind::{Read, Uniform, Write};
        let mut kinds = vec![Read, Uniform, Read, Read, Write, Write, Write, Read, Read];
        if options.trace || options.count {
            kinds.push(Write);
        }
        let mut choose_kinds = vec![Read, Uniform, Read, Read, Write, Write, Write, Read, Write];
        choose_kinds.extend(options.count.then_some(Write));
        Self {
            stitch_layout: bind_group_layout(device, "stitch", &kinds),
            choose_layout: bind_group_layout(device, "choose", &choose_kinds),
            options: *options,
            energies: running.energies,
            most: kernels.iter().map(Counts::new).fold(Counts::default(), Counts::max),
            grid: kernels.iter().find_map(|k| k.table().map(|t| *t.grid())),
            how: how(device, options),
            compiled: HashMap::new(),
        }
    }

    /// A stitch type; `no_table` stands in for its table, where it has none.
    pub fn stitch_type(
        &mut self,
        device: &Device,
        kernel: &Kernel<f32>,
        key: &str,
        no_table: &wgpu::Buffer,
    ) -> Result<StitchType> {
        let maker = Maker(device);
        let table = match kernel.table().filter(|_| kernel.solves()) {
            Some(table) => maker.words("table", &layout::table_words(table))?,
            None => no_table.clone(),
        };
        let variant = self.variant(kernel);
        let text = shader::stitch(&variant, self.options.workgroup);
        let segments = match variant.count && !variant.trace {
            true => Some(counters::segments(&self.options.faulty(text.clone()))),
            false => None,
        };
        Ok(StitchType {
            segments: segments.transpose().map_err(|fault| device.fault(&fault.0))?,
            stitch: self.pipeline(device, text, key, "stitch")?,
            choose: None,
            stencil: maker.words("stencil", &layout::words(kernel, &self.room(kernel)))?,
            table,
        })
    }

    /// The pipeline that chooses which stitches of a type need work.
    pub fn choose(
        &mut self,
        device: &Device,
        kernel: &Kernel<f32>,
        key: &str,
    ) -> Result<wgpu::ComputePipeline> {
        self.pipeline(device, self.chooser(kernel), key, "choose")
    }

    /// The shader that does.
    pub fn chooser(&self, kernel: &Kernel<f32>) -> String {
        counting::select(&self.variant(kernel), &self.options)
    }

    fn room(&self, kernel: &Kernel<f32>) -> Counts {
        if self.options.own_shaders { Counts::new(kernel) } else { self.most }
    }

    fn variant(&self, kernel: &Kernel<f32>) -> Variant<'_> {
        let own = self.options.own_shaders;
        let has_table = kernel.solves() && kernel.table().is_some();
        Variant {
            room: self.room(kernel),
            own,
            grid: self.grid.as_ref().filter(|_| !own || has_table),
            spaced: kernel.beta().is_some(),
            energies: self.energies,
            trace: self.options.trace,
            count: self.options.count,
        }
    }

    fn pipeline(
        &mut self,
        device: &Device,
        text: String,
        key: &str,
        entry: &str,
    ) -> Result<wgpu::ComputePipeline> {
        if let Some(pipeline) = self.compiled.get(&text) {
            return Ok(pipeline.clone());
        }
        let faulty = self.options.faulty(text.clone());
        let module = shader::compile(&device.device, self.how, key, &faulty)
            .map_err(|fault| device.fault(&fault.0))?;
        let layout = if entry == "stitch" { &self.stitch_layout } else { &self.choose_layout };
        let made = pipeline(device, layout, &module, entry)?;
        self.compiled.insert(text, made.clone());
        Ok(made)
    }
}
