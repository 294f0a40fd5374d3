//! Yarn curves as writers ask for them and readers give them.

use crate::Result;
use glam::DVec3;

/// Something with yarns: a solved frame or a curve file. Points are streamed, for a yarn may be longer
/// than memory allows (a helical tube is one yarn).
pub trait CurveSource {
    /// Number of yarns.
    fn yarn_count(&self) -> usize;
    /// Whether a yarn is closed. Closed yarns do not repeat their first point.
    fn yarn_closed(&self, yarn: usize) -> bool;
    /// Number of points of a yarn.
    fn yarn_len(&self, yarn: usize) -> usize;
    /// The yarn radius in world units, where known.
    fn yarn_radius(&self, yarn: usize) -> Option<f64>;
    /// Calls `sink` with consecutive chunks of the yarn's points, world units.
    fn visit(&self, yarn: usize, sink: &mut dyn FnMut(&[DVec3]) -> Result<()>) -> Result<()>;
    /// Calls `sink` with consecutive chunks of one number per point: the pattern line the point comes
    /// from (0 where unknown). Chunks need not match those of `visit`.
    fn visit_sources(&self, yarn: usize, sink: &mut dyn FnMut(&[u32]) -> Result<()>) -> Result<()> {
        let mut left = self.yarn_len(yarn);
        while left > 0 {
            let n = left.min(1024);
            sink(&[0; 1024][..n])?;
            left -= n;
        }
        Ok(())
    }
    /// Names and lengths of the yarn length units, where the source has any.
    fn units(&self) -> &[(String, f64)] {
        &[]
    }
    /// Rest lengths along the yarns, where the source has any.
    fn checkpoints(&self) -> &[CurveCheckpoint] {
        &[]
    }
}

/// A rest length that starts at a point of a yarn (`.yarns` chunk `chk.`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveCheckpoint {
    /// Global point index: points of all yarns one after the other.
    pub point: u32,
    /// Length in units.
    pub length: f64,
    /// The unit, counted from 0.
    pub unit: u32,
}

/// Curves in memory, as readers return them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    /// Points of all yarns, one yarn after the other, world units.
    pub points: Vec<DVec3>,
    /// `[yarn + 1]` yarn i is `points[offsets[i] .. offsets[i + 1]]`.
    pub offsets: Vec<usize>,
    /// `[yarn]` closed yarns do not repeat their first point.
    pub closed: Vec<bool>,
    /// `[yarn]` radius, world units, where the file has one.
    pub radius: Vec<Option<f64>>,
    /// `[point]` pattern line, or empty.
    pub sources: Vec<u32>,
    /// Yarn length units.
    pub units: Vec<(String, f64)>,
    /// Rest lengths.
    pub checkpoints: Vec<CurveCheckpoint>,
}

impl CurveSource for Curves {
    fn yarn_count(&self) -> usize {
        self.closed.len()
    }
    fn yarn_closed(&self, yarn: usize) -> bool {
        self.closed[yarn]
    }
    fn yarn_len(&self, yarn: usize) -> usize {
        self.offsets[yarn + 1] - self.offsets[yarn]
    }
    fn yarn_radius(&self, yarn: usize) -> Option<f64> {
        self.radius[yarn]
    }
    fn visit(&self, yarn: usize, sink: &mut dyn FnMut(&[DVec3]) -> Result<()>) -> Result<()> {
        sink(&self.points[self.offsets[yarn]..self.offsets[yarn + 1]])
    }
    fn visit_sources(&self, yarn: usize, sink: &mut dyn FnMut(&[u32]) -> Result<()>) -> Result<()> {
        if self.sources.is_empty() {
            return sink(&vec![0; self.yarn_len(yarn)]);
        }
        sink(&self.sources[self.offsets[yarn]..self.offsets[yarn + 1]])
    }
    fn units(&self) -> &[(String, f64)] {
        &self.units
    }
    fn checkpoints(&self) -> &[CurveCheckpoint] {
        &self.checkpoints
    }
}

impl Curves {
    /// No yarns yet; points are pushed, and [`Curves::end_yarn`] closes each yarn off.
    pub fn empty() -> Self {
        Self { offsets: vec![0], ..Self::default() }
    }

    /// Makes a yarn of the points pushed since the last one.
    pub fn end_yarn(&mut self, closed: bool, radius: Option<f64>) {
        self.offsets.push(self.points.len());
        self.closed.push(closed);
        self.radius.push(radius);
    }
}
