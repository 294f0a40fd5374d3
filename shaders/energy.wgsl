// Stage 3: the energy of a stitch and its normal equations. Twin of src/knot/energy.rs.

struct Segment {
    unit: vec2<f32>,
    up: f32,
    length: f32,
    inverse: f32,
}

struct Own {
    length: f32,
    inverse: f32,
}

var<private> plane: array<vec2<f32>, ROOM_POINTS>;
var<private> offsets: array<vec2<f32>, ROOM_POINTS>;
var<private> segments: array<Segment, ROOM_LENGTHS>;
var<private> own_now: array<Own, ROOM_OWN_LENGTHS>;
// Where points are placed and energies taken: the solve's state or its trial.
var<private> at_knots: array<Knot, ROOM_KNOTS>;

fn inverse_or_zero(length: f32) -> f32 {
    let some = 0.0 < length;
    return select(0.0, 1.0 / select(1.0, length, some), some);
}

// Puts contacts and controls where the knots say.
fn place() {
    for (var i = 0u; i < POINTS; i++) {
        let p = stencil.points[i];
        if p.role == BOUNDARY || p.role == FREE {
            continue;
        }
        let knot = at_knots[p.knot];
        let d = knot.direction;
        var offset: vec2<f32>;
        if p.role == CONTACT {
            offset = d * (p.sign * knot.half_length);
        } else {
            offset = vec2<f32>(d.y, -d.x) * (p.sign * stencil.yarn_radius);
        }
        offsets[i] = offset;
        plane[i] = centers[p.knot] + offset;
    }
    for (var i = 0u; i < OWN_LENGTHS; i++) {
        let l = at_knots[stencil.own_lengths[i].knot].half_length;
        let length = sqrt(l * l + stencil.own_lengths[i].square);
        own_now[i].length = length;
        own_now[i].inverse = inverse_or_zero(length);
    }
}

fn measure() {
    for (var s = 0u; s < LENGTHS; s++) {
        let i = stencil.lengths[s].point;
        let rise = stencil.rises[s];
        let own = stencil.own[s];
        if own == NOT_OWN {
            let along = plane[i + 1u] - plane[i];
            let length = sqrt(dot2(along, along) + rise * rise);
            let inverse = inverse_or_zero(length);
            segments[s] = Segment(along * inverse, rise * inverse, length, inverse);
        } else {
            let now = own_now[own];
            let along = offsets[i + 1u] - offsets[i];
            segments[s] = Segment(along * now.inverse, rise * now.inverse, now.length, now.inverse);
        }
    }
}

fn cosine_of(segment: u32) -> f32 {
    let e = segments[segment];
    let f = segments[segment + 1u];
    return dot2(e.unit, f.unit) + e.up * f.up;
}

fn length_residual(i: u32) -> f32 {
    return settings.weight_length * (segments[i].length - stencil.lengths[i].rest);
}

fn cosine_residual(i: u32, cosine: f32) -> f32 {
    return settings.weight_angle * (cosine - stencil.cosines[i].rest);
}

// What terms add that depend on no knot.
fn fixed_energy() -> f32 {
    var energy = 0.0;
    for (var j = 0u; j < FIXED_LENGTHS; j++) {
        let r = length_residual(stencil.fixed_lengths[j]);
        energy += r * r;
    }
    for (var j = 0u; j < FIXED_COSINES; j++) {
        let i = stencil.fixed_cosines[j];
        let r = cosine_residual(i, cosine_of(stencil.cosines[i].segment));
        energy += r * r;
    }
    return energy;
}

// E of the points as they are placed.
fn energy_now() -> f32 {
    measure();
    var energy = fixed_energy();
    for (var i = 0u; i < OWN_LENGTHS; i++) {
        let own = stencil.own_lengths[i];
        let r = settings.weight_length * (own_now[i].length - own.rest);
        energy += own.count * (r * r);
    }
    for (var i = 0u; i < OWN_COSINES; i++) {
        let own = stencil.own_cosines[i];
        let inverse = own_now[own.length].inverse;
        let l = at_knots[stencil.own_lengths[own.length].knot].half_length;
        let cosine = (own.sign * (l * l) + own.offset) * (inverse * inverse);
        let r = settings.weight_angle * (cosine - own.rest);
        energy += own.count * (r * r);
    }
    for (var j = 0u; j < CROSS_LENGTHS; j++) {
        let r = length_residual(stencil.cross_lengths[j]);
        energy += r * r;
    }
    for (var j = 0u; j < CROSS_COSINES; j++) {
        let i = stencil.cross_cosines[j];
        let r = cosine_residual(i, cosine_of(stencil.cosines[i].segment));
        energy += r * r;
    }
    return energy;
}

// E, and the normal equations.
fn assemble() -> f32 {
    measure();
    clear_sums();
    var energy = fixed_energy();
    for (var i = 0u; i < OWN_LENGTHS; i++) {
        energy += add_own_length(i);
    }
    for (var i = 0u; i < OWN_COSINES; i++) {
        energy += add_own_cosine(i);
    }
    for (var j = 0u; j < CROSS_LENGTHS; j++) {
        let i = stencil.cross_lengths[j];
        let r = length_residual(i);
        energy += r * r;
        add_length(i, r);
    }
    for (var j = 0u; j < CROSS_COSINES; j++) {
        let i = stencil.cross_cosines[j];
        let cosine = cosine_of(stencil.cosines[i].segment);
        let r = cosine_residual(i, cosine);
        energy += r * r;
        add_cosine(i, cosine, r);
    }
    return energy;
}
