//! USD text (`.usda`), writing: BasisCurves with Catmull-Rom basis, all frames in one file.
//!
//! USD gives a whole prim one wrap mode, so open yarns (`pinned`, which reaches the end points) and closed yarns
//! (`periodic`) are a prim each; where both occur, `knotmesh:yarn` numbers the yarns in their original order.
//! Widths are diameters. Frames are time samples at their index. Closed yarns of fewer than three points are
//! outside of what USD draws. The reader is in [`super::usda_read`].

use super::curves::{
    FrameWriter, UpAxis, WriteOptions, check_single, frame_count_error, radius_of, visit_points,
};
use super::numbers::{SINGLE, push_number};
use super::output::Output;
use crate::yarn::CurveSource;
use crate::{Error, Result};
use glam::DVec3;
use std::fs::File;
use std::io::{BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// Writes a `.usda` file frame by frame; memory does not grow with the frames' points.
pub struct UsdaWriter {
    path: PathBuf,
    out: Output,
    /// Time samples of the closed yarns wait here until those of the open ones are complete.
    spool: Option<BufWriter<File>>,
    options: WriteOptions,
    frame_count: usize,
    frames: Vec<usize>,
    /// `[yarn]` points and closedness, which must not change.
    topology: Vec<(usize, bool)>,
    parts: Vec<Part>,
    /// Whether points are time samples.
    timed: bool,
    /// Where in the file the end time is to be filled in.
    end_time_at: u64,
}

/// The yarns of one wrap mode.
struct Part {
    closed: bool,
    yarns: Vec<usize>,
    margin: f64,
    extents: Vec<Option<[DVec3; 2]>>,
}

/// Digits kept free for the end time.
const TIME_WIDTH: usize = 20;

impl UsdaWriter {
    /// Starts a file of `frame_count` frames.
    pub fn create(path: &Path, frame_count: usize, options: &WriteOptions) -> Result<Self> {
        Ok(Self {
            path: path.into(),
            out: Output::create(path)?,
            spool: None,
            options: *options,
            frame_count,
            frames: Vec::new(),
            topology: Vec::new(),
            parts: Vec::new(),
            timed: frame_count > 1 || options.sequence,
            end_time_at: 0,
        })
    }

    fn begin(&mut self, index: usize, curves: &dyn CurveSource) -> Result<()> {
        self.topology = topology(curves);
        let mut text = Vec::new();
        let up = if self.options.up == UpAxis::Y { "Y" } else { "Z" };
        text.extend_from_slice(b"#usda 1.0\n(\n    defaultPrim = \"yarn\"\n    metersPerUnit = ");
        push_number(&mut text, self.options.meters_per_unit, SINGLE);
        text.extend_from_slice(format!("\n    upAxis = \"{up}\"\n").as_bytes());
        if self.timed {
            text.extend_from_slice(
                format!("    startTimeCode = {index}\n    timeCodesPerSecond = ").as_bytes(),
            );
            push_number(&mut text, self.options.frames_per_second, SINGLE);
            text.extend_from_slice(b"\n    endTimeCode = ");
            self.end_time_at = text.len() as u64;
            text.extend_from_slice(&[b' '; TIME_WIDTH]);
            text.push(b'\n');
        }
        text.extend_from_slice(b")\n\ndef Xform \"yarn\"\n{\n");
        self.out.put(&text)?;
        for closed in [false, true] {
            let yarns: Vec<_> =
                (0..self.topology.len()).filter(|&yarn| self.topology[yarn].1 == closed).collect();
            if !yarns.is_empty() {
                self.parts.push(Part { closed, yarns, margin: 0.0, extents: Vec::new() });
            }
        }
        if self.parts.len() > 1 {
            let folder = self.path.parent().unwrap_or(Path::new("."));
            let spool = tempfile::tempfile_in(folder).or_else(|_| tempfile::tempfile());
            self.spool = Some(BufWriter::new(spool.map_err(|e| Error::io(&self.path, e))?));
        }
        for part in 0..self.parts.len() {
            self.begin_part(part, curves)?;
        }
        Ok(())
    }

    fn put(&mut self, part: usize, bytes: &[u8]) -> Result<()> {
        match &mut self.spool {
            Some(spool) if part > 0 => spool.write_all(bytes).map_err(|e| Error::io(&self.path, e)),
            _ => self.out.put(bytes),
        }
    }

    /// Everything of a prim that comes before its points.
    fn begin_part(&mut self, index: usize, curves: &dyn CurveSource) -> Result<()> {
        let part = &self.parts[index];
        let (name, wrap) = if part.closed { ("closed", "periodic") } else { ("open", "pinned") };
        let mut text = format!(
            "    def BasisCurves \"{name}\"\n    {{\n        uniform token type = \"cubic\"\n        \
             uniform token basis = \"catmullRom\"\n        uniform token wrap = \"{wrap}\"\n        \
             int[] curveVertexCounts = ["
        )
        .into_bytes();
        let mut widths = Vec::with_capacity(part.yarns.len());
        for (i, &yarn) in part.yarns.iter().enumerate() {
            let length = self.topology[yarn].0;
            if i32::try_from(length).is_err() {
                return Err(Error::invalid(format_args!(
                    "{}: found {length} points in yarn {}, expected at most 2147483647",
                    self.path.display(),
                    yarn + 1
                )));
            }
            text.extend_from_slice(format!("{}{length}", if i > 0 { ", " } else { "" }).as_bytes());
            widths.push(2.0 * radius_of(&self.path, curves, yarn, &self.options)?);
        }
        text.extend_from_slice(b"]\n        float[] widths = [");
        let margin = widths.iter().fold(0.0, |m: f64, w| m.max(0.5 * w));
        let constant = widths.windows(2).all(|w| w[0] == w[1]);
        if constant {
            widths.truncate(1);
        }
        for (i, width) in widths.iter().enumerate() {
            text.extend_from_slice(if i > 0 { b", " } else { b"" });
            push_number(&mut text, *width, SINGLE);
        }
        let interpolation = if constant { "constant" } else { "uniform" };
        text.extend_from_slice(
            format!("] (\n            interpolation = \"{interpolation}\"\n        )\n").as_bytes(),
        );
        if self.parts.len() > 1 {
            text.extend_from_slice(b"        custom int[] knotmesh:yarn = [");
            for (i, yarn) in part.yarns.iter().enumerate() {
                text.extend_from_slice(format!("{}{yarn}", if i > 0 { ", " } else { "" }).as_bytes());
            }
            text.extend_from_slice(b"]\n");
        }
        if self.timed {
            text.extend_from_slice(b"        point3f[] points.timeSamples = {\n");
        }
        self.parts[index].margin = margin;
        self.put(index, &text)
    }

    fn points(&mut self, index: usize, frame: usize, curves: &dyn CurveSource) -> Result<()> {
        let mut text = Vec::new();
        if self.timed {
            text.extend_from_slice(format!("            {frame}: [").as_bytes());
        } else {
            text.extend_from_slice(b"        point3f[] points = [");
        }
        let mut extent: Option<[DVec3; 2]> = None;
        let yarns = std::mem::take(&mut self.parts[index].yarns);
        let path = self.path.clone();
        for &yarn in &yarns {
            visit_points(curves, yarn, |points| {
                for part in points.chunks(1024) {
                    for &p in part {
                        check_single(&path, yarn, p)?;
                        text.extend_from_slice(if extent.is_some() { b", (" } else { b"(" });
                        let [low, high] = extent.get_or_insert([p, p]);
                        (*low, *high) = (low.min(p), high.max(p));
                        push_triple(&mut text, p);
                        text.push(b')');
                    }
                    self.put(index, &text)?;
                    text.clear();
                }
                Ok(())
            })?;
        }
        text.extend_from_slice(if self.timed { b"],\n" } else { b"]\n" });
        self.parts[index].yarns = yarns;
        self.parts[index].extents.push(extent);
        self.put(index, &text)
    }

    /// Closes a prim. Its box can only be written when all points have been seen.
    fn end_part(&mut self, index: usize) -> Result<()> {
        let part = &self.parts[index];
        let mut text = Vec::new();
        let several = self.timed;
        if several {
            text.extend_from_slice(b"        }\n");
        }
        let margin = DVec3::splat(part.margin);
        if part.extents.iter().all(Option::is_some) {
            text.extend_from_slice(if several {
                b"        float3[] extent.timeSamples = {\n"
            } else {
                b"        float3[] extent = "
            });
            for (frame, [low, high]) in self.frames.iter().zip(part.extents.iter().flatten()) {
                if several {
                    text.extend_from_slice(format!("            {frame}: ").as_bytes());
                }
                text.extend_from_slice(b"[(");
                push_triple(&mut text, *low - margin);
                text.extend_from_slice(b"), (");
                push_triple(&mut text, *high + margin);
                text.extend_from_slice(if several { b")],\n" } else { b")]\n" });
            }
            if several {
                text.extend_from_slice(b"        }\n");
            }
        }
        text.extend_from_slice(b"    }\n");
        self.put(index, &text)
    }
}

fn push_triple(text: &mut Vec<u8>, p: DVec3) {
    for (i, x) in p.to_array().into_iter().enumerate() {
        text.extend_from_slice(if i > 0 { b", " } else { b"" });
        push_number(text, x, SINGLE);
    }
}

fn topology(curves: &dyn CurveSource) -> Vec<(usize, bool)> {
    (0..curves.yarn_count()).map(|yarn| (curves.yarn_len(yarn), curves.yarn_closed(yarn))).collect()
}

impl FrameWriter for UsdaWriter {
    fn frame(&mut self, index: usize, curves: &dyn CurveSource) -> Result<()> {
        if self.frames.len() == self.frame_count {
            return Err(frame_count_error(&self.path, self.frame_count + 1, self.frame_count));
        }
        if self.frames.is_empty() {
            self.begin(index, curves)?;
        } else if topology(curves) != self.topology {
            return Err(Error::invalid(format_args!(
                "{}: found yarns in frame {index} that differ in number, length or closedness, expected those of frame {}",
                self.path.display(),
                self.frames[0]
            )));
        } else if self.frames.last().is_some_and(|&last| last >= index) {
            return Err(Error::invalid(format_args!(
                "{}: found frame {index} after frame {}, expected rising numbers",
                self.path.display(),
                self.frames[self.frames.len() - 1]
            )));
        }
        self.frames.push(index);
        (0..self.parts.len()).try_for_each(|part| self.points(part, index, curves))
    }

    fn finish(mut self: Box<Self>) -> Result<Vec<PathBuf>> {
        if self.frames.len() != self.frame_count {
            return Err(frame_count_error(&self.path, self.frames.len(), self.frame_count));
        }
        for part in 0..self.parts.len() {
            self.end_part(part)?;
        }
        if let Some(spool) = self.spool.take() {
            let failed = |e| Error::io(&self.path, e);
            let mut file = spool.into_inner().map_err(|e| failed(e.into_error()))?;
            file.rewind().map_err(failed)?;
            let mut buffer = vec![0; 1 << 16];
            loop {
                match file.read(&mut buffer).map_err(failed)? {
                    0 => break,
                    n => self.out.put(&buffer[..n])?,
                }
            }
        }
        self.out.put(b"}\n")?;
        if self.timed {
            let end = self.frames[self.frames.len() - 1];
            self.out.patch(self.end_time_at, end.to_string().as_bytes())?;
        }
        self.out.commit()?;
        Ok(vec![self.path])
    }
}
