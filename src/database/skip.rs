//! What of a frame is known already.

use super::fabric::Fabric;
use super::forms::FaceFrame;
use crate::math::Scalar;

/// All of a face changed.
pub const ALL: u8 = STRAIN | FRAME;
/// Strains changed: its points are displaced anew.
pub const STRAIN: u8 = 1;
/// Places or normals changed: its points are lifted anew.
pub const FRAME: u8 = 2;
/// Nobody sees it.
pub const HIDDEN: u8 = 4;

/// Work to skip where that does not change the result by more than its bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkipYarn {
    /// Faces that are, with all around them, to the bit where they were. Changes nothing.
    pub unmoved: bool,
    /// Faces whose strain is that of the last look-up: their points are only lifted.
    pub rigid: bool,
    /// How far that may move a point beside its face, yarn radii.
    pub tolerance: f64,
}

impl SkipYarn {
    /// Skips nothing.
    pub const NOTHING: Self = Self { unmoved: false, rigid: false, tolerance: 0.0 };
}

impl Default for SkipYarn {
    fn default() -> Self {
        Self { unmoved: true, rigid: true, tolerance: 1e-3 }
    }
}

/// How many points were not worked out, and why; the rest was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct SkippedYarn {
    /// Nothing around them moved: nothing was done.
    pub unmoved: usize,
    /// Of a strain that was known: lifted.
    pub rigid: usize,
    /// Not visible: nothing was done.
    pub hidden: usize,
}

/// What counts as the same strain.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance<T> {
    /// Of components of I.
    pub first: T,
    /// Of components of twice II.
    pub second: T,
}

impl<T: Scalar> Tolerance<T> {
    /// Half of what the table's steepest slope allows for each form.
    pub fn new(fabric: &Fabric, skip: &SkipYarn) -> Self {
        let table = &fabric.model.table;
        let axes = table.axes();
        let (nx, na) = (axes[0].len(), axes[1].len());
        let mut slope = 0.0;
        for (k, stride) in [1, nx, nx * na].into_iter().enumerate() {
            let mut steepest = 0f64;
            for (at, value) in table.values().iter().enumerate() {
                let node = at % table.node_count() / stride % axes[k].len();
                if node + 1 == axes[k].len() {
                    continue;
                }
                let next = &table.values()[at + stride];
                let far = (0..3).map(|i| f64::from(next[i] - value[i]).powi(2)).sum::<f64>().sqrt();
                steepest = steepest.max(far / f64::from(axes[k][node + 1] - axes[k][node]));
            }
            slope += steepest;
        }
        let pattern = &fabric.model.pattern;
        // Strains follow components of C at most so fast, C being bounded from below.
        let faster = 1.0 / fabric.settings.min_eigenvalue.max(0.1);
        let slope = (slope * faster * fabric.settings.displacement.abs()).max(1e-30);
        let allowed = 0.5 * skip.tolerance * pattern.radius / slope;
        let height = fabric.rows.iter().map(|r| r.1.abs()).fold(0.0, f64::max).max(1e-30);
        Self { first: T::of(allowed.min(1e30)), second: T::of((allowed / height).min(1e30)) }
    }

    /// Puts a face's new frame in the old one's place and says what changed. A strain within the tolerance is not taken
    /// over, so that slow changes add up to one that is seen.
    pub fn update(&self, old: &mut FaceFrame<T>, new: FaceFrame<T>, continued: bool, skip: &SkipYarn) -> u8 {
        if !continued {
            *old = new;
            return ALL;
        }
        // Differences from the first corner add to it: a third for each.
        let close = |a: &[[T; 4]; 3], b: &[[T; 4]; 3], tolerance: T| {
            let within = tolerance * T::of(1.0 / 3.0);
            a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (*a - *b).abs() <= within)
        };
        let same = old.first == new.first && old.second == new.second;
        let known = (skip.unmoved && same)
            || skip.rigid
                && close(&old.first, &new.first, self.first)
                && close(&old.second, &new.second, self.second);
        let stays =
            skip.unmoved && old.place == new.place && old.phong == new.phong && old.normal == new.normal;
        let (first, second) = (old.first, old.second);
        *old = new;
        if !known {
            return ALL;
        }
        (old.first, old.second) = (first, second);
        if stays { 0 } else { FRAME }
    }
}
