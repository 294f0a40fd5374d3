// What of the yarn is seen, and how finely it is drawn: each segment goes into the list of its level, or into none; far ones that lie on
// a line, to a part of a pixel, go as one. A thread looks at eight; lists of two levels grow towards each other.

struct Culling {
    // Points that begin segments of this part's own.
    own: u32,
    // Room of a pair of lists.
    room: u32,
}

@group(0) @binding(0) var<uniform> eye: Eye;
@group(1) @binding(0) var<uniform> culling: Culling;
@group(1) @binding(1) var<storage, read> places: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read> leaves: array<vec4<f32>>;
@group(1) @binding(3) var<storage, read> arrives: array<vec4<f32>>;
@group(1) @binding(4) var<storage, read> links: array<vec2<u32>>;
@group(1) @binding(5) var<storage, read_write> list: array<u32>;
// Of each level: indices, instances, first index, base vertex, first instance.
@group(1) @binding(6) var<storage, read_write> draws: array<atomic<u32>, 25>;

const NONE = 0xffffffffu;
const LEVELS = 5u;
const NOT_SEEN = 7u;
// Segments that a thread looks at, and that may become one at most.
const RUN = 8u;
// Flags of caps in lists; and where the logarithm of how many segments are one stands.
const CAP = 0x80000000u;
const AT_START = 0x40000000u;
const MERGED = 28u;

var<workgroup> counts: array<atomic<u32>, 5>;
var<workgroup> begins: array<u32, 5>;

// By how much a segment's curve may leave its chord, on each axis: 4/27 of what its tangents differ from it.
fn bulge(i: u32, chord: vec3<f32>) -> vec3<f32> {
    return (abs(leaves[i].xyz - chord) + abs(arrives[i].xyz - chord)) * 0.15;
}

fn in_view(middle: vec3<f32>, reach: f32) -> bool {
    for (var k = 0u; k < 6u; k++) {
        let plane = eye.planes[k];
        if dot(plane.xyz, middle) + plane.w < -reach {
            return false;
        }
    }
    return true;
}

// How many pixels a chord may be off: fewer where yarn is thicker than a pixel.
fn off(size: f32) -> f32 {
    return eye.scale.w * min(1.0, 0.5 / size);
}

// The level of a segment, or NOT_SEEN.
fn level_of(i: u32) -> u32 {
    let next = links[i].y;
    let a = places[i];
    var b = a;
    var aside = 0.0;
    if next != NONE {
        b = places[next];
        aside = length(bulge(i, b.xyz - a.xyz));
    }
    let middle = 0.5 * (a.xyz + b.xyz);
    let r = max(a.w, b.w);
    if !in_view(middle, 0.5 * length(b.xyz - a.xyz) + aside + 2.0 * r) {
        return NOT_SEEN;
    }
    let scale = pixels(eye, middle) * eye.scale.y;
    let size = r * scale;
    let bow = aside * scale;
    var level = 0u;
    if size > 1.2 || bow > off(size) {
        level = 1u;
    }
    if size > 1.2 || bow > 0.3 {
        level = 2u;
    }
    if size > 4.5 || bow > 1.0 {
        level = 3u;
    }
    if size > 18.0 || bow > 4.0 {
        level = 4u;
    }
    return level;
}

// Whether so many segments from here may be drawn as one: what leaves their chord is less than what anybody sees.
fn straight(i: u32, count: u32) -> bool {
    var next = i;
    for (var k = 0u; k < count; k++) {
        // Of one yarn, in order; the last may lead anywhere.
        if next != i + k || next >= culling.own {
            return false;
        }
        next = links[next].y;
        if next == NONE {
            return false;
        }
    }
    let a = places[i];
    let b = places[next];
    let chord = b.xyz - a.xyz;
    let scale = pixels(eye, 0.5 * (a.xyz + b.xyz)) * eye.scale.y;
    if max(a.w, b.w) * scale > 1.2 {
        return false;
    }
    let allowed = off(max(a.w, b.w) * scale) / scale;
    var from_here = a.xyz;
    for (var k = 0u; k < count; k++) {
        let last = k + 1u == count;
        let to = select(places[min(i + k + 1u, culling.own - 1u)].xyz, b.xyz, last);
        let along = clamp(dot(to - a.xyz, chord) / max(dot(chord, chord), 1e-30), 0.0, 1.0);
        let aside = length(to - a.xyz - along * chord);
        if max(aside, length(bulge(i + k, to - from_here))) > allowed {
            return false;
        }
        from_here = to;
    }
    return true;
}

@compute @workgroup_size(64)
fn cull(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    if local < LEVELS {
        atomicStore(&counts[local], 0u);
    }
    workgroupBarrier();
    let begin = RUN * (id.x + id.y * groups.x * 64u);
    let end = min(begin + RUN, culling.own);
    // Of each run that begins at its place: its level, the logarithm of its length, where in the workgroup's list it goes.
    var levels: array<u32, 8>;
    var lengths: array<u32, 8>;
    var at: array<u32, 8>;
    for (var i = begin; i < end;) {
        var doubled = 0u;
        for (var k = 3u; k > 0u; k--) {
            let count = 1u << k;
            if i % count == 0u && i + count <= begin + RUN && straight(i, count) {
                doubled = k;
                break;
            }
        }
        var level = 0u;
        if doubled == 0u {
            level = level_of(i);
        } else {
            let a = places[i];
            let b = places[links[i + (1u << doubled) - 1u].y];
            let reach = 0.5 * length(b.xyz - a.xyz) + eye.scale.w / pixels(eye, a.xyz) + 3.0 * max(a.w, b.w);
            level = select(NOT_SEEN, 0u, in_view(0.5 * (a.xyz + b.xyz), reach));
        }
        let link = links[i];
        // Where a yarn begins or ends, it is closed.
        let items = u32(link.y != NONE) + u32(link.x == NONE || link.y == NONE);
        if level != NOT_SEEN {
            at[i - begin] = atomicAdd(&counts[level], items);
        }
        levels[i - begin] = level;
        lengths[i - begin] = doubled;
        i += 1u << doubled;
    }
    workgroupBarrier();
    if local < LEVELS {
        begins[local] = atomicAdd(&draws[5u * local + 1u], atomicLoad(&counts[local]));
    }
    workgroupBarrier();
    for (var i = begin; i < end;) {
        let level = levels[i - begin];
        let doubled = lengths[i - begin];
        if level != NOT_SEEN {
            let link = links[i];
            var to = at[i - begin] + begins[level];
            if link.y != NONE {
                put(level, to, i | doubled << MERGED);
                to += 1u;
            }
            if link.x == NONE {
                put(level, to, i | CAP | AT_START);
            } else if link.y == NONE {
                put(level, to, i | CAP);
            }
        }
        i += 1u << doubled;
    }
}

fn put(level: u32, at: u32, item: u32) {
    let place = (level / 2u) * culling.room;
    list[select(place + at, place + culling.room - 1u - at, level % 2u == 1u)] = item;
}
