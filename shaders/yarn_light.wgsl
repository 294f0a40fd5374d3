// How light falls, and what colours mean. Layout as in src/render/uniforms.rs.

struct Light {
    clip: mat4x4<f32>,
    view: mat4x4<f32>,
    // Near plane, focal length in pixels, half width, half height.
    lens: vec4<f32>,
    // To the key light; tangent of half its angle.
    key: vec4<f32>,
    // To the middle of the sky; yarn radius.
    sky: vec4<f32>,
    // Texel in units, texels a side, range of depth in units, whether there are shadows.
    shadow: vec4<f32>,
    // Radius in units, whether there is any, turn of the directions, strength.
    occlusion: vec4<f32>,
    // 0 yarn, 1 numbers, 2 tension; its low and high; whether there are plies.
    shading: vec4<f32>,
    top: vec4<f32>,
    bottom: vec4<f32>,
}
