// Vector areas of faces and their sums around corners. Twin of src/backend/surface.rs.

struct Sizes {
    vertices: u32,
    faces: u32,
    groups: u32,
    seams: u32,
    points: u32,
    // Two for each seam, then those whose other side is elsewhere.
    sides: u32,
    // Where in the topology the faces' corners, the groups' faces and the seams' points begin; offsets come first.
    face_offsets: u32,
    face_vertices: u32,
    group_offsets: u32,
    group_faces: u32,
    seam_points: u32,
    // Where in the surface flags begin: bits of vertices that moved, words of faces whose area changed, words of corner
    // groups whose normal did.
    moved: u32,
    bent: u32,
    turned: u32,
    // Corners of a face, and faces around a corner group, at most: whatever the topology says, no loop is longer.
    most_corners: u32,
    most_around: u32,
}

@group(0) @binding(0) var<uniform> sizes: Sizes;
// Places of vertices, then normals: the faces' own areas, then, where there are any, those of corner groups; then flags.
@group(0) @binding(1) var<storage, read_write> surface: array<u32>;
@group(0) @binding(2) var<storage, read> topology: array<u32>;
@group(0) @binding(3) var<storage, read_write> points: array<f32>;

fn put_surface(i: u32, p: vec3<f32>) {
    surface[3u * i] = bitcast<u32>(p.x);
    surface[3u * i + 1u] = bitcast<u32>(p.y);
    surface[3u * i + 2u] = bitcast<u32>(p.z);
}

// The vector area of each face; zero for one so thin that it has no frame either, or not finite.
@compute @workgroup_size(WORKGROUP)
fn areas(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let face = thread_of(id, groups);
    if face >= sizes.faces {
        return;
    }
    let begin = topology[sizes.face_offsets + face];
    let count = min(topology[sizes.face_offsets + face + 1u] - begin, sizes.most_corners);
    let first = at_surface(topology[sizes.face_vertices + begin]);
    var bent = 0u;
    for (var i = 0u; i < count; i++) {
        let vertex = topology[sizes.face_vertices + begin + i];
        bent |= (surface[sizes.moved + vertex / 32u] >> (vertex % 32u)) & 1u;
    }
    surface[sizes.bent + face] = bent;
    var sum = vec3<f32>(0.0);
    var size = 0.0;
    for (var i = 1u; i + 1u < count; i++) {
        let a = at_surface(topology[sizes.face_vertices + begin + i]) - first;
        let b = at_surface(topology[sizes.face_vertices + begin + i + 1u]) - first;
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
    let group = thread_of(id, groups);
    if group >= sizes.groups {
        return;
    }
    let begin = topology[sizes.group_offsets + group];
    let count = min(topology[sizes.group_offsets + group + 1u] - begin, sizes.most_around);
    var sum = vec3<f32>(0.0);
    var turned = 0u;
    for (var i = 0u; i < count; i++) {
        turned |= surface[sizes.bent + topology[sizes.group_faces + begin + i]];
        sum = sum + at_surface(sizes.vertices + topology[sizes.group_faces + begin + i]);
    }
    surface[sizes.turned + group] = turned;
    put_surface(sizes.vertices + sizes.faces + group, sum);
}

// Shared points are the mean of what both faces say.
@compute @workgroup_size(WORKGROUP)
fn join(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let seam = thread_of(id, groups);
    if seam >= sizes.seams {
        return;
    }
    let to = 3u * topology[sizes.seam_points + seam];
    let a = 3u * (sizes.points + 2u * seam);
    for (var i = 0u; i < 3u; i++) {
        points[to + i] = (points[a + i] + points[a + 3u + i]) * 0.5;
    }
}

// A motion of all points as one: p to x p.x + y p.y + z p.z + shift.
struct Turn {
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    shift: vec4<f32>,
}

@group(0) @binding(4) var<uniform> turn: Turn;

// Turns points and sides of seams along.
@compute @workgroup_size(WORKGROUP)
fn carry(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let at = thread_of(id, groups);
    if at >= sizes.points + sizes.sides {
        return;
    }
    let p = vec3<f32>(points[3u * at], points[3u * at + 1u], points[3u * at + 2u]);
    let q = turn.x.xyz * p.x + turn.y.xyz * p.y + turn.z.xyz * p.z + turn.shift.xyz;
    points[3u * at] = q.x;
    points[3u * at + 1u] = q.y;
    points[3u * at + 2u] = q.z;
}
