// A face's new frame takes the old one's place, and what changed of it is put down. Twin of src/database/skip.rs.

@group(0) @binding(4) var<storage, read_write> frames: array<FaceFrame>;
// [face] bits: STRAIN, FRAME, HIDDEN.
@group(0) @binding(5) var<storage, read_write> changes: array<u32>;
// [face] a bit each, whether anybody sees it.
@group(0) @binding(6) var<storage, read> seen: array<u32>;

fn same3(a: array<vec4<f32>, 3>, b: array<vec4<f32>, 3>) -> bool {
    return all(a[0] == b[0]) && all(a[1] == b[1]) && all(a[2] == b[2]);
}

fn close(a: array<vec4<f32>, 3>, b: array<vec4<f32>, 3>, within: f32) -> bool {
    let most = vec4<f32>(within);
    return all(abs(a[0] - b[0]) <= most) && all(abs(a[1] - b[1]) <= most) && all(abs(a[2] - b[2]) <= most);
}

// Says what changed. A strain within the tolerance is not taken over, so that slow changes add up to one that is seen.
fn update(face: u32, continued: bool) -> u32 {
    let fresh = face_frame(face);
    if !continued {
        frames[face] = fresh;
        return STRAIN | FRAME;
    }
    let old = frames[face];
    let same = same3(old.first, fresh.first) && same3(old.second, fresh.second);
    let near = close(old.first, fresh.first, settings.within_first)
        && close(old.second, fresh.second, settings.within_second);
    let known = (settings.unmoved != 0u && same) || (settings.rigid != 0u && near);
    let stays = settings.unmoved != 0u
        && same3(old.place, fresh.place)
        && same3(old.phong, fresh.phong)
        && same3(old.normal, fresh.normal);
    frames[face].place = fresh.place;
    frames[face].phong = fresh.phong;
    frames[face].normal = fresh.normal;
    if !known {
        frames[face].first = fresh.first;
        frames[face].second = fresh.second;
        return STRAIN | FRAME;
    }
    return select(FRAME, 0u, stays);
}

@compute @workgroup_size(WORKGROUP)
fn frames_of_faces(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let face = thread_of(id, groups);
    if face >= settings.faces {
        return;
    }
    let continued = settings.continued != 0u;
    let change = update(face, continued && (changes[face] & HIDDEN) == 0u);
    // Shown again, all of it is worked on.
    let hidden = continued && settings.hides != 0u && ((seen[face / 32u] >> (face % 32u)) & 1u) == 0u;
    changes[face] = select(change, HIDDEN, hidden);
}
