//! `--skip`, `--skip-tolerance`, `--visible` and `--lanes`: what a frame may leave undone, and how it is worked on.

use knotmesh::backend::{Backend, Skip};
use knotmesh::database::SkipYarn;
use knotmesh::io::face_mask::FaceMask;
use knotmesh::math::{Scalar, Width};
use knotmesh::{Error, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub struct SkipArguments {
    /// What to leave undone where it is known: a list of unmoved (faces around which nothing moved), rigid (of the
    /// shape they were last solved for), rest (of the template's shape) and shared (of the shape of the first
    /// face of their type); all or none.
    #[arg(long, value_name = "LIST", default_value = "all")]
    pub skip: SkipList,
    /// How far apart, in yarn radii, corners may be in shapes that count as the same.
    #[arg(long, value_name = "R", default_value_t = Skip::default().tolerance)]
    pub skip_tolerance: f64,
    /// Faces that need to be right: .npy of booleans or bytes, `[face]` or `[frame, face]`, in the mesh file's
    /// order. The yarn of others stays where it was.
    #[arg(long, value_name = "FILE.npy")]
    pub visible: Option<PathBuf>,
    /// Stitches side by side, in f32; the result does not depend on it.
    #[arg(long, value_enum, default_value = "auto")]
    pub lanes: LanesName,
}

/// `--skip LIST`, its tolerance left open.
#[derive(Clone, Copy)]
pub struct SkipList(Skip);

impl std::str::FromStr for SkipList {
    type Err = String;

    fn from_str(list: &str) -> std::result::Result<Self, String> {
        let mut skip = Skip::NOTHING;
        for name in list.split(',').map(str::trim) {
            match name {
                "all" => skip = Skip::default(),
                "none" if list.trim() == "none" => {}
                "unmoved" => skip.unmoved = true,
                "rigid" => skip.rigid = true,
                "rest" => skip.rest = true,
                "shared" => skip.shared = true,
                _ => return Err("expected all, none, or a list of unmoved, rigid, rest, shared".into()),
            }
        }
        Ok(Self(skip))
    }
}

#[derive(Clone, Copy, clap::ValueEnum)]
pub enum LanesName {
    Auto,
    #[value(name = "1")]
    One,
    #[value(name = "8")]
    Eight,
    #[value(name = "16")]
    Sixteen,
}

impl SkipArguments {
    pub fn skip(&self) -> Skip {
        Skip { tolerance: self.skip_tolerance, ..self.skip.0 }
    }

    /// The same for yarn of the precomputed method, which knows neither templates nor faces alike.
    pub fn skip_yarn(&self) -> SkipYarn {
        SkipYarn { unmoved: self.skip.0.unmoved, rigid: self.skip.0.rigid, tolerance: self.skip_tolerance }
    }

    pub fn width(&self) -> Width {
        match self.lanes {
            LanesName::Auto => Width::Auto,
            LanesName::One => Width::One,
            LanesName::Eight => Width::Eight,
            LanesName::Sixteen => Width::Sixteen,
        }
    }
}

/// `--visible`, frame by frame.
pub struct Visible {
    source: FaceMask,
    mask: Vec<bool>,
}

impl Visible {
    /// Opens a mask for a mesh of `faces` faces that moves through `frames` frames.
    pub fn open(path: &Path, faces: usize, frames: usize) -> Result<Self> {
        let source = FaceMask::open(path, faces)?;
        if let Some(found) = source.frames().filter(|n| *n != frames) {
            let expected = format!("{frames} as there are frames");
            return Err(Error::binary(path, 0, format!("masks of {found} frames"), expected));
        }
        Ok(Self { source, mask: Vec::new() })
    }

    /// The faces of a frame.
    pub fn read(&mut self, frame: usize) -> Result<&[bool]> {
        self.source.read(frame, &mut self.mask)?;
        Ok(&self.mask)
    }

    /// Shows a backend the faces of a frame.
    pub fn show<T: Scalar>(&mut self, frame: usize, backend: &mut dyn Backend<T>) -> Result<()> {
        backend.set_visible(Some(self.read(frame)?))
    }
}

/// The settings, for the report.
#[derive(Serialize)]
pub struct SkipReport {
    unmoved: bool,
    rigid: bool,
    rest: bool,
    shared: bool,
    tolerance: f64,
    visible: Option<PathBuf>,
}

impl SkipReport {
    pub fn new(arguments: &SkipArguments) -> Self {
        let Skip { unmoved, rigid, rest, shared, tolerance } = arguments.skip();
        Self { unmoved, rigid, rest, shared, tolerance, visible: arguments.visible.clone() }
    }
}
