// Ambient occlusion from depth: how much of the sky over a pixel's surface stays open, by the horizons in a few directions (after
// horizon-based occlusion, Bavoil et al. 2008, weighted by cosines as in Jimenez et al. 2016), then smoothed where depth is alike.

@group(0) @binding(0) var<uniform> light: Light;
@group(0) @binding(1) var depth: DEPTH;
@group(0) @binding(2) var occlusion: texture_storage_2d<r32float, write>;
@group(0) @binding(3) var before: texture_2d<f32>;

const DIRECTIONS = 3;
const STEPS = 6;
const PI = 3.14159265;

fn depth_at(pixel: vec2<i32>) -> f32 {
    return textureLoad(depth, clamp(pixel, vec2<i32>(0), vec2<i32>(light.lens.zw * 2.0) - 1), 0);
}

// The place of a pixel in the camera's axes; far away where there is nothing.
fn place(pixel: vec2<i32>) -> vec3<f32> {
    let d = max(depth_at(pixel), 1e-9);
    let distance = light.lens.x / d;
    let centre = vec2<f32>(pixel) + 0.5 - light.lens.zw;
    return vec3<f32>(centre.x, -centre.y, -light.lens.y) * (distance / light.lens.y);
}

// The smaller of two differences: that to the neighbour on the same surface.
fn nearer(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return select(b, a, abs(a.z) < abs(b.z));
}

// Angle of the horizon above the plane across the view, on one side.
fn horizon(pixel: vec2<i32>, p: vec3<f32>, look: vec3<f32>, along: vec2<f32>, pixels: f32, low: f32) -> f32 {
    var highest = low;
    for (var k = 0; k < STEPS; k++) {
        // Denser near by.
        let s = (f32(k) + 0.7) / f32(STEPS);
        let at = pixel + vec2<i32>(round(along * max(s * s * pixels, f32(k) + 1.0)));
        let to = place(at) - p;
        let l = length(to);
        let fade = clamp(1.5 - l / light.occlusion.x, 0.0, 1.0);
        highest = max(highest, mix(low, dot(to, look) / max(l, 1e-9), fade));
    }
    return highest;
}

@compute @workgroup_size(8, 8)
fn occlude(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = vec2<i32>(id.xy);
    let size = vec2<i32>(light.lens.zw * 2.0);
    if any(pixel >= size) {
        return;
    }
    if depth_at(pixel) <= 0.0 || light.occlusion.y == 0.0 {
        textureStore(occlusion, pixel, vec4<f32>(1.0));
        return;
    }
    let p = place(pixel);
    let dx = nearer(place(pixel + vec2<i32>(1, 0)) - p, p - place(pixel - vec2<i32>(1, 0)));
    let dy = nearer(p - place(pixel + vec2<i32>(0, 1)), place(pixel - vec2<i32>(0, 1)) - p);
    let normal = normalize(cross(dx, dy));
    let look = -normalize(p);
    let pixels = clamp(light.occlusion.x * light.lens.y / -p.z, 2.0, 96.0);
    // A turn that differs between neighbours, in a pattern of 4 x 4 that smoothing takes away.
    let cell = (pixel.x & 3) * 4 + ((pixel.x + 2 * pixel.y) & 3);
    let turn = (f32(cell) / 16.0 + light.occlusion.z) * PI / f32(DIRECTIONS);
    var open = 0.0;
    for (var k = 0; k < DIRECTIONS; k++) {
        let angle = turn + PI * f32(k) / f32(DIRECTIONS);
        let along = vec2<f32>(cos(angle), sin(angle));
        // The slice through the view and this direction, and the normal in it.
        let d = vec3<f32>(along.x, -along.y, 0.0);
        let across = normalize(cross(d, look));
        let tangent = cross(look, across);
        let flat = normal - across * dot(normal, across);
        let l = length(flat);
        let cosine = clamp(dot(flat, look) / max(l, 1e-6), -1.0, 1.0);
        let tilt = sign(dot(flat, tangent)) * acos(cosine);
        // Horizons as angles from the view, one to each side, no lower than the surface itself.
        let right = acos(clamp(horizon(pixel, p, look, along, pixels, cos(min(tilt + 0.5 * PI, PI))), -1.0, 1.0));
        let left = -acos(clamp(horizon(pixel, p, look, -along, pixels, cos(max(tilt - 0.5 * PI, -PI))), -1.0, 1.0));
        let h1 = tilt + max(left - tilt, -0.5 * PI);
        let h2 = tilt + min(right - tilt, 0.5 * PI);
        let arc = 0.25 * (-cos(2.0 * h1 - tilt) + cosine + 2.0 * h1 * sin(tilt))
            + 0.25 * (-cos(2.0 * h2 - tilt) + cosine + 2.0 * h2 * sin(tilt));
        open += l * arc;
    }
    textureStore(occlusion, pixel, vec4<f32>(clamp(open / f32(DIRECTIONS), 0.0, 1.0)));
}

@compute @workgroup_size(8, 8)
fn smooth_out(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = vec2<i32>(id.xy);
    let size = vec2<i32>(light.lens.zw * 2.0);
    if any(pixel >= size) {
        return;
    }
    let own = depth_at(pixel);
    if own <= 0.0 {
        textureStore(occlusion, pixel, vec4<f32>(1.0));
        return;
    }
    let distance = light.lens.x / own;
    var sum = 0.0;
    var weights = 0.0;
    for (var y = -2; y < 2; y++) {
        for (var x = -2; x < 2; x++) {
            let at = clamp(pixel + vec2<i32>(x, y), vec2<i32>(0), size - 1);
            let d = depth_at(at);
            let apart = abs(light.lens.x / max(d, 1e-9) - distance) / light.sky.w;
            let weight = max(1.0 - apart, 0.0) + 1e-4;
            sum += weight * textureLoad(before, at, 0).x;
            weights += weight;
        }
    }
    textureStore(occlusion, pixel, vec4<f32>(sum / weights));
}
