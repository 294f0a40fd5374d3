// What of the yarn is seen, and how finely it is drawn: each segment goes into the list of its level, or into none. Twice the same: first
// to count, then to put; lists of two levels grow towards each other.

struct Culling {
    points: u32,
    own: u32,
    // Room of a pair of lists.
    room: u32,
    levels: u32,
}

@group(0) @binding(0) var<uniform> eye: Eye;
@group(0) @binding(1) var<uniform> culling: Culling;
@group(0) @binding(2) var<storage, read> places: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> leaves: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> arrives: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> links: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> list: array<u32>;
// Of each level: indices, instances, first index, base vertex, first instance.
@group(0) @binding(7) var<storage, read_write> draws: array<atomic<u32>, 20>;

const NONE = 0xffffffffu;
const NOT_SEEN = 4u;
// Flags of caps in lists.
const CAP = 0x80000000u;
const AT_START = 0x40000000u;

var<workgroup> counts: array<atomic<u32>, 4>;
var<workgroup> begins: array<u32, 4>;

// The level of a segment, or NOT_SEEN.
fn level_of(i: u32) -> u32 {
    let next = links[i].y;
    let a = places[i];
    var b = a;
    var bulge = vec3<f32>(0.0);
    if next != NONE {
        b = places[next];
        // By how much a Hermite curve may leave its chord: 4/27 of what its tangents differ from it.
        let chord = b.xyz - a.xyz;
        bulge = (abs(leaves[i].xyz - chord) + abs(arrives[i].xyz - chord)) * 0.15;
    }
    let middle = 0.5 * (a.xyz + b.xyz);
    let r = max(a.w, b.w);
    let reach = 0.5 * length(b.xyz - a.xyz) + length(bulge) + 2.0 * r;
    for (var k = 0u; k < 6u; k++) {
        let plane = eye.planes[k];
        if dot(plane.xyz, middle) + plane.w < -reach {
            return NOT_SEEN;
        }
    }
    let scale = pixels(eye, middle) * eye.scale.y;
    let size = r * scale;
    let bow = length(bulge) * scale;
    var level = 0u;
    if size > 2.2 || bow > 0.5 {
        level = 1u;
    }
    if size > 5.0 || bow > 1.2 {
        level = 2u;
    }
    if size > 18.0 || bow > 4.0 {
        level = 3u;
    }
    return level;
}

@compute @workgroup_size(64)
fn cull(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    if local < 4u {
        atomicStore(&counts[local], 0u);
    }
    workgroupBarrier();
    let i = id.x + id.y * groups.x * 64u;
    var level = NOT_SEEN;
    var items = 0u;
    var cap = 0u;
    if i < culling.own {
        level = level_of(i);
        let link = links[i];
        if link.y != NONE {
            items = 1u;
        }
        // Where a yarn begins or ends, it is closed.
        if link.x == NONE {
            items += 1u;
            cap = CAP | AT_START | i;
        } else if link.y == NONE {
            items += 1u;
            cap = CAP | i;
        }
    }
    var at = 0u;
    if level != NOT_SEEN {
        at = atomicAdd(&counts[level], items);
    }
    workgroupBarrier();
    if local < 4u {
        begins[local] = atomicAdd(&draws[5u * local + 1u], atomicLoad(&counts[local]));
    }
    workgroupBarrier();
    if level == NOT_SEEN {
        return;
    }
    at += begins[level];
    for (var k = 0u; k < items; k++) {
        let item = select(cap, i, k == 0u && links[i].y != NONE);
        let place = (level / 2u) * culling.room;
        if level % 2u == 0u {
            list[place + at + k] = item;
        } else {
            list[place + culling.room - 1u - at - k] = item;
        }
    }
}
