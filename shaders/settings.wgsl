// What a dispatch is told, as src/backend/gpu/layout.rs writes it.

struct Settings {
    beta: f32,
    weight_angle: f32,
    weight_length: f32,
    // The bits of a NaN: shaders cannot write one.
    nan: u32,
    iterations: u32,
    // Faces of the batch, and where a direct dispatch begins among them.
    face_count: u32,
    begin: u32,
    // Where the batch begins in the topology: corners, strands, and its faces of the mesh.
    first_corner: u32,
    first_strand: u32,
    first_mesh_face: u32,
    // Where it begins among results and knots.
    first_face: u32,
    first_knot: u32,
    // Control points; sides of seams follow them.
    point_count: u32,
    // Whether knots hold starts, and whether those are of the frame before.
    given: u32,
    near: u32,
    // Which faces: DIRECT, SOLVE_LIST, LIFT_LIST or DIRECT_LIFT.
    way: u32,
    // Where the batch's counts and entries lie in the lists.
    first_count: u32,
    first_entry: u32,
    // Where its remembered shapes begin, and the shapes that are known: the template's own, then the first face's.
    first_shape: u32,
    first_known: u32,
    // Bits of what may be skipped: UNMOVED, RIGID, REST, SHARED, and SEEN_ALL where no face is hidden.
    skip: u32,
    tolerance: f32,
    // Whether the output holds a frame of this backend, and whether solves start from the frame before.
    own: u32,
    from_previous: u32,
    // Where in the surface the flags of faces and corner groups begin, and the bits of faces that are seen.
    bent: u32,
    turned: u32,
    seen: u32,
    // Index of the first face normal and of the first corner group among normals.
    face_normals: u32,
    group_normals: u32,
}

const DIRECT: u32 = 0u;
const SOLVE_LIST: u32 = 1u;
const LIFT_LIST: u32 = 2u;
const DIRECT_LIFT: u32 = 3u;
const UNMOVED: u32 = 1u;
const RIGID: u32 = 2u;
const REST: u32 = 4u;
const SHARED: u32 = 8u;
const SEEN_ALL: u32 = 16u;

@group(0) @binding(1) var<uniform> settings: Settings;
