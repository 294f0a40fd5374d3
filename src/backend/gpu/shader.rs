//! Shaders: put together from their files, compiled for the device.

use super::layout::{self, Variant};
use super::{counters, exact};
use std::borrow::Cow;

/// Threads that work side by side.
pub const WORKGROUP: u32 = 64;

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../../../shaders/", $name, ".wgsl")))),*]
    };
}

/// The shaders' files, by stem.
const FILES: [(&str, &str); 24] = files!(
    "thread",
    "vector",
    "stencil",
    "settings",
    "frame",
    "start",
    "table",
    "no_table",
    "energy",
    "sums",
    "factor",
    "solve",
    "lift",
    "trace",
    "no_trace",
    "count",
    "count_kernel",
    "load",
    "stitch",
    "select",
    "arguments",
    "places",
    "surface",
    "curve",
);

/// The functions that the shaders' files define, each with the stem of its file.
pub(super) fn functions() -> impl Iterator<Item = (&'static str, &'static str)> {
    let of_file = |(stem, text): &(&'static str, &'static str)| {
        let stem = *stem;
        text.lines().filter_map(move |line| Some((line.strip_prefix("fn ")?.split('(').next()?, stem)))
    };
    FILES.iter().flat_map(of_file)
}

pub(crate) fn file(stem: &str) -> &'static str {
    FILES.iter().find(|(name, _)| *name == stem).expect("a shader's stem").1
}

pub(crate) fn workgroup(size: u32) -> String {
    format!("const WORKGROUP: u32 = {size}u;\n")
}

/// The shader of stitches.
pub fn stitch(variant: &Variant, size: u32) -> String {
    let mut text = workgroup(size) + &layout::constants(variant);
    let table = if variant.grid.is_some() { "table" } else { "no_table" };
    let trace = match (variant.trace, variant.count) {
        (true, _) => "trace",
        (false, true) => "count",
        (false, false) => "no_trace",
    };
    for stem in [
        "thread", "vector", "stencil", "settings", "frame", "start", table, "lift", "energy", "sums",
        "factor", trace, "solve", "places", "load", "stitch",
    ] {
        text += file(stem);
    }
    text
}

/// The shader that chooses which stitches need work.
pub fn select(variant: &Variant, size: u32) -> String {
    let mut text = workgroup(size) + &layout::constants(variant);
    for stem in ["thread", "vector", "stencil", "settings", "frame", "places", "load", "select"] {
        text += file(stem);
    }
    text
}

/// The shader that turns counts into dispatches.
pub fn arguments(size: u32) -> String {
    workgroup(size) + file("arguments")
}

/// The shader of surfaces and seams.
pub fn surface(size: u32) -> String {
    workgroup(size) + file("thread") + file("vector") + file("places") + file("surface")
}

/// The shader of curves.
pub fn curve(size: u32) -> String {
    workgroup(size) + file("thread") + file("vector") + file("curve")
}

/// Such a shader with counters of what threads do, which it puts into the buffer of that binding; see [`counters`].
pub fn counted(text: String, binding: usize) -> String {
    text + &format!("const COUNTS_BINDING: u32 = {binding}u;\n") + file("count_kernel")
}

/// A shader that does not compile.
#[derive(Debug)]
pub struct Fault(pub String);

/// The module that a shader's text means, checked.
pub fn parse(text: &str) -> Result<(naga::Module, naga::valid::ModuleInfo), Fault> {
    let module = naga::front::wgsl::parse_str(text).map_err(|e| Fault(e.emit_to_string(text)))?;
    let info = checked(&module).map_err(|e| Fault(e.emit_to_string(text)))?;
    Ok((module, info))
}

type Invalid = naga::WithSpan<naga::valid::ValidationError>;

/// What is known of a module, if it is valid.
pub(super) fn checked(module: &naga::Module) -> Result<naga::valid::ModuleInfo, Box<Invalid>> {
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    Ok(validator.validate(module)?)
}

/// SPIR-V of a shader's text, its sums as written.
///
/// With `rolled`, loops are given a second bound, so that a driver's compiler takes them as they are instead of guessing from
/// the length of arrays how often to repeat their text: that takes software drivers a minute.
pub fn spirv(text: &str, rolled: bool) -> Result<Vec<u32>, Fault> {
    let (module, info) = counters::counting(parse(text)?)?;
    written(&module, &info, rolled, None)
}

fn written(
    module: &naga::Module,
    info: &naga::valid::ModuleInfo,
    rolled: bool,
    free: Option<&str>,
) -> Result<Vec<u32>, Fault> {
    // An index out of bounds is kept within them: nobody else checks SPIR-V that is handed over as it is.
    let checked = naga::proc::BoundsCheckPolicy::Restrict;
    let options = naga::back::spv::Options {
        lang_version: (1, 3),
        flags: match free {
            // Functions have names then.
            Some(_) => naga::back::spv::WriterFlags::DEBUG,
            None => naga::back::spv::WriterFlags::empty(),
        },
        bounds_check_policies: naga::proc::BoundsCheckPolicies {
            index: checked,
            buffer: checked,
            ..Default::default()
        },
        force_loop_bounding: rolled,
        ..Default::default()
    };
    let words = naga::back::spv::write_vec(module, info, &options, None).map_err(|e| Fault(e.to_string()))?;
    Ok(exact::forbid_contraction(words, free))
}

/// How a shader is compiled.
#[derive(Clone, Copy, Debug)]
pub struct How {
    /// As written, where the device takes SPIR-V; else as its compiler sees fit.
    pub exact: bool,
    /// See [`spirv`].
    pub rolled: bool,
    /// A function whose sums are left to the device's compiler all the same.
    pub free: Option<&'static str>,
}

/// Compiles a shader for a device.
pub fn compile(
    device: &wgpu::Device,
    how: How,
    label: &str,
    text: &str,
) -> Result<wgpu::ShaderModule, Fault> {
    if !how.exact {
        return Ok(device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(Cow::Borrowed(text)),
        }));
    }
    let (module, info) = counters::counting(parse(text)?)?;
    let words = written(&module, &info, how.rolled, how.free)?;
    let entry = |e: &naga::EntryPoint| wgpu::PassthroughShaderEntryPoint {
        name: Cow::Owned(e.name.clone()),
        workgroup_size: e.workgroup_size.into(),
    };
    let entry_points: Vec<_> = module.entry_points.iter().map(entry).collect();
    #[allow(unsafe_code)]
    // SAFETY: naga has validated the module it wrote; only decorations that forbid rewriting were added.
    Ok(unsafe {
        device.create_shader_module_passthrough(wgpu::ShaderModuleDescriptorPassthrough {
            label: Some(label),
            entry_points: entry_points.into(),
            spirv: Some(words.into()),
            ..Default::default()
        })
    })
}
