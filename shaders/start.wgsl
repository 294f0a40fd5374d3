// Stage 2: where the solve starts. Twin of src/knot/start.rs.

struct Knot {
    direction: vec2<f32>,
    half_length: f32,
}

var<private> state: array<Knot, ROOM_KNOTS>;

// The template's own knots, carried rigidly.
fn rigid_start() {
    for (var k = 0u; k < KNOTS; k++) {
        state[k].direction = pair(stencil.knot_direction[k]);
        state[k].half_length = stencil.knot_half_length[k];
    }
}

// v = l0 F d0, l = |v|, d = v / l.
fn affine_start(frame: Frame) {
    for (var k = 0u; k < KNOTS; k++) {
        let rest = pair(stencil.knot_direction[k]);
        let before = rest * stencil.knot_half_length[k];
        let v = vec2<f32>(frame.f11 * before.x + frame.f12 * before.y, frame.f22 * before.y);
        let length = sqrt(dot2(v, v));
        let usable = 0.0 < length;
        let direction = v * (1.0 / select(1.0, length, usable));
        state[k].direction = select(rest, direction, usable);
        state[k].half_length = length;
    }
}

// The state after turning d by 2 atan(angle / 2) (Cayley) and lengthening l.
fn stepped(knot: Knot, angle: f32, lengthening: f32) -> Knot {
    let h = angle * 0.5;
    let scale = 1.0 / (1.0 + h * h);
    let cosine = (1.0 - h * h) * scale;
    let sine = (h + h) * scale;
    let d = knot.direction;
    var moved: Knot;
    moved.direction = vec2<f32>(cosine * d.x - sine * d.y, sine * d.x + cosine * d.y);
    moved.half_length = knot.half_length + lengthening;
    return moved;
}
