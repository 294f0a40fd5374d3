//! Curves that several tests use.

use super::Random;
use glam::DVec3;
use knotmesh::backend::FrameOutput;
use knotmesh::curve::FrameCurves;
use knotmesh::scene::Scene;
use knotmesh::yarn::{CurveCheckpoint, CurveSource, Curves};

/// All points of a yarn.
pub fn collect(curves: &dyn CurveSource, yarn: usize) -> Vec<DVec3> {
    let mut points = Vec::new();
    curves
        .visit(yarn, &mut |chunk| {
            points.extend_from_slice(chunk);
            Ok(())
        })
        .expect("the sink takes all");
    points
}

/// The samples of all yarns of a frame.
pub fn samples(scene: &Scene, output: &FrameOutput<f32>, subdivide: usize) -> Vec<DVec3> {
    let curves = FrameCurves::new(scene, output, subdivide, None);
    (0..curves.yarn_count()).flat_map(|yarn| collect(&curves, yarn)).collect()
}

/// Yarns of the given lengths and closedness, random points within 10 units.
pub fn curves(seed: u64, shape: &[(usize, bool)], radius: Option<f64>) -> Curves {
    let mut random = Random::new(seed);
    let mut curves = Curves::empty();
    for &(length, closed) in shape {
        for _ in 0..length {
            curves.points.push(
                DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0))
                    * 10.0,
            );
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
