// Stage 1: the face frame, and the template's points in it. Twin of src/knot/frame.rs.

struct Frame {
    t1: vec3<f32>,
    t2: vec3<f32>,
    n: vec3<f32>,
    f11: f32,
    f12: f32,
    f22: f32,
    usable: bool,
}

// The face at hand: places of corners relative to the first, unnormalised normals.
var<private> corners: array<vec3<f32>, ROOM_CORNERS>;
var<private> normals: array<vec3<f32>, ROOM_CORNERS>;
var<private> centers: array<vec2<f32>, ROOM_KNOTS>;

fn face_frame() -> Frame {
    var a = vec3<f32>(0.0);
    var b = vec3<f32>(0.0);
    for (var i = 0u; i < CORNERS; i++) {
        a = a + corners[i] * stencil.frame_gradients[i].u;
        b = b + corners[i] * stencil.frame_gradients[i].v;
    }
    let crossed = cross3(a, b);
    let area = length3(crossed);
    let size = dot3(a, a) + dot3(b, b);
    let course = length3(a);
    var frame: Frame;
    frame.usable = 1e-6 * size < area && finite(area) && finite(size);
    let area_or_one = select(1.0, area, frame.usable);
    let course_or_one = select(1.0, course, frame.usable);
    frame.t1 = a * (1.0 / course_or_one);
    frame.n = crossed * (1.0 / area_or_one);
    frame.t2 = cross3(frame.n, frame.t1);
    frame.f11 = course;
    frame.f12 = dot3(b, frame.t1);
    frame.f22 = dot3(b, frame.t2);
    return frame;
}

fn in_plane(frame: Frame, x: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(dot3(x, frame.t1), dot3(x, frame.t2));
}

fn blend_corners(point: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < CORNERS; i++) {
        let w = stencil.weights[point * CORNERS + i];
        if w != 0.0 {
            sum = sum + corners[i] * w;
        }
    }
    return sum;
}

fn blend_normals(point: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < CORNERS; i++) {
        let w = stencil.weights[point * CORNERS + i];
        if w != 0.0 {
            sum = sum + normals[i] * w;
        }
    }
    return sum;
}

// Draws the knot centres towards or away from their mean.
fn space_knots() {
    if KNOTS < 2u {
        return;
    }
    let share = 1.0 / f32(max(KNOTS, 1u));
    var mean = vec2<f32>(0.0);
    for (var k = 0u; k < KNOTS; k++) {
        mean = mean + centers[k];
    }
    mean = mean * share;
    var spread = 0.0;
    for (var k = 0u; k < KNOTS; k++) {
        let off = centers[k] - mean;
        spread += dot2(off, off);
    }
    spread = sqrt(spread * share);
    let apart = 0.0 < spread;
    let rest = stencil.rest_spread;
    var scale = (rest + settings.beta * (spread - rest)) / select(1.0, spread, apart);
    scale = select(1.0, scale, apart);
    for (var k = 0u; k < KNOTS; k++) {
        centers[k] = mean + (centers[k] - mean) * scale;
    }
}
