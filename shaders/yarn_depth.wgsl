// Depth alone: for the light's view, and before shading.

struct Inside {
    @builtin(position) @invariant clip: vec4<f32>,
}

@vertex
fn depth_vertex(@builtin(vertex_index) number: u32, @builtin(instance_index) instance: u32) -> Inside {
    return Inside(eye.clip * vec4<f32>(tube(number, instance).p, 1.0));
}
