// What yarn needs to know of a face, put together from its corners. Twin of `face_frame` in src/database/forms.rs.

@group(0) @binding(3) var<storage, read> node_forms: array<NodeForm>;

// The value of the first corner, and the differences of the others from it.
fn cornered(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> array<vec4<f32>, 3> {
    return array<vec4<f32>, 3>(vec4<f32>(a, 0.0), vec4<f32>(b - a, 0.0), vec4<f32>(c - a, 0.0));
}

// Sum over corners of b_k F_k (p - u_k): with p = sum b_j u_j only pairs of corners are left.
fn paired(j: NodeForm, k: NodeForm, u: f32, v: f32) -> vec4<f32> {
    let a = vector(j.u) - vector(k.u);
    let b = vector(j.v) - vector(k.v);
    return vec4<f32>((a * u + b * v) * settings.phong, 0.0);
}

fn face_frame(face: u32) -> FaceFrame {
    let vertices = mesh[face].vertices;
    let at = mesh[face].nodes;
    let edges = mesh[face].edges;
    let a = node_forms[at[0]];
    let b = node_forms[at[1]];
    let c = node_forms[at[2]];
    return FaceFrame(
        cornered(place(vertices[0]), place(vertices[1]), place(vertices[2])),
        array<vec4<f32>, 3>(
            paired(a, b, edges[0], edges[1]),
            paired(b, c, edges[2], edges[3]),
            paired(c, a, edges[4], edges[5]),
        ),
        cornered(vector(a.normal), vector(b.normal), vector(c.normal)),
        cornered(vector(a.first), vector(b.first), vector(c.first)),
        cornered(vector(a.second) * 2.0, vector(b.second) * 2.0, vector(c.second) * 2.0),
    );
}
