// Something that yarn is seen from: the camera, or the light. Layout as in src/render/uniforms.rs.

struct Eye {
    clip: mat4x4<f32>,
    // Planes of what is seen, normals inwards.
    planes: array<vec4<f32>, 6>,
    // Place of the camera and 1, or the direction to the light and 0.
    place: vec4<f32>,
    // Pixels per unit at distance 1 (camera) or anywhere (light), detail, least radius in pixels, how many pixels a chord may be off.
    scale: vec4<f32>,
}

// Towards the eye.
fn towards(eye: Eye, p: vec3<f32>) -> vec3<f32> {
    return normalize(eye.place.xyz - p * eye.place.w);
}

// Pixels per unit at a place.
fn pixels(eye: Eye, p: vec3<f32>) -> f32 {
    let distance = length(eye.place.xyz - p);
    return eye.scale.x / mix(1.0, max(distance, 1e-12), eye.place.w);
}
