//! `-o`: what is written of each frame.

use super::relax::Arguments;
use knotmesh::backend::{FrameOutput, Wanted};
use knotmesh::curve::{CurveExtras, FrameCurves, UNIFORM_SUBDIVISION};
use knotmesh::io::curves::{CurveFormat, FrameWriter, WriteOptions, open_frame_writer};
use knotmesh::io::result::ResultWriter;
use knotmesh::math::Scalar;
use knotmesh::scene::Scene;
use knotmesh::{Error, Result};
use std::path::{Path, PathBuf};

/// Outputs must have a known kind and a folder, and be neither each other nor an input.
pub fn check(arguments: &Arguments) -> Result<()> {
    let same = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let inputs = arguments.templates.iter().chain(&arguments.rest).chain([&arguments.mesh]);
    let inputs = inputs.chain(&arguments.skip.visible).chain(&arguments.database.model);
    let inputs: Vec<PathBuf> =
        inputs.chain(&arguments.frames.as_ref().map(PathBuf::from)).map(|p| same(p)).collect();
    let mut seen = Vec::new();
    for (path, report) in
        arguments.outputs.iter().map(|p| (p, false)).chain(arguments.report.iter().map(|p| (p, true)))
    {
        if !report {
            CurveFormat::from_path(path)?;
        }
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
        if folder.is_some_and(|f| !f.is_dir()) {
            return Err(Error::invalid(format_args!("{}: its folder does not exist", path.display())));
        }
        let place = same(path);
        // A model is a folder of files.
        let model = arguments.database.model.as_deref().map(same);
        let within = model.is_some_and(|folder| place.is_file() && place.starts_with(folder));
        if within || inputs.contains(&place) {
            return Err(Error::invalid(format_args!("{}: an output would replace an input", path.display())));
        }
        // Devices take any number of outputs.
        if seen.contains(&place) && !place.exists() | place.is_file() {
            return Err(Error::invalid(format_args!("{}: named as an output twice", path.display())));
        }
        seen.push(place);
    }
    Ok(())
}

/// What the outputs take of a frame.
pub fn wanted(arguments: &Arguments) -> Result<Wanted> {
    let formats = arguments.outputs.iter().map(|path| CurveFormat::from_path(path));
    let formats: Vec<CurveFormat> = formats.collect::<Result<_>>()?;
    // A device samples curves once; where outputs differ, those of the first.
    let curves = formats.first().map_or(0, |f| subdivide(arguments, *f));
    let knots = arguments.report.is_some() || formats.contains(&CurveFormat::Npz);
    Ok(Wanted { points: true, knots, curves })
}

/// Extra points a segment in a format.
pub fn subdivide(arguments: &Arguments, format: CurveFormat) -> usize {
    // Uniform splines overshoot between unevenly spaced control points; samples do not.
    let least = if format.is_uniform_spline() { UNIFORM_SUBDIVISION } else { 0 };
    arguments.subdivide.max(least)
}

/// One output file, or one file a frame.
pub struct Sink {
    writer: Writer,
    subdivide: usize,
    extras: CurveExtras,
}

enum Writer {
    Curves(Box<dyn FrameWriter>),
    Result(Box<ResultWriter>),
}

/// Opens the outputs for so many frames, which may be some of a longer `sequence`; `output` is the first of them.
pub fn open<T: Scalar>(
    arguments: &Arguments,
    (scene, extras): (&Scene, &CurveExtras),
    output: &FrameOutput<T>,
    frame_count: usize,
    sequence: bool,
) -> Result<Vec<Sink>> {
    let options = WriteOptions { sequence, ..WriteOptions::default() };
    let sink = |path: &PathBuf| {
        let format = CurveFormat::from_path(path)?;
        let subdivide = subdivide(arguments, format);
        let writer = if format == CurveFormat::Npz {
            Writer::Result(Box::new(ResultWriter::create(path, scene, output, subdivide, frame_count)?))
        } else {
            Writer::Curves(open_frame_writer(path, frame_count, &options)?)
        };
        Ok(Sink { writer, subdivide, extras: extras.subdivided(scene, subdivide) })
    };
    arguments.outputs.iter().map(sink).collect()
}

impl Sink {
    /// Writes a frame.
    pub fn frame<T: Scalar>(&mut self, scene: &Scene, frame: usize, output: &FrameOutput<T>) -> Result<()> {
        let curves = FrameCurves::new(scene, output, self.subdivide, Some(&self.extras));
        match &mut self.writer {
            Writer::Curves(writer) => writer.frame(frame, &curves),
            Writer::Result(writer) => writer.frame(scene, output, &curves),
        }
    }

    /// Puts the files in place, and names them.
    pub fn finish(self) -> Result<Vec<PathBuf>> {
        match self.writer {
            Writer::Curves(writer) => writer.finish(),
            Writer::Result(writer) => Ok(vec![writer.finish()?]),
        }
    }
}
