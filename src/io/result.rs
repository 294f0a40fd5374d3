//! The project's own result files (`.npz`) of solved frames.

use super::npz::{Floats, FrameArrays, NpzPrecision, NpzWriter, StaticArrays};
use crate::Result;
use crate::backend::FrameOutput;
use crate::curve::sampled_len;
use crate::ids::FaceId;
use crate::math::Scalar;
use crate::scene::{Role, Scene};
use crate::yarn::CurveSource;
use std::path::{Path, PathBuf};

/// Role of a curve sample that is no control point.
const SAMPLE: u8 = 4;

/// Writes solved frames into one `.npz`.
pub struct ResultWriter {
    npz: NpzWriter,
    path: PathBuf,
    direction: Vec<f64>,
    half_length: Vec<f64>,
    energy_start: Vec<f64>,
    energy: Vec<f64>,
    status: Vec<u8>,
}

impl ResultWriter {
    /// Starts a file for `frame_count` frames of curves with `subdivide` extra points a segment. `output`
    /// gives the origin; its precision is the file's.
    ///
    /// # Errors
    /// The file cannot be made.
    pub fn create<T: Scalar>(
        path: &Path,
        scene: &Scene,
        output: &FrameOutput<T>,
        subdivide: usize,
        frame_count: usize,
    ) -> Result<Self> {
        let precision = if std::mem::size_of::<T>() == 4 {
            NpzPrecision::F32 { origin: output.origin }
        } else {
            NpzPrecision::F64
        };
        let (mut offsets, mut face, mut knot, mut role) = (vec![0u32], Vec::new(), Vec::new(), Vec::new());
        for yarn in 0..scene.yarns.len() {
            let range = scene.yarns.range(yarn);
            let len = sampled_len(range.len(), scene.yarns.closed[yarn], subdivide);
            for i in 0..len {
                let [slot, _] = scene.point_slots()[range.start + i / (subdivide + 1)];
                let (batch, index, local) = scene.slot_place(slot);
                let point = &scene.stencils[batch.stencil].points[local];
                let owned = matches!(point.role, Role::Contact | Role::Control);
                face.push(batch.faces[index].0 as i32);
                knot.push(if owned { point.knot as i32 } else { -1 });
                role.push(if i % (subdivide + 1) == 0 { point.role.code() } else { SAMPLE });
            }
            offsets.push(face.len() as u32);
        }
        let mut knot_offsets = vec![0u32];
        for f in 0..scene.face_places.len() {
            let knots = scene.face_stencil(f.into()).map_or(0, |(s, _)| s.knot_count() as u32);
            knot_offsets.push(knot_offsets[f] + knots);
        }
        let arrays = StaticArrays {
            yarn_offsets: &offsets,
            yarn_closed: &scene.yarns.closed,
            radius: Some(scene.yarn_radius * scene.gauge),
            gauge: Some(scene.gauge),
            point_face: &face,
            point_knot: &knot,
            point_role: &role,
            face_knot_offsets: &knot_offsets,
            ..StaticArrays::default()
        };
        Ok(Self {
            npz: NpzWriter::create(path, precision, frame_count, &arrays)?,
            path: path.into(),
            direction: Vec::new(),
            half_length: Vec::new(),
            energy_start: Vec::new(),
            energy: Vec::new(),
            status: Vec::new(),
        })
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn frame<T: Scalar>(
        &mut self,
        scene: &Scene,
        output: &FrameOutput<T>,
        curves: &dyn CurveSource,
    ) -> Result<()> {
        for array in [&mut self.direction, &mut self.half_length, &mut self.energy_start, &mut self.energy] {
            array.clear();
        }
        self.status.clear();
        for f in 0..scene.face_places.len() {
            let face = FaceId::from(f);
            for knot in output.face_knots(scene, face) {
                self.direction.extend([knot.direction.u.to_f64(), knot.direction.v.to_f64()]);
                self.half_length.push(knot.half_length.to_f64());
            }
            let result = output.face(scene, face);
            self.energy_start.push(result.energy_start.to_f64());
            self.energy.push(result.energy.to_f64());
            self.status.push(result.status as u8);
        }
        let arrays = FrameArrays {
            knot_direction: Some(Floats::F64(&self.direction)),
            knot_half_length: Some(Floats::F64(&self.half_length)),
            face_energy_start: Some(Floats::F64(&self.energy_start)),
            face_energy: Some(Floats::F64(&self.energy)),
            face_status: Some(&self.status),
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
