// What the kernels of fabrics are told, and what a face and its corners are to them.

struct FabricSettings {
    vertices: u32,
    faces: u32,
    nodes: u32,
    // Yarn vertices.
    homes: u32,
    // Faces around a node and vertices of a fit, at most: whatever buffers say, no loop is longer.
    most_shares: u32,
    most_fits: u32,
    // Whether bending is taken account of.
    bends: u32,
    // Share of Phong deformation.
    phong: f32,
    // Lower bound of eigenvalues.
    least: f32,
    // Nodes along sx, sa and sy; those of an axis stand one after the other, the axes too.
    axis_sx: u32,
    axis_sa: u32,
    axis_sy: u32,
    // Where among the words of the pattern its rows begin, and its displacements.
    first_row: u32,
    first_value: u32,
    // Displacements of a pattern's vertex; from a node to the next along sa and sy, 0 where there is but one.
    table_nodes: u32,
    table_sa: u32,
    table_sy: u32,
    // Whether the output holds the frame before.
    continued: u32,
    // What may be skipped, and what counts as the same strain.
    unmoved: u32,
    rigid: u32,
    within_first: f32,
    within_second: f32,
    // Whether some faces are hidden.
    hides: u32,
}

// Places of corners, what Phong deformation adds for each pair of them, normals, first fundamental forms and twice the
// second; of the corners the first one's value and the differences of the others from it.
struct FaceFrame {
    place: array<vec4<f32>, 3>,
    phong: array<vec4<f32>, 3>,
    normal: array<vec4<f32>, 3>,
    first: array<vec4<f32>, 3>,
    second: array<vec4<f32>, 3>,
}

@group(0) @binding(0) var<uniform> settings: FabricSettings;
