//! What pictures are made of, whatever the file.

use super::curves::FromCurves;
use super::knitted::FromMesh;
use super::{Arguments, StyleName, Up};
use crate::cli::device::DeviceName;
use crate::cli::{Console, info};
use glam::DVec3;
use knotmesh::io::text::extension;
use knotmesh::render::{Legend, Strands, Style};
use knotmesh::{Error, Result};
use std::ops::Range;
use std::path::Path;

/// Kinds of inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Mesh,
    Pattern,
    Curves,
}

impl Kind {
    fn of(path: &Path) -> Result<Self> {
        let database = |what: &str| {
            Err(Error::invalid(format_args!(
                "{}: found {what}, expected yarn: 'knotmesh relax --backend database' lays it, and 'knotmesh render' draws \
                 the .npz that it writes",
                path.display()
            )))
        };
        if path.is_dir() {
            return database("a folder");
        }
        match extension(path).as_str() {
            "smobj" => Ok(Self::Mesh),
            "obj" if info::has_faces(path)? => Ok(Self::Mesh),
            "obj" | "yarns" | "bcc" | "usda" | "npz" | "txt" | "pbrt" => Ok(Self::Curves),
            "knit" | "chart" | "json" | "png" => Ok(Self::Pattern),
            "bin" => database("a sequence of cloth"),
            _ => Err(Error::invalid(format_args!(
                "{}: found a file of another kind, expected a mesh (.smobj, .obj), a pattern or chart (.knit, .chart, .json, \
                 .png) or curves (.yarns, .bcc, .obj, .usda, .npz, .txt, .pbrt)",
                path.display()
            ))),
        }
    }

    /// Refuses options that mean nothing here.
    fn check(self, arguments: &Arguments) -> Result<()> {
        use Kind::{Curves, Mesh, Pattern};
        let a = arguments;
        let solved: &[Kind] = &[Mesh, Pattern];
        let numbers = matches!(a.style, StyleName::Energy | StyleName::Type | StyleName::Tightness);
        let options: [(&str, bool, &[Kind]); 16] = [
            ("--templates", !a.templates.is_empty(), &[Mesh]),
            ("--map", !a.map.is_empty(), &[Mesh]),
            ("--skip-unknown", a.skip_unknown, &[Mesh]),
            ("--frames", a.frames.is_some(), &[Mesh]),
            ("--frame-range", a.frame_range.is_some(), &[Mesh, Curves]),
            ("--rest", a.rest.is_some(), &[Mesh]),
            ("--fold-ribs", a.fold_ribs, &[Mesh]),
            ("--flat-ribs", a.flat_ribs, &[Pattern]),
            ("--mode", a.mode.is_some(), solved),
            ("--beta", a.beta.is_some(), solved),
            ("--gauge", a.gauge.is_some(), solved),
            ("--size", a.size.is_some(), &[Pattern]),
            ("--repeat or --border", a.chart.given(), &[Pattern]),
            ("--device", a.device.device != DeviceName::Auto, solved),
            ("--radius", a.radius.is_some(), &[Curves]),
            ("--style energy, type or tightness", numbers, solved),
        ];
        let name = |kind: &Kind| match kind {
            Mesh => "a stitch mesh",
            Pattern => "a pattern",
            Curves => "a curve file",
        };
        match options.iter().find(|(_, given, kinds)| *given && !kinds.contains(&self)) {
            None => Ok(()),
            Some((option, _, kinds)) => Err(Error::invalid(format_args!(
                "{}: found {option} for {}, expected {}",
                a.input.display(),
                name(&self),
                kinds.iter().map(name).collect::<Vec<_>>().join(" or ")
            ))),
        }
    }
}

/// An input, of which one frame is at hand at a time.
pub enum Source {
    Mesh(Box<FromMesh>),
    Curves(Box<FromCurves>),
}

