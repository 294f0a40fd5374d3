// A stitch a thread: from corners and normals to control points. Twin of src/knot/mod.rs and of what src/backend/work.rs
// does around it.

struct Strand {
    start: u32,
    ends: array<u32, 2>,
}

@group(0) @binding(4) var<storage, read_write> points: array<f32>;
@group(0) @binding(5) var<storage, read_write> knots: array<KnotWords>;
@group(0) @binding(6) var<storage, read_write> results: array<FaceResult>;
// [face] which are to be solved, from the front, and which only lifted, from the back; see select.wgsl.
@group(0) @binding(8) var<storage, read> lists: array<u32>;

var<private> lifted: array<vec3<f32>, ROOM_POINTS>;

fn read_knot(face: u32, k: u32) -> Knot {
    let words = knots[settings.first_knot + face * KNOTS + k];
    return Knot(vec2<f32>(words.u, words.v), words.half_length);
}

// Puts the solve's start in place; gives the damping of its first step.
fn start_solve(frame: Frame, face: u32) -> f32 {
    affine_start(frame);
    correct_start(frame);
    var damping = FIRST_DAMPING;
    // Of a face that nobody saw, the state is from no one knows when.
    if settings.given != 0u && results[settings.first_face + face].status != HIDDEN {
        var known = true;
        for (var k = 0u; k < KNOTS; k++) {
            let l = state[k].half_length;
            let before = read_knot(face, k).half_length;
            known = known && 0.0 < before;
            if settings.near != 0u {
                known = known && l < before * LEAP && before < l * LEAP;
            }
        }
        if known {
            for (var k = 0u; k < KNOTS; k++) {
                state[k] = read_knot(face, k);
            }
            damping = DAMPING_PREVIOUS;
        }
    }
    return damping;
}

fn put(at: u32, p: vec3<f32>) {
    points[3u * at] = p.x;
    points[3u * at + 1u] = p.y;
    points[3u * at + 2u] = p.z;
}

// A control point, or a side of a seam.
fn end_place(place: u32) -> u32 {
    return select(place, settings.point_count + (place & ~TOP), (place & TOP) != 0u);
}

fn store(face: u32, first: vec3<f32>) {
    for (var s = 0u; s < STRANDS; s++) {
        let begin = stencil.strand_offsets[s];
        let count = min(stencil.strand_offsets[s + 1u] - begin, POINTS);
        if count < 2u {
            continue;
        }
        let at = settings.first_strand + 3u * (face * STRANDS + s);
        let start = topology[at] & ~TOP;
        let with_yarn = (topology[at] & TOP) == 0u;
        put(end_place(topology[at + 1u]), lifted[begin] + first);
        for (var i = 1u; i < count - 1u; i++) {
            put(select(start - i, start + i, with_yarn), lifted[begin + i] + first);
        }
        put(end_place(topology[at + 2u]), lifted[begin + count - 1u] + first);
    }
}

// The face that a thread works on, and whether nobody sees it.
struct Entry {
    there: bool,
    face: u32,
    hidden: bool,
}

fn entry_of(thread: u32) -> Entry {
    if settings.way == DIRECT || settings.way == DIRECT_LIFT {
        let face = settings.begin + thread;
        return Entry(face < settings.face_count, face, false);
    }
    let lift_only = settings.way == LIFT_LIST;
    let count = lists[settings.first_count + select(0u, 1u, lift_only)];
    if thread >= min(count, settings.face_count) {
        return Entry(false, 0u, false);
    }
    let at = settings.first_entry + select(thread, settings.face_count - 1u - thread, lift_only);
    return Entry(true, lists[at] & ~TOP, (lists[at] & TOP) != 0u);
}

@compute @workgroup_size(WORKGROUP)
fn stitch(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    know_counts();
    let entry = entry_of(thread_of(id, groups));
    if !entry.there {
        return;
    }
    let face = entry.face;
    let loaded = load(face);
    let frame = face_frame();
    for (var i = 0u; i < POINTS; i++) {
        let role = stencil.points[i].role;
        if role == BOUNDARY || role == FREE {
            let at = blend_corners(i);
            lifted[i] = interpolate(i, at);
            plane[i] = in_plane(frame, at);
        }
    }
    for (var k = 0u; k < KNOTS; k++) {
        seats[k] = seat(frame, k);
        centers[k] = seats[k].center;
    }
    if SPACED {
        space_knots();
    }
    let known = SOLVES && (settings.way == LIFT_LIST || settings.way == DIRECT_LIFT);
    var sound = frame.usable && loaded.whole;
    var outcome = Outcome(0.0, 0.0, false, false, 0u, false);
    if sound {
        if known {
            if entry.hidden {
                rigid_start();
            } else {
                for (var k = 0u; k < KNOTS; k++) {
                    state[k] = read_knot(face, k);
                }
            }
            place_state();
        } else {
            var damping = 0.0;
            if SOLVES {
                damping = start_solve(frame, face);
            } else {
                rigid_start();
            }
            trace_start(frame, face);
            outcome = run_solve(damping, select(0u, settings.iterations, SOLVES));
            sound = outcome.finite;
        }
        for (var i = 0u; i < POINTS; i++) {
            let p = stencil.points[i];
            if p.role == CONTACT || p.role == CONTROL {
                lifted[i] = lift(frame, p.knot, plane[i], p.z);
            }
            sound = sound && finite3(lifted[i]);
        }
    }
    if !sound {
        for (var i = 0u; i < POINTS; i++) {
            lifted[i] = interpolate(i, blend_corners(i));
        }
    }
    report(face, entry.hidden, known, sound, outcome);
    store(face, loaded.first);
    trace_end(face);
}

// Puts down how it ended.
fn report(face: u32, hidden: bool, known: bool, sound: bool, outcome: Outcome) {
    // What is known already is in place.
    if known && sound && !hidden {
        return;
    }
    var result = FaceResult(0.0, 0.0, FELL_BACK);
    if hidden {
        result.status = HIDDEN;
    } else if sound {
        result.energy_start = outcome.start;
        result.energy = outcome.end;
        if !SOLVES {
            result.status = INTERPOLATED;
        } else if outcome.at_rest {
            result.status = AT_REST;
        } else if outcome.converged {
            result.status = HAS_CONVERGED;
        } else if settings.iterations > 0u && outcome.steps == 0u {
            result.status = STUCK;
        } else {
            result.status = STEPPED;
        }
    }
    results[settings.first_face + face] = result;
    let nothing = !sound || (known && hidden);
    for (var k = 0u; k < KNOTS; k++) {
        let at = settings.first_knot + face * KNOTS + k;
        if nothing {
            knots[at] = KnotWords(0.0, 0.0, 0.0);
        } else {
            knots[at] = KnotWords(state[k].direction.x, state[k].direction.y, state[k].half_length);
        }
    }
}
