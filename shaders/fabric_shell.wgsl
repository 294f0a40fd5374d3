// Where a displaced vertex of the pattern lies on the mesh, and from there in space. Twin of src/database/shell.rs.

// What lies across an edge: the face or NONE; which of its corners are this edge's first and second, and the third, two bits
// each; barycentric coordinates there of the corner here that the edge does not touch.
struct Step {
    face: u32,
    corners: u32,
    opposite: array<f32, 3>,
}

struct FaceMap {
    // Rows of the inverse of the material edges.
    inverse: array<f32, 4>,
    steps: array<Step, 3>,
}

@group(0) @binding(2) var<storage, read> maps: array<FaceMap>;
@group(0) @binding(3) var<storage, read> frames: array<FaceFrame>;

// Barycentric coordinates of a face's three corners, after a place in it was moved along u and v.
fn shifted(face: u32, b: f32, c: f32, u: f32, v: f32) -> vec3<f32> {
    let inverse = maps[face].inverse;
    let to_b = b + (inverse[0] * u + inverse[1] * v);
    let to_c = c + (inverse[2] * u + inverse[3] * v);
    return vec3<f32>(1.0 - to_b - to_c, to_b, to_c);
}

// Which of three numbers is put at a place.
fn put_at(place: u32, numbers: vec3<f32>, places: vec3<u32>) -> f32 {
    let one = places == vec3<u32>(place);
    return select(select(select(0.0, numbers.x, one.x), numbers.y, one.y), numbers.z, one.z);
}

struct Followed {
    face: u32,
    all: vec3<f32>,
}

fn corner(all: vec3<f32>, k: u32) -> f32 {
    return select(select(all.x, all.y, k == 1u), all.z, k == 2u);
}

// Follows barycentric coordinates that leave their face to the face they lie in.
fn followed(from_face: u32, from_all: vec3<f32>) -> Followed {
    var face = from_face;
    var all = from_all;
    for (var i = 0u; i < MOST_CROSSED; i++) {
        // The corner whose edge it is farthest beyond, of those with a face across.
        var opposite = 3u;
        var least = 0.0;
        for (var k = 0u; k < 3u; k++) {
            let b = corner(all, k);
            if b < least && maps[face].steps[(k + 1u) % 3u].face != NONE {
                opposite = k;
                least = b;
            }
        }
        if opposite == 3u {
            break;
        }
        let step = maps[face].steps[(opposite + 1u) % 3u];
        let own = vec3<f32>(corner(all, (opposite + 1u) % 3u), corner(all, (opposite + 2u) % 3u), 0.0);
        let there = own + vec3<f32>(step.opposite[0], step.opposite[1], step.opposite[2]) * least;
        let to = (vec3<u32>(step.corners) >> vec3<u32>(0u, 2u, 4u)) & vec3<u32>(3u);
        face = step.face;
        all = vec3<f32>(put_at(0u, there, to), put_at(1u, there, to), put_at(2u, there, to));
    }
    return Followed(face, all);
}

// A place in space, relative to the origin: on the face, bent by Phong deformation, and lifted along the normal.
fn lifted(face: u32, b: f32, c: f32, height: f32) -> vec3<f32> {
    let a = 1.0 - b - c;
    let n = frames[face].normal;
    let x = frames[face].place;
    let p = frames[face].phong;
    let normal = n[0].xyz + n[1].xyz * b + n[2].xyz * c;
    let flat = x[0].xyz + x[1].xyz * b + x[2].xyz * c;
    let point = flat + (p[0].xyz * (a * b) + p[1].xyz * (b * c) + p[2].xyz * (c * a));
    let squared = dot3(normal, normal);
    let usable = 0.0 < squared && finite(squared);
    let scale = height / sqrt(select(1.0, squared, usable));
    return point + normal * scale;
}

// `C = I - 2 h II` at barycentric coordinates and a height: uu, uv, vv.
fn strain(face: u32, b: f32, c: f32, height: f32) -> vec3<f32> {
    let i = frames[face].first;
    let ii = frames[face].second;
    let first = i[0].xyz + i[1].xyz * b + i[2].xyz * c;
    let second = ii[0].xyz + ii[1].xyz * b + ii[2].xyz * c;
    return first - second * height;
}
