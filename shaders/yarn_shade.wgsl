// Yarn in light: a key light with shadows, a sky with occlusion, plies and fibres from the periodic map.

@group(2) @binding(0) var<uniform> light: Light;
@group(2) @binding(1) var shadow: texture_depth_2d;
@group(2) @binding(2) var shadow_sampler: sampler_comparison;
@group(2) @binding(3) var occlusion: texture_2d<f32>;
@group(2) @binding(4) var fibres: texture_2d<f32>;
@group(2) @binding(5) var fibre_sampler: sampler;

struct Shaded {
    @builtin(position) @invariant clip: vec4<f32>,
    @location(0) p: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) tangent: vec3<f32>,
    @location(3) side: vec4<f32>,
    @location(4) colour: vec3<f32>,
    @location(5) stretch: f32,
}

@vertex
fn shade_vertex(@builtin(vertex_index) number: u32, @builtin(instance_index) instance: u32) -> Shaded {
    let v = tube(number, instance);
    return Shaded(eye.clip * vec4<f32>(v.p, 1.0), v.p, v.normal, v.tangent, vec4<f32>(v.side, v.along), v.colour, v.stretch);
}

// Places on a disc, even however many are taken (Vogel's spiral).
fn disc(i: u32, count: u32) -> vec2<f32> {
    let r = sqrt((f32(i) + 0.5) / f32(count));
    let angle = 2.3999632 * f32(i);
    return r * vec2<f32>(cos(angle), sin(angle));
}

// Where in the shadow map a place stands that is lifted off its own surface, and its depth there.
fn from_light(p: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let slope = 1.0 - clamp(dot(normal, light.key.xyz), 0.0, 1.0);
    let lifted = p + normal * ((1.0 + 2.0 * slope) * light.shadow.x + 0.05 * light.sky.w);
    let at = light.clip * vec4<f32>(lifted, 1.0);
    return vec3<f32>(vec2<f32>(at.x, -at.y) * 0.5 + 0.5, at.z);
}

// How much of the key light comes through, softer the further away what is in between (Fernando 2005).
fn lit(p: vec3<f32>, normal: vec3<f32>) -> f32 {
    if light.shadow.w == 0.0 {
        return 1.0;
    }
    let texel = light.shadow.x;
    let at = from_light(p, normal);
    let map = light.shadow.y;
    // What stands in between, within the light's angle.
    let search = 2.5 * light.sky.w * light.key.w * 6.0 + texel;
    var between = 0.0;
    var found = 0.0;
    for (var i = 0u; i < 8u; i++) {
        let tap = at.xy + disc(i, 8u) * search / (texel * map);
        let d = textureLoad(shadow, clamp(vec2<i32>(tap * map), vec2<i32>(0), vec2<i32>(i32(map) - 1)), 0);
        if d > at.z {
            between += d;
            found += 1.0;
        }
    }
    if found == 0.0 {
        return 1.0;
    }
    let gap = (between / found - at.z) * light.shadow.z;
    let soft = clamp(gap * light.key.w * 2.0, 1.2 * texel, 24.0 * texel);
    var open = 0.0;
    for (var i = 0u; i < 16u; i++) {
        let tap = at.xy + disc(i, 16u) * soft / (texel * map);
        open += textureSampleCompareLevel(shadow, shadow_sampler, tap, at.z);
    }
    return open / 16.0;
}

// The same for yarn of a pixel or less: shadows as soft as a texel.
fn lit_far(p: vec3<f32>, normal: vec3<f32>) -> f32 {
    if light.shadow.w == 0.0 {
        return 1.0;
    }
    let at = from_light(p, normal);
    var open = 0.0;
    for (var i = 0u; i < 3u; i++) {
        open += textureSampleCompareLevel(shadow, shadow_sampler, at.xy + disc(i, 3u) * 1.2 / light.shadow.y, at.z);
    }
    return open / 3.0;
}

// Blue, off-white, red: less than at rest, at rest, more.
fn diverging(t: f32) -> vec3<f32> {
    var stops = array<vec3<f32>, 9>(DIVERGING);
    let at = clamp(t, 0.0, 1.0) * 8.0;
    let i = min(u32(at), 7u);
    return mix(stops[i], stops[i + 1u], at - f32(i));
}

// A shoulder for what is brighter than paper.
fn develop(c: vec3<f32>) -> vec3<f32> {
    let over = max(c - 0.7, vec3<f32>(0.0));
    return min(c, vec3<f32>(0.7)) + 0.3 * (1.0 - exp(-over / 0.3));
}

// A surface in light: its normal with and without plies, the fibres' direction, how open it lies between fibres, and how light it is.
struct Surface {
    smooth_normal: vec3<f32>,
    normal: vec3<f32>,
    fibre: vec3<f32>,
    open: f32,
    tone: f32,
}

