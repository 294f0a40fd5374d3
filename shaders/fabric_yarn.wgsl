// A yarn vertex a thread: from the frames of faces to points. Twin of src/database/cpu.rs.

// A yarn vertex at rest: its face, row of the pattern, number among the yarns' points, and barycentric coordinates of the
// face's corners 1 and 2.
struct Home {
    face: u32,
    row: u32,
    point: u32,
    b: f32,
    c: f32,
}

// Where it lies, displaced: the face, with TOP where its strain lies outside the table.
struct Place {
    face: u32,
    b: f32,
    c: f32,
    height: f32,
}

struct YarnPoint {
    x: f32,
    y: f32,
    z: f32,
    twist: f32,
}

const TOP: u32 = 0x80000000u;

@group(0) @binding(4) var<storage, read> changes: array<u32>;
@group(0) @binding(5) var<storage, read> homes: array<Home>;
@group(0) @binding(6) var<storage, read_write> yarn_places: array<Place>;
@group(0) @binding(7) var<storage, read_write> points: array<YarnPoint>;
// Yarn vertices left alone, carried, hidden; those outside the table.
@group(0) @binding(8) var<storage, read_write> counts: array<atomic<u32>, 4>;

const UNMOVED: u32 = 0u;
const RIGID: u32 = 1u;
const IS_HIDDEN: u32 = 2u;
const OUTSIDE: u32 = 3u;

var<workgroup> tally: array<atomic<u32>, 4>;

// Lifts a point again whose strain is known, where its surface moved.
fn carry(home: u32, point: u32, change: u32) {
    let there = yarn_places[home];
    let face = there.face & ~TOP;
    if ((change | changes[face]) & FRAME) == 0u {
        atomicAdd(&tally[UNMOVED], 1u);
        return;
    }
    atomicAdd(&tally[RIGID], 1u);
    let at = lifted(face, there.b, there.c, there.height);
    points[point].x = at.x;
    points[point].y = at.y;
    points[point].z = at.z;
}

// Displaces a point anew; says whether its strain is outside the table.
fn displace(home: u32, at_rest: Home) -> bool {
    let row = pattern[settings.first_row + at_rest.row];
    let height = bitcast<f32>(row.y);
    let cell = find(strains(clamped(strain(at_rest.face, at_rest.b, at_rest.c, height))));
    let by = displacement(row.x, cell);
    var all = shifted(at_rest.face, at_rest.b, at_rest.c, by.x, by.y);
    let to_height = height + by.z;
    var face = at_rest.face;
    if all.x < 0.0 || all.y < 0.0 || all.z < 0.0 {
        let there = followed(face, all);
        if there.face != face {
            face = there.face;
            all = there.all;
        }
    }
    let at = lifted(face, all.y, all.z, to_height);
    yarn_places[home] = Place(face | select(0u, TOP, cell.outside), all.y, all.z, to_height);
    points[at_rest.point] = YarnPoint(at.x, at.y, at.z, by.w + bitcast<f32>(row.z));
    return cell.outside;
}

@compute @workgroup_size(WORKGROUP)
fn yarn(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    if local == 0u {
        for (var i = 0u; i < 4u; i++) {
            atomicStore(&tally[i], 0u);
        }
    }
    workgroupBarrier();
    let home = thread_of(id, groups);
    if home < settings.homes {
        let at_rest = homes[home];
        let change = changes[at_rest.face];
        var outside = false;
        if (change & HIDDEN) == 0u && (change & STRAIN) != 0u {
            outside = displace(home, at_rest);
        } else {
            outside = (yarn_places[home].face & TOP) != 0u;
            if (change & HIDDEN) != 0u {
                atomicAdd(&tally[IS_HIDDEN], 1u);
            } else {
                carry(home, at_rest.point, change);
            }
        }
        if outside {
            atomicAdd(&tally[OUTSIDE], 1u);
        }
    }
    workgroupBarrier();
    if local == 0u {
        for (var i = 0u; i < 4u; i++) {
            let count = atomicLoad(&tally[i]);
            if count != 0u {
                atomicAdd(&counts[i], count);
            }
        }
    }
}
