//! What the stages of a stitch came to on the device, by name: for comparison with their twins. `shaders/trace.wgsl`
//! writes it.

use crate::scene::Stencil;
use std::ops::Range;

/// The stages, and where their words lie in those of a face. `trace_words` in the shader is their sum.
pub fn stages(stencil: &Stencil<f32>) -> Vec<(&'static str, Range<usize>)> {
    let (k, p) = (stencil.knot_count(), stencil.points.len());
    let n = 2 * k;
    let mut at = 0;
    let mut stage = |name, words| {
        at += words;
        (name, at - words..at)
    };
    vec![
        // t1, t2, n, F11, F12, F22.
        stage("frame", 12),
        // Of each knot: centre, height, slope, normal.
        stage("seats", 8 * k),
        // Of each knot: d, l.
        stage("start", 3 * k),
        // Of each point, at the start.
        stage("plane", 2 * p),
        // E at the start.
        stage("energy", 1),
        // Of each unknown i: b, and for each j up to i: A, C.
        stage("normal_equations", n + n * (n + 1)),
        // Of each unknown i: the step, and for each j up to i the factors.
        stage("step", n + n * (n + 1) / 2),
        // Of each knot at the end: d, l.
        stage("knots", 3 * k),
        // Of each point, relative to the first corner.
        stage("points", 3 * p),
    ]
}

/// Words of a face.
pub fn words(stencil: &Stencil<f32>) -> usize {
    stages(stencil).last().map_or(0, |(_, range)| range.end)
}
