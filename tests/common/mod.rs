//! Curves and folders that several tests use.
#![allow(dead_code)]

use glam::DVec3;
use knotmesh::yarn::{CurveCheckpoint, Curves};
use std::path::PathBuf;

/// Pseudo-random numbers, the same in every run (xorshift).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
    /// Between -1 and 1.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Yarns of the given lengths and closedness, random points within 10 units.
pub fn curves(seed: u64, shape: &[(usize, bool)], radius: Option<f64>) -> Curves {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let mut curves = Curves::empty();
    for &(length, closed) in shape {
        for _ in 0..length {
            curves.points.push(DVec3::new(random.unit(), random.unit(), random.unit()) * 10.0);
        }
        curves.end_yarn(closed, radius);
    }
    curves
}

/// Open and closed yarns, short ones among them.
pub const MIXED: [(usize, bool); 6] = [(5, false), (6, true), (2, false), (1, false), (3, true), (9, false)];

/// [`MIXED`] with pattern lines, units and rest lengths.
pub fn annotated() -> Curves {
    let mut curves = curves(7, &MIXED, Some(0.125));
    curves.sources = (0..curves.points.len() as u32).map(|i| 3 * i + 1).collect();
    curves.units = vec![("1".into(), 1.0), ("inna".into(), 0.25), ("gl".into(), 0.5)];
    // Points before, in and after a closed yarn.
    curves.checkpoints = [(0, 1.5, 0), (5, 2.0, 1), (10, 0.0, 2), (11, 4.0, 2), (14, 7.5, 0), (25, 1.0, 1)]
        .map(|(point, length, unit)| CurveCheckpoint { point, length, unit })
        .to_vec();
    curves
}

/// The folder of real files, or a line that says it is not there.
pub fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("KNOTMESH_DATA").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: KNOTMESH_DATA is not set");
    }
    folder
}

/// Extensions of all curve formats.
pub const EXTENSIONS: [&str; 7] = ["yarns", "bcc", "obj", "npz", "usda", "txt", "pbrt"];

/// Compares yarns; points may differ by `tolerance`.
pub fn assert_same(found: &Curves, expected: &Curves, tolerance: f64, what: &str) {
    assert_eq!(found.offsets, expected.offsets, "{what}");
    assert_eq!(found.closed, expected.closed, "{what}");
    for (a, b) in found.points.iter().zip(&expected.points) {
        assert!(a.distance(*b) <= tolerance, "{what}: {a} {b}");
    }
    for (a, b) in found.radius.iter().zip(&expected.radius) {
        if let (Some(a), Some(b)) = (a, b) {
            assert!((a - b).abs() <= tolerance, "{what}: radius {a} {b}");
        }
    }
}
