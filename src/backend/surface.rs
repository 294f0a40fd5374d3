//! The surface of a frame: places in template units, normals around corners, and what of them changed.

use super::rigid::{self, Motion};
use super::skip::Skip;
use crate::math::{Real, Scalar, V3};
use crate::scene::Scene;
use crate::{Error, Result};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

const CHUNK: usize = 4096;

/// Places and normals of the last frame.
#[derive(Debug, Default)]
pub struct Surface<T> {
    origin: Option<DVec3>,
    /// `[vertex]` world positions, as they were given.
    last: Vec<DVec3>,
    /// `[chunk of vertices]` whether any place is not finite.
    spoilt: Vec<bool>,
    /// `[vertex]` template units, relative to the origin.
    pub local: Vec<V3<T>>,
    /// `[face]` vector areas.
    pub areas: Vec<V3<T>>,
    /// `[corner group]` sums of the vector areas around it; none where each face is on its own.
    pub normals: Vec<V3<T>>,
    /// Whether any place is not finite.
    pub not_finite: bool,
    /// `[vertex]` whether it moved since the frame before.
    pub moved: Vec<bool>,
    /// `[face]` whether its area changed.
    pub bent: Vec<bool>,
    /// `[corner group]` whether its normal changed.
    pub turned: Vec<bool>,
    /// Whether anything moved since the frame before.
    pub any: bool,
}

impl<T: Scalar> Surface<T> {
    /// World position that places are relative to.
    pub fn origin(&self) -> DVec3 {
        self.origin.unwrap_or(DVec3::ZERO)
    }

    /// Sets what places are relative to, before the first frame: those of a frame before would not be moved.
    pub fn set_origin(&mut self, origin: DVec3) {
        if self.local.is_empty() {
            self.origin = Some(origin);
        }
    }

    /// Whether nothing moves in a frame after one in which nothing moved: the cheapest way to know.
    pub fn rests(&self, positions: &[DVec3]) -> bool {
        !self.any && self.holds(positions)
    }

    /// Whether these are the positions of the last frame.
    pub fn holds(&self, positions: &[DVec3]) -> bool {
        let bits = bytemuck::cast_slice::<DVec3, u64>;
        !self.local.is_empty() && bits(&self.last) == bits(positions)
    }

    /// The motion of the whole mesh as one since the last frame, where that is looked for and there is one, after `turned`
    /// frames in a row that were only turned along.
    pub fn motion(&self, scene: &Scene, skip: &Skip, positions: &[DVec3], turned: u32) -> Option<Motion> {
        let fits = !self.not_finite && self.last.len() == positions.len();
        if !fits || !skip.rigid || turned >= rigid::FRAMES {
            return None;
        }
        let share = skip.tolerance / f64::from(rigid::FRAMES);
        Motion::find(&self.last, positions, share * scene.yarn_radius * scene.gauge)
    }

    /// Takes a frame's positions, and works out areas and normals where they moved; says whether anything did.
    pub fn update(&mut self, scene: &Scene, positions: &[DVec3]) -> Result<bool> {
        let first = self.local.is_empty();
        let before = self.any;
        let any = self.take(scene, positions)?;
        if any {
            self.turn(scene, first);
        } else if before {
            self.bent.fill(false);
            self.turned.fill(false);
        }
        Ok(any)
    }

    /// Takes a frame's positions; says whether anything moved. Areas and normals stay as they are.
    pub fn take(&mut self, scene: &Scene, positions: &[DVec3]) -> Result<bool> {
        if positions.len() != scene.vertex_count {
            return Err(Error::invalid(format_args!(
                "a frame of {} positions, expected {} as the mesh has vertices",
                positions.len(),
                scene.vertex_count
            )));
        }
        let first = self.local.is_empty();
        let origin = *self.origin.get_or_insert_with(|| middle(positions));
        self.local.resize(positions.len(), V3::zero());
        self.last.resize(positions.len(), DVec3::ZERO);
        self.moved.resize(positions.len(), false);
        let scale = 1.0 / scene.gauge;
        let any = AtomicBool::new(first);
        self.spoilt.resize(positions.len().div_ceil(CHUNK), false);
        // Beyond this, face-local differences could overflow; such faces fall back anyway.
        let limit = DVec3::splat(if std::mem::size_of::<T>() == 4 { 1e37 } else { 1e300 });
        let chunks = self.local.par_chunks_mut(CHUNK).zip(self.moved.par_chunks_mut(CHUNK));
        let chunks = chunks.zip(self.last.par_chunks_mut(CHUNK)).zip(&mut self.spoilt);
        chunks.zip(positions.par_chunks(CHUNK)).for_each(|((((local, moved), last), spoilt), positions)| {
            // Where nothing moves, nothing is done but this.
            if !first && bytemuck::cast_slice::<_, u64>(last) == bytemuck::cast_slice::<_, u64>(positions) {
                moved.fill(false);
                return;
            }
            last.copy_from_slice(positions);
            let (mut some, mut marked) = (false, false);
            for ((l, moved), p) in local.iter_mut().zip(moved).zip(positions) {
                // One that is not finite is marked, for clamping would make it so.
                let new =
                    if p.is_finite() { ((*p - origin) * scale).clamp(-limit, limit) } else { DVec3::NAN };
                let new = V3::of(new);
                // One that is still not finite did not move.
                *moved = first || (new != *l && !(new.x.to_f64().is_nan() && l.x.to_f64().is_nan()));
                *l = new;
                some |= *moved;
                marked |= new.x.to_f64().is_nan();
            }
            if some {
                any.store(true, Relaxed);
            }
            *spoilt = marked;
        });
        self.not_finite = self.spoilt.contains(&true);
        self.any = any.into_inner();
        Ok(self.any)
    }