fn shaded(in: Shaded, on: Surface, through: f32) -> vec4<f32> {
    let look = towards(eye, in.p);
    var colour = in.colour;
    if light.shading.x == 2.0 {
        colour = diverging((in.stretch - light.shading.y) / (light.shading.z - light.shading.y));
    }
    let ambient = textureLoad(occlusion, vec2<i32>(in.clip.xy), 0).x;
    // Fibres pass light on: it wraps around.
    let facing = dot(on.normal, light.key.xyz);
    let wrap = 0.3;
    let key = clamp((facing + wrap) / (1.0 + wrap), 0.0, 1.0) * mix(0.12, 1.0, through);
    let sky = mix(0.55, 1.0, 0.5 + 0.5 * dot(on.normal, light.sky.xyz));
    // Light that comes back from neighbours of the same colour brightens what is occluded.
    let bounced = ambient + (1.0 - ambient) * 0.35 * colour;
    let inside = mix(0.45, 1.0, on.open);
    if light.shading.x != 0.0 {
        // Colours that stand for numbers keep their hue and most of their lightness.
        let plain = 0.62 + 0.38 * key * inside;
        return vec4<f32>(colour * plain * mix(0.5, 1.0, ambient), 1.0);
    }
    // A fibre's highlight lies where light and view are mirrored across its length (Kajiya and Kay 1989).
    let halfway = normalize(look + light.key.xyz);
    let along = dot(on.fibre, halfway);
    let shine = pow(max(1.0 - along * along, 0.0), 24.0) * clamp(facing * 2.0 + 0.3, 0.0, 1.0) * through;
    // Fuzz catches light at the rim.
    let rim = pow(1.0 - clamp(dot(on.smooth_normal, look), 0.0, 1.0), 4.0);
    let diffuse = colour * on.tone * inside * (1.02 * key + 0.5 * sky * bounced);
    let white = vec3<f32>(0.05) * shine * inside + (colour * 0.5 + 0.12) * rim * (0.25 * sky * ambient + 0.2 * through);
    return vec4<f32>(develop(diffuse + white), 1.0);
}

// What stands for a texel of the map.
fn surface(texel: vec4<f32>, normal: vec3<f32>, tangent: vec3<f32>) -> Surface {
    if light.shading.w == 0.0 {
        return Surface(normal, normal, tangent, 1.0, 1.0);
    }
    // The map's second direction goes round with the sides' order.
    let slopes = (texel.xy * 2.0 - 1.0 - 1.0 / 255.0) * 0.9;
    let up = sqrt(max(1.0 - dot(slopes, slopes), 0.05));
    let bumped = normalize(normal * up + tangent * slopes.x + cross(tangent, normal) * slopes.y);
    let fibre = normalize(tangent - bumped * dot(tangent, bumped));
    return Surface(normal, bumped, fibre, texel.z, mix(0.82, 1.18, texel.w));
}

@fragment
fn shade(in: Shaded) -> @location(0) vec4<f32> {
    let tangent = normalize(in.tangent);
    let normal = normalize(in.normal);
    // Turns around, and how fast they change: where one way to count them jumps, the other does not.
    let side = in.side.xyz - tangent * dot(in.side.xyz, tangent);
    let around = atan2(dot(normal, cross(tangent, side)), dot(normal, side)) / 6.2831853;
    let other = fract(around);
    let dx = select(dpdx(other), dpdx(around), abs(dpdx(around)) < abs(dpdx(other)));
    let dy = select(dpdy(other), dpdy(around), abs(dpdy(around)) < abs(dpdy(other)));
    // Texels a pixel, of its two sides the geometric mean: the greater alone would blur what is seen from the side.
    let texels = vec2<f32>(textureDimensions(fibres));
    let right = length(vec2<f32>(dpdx(in.side.w), dx) * texels);
    let down = length(vec2<f32>(dpdy(in.side.w), dy) * texels);
    let level_of_map = max(0.5 * log2(max(right * down, 1e-12)), log2(max(right, down)) - 1.5);
    let texel = textureSampleLevel(fibres, fibre_sampler, vec2<f32>(in.side.w, around), level_of_map);
    return shaded(in, surface(texel, normal, tangent), lit(in.p, normal));
}

// Yarn of a pixel or less: what is seen of plies and fibres is their mean.
@fragment
fn shade_far(in: Shaded) -> @location(0) vec4<f32> {
    let normal = normalize(in.normal);
    let mean = vec4<f32>(0.5 + 0.5 / 255.0, 0.5 + 0.5 / 255.0, MEAN);
    return shaded(in, surface(mean, normal, normalize(in.tangent)), lit_far(in.p, normal));
}
