// What the stages of a stitch came to, for comparison with their twins: src/backend/gpu/trace.rs says what lies where.

@group(0) @binding(9) var<storage, read_write> trace: array<f32>;

var<private> trace_at: u32;

// Words of a face.
fn trace_words() -> u32 {
    let n = UNKNOWNS;
    return 13u + 14u * KNOTS + 5u * POINTS + 2u * n + 3u * (n * (n + 1u) / 2u);
}

fn told(value: f32) {
    trace[trace_at] = value;
    trace_at += 1u;
}

fn told2(value: vec2<f32>) {
    told(value.x);
    told(value.y);
}

fn told3(value: vec3<f32>) {
    told(value.x);
    told(value.y);
    told(value.z);
}

fn told_knots() {
    for (var k = 0u; k < KNOTS; k++) {
        told2(state[k].direction);
        told(state[k].half_length);
    }
}

fn trace_start(frame: Frame, face: u32) {
    trace_at = face * trace_words();
    told3(frame.t1);
    told3(frame.t2);
    told3(frame.n);
    told(frame.f11);
    told(frame.f12);
    told(frame.f22);
    for (var k = 0u; k < KNOTS; k++) {
        told2(centers[k]);
        told(seats[k].height);
        told2(seats[k].slope);
        told3(seats[k].normal);
    }
    told_knots();
}

fn trace_first(energy: f32) {
    for (var i = 0u; i < POINTS; i++) {
        told2(plane[i]);
    }
    told(energy);
    for (var i = 0u; i < UNKNOWNS; i++) {
        told(b_sum[i]);
        for (var j = 0u; j <= i; j++) {
            told(a_sum[i * UNKNOWNS + j]);
            told(c_sum[i * UNKNOWNS + j]);
        }
    }
}

fn trace_step() {
    for (var i = 0u; i < UNKNOWNS; i++) {
        told(step[i]);
        for (var j = 0u; j <= i; j++) {
            told(factors[i * UNKNOWNS + j]);
        }
    }
}

fn trace_end(face: u32) {
    trace_at = (face + 1u) * trace_words() - 3u * KNOTS - 3u * POINTS;
    told_knots();
    for (var i = 0u; i < POINTS; i++) {
        told3(lifted[i]);
    }
}
