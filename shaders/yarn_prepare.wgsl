// From control points to what a tube is drawn from: the curve's tangents, radii, and a direction across that turns as little as can be,
// along the yarn at first and over time from then on. A point a thread, in two passes.

struct Preparing {
    // Points of this part and of its neighbours that it needs.
    points: u32,
    keep_volume: u32,
}

@group(0) @binding(0) var<uniform> preparing: Preparing;
// x, y, z of each.
@group(0) @binding(1) var<storage, read> raw: array<f32>;
// The points before and after; NONE at ends.
@group(0) @binding(2) var<storage, read> links: array<vec2<u32>>;
// Length at rest of the segment that begins here, radius at rest, turns of the twist up to here, and in this segment.
@group(0) @binding(3) var<storage, read> fixed: array<vec4<f32>>;
// Place, radius.
@group(0) @binding(4) var<storage, read_write> places: array<vec4<f32>>;
// Tangent of the segment that begins here at its start; angle from the direction across that is carried along it to that of its end.
@group(0) @binding(5) var<storage, read_write> leaves: array<vec4<f32>>;
// Tangent at its end; its length over that at rest.
@group(0) @binding(6) var<storage, read_write> arrives: array<vec4<f32>>;
// Direction across; stretch of the two segments that meet here.
@group(0) @binding(7) var<storage, read_write> sides: array<vec4<f32>>;

const NONE = 0xffffffffu;

fn raw_at(i: u32) -> vec3<f32> {
    return vec3<f32>(raw[3u * i], raw[3u * i + 1u], raw[3u * i + 2u]);
}

fn usable(a: f32, b: f32) -> bool {
    return 0.0 < a && 0.0 < b && a + b < 1e30;
}

// Carries a direction from one tangent to another by the least turn.
fn carried(v: vec3<f32>, a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    let axis = cross(a, b);
    let c = dot(a, b);
    return v * c + cross(axis, v) + axis * (dot(axis, v) / max(1.0 + c, 1e-3));
}

fn unit(v: vec3<f32>, otherwise: vec3<f32>) -> vec3<f32> {
    let l = length(v);
    return select(otherwise, v / l, l > 1e-20);
}

fn any_across(t: vec3<f32>) -> vec3<f32> {
    let axis = select(vec3<f32>(0.0, 0.0, 1.0), vec3<f32>(1.0, 0.0, 0.0), abs(t.z) > 0.7);
    return normalize(cross(t, axis));
}

// A tangent as long as that of an arc over the chord that leaves it at the same angle: those of a Catmull-Rom curve are shorter, which
// bends yarn sharply at its control points and hardly between them.
fn arched(tangent: vec3<f32>, chord: vec3<f32>) -> vec3<f32> {
    let c = length(chord);
    let along = unit(tangent, vec3<f32>(0.0));
    let cosine = dot(along, chord) / max(c, 1e-20);
    return along * (c * 2.0 / (1.0 + max(cosine, 0.0)));
}

@compute @workgroup_size(64)
fn prepare(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + id.y * groups.x * 64u;
    if i >= preparing.points {
        return;
    }
    let link = links[i];
    let p1 = raw_at(i);
    var p0 = p1;
    var p2 = p1;
    if link.x != NONE {
        p0 = raw_at(link.x);
    }
    if link.y != NONE {
        p2 = raw_at(link.y);
    }
    // Ends mirror their neighbours.
    if link.x == NONE {
        p0 = p1 + p1 - p2;
    }
    var p3 = p2;
    if link.y != NONE {
        let after = links[link.y].y;
        if after != NONE {
            p3 = raw_at(after);
        } else {
            p3 = p2 + p2 - p1;
        }
    }
    let before = length(p1 - p0);
    let chord_length = length(p2 - p1);
    let d0 = sqrt(before);
    let d1 = sqrt(chord_length);
    let d2 = sqrt(length(p3 - p2));
    let chord = p2 - p1;
    var leave = chord;
    var arrive = chord;
    if usable(d0, d1) {
        let across = (p2 - p0) / (d0 + d1);
        leave = chord + ((p1 - p0) / d0 - across) * d1;
    }
    if usable(d1, d2) {
        let across = (p3 - p1) / (d1 + d2);
        arrive = chord + ((p3 - p2) / d2 - across) * d1;
    }
    leave = arched(leave, chord);
    arrive = arched(arrive, chord);
    if link.y == NONE {
        // Nothing is drawn from here: the direction in which the yarn ends.
        leave = p1 - p0;
        arrive = leave;
    }
    var stretch = 1.0;
    let rest = fixed[i].x;
    if rest > 0.0 && link.y != NONE {
        stretch = chord_length / rest;
    }
    var around = stretch;
    if link.x != NONE {
        let rest_before = fixed[link.x].x;
        if rest_before > 0.0 {
            let stretch_before = before / rest_before;
            around = select(0.5 * (stretch + stretch_before), stretch_before, link.y == NONE);
        }
    }
    let tangent = unit(leave, unit(chord, vec3<f32>(1.0, 0.0, 0.0)));
    let old = unit(leaves[i].xyz, tangent);
    var side = carried(sides[i].xyz, old, tangent);
    side = unit(side - tangent * dot(side, tangent), any_across(tangent));
    var radius = fixed[i].y;
    if preparing.keep_volume != 0u {
        radius *= clamp(inverseSqrt(max(around, 1e-6)), 0.6, 1.4);
    }
    places[i] = vec4<f32>(p1, radius);
    leaves[i] = vec4<f32>(select(tangent * 1e-12, leave, dot(leave, leave) > 1e-24), 0.0);
    arrives[i] = vec4<f32>(arrive, stretch);
    sides[i] = vec4<f32>(side, around);
}

@compute @workgroup_size(64)
fn twist(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + id.y * groups.x * 64u;
    if i >= preparing.points || links[i].y == NONE {
        return;
    }
    let next = links[i].y;
    let x_axis = vec3<f32>(1.0, 0.0, 0.0);
    let a = unit(leaves[i].xyz, x_axis);
    let b = unit(leaves[next].xyz, x_axis);
    let come = carried(sides[i].xyz, a, b);
    let there = sides[next].xyz;
    leaves[i].w = atan2(dot(cross(come, there), b), dot(come, there));
}
