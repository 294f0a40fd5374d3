// Vector areas of faces and their sums around corners. Twin of src/backend/surface.rs.

struct Sizes {
    vertices: u32,
    faces: u32,
    groups: u32,
    seams: u32,
    points: u32,
    // Where in the topology the faces' corners, the groups' faces and the seams' points begin; offsets come first.
    face_offsets: u32,
    face_vertices: u32,
    group_offsets: u32,
    group_faces: u32,
    seam_points: u32,
}

@group(0) @binding(0) var<uniform> sizes: Sizes;
// Places of vertices, then normals: the faces' own areas, then, where there are any, those of corner groups.
@group(0) @binding(1) var<storage, read_write> surface: array<f32>;
@group(0) @binding(2) var<storage, read> topology: array<u32>;
@group(0) @binding(3) var<storage, read_write> points: array<f32>;

fn at_surface(i: u32) -> vec3<f32> {
    return vec3<f32>(surface[3u * i], surface[3u * i + 1u], surface[3u * i + 2u]);
}

fn put_surface(i: u32, p: vec3<f32>) {
    surface[3u * i] = p.x;
    surface[3u * i + 1u] = p.y;
    surface[3u * i + 2u] = p.z;
}

fn thread(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.x + id.y * groups.x * WORKGROUP;
}

// The vector area of each face; zero for one so thin that it has no frame either, or not finite.
@compute @workgroup_size(WORKGROUP)
fn areas(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let face = thread(id, groups);
    if face >= sizes.faces {
        return;
    }
    let begin = topology[sizes.face_offsets + face];
    let end = topology[sizes.face_offsets + face + 1u];
    let first = at_surface(topology[sizes.face_vertices + begin]);
    var sum = vec3<f32>(0.0);
    var size = 0.0;
    for (var i = begin + 1u; i + 1u < end; i++) {
        let a = at_surface(topology[sizes.face_vertices + i]) - first;
        let b = at_surface(topology[sizes.face_vertices + i + 1u]) - first;
        sum = sum + cross3(a, b);
        size += dot3(a, a) + dot3(b, b);
    }
    let area = sum * 0.5;
    let wide = 1e-6 * size < length3(area) && finite(size);
    put_surface(sizes.vertices + face, select(vec3<f32>(0.0), area, wide && finite3(area)));
}

// The sum of the vector areas around each corner group.
@compute @workgroup_size(WORKGROUP)
fn corner_normals(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let group = thread(id, groups);
    if group >= sizes.groups {
        return;
    }
    let begin = topology[sizes.group_offsets + group];
    let end = topology[sizes.group_offsets + group + 1u];
    var sum = vec3<f32>(0.0);
    for (var i = begin; i < end; i++) {
        sum = sum + at_surface(sizes.vertices + topology[sizes.group_faces + i]);
    }
    put_surface(sizes.vertices + sizes.faces + group, sum);
}

// Shared points are the mean of what both faces say.
@compute @workgroup_size(WORKGROUP)
fn join(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let seam = thread(id, groups);
    if seam >= sizes.seams {
        return;
    }
    let to = 3u * topology[sizes.seam_points + seam];
    let a = 3u * (sizes.points + 2u * seam);
    for (var i = 0u; i < 3u; i++) {
        points[to + i] = (points[a + i] + points[a + 3u + i]) * 0.5;
    }
}
