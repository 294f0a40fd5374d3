//! Pictures of curve files.

use super::{Arguments, Up};
use crate::cli::Console;
use knotmesh::io::curves::{CurveReader, UpAxis};
use knotmesh::io::frames::frame_range;
use knotmesh::render::{Strands, Style};
use knotmesh::{Error, Result};
use std::ops::Range;
use std::path::PathBuf;

/// A curve file; see [`super::source::Source`].
pub struct FromCurves {
    pub path: PathBuf,
    pub frames: Range<usize>,
    pub moves: bool,
    pub up: Option<Up>,
    pub strands: Strands,
    pub numbers: Vec<f32>,
    style: Style,
    radius: Option<f64>,
    palette: Vec<[u8; 3]>,
    reader: CurveReader,
    /// The frame that the reader gives next.
    next: usize,
    /// Lengths of segments in frame 0.
    rest: Vec<f32>,
}

impl FromCurves {
    pub fn open(arguments: &Arguments, style: Style, console: Console) -> Result<Self> {
        let path = arguments.input.clone();
        let reader = CurveReader::open(&path)?;
        for note in &reader.header.notes {
            console.warn(note);
        }
        let count = reader.frames_left();
        let frames = match &arguments.frame_range {
            Some(text) => frame_range(text, count)?,
            None => 0..count,
        };
        if frames.is_empty() {
            return Err(Error::invalid(format_args!("{}: found no frames to draw", path.display())));
        }
        if style.is_number() && count == 1 {
            return Err(Error::invalid(format_args!(
                "{}: found curves of one frame, expected several for this style, lengths being compared with those of frame \
                 0; or the mesh, whose yarn has lengths at rest",
                path.display()
            )));
        }
        let up = reader.header.up.map(|up| match up {
            UpAxis::Y => Up::Y,
            UpAxis::Z => Up::Z,
        });
        let mut made = Self {
            path,
            frames,
            moves: count > 1,
            up,
            strands: Strands::default(),
            numbers: Vec::new(),
            style,
            radius: arguments.radius,
            palette: arguments.colour.iter().map(|c| c.0).collect(),
            reader,
            next: 0,
            rest: Vec::new(),
        };
        made.read(0)?;
        made.rest = segment_lengths(&made.strands);
        made.measure();
        Ok(made)
    }

    pub fn read(&mut self, frame: usize) -> Result<()> {
        if self.next == frame + 1 && self.strands.unit > 0.0 {
            return Ok(());
        }
        if frame < self.next {
            self.reader = CurveReader::open(&self.path)?;
            self.next = 0;
        }
        let mut curves = None;
        while self.next <= frame {
            curves = self.reader.next_frame()?;
            self.next += 1;
        }
        let curves = curves
            .ok_or_else(|| Error::invalid(format_args!("{}: found no frame {frame}", self.path.display())))?;
        self.strands = Strands::of_curves(&curves, self.radius)?;
        if !self.palette.is_empty() {
            for (yarn, ends) in self.strands.offsets.windows(2).enumerate() {
                let colour = self.palette[yarn % self.palette.len()];
                self.strands.colours[ends[0] as usize..ends[1] as usize].fill(colour);
            }
        }
        self.measure();
        Ok(())
    }

    fn measure(&mut self) {
        if self.rest.len() == self.strands.points.len() {
            self.strands.rest.clone_from(&self.rest);
        }
        self.numbers = if self.style.is_number() { self.style.of_strands(&self.strands) } else { Vec::new() };
    }
}

/// `[point]` length of the segment that begins there.
fn segment_lengths(strands: &Strands) -> Vec<f32> {
    let mut lengths = Vec::with_capacity(strands.points.len());
    for ends in strands.offsets.windows(2) {
        let points = &strands.points[ends[0] as usize..ends[1] as usize];
        for (i, p) in points.iter().enumerate() {
            let next = points[(i + 1) % points.len()];
            lengths.push(glam::Vec3::from(*p).distance(glam::Vec3::from(next)));
        }
    }
    lengths
}
