// A stitch a thread: from corners and normals to control points. Twin of src/knot/mod.rs and of what src/backend/work.rs
// does around it.

struct Strand {
    start: u32,
    ends: array<u32, 2>,
}

struct KnotWords {
    u: f32,
    v: f32,
    half_length: f32,
}

struct FaceResult {
    energy_start: f32,
    energy: f32,
    status: u32,
}

// [face][corner] vertex and index of the normal.
struct Corner {
    vertex: u32,
    normal: u32,
}

// Places of vertices, then their normals: x, y, z each.
@group(0) @binding(2) var<storage, read> surface: array<f32>;
@group(0) @binding(3) var<storage, read> topology: array<u32>;
@group(0) @binding(4) var<storage, read_write> points: array<f32>;
@group(0) @binding(5) var<storage, read_write> knots: array<KnotWords>;
@group(0) @binding(6) var<storage, read_write> results: array<FaceResult>;

var<private> lifted: array<vec3<f32>, ROOM_POINTS>;

const TOP: u32 = 0x80000000u;
const INTERPOLATED: u32 = 0u;
const STEPPED: u32 = 1u;
const HAS_CONVERGED: u32 = 2u;
const AT_REST: u32 = 3u;
const STUCK: u32 = 4u;
const FELL_BACK: u32 = 5u;

fn at_surface(i: u32) -> vec3<f32> {
    return vec3<f32>(surface[3u * i], surface[3u * i + 1u], surface[3u * i + 2u]);
}

// Fills corners and normals; gives the first corner, and whether all were finite.
struct Loaded {
    first: vec3<f32>,
    whole: bool,
}

fn load(face: u32) -> Loaded {
    var count = 0.0;
    for (var i = 0u; i < CORNERS; i++) {
        let at = settings.first_corner + 2u * (face * CORNERS + i);
        corners[i] = at_surface(topology[at]);
        normals[i] = at_surface(topology[at + 1u]);
        if finite3(corners[i]) {
            count += 1.0;
        }
    }
    let whole = count == f32(CORNERS);
    if !whole {
        // Corners that are not finite are put at the mean of the others.
        let share = 1.0 / larger(count, 1.0);
        var middle = vec3<f32>(0.0);
        for (var i = 0u; i < CORNERS; i++) {
            if finite3(corners[i]) {
                middle = middle + corners[i] * share;
            }
        }
        for (var i = 0u; i < CORNERS; i++) {
            if !finite3(corners[i]) {
                corners[i] = middle;
            }
        }
    }
    let first = corners[0];
    for (var i = 0u; i < CORNERS; i++) {
        corners[i] = corners[i] - first;
    }
    return Loaded(first, whole);
}

fn read_knot(face: u32, k: u32) -> Knot {
    let words = knots[settings.first_knot + face * KNOTS + k];
    return Knot(vec2<f32>(words.u, words.v), words.half_length);
}

// Puts the solve's start in place; gives the damping of its first step.
fn start_solve(frame: Frame, face: u32) -> f32 {
    affine_start(frame);
    correct_start(frame);
    var damping = FIRST_DAMPING;
    if settings.given != 0u {
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
        let count = stencil.strand_offsets[s + 1u] - begin;
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

@compute @workgroup_size(WORKGROUP)
fn stitch(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    know_counts();
    let face = settings.begin + id.x + id.y * groups.x * WORKGROUP;
    if face >= settings.face_count {
        return;
    }
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
    var sound = frame.usable && loaded.whole;
    var outcome = Outcome(0.0, 0.0, false, false, 0u, false);
    if sound {
        var damping = 0.0;
        if SOLVES {
            damping = start_solve(frame, face);
        } else {
            rigid_start();
        }
        trace_start(frame, face);
        outcome = run_solve(damping, select(0u, settings.iterations, SOLVES));
        sound = outcome.finite;
        for (var i = 0u; i < POINTS; i++) {
            let p = stencil.points[i];
            if p.role == CONTACT || p.role == CONTROL {
                lifted[i] = lift(frame, p.knot, plane[i], p.z);
            }
            sound = sound && finite3(lifted[i]);
        }
    }
    var result = FaceResult(0.0, 0.0, FELL_BACK);
    if sound {
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
    } else {
        for (var i = 0u; i < POINTS; i++) {
            lifted[i] = interpolate(i, blend_corners(i));
        }
    }
    results[settings.first_face + face] = result;
    for (var k = 0u; k < KNOTS; k++) {
        let at = settings.first_knot + face * KNOTS + k;
        if sound {
            knots[at] = KnotWords(state[k].direction.x, state[k].direction.y, state[k].half_length);
        } else {
            knots[at] = KnotWords(0.0, 0.0, 0.0);
        }
    }
    trace_end(face);
    store(face, loaded.first);
}
