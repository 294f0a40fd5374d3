//! The comparison can fail: a change of 1 % of one number, or of one decision, in each shader is found.

use crate::case::{Case, Found, rolled, tube, uneven};
use crate::common::fabric::{PERIOD, model};
use crate::common::gpu::adapter;
use crate::skips::sequence;
use glam::DVec2;
use knotmesh::backend::gpu::GpuOptions;
use knotmesh::database::gpu::{GpuYarn, shader};
use knotmesh::database::{Settings, SkipYarn};
use knotmesh::pattern::YarnModel;

/// What stands in a shader, and instead.
type Fault = (&'static str, &'static str);

const FORMS: [Fault; 6] = [
    ("dot3(u, u), dot3(u, v)", "1.01 * dot3(u, u), dot3(u, v)"),
    ("normalized_or_zero(cross3(a, b))", "cross3(a, b)"),
    ("return normalized_or_zero(sum)", "return sum"),
    ("place(fit.vertex) - own", "place(fit.vertex) - own * 1.01"),
    ("v = v + vector(", "v = v + 1.01 * vector("),
    ("settings.bends != 0u", "settings.bends == 0u"),
];

const FRAMES: [Fault; 10] = [
    ("settings.phong, 0.0", "settings.phong * 1.01, 0.0"),
    ("paired(b, c, edges[2], edges[3])", "paired(b, c, edges[2], edges[1])"),
    ("vector(c.second) * 2.0)", "vector(c.second) * 2.02)"),
    ("vec4<f32>(c - a, 0.0)", "vec4<f32>(c - b, 0.0)"),
    // Of what is skipped.
    ("known = (settings.unmoved != 0u && same)", "known = (settings.unmoved != 0u)"),
    ("settings.rigid != 0u && near", "settings.rigid != 0u && same"),
    ("&& (changes[face] & HIDDEN) == 0u", ""),
    ("return select(FRAME, 0u, stays)", "return FRAME"),
    ("settings.continued != 0u", "false"),
    ("settings.hides != 0u", "false"),
];

const YARN: [Fault; 16] = [
    ("spread / larger(deviation, 1e-30)", "spread / larger(deviation, 1e-2)"),
    ("larger(mean - deviation, settings.least)", "larger(mean - deviation, settings.least * 1.01)"),
    ("select(vec3<f32>(1.0, 0.0, 1.0), c, finite3(c))", "c * 1.0001"),
    ("c.y / sqrt(c.x * c.z)", "c.y / c.x"),
    ("next.x <= s", "next.x <= s * 1.01"),
    ("s < first.x || last < s", "s < first.x"),
    ("let left = between(near_left, far_left, t.y)", "let left = between(near_left, far_left, t.z)"),
    ("value(at + sa + sy + 1u)", "value(at + sa + sy)"),
    ("inverse[2] * u", "inverse[1] * u"),
    ("maps[face].steps[(k + 1u) % 3u].face != NONE", "true"),
    ("there = own + vec3<f32>(step", "there = own - vec3<f32>(step"),
    ("p[1].xyz * (b * c)", "p[1].xyz * (b * b)"),
    ("first - second * height", "first - second * (height * 1.01)"),
    // Of what is skipped.
    ("(change | changes[face]) & FRAME", "change & FRAME"),
    ("outside = (yarn_places[home].face & TOP) != 0u;", ""),
    ("points[point].y = at.y;", ""),
];

fn found(model: YarnModel, settings: Settings, shaders: &str, faults: &[Fault]) {
    let Some(adapter) = adapter() else { return };
    let size = DVec2::new(6.0, 10.0) * PERIOD;
    let mesh = tube([48, 60], size);
    let motions = sequence(&mesh, &|time| rolled(&mesh, size, time));
    let mut case = Case::new(&mesh, model, settings, motions);
    case.skip = SkipYarn::default();
    let right = case.by_gpu(&adapter, GpuYarn::default());
    for fault in faults {
        assert!(shaders.contains(fault.0), "{} is in no shader", fault.0);
        let device = GpuOptions { fault: Some(*fault), ..GpuOptions::default() };
        let wrong = case.by_gpu(&adapter, GpuYarn { device, ..GpuYarn::default() });
        let differs = |(a, b): (&Found, &Found)| a.differing(b) > 0 || a != b;
        let frames = right.iter().zip(&wrong).filter(|(a, b)| differs((a, b))).count();
        println!("{}: {frames} of {} frames", fault.1, right.len());
        assert!(frames > 0, "nobody sees {} instead of {}", fault.1, fault.0);
    }
}

#[test]
fn of_forms_are_found() {
    found(model(20, 5), Settings::default(), &shader::forms(64), &FORMS);
}

#[test]
fn of_frames_are_found() {
    found(model(20, 5), Settings::default(), &shader::frames(64), &FRAMES);
}

#[test]
fn of_yarn_are_found() {
    found(uneven(20, [4, 3, 3], 2e-3), Settings::default(), &shader::yarn(64), &YARN);
}
