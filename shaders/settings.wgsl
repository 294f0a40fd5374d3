// What a dispatch is told, as src/backend/gpu/layout.rs writes it.

struct Settings {
    beta: f32,
    weight_angle: f32,
    weight_length: f32,
    // The bits of a NaN: shaders cannot write one.
    nan: u32,
    iterations: u32,
    // Faces of the batch, and where this dispatch begins among them.
    face_count: u32,
    begin: u32,
    // Where the batch begins in the buffers of corners, strands, results and knots.
    first_corner: u32,
    first_strand: u32,
    first_face: u32,
    first_knot: u32,
    // Control points; sides of seams follow them.
    point_count: u32,
    // Whether knots hold starts, and whether those are of the frame before.
    given: u32,
    near: u32,
}

@group(0) @binding(1) var<uniform> settings: Settings;
