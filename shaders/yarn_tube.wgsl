// A segment's tube, an instance each: rings of vertices along the curve. Far ones are the halves that face the eye, as wide as they
// should be however few vertices they have.

struct Level {
    // Steps along a segment, around its tube; which list, and whether it is read from its end.
    steps: u32,
    around: u32,
    list: u32,
    backwards: u32,
    room: u32,
    // Whether rings are the halves that face the eye.
    faces: u32,
}

@group(0) @binding(0) var<uniform> eye: Eye;
@group(1) @binding(0) var<uniform> level: Level;
@group(1) @binding(1) var<storage, read> places: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read> leaves: array<vec4<f32>>;
@group(1) @binding(3) var<storage, read> arrives: array<vec4<f32>>;
@group(1) @binding(4) var<storage, read> sides: array<vec4<f32>>;
@group(1) @binding(5) var<storage, read> links: array<vec2<u32>>;
// Length at rest, radius at rest, turns of the twist up to here, and in this segment.
@group(1) @binding(6) var<storage, read> fixed: array<vec4<f32>>;
@group(1) @binding(7) var<storage, read> colours: array<u32>;
@group(1) @binding(8) var<storage, read> list: array<u32>;

const CAP = 0x80000000u;
const AT_START = 0x40000000u;
const MERGED = 28u;
const INDEX = 0x0fffffffu;
const TAU = 6.2831853;

struct Vertex {
    p: vec3<f32>,
    normal: vec3<f32>,
    tangent: vec3<f32>,
    // Where turns around are counted from, and turns along.
    side: vec3<f32>,
    along: f32,
    radius: f32,
    stretch: f32,
    colour: vec3<f32>,
}

fn carried(v: vec3<f32>, a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    let axis = cross(a, b);
    let c = dot(a, b);
    return v * c + cross(axis, v) + axis * (dot(axis, v) / max(1.0 + c, 1e-3));
}

// sRGB to light.
fn light_of(packed: u32) -> vec3<f32> {
    let c = unpack4x8unorm(packed).xyz;
    return select(pow((c + 0.055) / 1.055, vec3<f32>(2.4)), c / 12.92, c <= vec3<f32>(0.04045));
}

// What is left of a direction in the picture.
fn seen(v: vec3<f32>, look: vec3<f32>) -> f32 {
    return length(v - look * dot(v, look));
}

// How long the curve of so many segments is in the picture. Tangents of an arc's segment are c (1 + a^2/4) long where it is c (1 + a^2/6).
fn curve_length(i: u32, count: u32, look: vec3<f32>) -> f32 {
    var sum = 0.0;
    var from_here = places[i].xyz;
    for (var k = 0u; k < count; k++) {
        let to = places[links[i + k].y].xyz;
        let chord = to - from_here;
        let c = length(chord);
        let arc = (c + length(leaves[i + k].xyz) + length(arrives[i + k].xyz)) / (3.0 * max(c, 1e-20));
        sum += seen(chord, look) * arc;
        from_here = to;
    }
    return sum;
}