    /// Vector areas of all faces, and their sums around corners (model section 3).
    fn turn(&mut self, scene: &Scene, first: bool) {
        let (local, moved) = (&self.local, &self.moved);
        self.areas.resize(scene.face_places.len(), V3::zero());
        self.bent.resize(scene.face_places.len(), false);
        let chunks = self.areas.par_chunks_mut(CHUNK).zip(self.bent.par_chunks_mut(CHUNK));
        chunks.enumerate().for_each(|(chunk, (areas, bent))| {
            for (i, (area, bent)) in areas.iter_mut().zip(bent).enumerate() {
                let face = chunk * CHUNK + i;
                let range = scene.face_offsets[face] as usize..scene.face_offsets[face + 1] as usize;
                let vertices = &scene.face_vertices[range];
                *bent = first || vertices.iter().any(|v| moved[*v as usize]);
                if *bent {
                    *area = vector_area(vertices, local);
                }
            }
        });
        let Some(groups) = &scene.corner_groups else { return };
        let (areas, bent) = (&self.areas, &self.bent);
        self.normals.resize(groups.len(), V3::zero());
        self.turned.resize(groups.len(), false);
        let chunks = self.normals.par_chunks_mut(CHUNK).zip(self.turned.par_chunks_mut(CHUNK));
        chunks.enumerate().for_each(|(chunk, (normals, turned))| {
            for (i, (normal, turned)) in normals.iter_mut().zip(turned).enumerate() {
                let group = chunk * CHUNK + i;
                let [begin, end] = [0, 1].map(|k| groups.offsets[group + k] as usize);
                let faces = &groups.faces[begin..end];
                *turned = faces.iter().any(|f| bent[*f as usize]);
                if *turned {
                    *normal = faces.iter().fold(V3::zero(), |sum, f| sum + areas[*f as usize]);
                }
            }
        });
    }
}

/// The vector area of a polygon; zero for one so thin that it has no frame either (see
/// [`crate::knot::frame::face_frame`]) or not finite, so that a bad face spoils no neighbour's normal.
fn vector_area<T: Real>(vertices: &[u32], local: &[V3<T>]) -> V3<T> {
    let first = local[vertices[0] as usize];
    let (mut sum, mut size) = (V3::zero(), T::zero());
    for pair in vertices[1..].windows(2) {
        let (a, b) = (local[pair[0] as usize] - first, local[pair[1] as usize] - first);
        sum = sum + a.cross(b);
        size += a.dot(a) + b.dot(b);
    }
    let area = sum * T::of(0.5);
    let wide = T::and((T::of(1e-6) * size).lt(area.length()), size.finite());
    V3::select(T::and(wide, area.finite()), area, V3::zero())
}

/// The median position, coordinate by coordinate, of a regular sample: in the midst of the mesh even when some
/// vertices are far off or not finite. What places are relative to.
pub fn middle(positions: &[DVec3]) -> DVec3 {
    const SAMPLE: usize = 1024;
    let every = positions.len().div_ceil(SAMPLE).max(1);
    let median = |axis: usize| {
        let mut values: Vec<f64> = positions.iter().step_by(every).map(|p| p[axis]).collect();
        values.retain(|x| x.is_finite());
        let half = values.len() / 2;
        values.sort_by(f64::total_cmp);
        values.get(half).copied().unwrap_or(0.0)
    };
    DVec3::new(median(0), median(1), median(2))
}

/// Where corners of a face that are not finite are put, if there are any: at the mean of the others, or at the
/// origin if there are none.
pub(super) fn stand_in<T: Scalar>(corners: &[u32], local: &[V3<T>]) -> Option<V3<T>> {
    let finite = || corners.iter().map(|v| local[*v as usize]).filter(|x| x.finite());
    let count = finite().count();
    // Shares are summed, for a sum of far corners could overflow.
    let share = T::one() / T::of(count.max(1) as f64);
    (count < corners.len()).then(|| finite().fold(V3::zero(), |sum, x| sum + x * share))
}
