// A face's corners and normals, and what of it lies in buffers.

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

const TOP: u32 = 0x80000000u;
const INTERPOLATED: u32 = 0u;
const STEPPED: u32 = 1u;
const HAS_CONVERGED: u32 = 2u;
const AT_REST: u32 = 3u;
const STUCK: u32 = 4u;
const FELL_BACK: u32 = 5u;
const HIDDEN: u32 = 7u;

// See surface.wgsl.
@group(0) @binding(2) var<storage, read> surface: array<u32>;
@group(0) @binding(3) var<storage, read> topology: array<u32>;

// The first corner, and whether all were finite.
struct Loaded {
    first: vec3<f32>,
    whole: bool,
}

// Fills corners and normals.
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