// Vertex `number` of the tube of the list's item `instance`.
fn tube(number: u32, instance: u32) -> Vertex {
    let ring = number / (level.around + 1u);
    let spoke = number % (level.around + 1u);
    let base = level.list * level.room;
    let item = list[select(base + instance, base + level.room - 1u - instance, level.backwards != 0u)];
    let i = item & INDEX;
    var t = f32(ring) / f32(level.steps);
    let here = places[i];
    var out: Vertex;
    var side: vec3<f32>;
    if (item & CAP) != 0u {
        // A half ball on the yarn's end.
        let outwards = select(1.0, -1.0, (item & AT_START) != 0u);
        out.tangent = normalize(leaves[i].xyz);
        let angle = t * 0.25 * TAU;
        out.p = here.xyz + out.tangent * (outwards * here.w * sin(angle));
        out.radius = here.w * cos(angle);
        side = sides[i].xyz;
        out.normal = out.tangent * (outwards * sin(angle));
        out.along = fixed[i].z + outwards * fixed[i].w * 0.1 * t;
        out.stretch = sides[i].w;
        out.colour = light_of(colours[i]);
        if outwards < 0.0 {
            // Rings are counted inwards, so that faces look outwards.
            t = 1.0 - t;
            let inwards = t * 0.25 * TAU;
            out.p = here.xyz - out.tangent * (here.w * sin(inwards));
            out.radius = here.w * cos(inwards);
            out.normal = -out.tangent * sin(inwards);
            out.along = fixed[i].z - fixed[i].w * 0.1 * t;
        }
    } else {
        // Segments that are drawn as one: the last leads to its end.
        let count = 1u << ((item >> MERGED) & 3u);
        let next = links[i + count - 1u].y;
        let there = places[next];
        let leave = leaves[i];
        let arrive = arrives[i].xyz;
        let t2 = t * t;
        let t3 = t2 * t;
        let enters = normalize(leave.xyz);
        let ends = normalize(leaves[next].xyz);
        var tangent = enters;
        var wider = 1.0;
        if ring == level.steps {
            out.p = there.xyz;
            tangent = ends;
        } else if ring == 0u {
            out.p = here.xyz;
        } else {
            out.p = here.xyz * (2.0 * t3 - 3.0 * t2 + 1.0) + leave.xyz * (t3 - 2.0 * t2 + t)
                + there.xyz * (3.0 * t2 - 2.0 * t3) + arrive * (t3 - t2);
            let d = (there.xyz - here.xyz) * (6.0 * t - 6.0 * t2) + leave.xyz * (3.0 * t2 - 4.0 * t + 1.0)
                + arrive * (3.0 * t2 - 2.0 * t);
            let l = length(d);
            tangent = select(enters, d / l, l > 1e-20);
        }
        if level.steps == 1u {
            // Rings stand between chords, as much wider as they stand aslant; across their chord where yarn turns back, or they would have
            // no width.
            let chord = there.xyz - here.xyz;
            let l = length(chord);
            let along = select(enters, chord / l, l > 1e-20);
            let look = towards(eye, here.xyz);
            let slant = dot(along, tangent);
            tangent = select(along, tangent, slant > 0.5);
            wider = 1.0 / select(1.0, slant, slant > 0.5);
            // A chord is shorter than its curve: wider by half of that, it covers as much (the other half lies over other yarn).
            wider *= sqrt(clamp(curve_length(i, count, look) / max(seen(chord, look), 1e-20), 1.0, 1.6));
        }
        out.tangent = tangent;
        let straight = carried(sides[i].xyz, enters, tangent);
        let turn = leave.w * t;
        side = straight * cos(turn) + cross(tangent, straight) * sin(turn);
        // Between rings that stand at an angle to each other, a tube is thinner than they are.
        let thinner = select(0.0, (1.0 - dot(enters, ends)) / (4.0 * f32(level.steps * level.steps)), level.steps > 1u);
        out.radius = mix(here.w, there.w, t) * (1.0 + thinner) * wider;
        out.normal = vec3<f32>(0.0);
        out.along = fixed[i].z + fixed[i].w * f32(count) * t;
        out.stretch = mix(sides[i].w, sides[next].w, t);
        out.colour = mix(light_of(colours[i]), light_of(colours[next]), t);
    }
    let look = towards(eye, out.p);
    // No thinner than a part of a pixel: else it would be seen here and there only.
    let least = eye.scale.z / pixels(eye, out.p);
    out.radius = max(out.radius, least * f32((item & CAP) == 0u));
    out.side = side;
    var ray_zero = side;
    // Rings are as wide in the mean, seen from all sides, as the circles that they stand for.
    let sides_of_ring = f32(level.around);
    var wide = 0.5 * TAU / (sides_of_ring * sin(0.5 * TAU / sides_of_ring));
    var angle = TAU * f32(spoke) / f32(level.around);
    if level.faces != 0u {
        let facing = look - out.tangent * dot(look, out.tangent);
        let l = length(facing);
        ray_zero = select(side, facing / l, l > 1e-3);
        wide = 1.0;
        angle = 0.5 * TAU * (f32(spoke) / f32(level.around) - 0.5);
    }
    let ray = ray_zero * cos(angle) + cross(out.tangent, ray_zero) * sin(angle);
    out.normal += ray * select(1.0, sqrt(max(1.0 - dot(out.normal, out.normal), 0.0)), (item & CAP) != 0u);
    out.p += ray * (out.radius * wide);
    return out;
}
