// From light to a picture: passes are added up; the last lays the sum over the background, as sRGB.

struct Developing {
    // This pass and how many there are.
    pass_number: u32,
    passes: u32,
}

@group(0) @binding(0) var<uniform> light: Light;
@group(0) @binding(1) var<uniform> developing: Developing;
@group(0) @binding(2) var shaded: texture_2d<f32>;
@group(0) @binding(3) var<storage, read_write> sums: array<vec4<f32>>;
@group(0) @binding(4) var picture: texture_storage_2d<rgba8unorm, write>;

@compute @workgroup_size(8, 8)
fn develop_picture(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<u32>(light.lens.zw * 2.0);
    if any(id.xy >= size) {
        return;
    }
    let at = id.y * size.x + id.x;
    var sum = textureLoad(shaded, vec2<i32>(id.xy), 0);
    if developing.pass_number > 0u {
        sum += sums[at];
    }
    if developing.pass_number + 1u < developing.passes {
        sums[at] = sum;
        return;
    }
    let over = sum / f32(developing.passes);
    let t = (f32(id.y) + 0.5) / f32(size.y);
    let under = mix(light.top, light.bottom, t);
    let opacity = over.w + under.w * (1.0 - over.w);
    let mixed = over.xyz + under.xyz * (1.0 - over.w);
    let c = clamp(mixed / max(opacity, 1e-6), vec3<f32>(0.0), vec3<f32>(1.0));
    let srgb = select(1.055 * pow(c, vec3<f32>(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3<f32>(0.0031308));
    // Half a step of 8 bits, in a fixed pattern, so that slow gradients show no bands.
    let grain = fract(52.9829189 * fract(dot(vec2<f32>(id.xy), vec2<f32>(0.06711056, 0.00583715)))) - 0.5;
    let even = select(srgb + grain / 255.0, srgb, over.w > 0.999);
    textureStore(picture, vec2<i32>(id.xy), vec4<f32>(even, opacity));
}
