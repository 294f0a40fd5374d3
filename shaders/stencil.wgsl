// A stitch type, as src/backend/gpu/layout.rs writes it; all members are words, so that nothing is padded.

struct Pair {
    u: f32,
    v: f32,
}

struct StencilPoint {
    role: u32,
    knot: u32,
    sign: f32,
    z: f32,
}

struct Term {
    point: u32,
    segment: u32,
    rest: f32,
    knot_count: u32,
    knots: array<u32, 3>,
    codes: array<u32, 3>,
}

struct OwnLength {
    knot: u32,
    square: f32,
    rest: f32,
    count: f32,
}

struct OwnCosine {
    length: u32,
    sign: f32,
    offset: f32,
    rest: f32,
    count: f32,
}

struct Stencil {
    counts: array<u32, COUNTS>,
    rest_spread: f32,
    yarn_radius: f32,
    points: array<StencilPoint, ROOM_POINTS>,
    weights: array<f32, ROOM_WEIGHTS>,
    frame_gradients: array<Pair, ROOM_CORNERS>,
    knot_direction: array<Pair, ROOM_KNOTS>,
    knot_half_length: array<f32, ROOM_KNOTS>,
    knot_weights: array<f32, ROOM_KNOT_WEIGHTS>,
    knot_gradients: array<Pair, ROOM_KNOT_WEIGHTS>,
    strand_offsets: array<u32, ROOM_OFFSETS>,
    lengths: array<Term, ROOM_LENGTHS>,
    cosines: array<Term, ROOM_COSINES>,
    rises: array<f32, ROOM_LENGTHS>,
    own: array<u32, ROOM_LENGTHS>,
    own_lengths: array<OwnLength, ROOM_OWN_LENGTHS>,
    own_cosines: array<OwnCosine, ROOM_OWN_COSINES>,
    fixed_lengths: array<u32, ROOM_LENGTHS>,
    fixed_cosines: array<u32, ROOM_COSINES>,
    cross_lengths: array<u32, ROOM_LENGTHS>,
    cross_cosines: array<u32, ROOM_COSINES>,
}

const BOUNDARY: u32 = 0u;
const CONTACT: u32 = 1u;
const CONTROL: u32 = 2u;
const FREE: u32 = 3u;
const NOT_OWN: u32 = 0xffffffffu;

@group(0) @binding(0) var<storage, read> stencil: Stencil;

fn pair(p: Pair) -> vec2<f32> {
    return vec2<f32>(p.u, p.v);
}
