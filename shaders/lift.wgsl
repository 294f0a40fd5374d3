// Stage 5: from the face plane back onto the surface. Twin of src/knot/lift.rs.

struct Seat {
    center: vec2<f32>,
    height: f32,
    slope: vec2<f32>,
    normal: vec3<f32>,
}

var<private> seats: array<Seat, ROOM_KNOTS>;

fn seat(frame: Frame, k: u32) -> Seat {
    var x = vec3<f32>(0.0);
    var normal = vec3<f32>(0.0);
    var a = vec3<f32>(0.0);
    var b = vec3<f32>(0.0);
    for (var i = 0u; i < CORNERS; i++) {
        let at = k * CORNERS + i;
        let w = stencil.knot_weights[at];
        if w != 0.0 {
            x = x + corners[i] * w;
            normal = normal + normals[i] * w;
        }
        a = a + corners[i] * stencil.knot_gradients[at].u;
        b = b + corners[i] * stencil.knot_gradients[at].v;
    }
    let a_plane = in_plane(frame, a);
    let b_plane = in_plane(frame, b);
    let a_up = dot3(a, frame.n);
    let b_up = dot3(b, frame.n);
    let det = a_plane.x * b_plane.y - b_plane.x * a_plane.y;
    let size = dot3(a, a) + dot3(b, b);
    let steep = !(1e-6 * size < abs(det));
    let inverse = 1.0 / select(det, 1.0, steep);
    let slope = vec2<f32>(
        (a_up * b_plane.y - b_up * a_plane.y) * inverse,
        (b_up * a_plane.x - a_up * b_plane.x) * inverse,
    );
    var found: Seat;
    found.center = in_plane(frame, x);
    found.height = dot3(x, frame.n);
    found.slope = select(slope, vec2<f32>(0.0), steep);
    found.normal = normalized_or_zero(normal);
    return found;
}

// On the tangent plane of the surface, then offset along its normal.
fn lift(frame: Frame, k: u32, p: vec2<f32>, z: f32) -> vec3<f32> {
    let s = seats[k];
    let height = s.height + dot2(s.slope, p - s.center);
    return frame.t1 * p.x + frame.t2 * p.y + frame.n * height + s.normal * z;
}

// The place of an interpolated point that lies at `at` on the surface.
fn interpolate(point: u32, at: vec3<f32>) -> vec3<f32> {
    let z = stencil.points[point].z;
    // Most points on edges lie on the surface: they need no normal.
    if z == 0.0 {
        return at;
    }
    return at + normalized_or_zero(blend_normals(point)) * z;
}
