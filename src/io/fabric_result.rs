//! Result files (`.npz`) of the precomputed method.

use super::npz::{Floats, FrameArrays, NpzPrecision, NpzWriter, StaticArrays};
use crate::Result;
use crate::curve::sampled_len;
use crate::database::{Fabric, FabricCurves, YarnFrame};
use crate::math::{Scalar, V3};
use std::path::{Path, PathBuf};

/// Writes frames into one `.npz`. Samples between points have the period, vertex, twist and director of the point before.
pub struct FabricWriter {
    npz: NpzWriter,
    path: PathBuf,
    /// `[sample]` the point before.
    points: Vec<u32>,
    twist: Vec<f64>,
    director: Vec<f64>,
}

/// What of a fabric a file holds.
#[derive(Clone, Copy, Debug)]
pub struct Written {
    /// Extra points a segment.
    pub subdivide: usize,
    /// World units are so many metres.
    pub unit: f64,
    /// Number of frames.
    pub frames: usize,
}

impl FabricWriter {
    /// Starts a file. `frame` gives the origin; its precision is the file's.
    ///
    /// # Errors
    /// The file cannot be made.
    pub fn create<T: Scalar>(
        path: &Path,
        fabric: &Fabric,
        frame: &YarnFrame<T>,
        written: Written,
    ) -> Result<Self> {
        let Written { subdivide, unit, frames } = written;
        let precision = if std::mem::size_of::<T>() == 4 {
            NpzPrecision::F32 { origin: frame.origin / unit }
        } else {
            NpzPrecision::F64
        };
        let (lengths, vertices, faces) =
            (fabric.arclengths(), fabric.point_vertices(), fabric.point_polygons());
        let rest = &fabric.model.pattern.rest_lengths;
        let (mut offsets, mut points, mut arclength) = (vec![0u32], Vec::new(), Vec::new());
        for yarn in 0..fabric.yarn_count() {
            let range = fabric.yarn(yarn);
            for i in 0..sampled_len(range.len(), fabric.yarn_closed[yarn], subdivide) {
                let point = range.start + i / (subdivide + 1);
                let share = (i % (subdivide + 1)) as f64 / (subdivide + 1) as f64;
                points.push(point as u32);
                arclength.push((lengths[point] + share * rest[vertices[point] as usize]) / unit);
            }
            offsets.push(points.len() as u32);
        }
        let of = |values: &[u32]| -> Vec<i32> { points.iter().map(|p| values[*p as usize] as i32).collect() };
        let tile = |p: &u32| {
            let tile = fabric.tiles[fabric.point_tiles[*p as usize] as usize];
            [tile.y, tile.x]
        };
        let arrays = StaticArrays {
            yarn_offsets: &offsets,
            yarn_closed: &fabric.yarn_closed,
            radius: Some(fabric.model.pattern.radius / unit),
            point_face: &of(&faces),
            arclength: &arclength,
            point_tile: &points.iter().map(tile).collect::<Vec<_>>(),
            point_vertex: &of(&vertices),
            ..StaticArrays::default()
        };
        let npz = NpzWriter::create(path, precision, frames, &arrays)?;
        Ok(Self { npz, path: path.into(), points, twist: Vec::new(), director: Vec::new() })
    }

    /// Appends a frame, with its directors (`[point]`).
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn frame<T: Scalar>(
        &mut self,
        curves: &FabricCurves<T>,
        frame: &YarnFrame<T>,
        directors: &[V3<T>],
    ) -> Result<()> {
        self.twist.clear();
        self.director.clear();
        for point in &self.points {
            self.twist.push(frame.twists[*point as usize].to_f64());
            self.director.extend(directors[*point as usize].to_f64().to_array());
        }
        let arrays = FrameArrays {
            twist: Some(Floats::F64(&self.twist)),
            director: Some(Floats::F64(&self.director)),
            ..FrameArrays::default()
        };
        self.npz.frame(curves, &arrays)
    }

    /// Completes the file and gives its path.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<PathBuf> {
        self.npz.finish()?;
        Ok(self.path)
    }
}
