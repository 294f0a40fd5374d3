// What a frame does to the mesh: normals, gradients and fundamental forms of faces, then of nodes. Twin of
// src/database/forms.rs.

struct FaceForm {
    normal: array<f32, 3>,
    u: array<f32, 3>,
    v: array<f32, 3>,
    first: array<f32, 3>,
}

// A node's vertex, and where what it takes of faces begins, for its normal and for all else, and what of vertices around
// it; each ends where the next node's begins.
struct Node {
    vertex: u32,
    normal: u32,
    strain: u32,
    fit: u32,
}

struct Share {
    face: u32,
    weight: f32,
}

struct Fit {
    vertex: u32,
    uu: f32,
    uv: f32,
    vv: f32,
}

@group(0) @binding(3) var<storage, read_write> face_forms: array<FaceForm>;
@group(0) @binding(4) var<storage, read_write> node_forms: array<NodeForm>;
@group(0) @binding(5) var<storage, read> nodes: array<Node>;
@group(0) @binding(6) var<storage, read> shares: array<Share>;
@group(0) @binding(7) var<storage, read> fits: array<Fit>;

@compute @workgroup_size(WORKGROUP)
fn of_faces(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let face = thread_of(id, groups);
    if face >= settings.faces {
        return;
    }
    let corners = mesh[face].vertices;
    let inverse = mesh[face].inverse;
    let first = place(corners[0]);
    let a = place(corners[1]) - first;
    let b = place(corners[2]) - first;
    let u = a * inverse[0] + b * inverse[2];
    let v = a * inverse[1] + b * inverse[3];
    face_forms[face] = FaceForm(
        words(normalized_or_zero(cross3(a, b))),
        words(u),
        words(v),
        array<f32, 3>(dot3(u, u), dot3(u, v), dot3(v, v)),
    );
}

fn average_normal(node: u32) -> vec3<f32> {
    let begin = nodes[node].normal;
    let count = min(nodes[node + 1u].normal - begin, settings.most_shares);
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < count; i++) {
        let share = shares[begin + i];
        sum = sum + vector(face_forms[share.face].normal) * share.weight;
    }
    return normalized_or_zero(sum);
}

// Second derivatives of the surface along its normal.
fn fitted(normal: vec3<f32>, node: u32) -> vec3<f32> {
    let begin = nodes[node].fit;
    let count = min(nodes[node + 1u].fit - begin, settings.most_fits);
    let own = place(nodes[node].vertex);
    var second = vec3<f32>(0.0);
    for (var i = 0u; i < count; i++) {
        let fit = fits[begin + i];
        let off = dot3(normal, place(fit.vertex) - own);
        second = second + vec3<f32>(fit.uu, fit.uv, fit.vv) * off;
    }
    return second;
}

@compute @workgroup_size(WORKGROUP)
fn of_nodes(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let node = thread_of(id, groups);
    if node >= settings.nodes {
        return;
    }
    let normal = average_normal(node);
    let begin = nodes[node].strain;
    let count = min(nodes[node + 1u].strain - begin, settings.most_shares);
    var u = vec3<f32>(0.0);
    var v = vec3<f32>(0.0);
    var first = vec3<f32>(0.0);
    for (var i = 0u; i < count; i++) {
        let share = shares[begin + i];
        u = u + vector(face_forms[share.face].u) * share.weight;
        v = v + vector(face_forms[share.face].v) * share.weight;
        first = first + vector(face_forms[share.face].first) * share.weight;
    }
    var second = vec3<f32>(0.0);
    if settings.bends != 0u {
        second = fitted(normal, node);
    }
    node_forms[node] = NodeForm(words(normal), words(u), words(v), words(first), words(second));
}
