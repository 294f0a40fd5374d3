// A mesh and its places, as the kernels of forms see them.

struct FabricFace {
    vertices: array<u32, 3>,
    nodes: array<u32, 3>,
    // Rows of the inverse of the material edges.
    inverse: array<f32, 4>,
    // Material edges 0-1, 1-2 and 2-0.
    edges: array<f32, 6>,
}

// Normal, columns of the deformation gradient, fundamental forms.
struct NodeForm {
    normal: array<f32, 3>,
    u: array<f32, 3>,
    v: array<f32, 3>,
    first: array<f32, 3>,
    second: array<f32, 3>,
}

@group(0) @binding(1) var<storage, read> places: array<f32>;
@group(0) @binding(2) var<storage, read> mesh: array<FabricFace>;

fn place(vertex: u32) -> vec3<f32> {
    return vec3<f32>(places[3u * vertex], places[3u * vertex + 1u], places[3u * vertex + 2u]);
}

fn vector(a: array<f32, 3>) -> vec3<f32> {
    return vec3<f32>(a[0], a[1], a[2]);
}

fn words(a: vec3<f32>) -> array<f32, 3> {
    return array<f32, 3>(a.x, a.y, a.z);
}