impl Source {
    /// Opens an input.
    pub fn open(arguments: &Arguments, style: Style, console: Console) -> Result<Self> {
        let kind = Kind::of(&arguments.input)?;
        kind.check(arguments)?;
        Ok(match kind {
            Kind::Curves => Self::Curves(Box::new(FromCurves::open(arguments, style, console)?)),
            _ => Self::Mesh(Box::new(FromMesh::open(arguments, style, kind == Kind::Pattern, console)?)),
        })
    }

    /// Numbers of the frames to draw, at least one.
    pub fn frames(&self) -> Range<usize> {
        match self {
            Self::Mesh(mesh) => mesh.frames.clone(),
            Self::Curves(curves) => curves.frames.clone(),
        }
    }

    /// Whether the points of the frame at hand are here.
    pub fn has_points(&self) -> bool {
        match self {
            Self::Mesh(mesh) => mesh.has_points(),
            Self::Curves(_) => true,
        }
    }

    /// The mesh, if it is one.
    pub fn mesh(&mut self) -> Option<&mut FromMesh> {
        match self {
            Self::Mesh(mesh) => Some(mesh),
            Self::Curves(_) => None,
        }
    }

    /// Whether there are more frames than one, drawn or not.
    pub fn moves(&self) -> bool {
        match self {
            Self::Mesh(mesh) => mesh.moves,
            Self::Curves(curves) => curves.moves,
        }
    }

    /// The input's name without its ending.
    pub fn stem(&self) -> String {
        let path = match self {
            Self::Mesh(mesh) => &mesh.path,
            Self::Curves(curves) => &curves.path,
        };
        path.file_stem().map_or_else(|| "yarn".into(), |s| s.to_string_lossy().into_owned())
    }

    /// Makes a frame the one at hand.
    pub fn read(&mut self, frame: usize) -> Result<()> {
        match self {
            Self::Mesh(mesh) => mesh.read(frame),
            Self::Curves(curves) => curves.read(frame),
        }
    }

    /// The yarn at hand.
    pub fn strands(&self) -> &Strands {
        match self {
            Self::Mesh(mesh) => &mesh.strands,
            Self::Curves(curves) => &curves.strands,
        }
    }

    /// `[point]` the style's numbers at hand, where it has any.
    pub fn numbers(&self) -> &[f32] {
        match self {
            Self::Mesh(mesh) => &mesh.numbers,
            Self::Curves(curves) => &curves.numbers,
        }
    }

    /// Colours the yarn at hand by its numbers.
    pub fn colour(&mut self, colour: impl Fn(f32) -> [u8; 3]) {
        let (strands, numbers) = match self {
            Self::Mesh(mesh) => (&mut mesh.strands, &mesh.numbers),
            Self::Curves(curves) => (&mut curves.strands, &curves.numbers),
        };
        strands.colours = numbers.iter().map(|n| colour(*n)).collect();
    }

    /// What lengths are compared with.
    pub fn over(&self) -> &'static str {
        match self {
            Self::Mesh(_) => "length at rest",
            Self::Curves(_) => "length in frame 0",
        }
    }

    /// Which axis points up, where something says so.
    pub fn up(&self) -> Option<Up> {
        match self {
            Self::Mesh(mesh) => mesh.up(),
            Self::Curves(curves) => curves.up,
        }
    }

    /// Where the fabric's front faces, about.
    pub fn front(&self) -> Option<DVec3> {
        match self {
            Self::Mesh(mesh) => Some(mesh.normal),
            Self::Curves(_) => None,
        }
    }

    /// What colours of stitches mean.
    pub fn kinds_legend(&self) -> Option<Legend> {
        match self {
            Self::Mesh(mesh) => mesh.kinds_legend(),
            Self::Curves(_) => None,
        }
    }

    /// Warns of faces that fell back; whether there were any.
    pub fn name_fallen(&self, console: Console) -> bool {
        match self {
            Self::Mesh(mesh) => mesh.name_fallen(console),
            Self::Curves(_) => false,
        }
    }
}
