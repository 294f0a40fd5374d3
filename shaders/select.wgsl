// Which faces of a batch need work, and which of those only lifting. Twin of what src/backend/work.rs does before it
// solves.

// [face] 1 where there is one, and a shape: corners but the first, in the face frame.
@group(0) @binding(4) var<storage, read_write> shapes: array<f32>;
@group(0) @binding(5) var<storage, read_write> knots: array<KnotWords>;
@group(0) @binding(6) var<storage, read_write> results: array<FaceResult>;
// The template's own solve and the first face's: 1 where there is one, shape, knots, result.
@group(0) @binding(7) var<storage, read> known: array<u32>;
// Counts of what was skipped, of each batch's two lists, then the lists; an entry's top bit: nobody sees it.
@group(0) @binding(8) var<storage, read_write> lists: array<atomic<u32>>;

// Places of counts, in the order of src/backend/skip.rs.
const COUNT_HIDDEN: u32 = 0u;
const COUNT_UNMOVED: u32 = 1u;
const COUNT_WITHOUT_KNOTS: u32 = 2u;
const COUNT_RIGID: u32 = 3u;
const COUNT_REST: u32 = 4u;
const COUNT_SHARED: u32 = 5u;

fn add_to_list(list: u32, entry: u32) {
    let place = atomicAdd(&lists[settings.first_count + list], 1u);
    let at = select(place, settings.face_count - 1u - place, list == 1u);
    atomicStore(&lists[settings.first_entry + at], entry);
}

// Whether a face's last result would come out again, were nothing to move.
fn settled(status: u32) -> bool {
    return status != HIDDEN && (settings.from_previous == 0u || status != STEPPED);
}

// Whether a corner moved or its normal turned; where one moved, normals count as turned.
fn changed(face: u32) -> bool {
    for (var i = 0u; i < CORNERS; i++) {
        let at = settings.first_corner + 2u * (face * CORNERS + i);
        let normal = topology[at + 1u];
        if normal < settings.group_normals {
            if surface[settings.bent + normal - settings.face_normals] != 0u {
                return true;
            }
        } else if surface[settings.turned + normal - settings.group_normals] != 0u {
            return true;
        }
    }
    return false;
}

var<private> shape: array<vec2<f32>, ROOM_CORNERS>;

fn apart(a: vec2<f32>, b: vec2<f32>) -> bool {
    return !(abs(a.x - b.x) <= settings.tolerance && abs(a.y - b.y) <= settings.tolerance);
}

fn words_of_known() -> u32 {
    return 1u + 2u * (CORNERS - 1u) + 3u * KNOTS + 3u;
}

fn same_as_known(which: u32) -> bool {
    let at = settings.first_known + which * words_of_known();
    if known[at] == 0u {
        return false;
    }
    for (var i = 1u; i < CORNERS; i++) {
        let word = at + 2u * i - 1u;
        let other = vec2<f32>(bitcast<f32>(known[word]), bitcast<f32>(known[word + 1u]));
        if apart(shape[i], other) {
            return false;
        }
    }
    return true;
}

fn take_known(which: u32, face: u32, own_shape: u32) {
    var at = settings.first_known + which * words_of_known() + 1u;
    shapes[own_shape] = 1.0;
    for (var i = 0u; i < 2u * (CORNERS - 1u); i++) {
        shapes[own_shape + 1u + i] = bitcast<f32>(known[at + i]);
    }
    at += 2u * (CORNERS - 1u);
    for (var k = 0u; k < KNOTS; k++) {
        knots[settings.first_knot + face * KNOTS + k] = KnotWords(
            bitcast<f32>(known[at]),
            bitcast<f32>(known[at + 1u]),
            bitcast<f32>(known[at + 2u]),
        );
        at += 3u;
    }
    results[settings.first_face + face] =
        FaceResult(bitcast<f32>(known[at]), bitcast<f32>(known[at + 1u]), known[at + 2u]);
}

@compute @workgroup_size(WORKGROUP)
fn choose(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    know_counts();
    let face = thread_of(id, groups);
    if face >= settings.face_count {
        return;
    }
    let mesh_face = topology[settings.first_mesh_face + face];
    let status = results[settings.first_face + face].status;
    let hidden = (settings.skip & SEEN_ALL) == 0u
        && ((surface[settings.seen + mesh_face / 32u] >> (mesh_face % 32u)) & 1u) == 0u;
    if hidden {
        atomicAdd(&lists[COUNT_HIDDEN], 1u);
        if settings.own != 0u {
            results[settings.first_face + face].status = HIDDEN;
        } else {
            // It has no points yet: interpolated once, its knots as in the template.
            add_to_list(select(0u, 1u, SOLVES), face | TOP);
        }
        return;
    }
    if settings.near != 0u && (settings.skip & UNMOVED) != 0u && settled(status) && !changed(face) {
        atomicAdd(&lists[COUNT_UNMOVED], 1u);
        return;
    }
    if !SOLVES {
        atomicAdd(&lists[COUNT_WITHOUT_KNOTS], 1u);
        add_to_list(0u, face);
        return;
    }
    let loaded = load(face);
    let frame = face_frame();
    let own_shape = settings.first_shape + face * (2u * CORNERS - 1u);
    let remembers = (settings.skip & RIGID) != 0u;
    if !(frame.usable && loaded.whole) {
        if remembers {
            shapes[own_shape] = 0.0;
        }
        add_to_list(0u, face);
        return;
    }
    var same = remembers && settings.near != 0u && shapes[own_shape] != 0.0 && settled(status) && status != FELL_BACK;
    for (var i = 1u; i < CORNERS; i++) {
        shape[i] = in_plane(frame, corners[i]);
        if same {
            let at = own_shape + 2u * i - 1u;
            same = !apart(shape[i], vec2<f32>(shapes[at], shapes[at + 1u]));
        }
    }
    if same {
        atomicAdd(&lists[COUNT_RIGID], 1u);
        add_to_list(1u, face);
    } else if (settings.skip & REST) != 0u && same_as_known(0u) {
        atomicAdd(&lists[COUNT_REST], 1u);
        take_known(0u, face, own_shape);
        add_to_list(1u, face);
    } else if (settings.skip & SHARED) != 0u && same_as_known(1u) {
        atomicAdd(&lists[COUNT_SHARED], 1u);
        take_known(1u, face, own_shape);
        add_to_list(1u, face);
    } else {
        if remembers {
            shapes[own_shape] = 1.0;
            for (var i = 1u; i < CORNERS; i++) {
                shapes[own_shape + 2u * i - 1u] = shape[i].x;
                shapes[own_shape + 2u * i] = shape[i].y;
            }
        }
        add_to_list(0u, face);
    }
}
