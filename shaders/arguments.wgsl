// How many workgroups each list needs.

struct Lists {
    // Lists, and the place of their first count.
    count: u32,
    first_count: u32,
}

@group(0) @binding(0) var<uniform> sizes: Lists;
@group(0) @binding(1) var<storage, read> lists: array<u32>;
// [list] workgroups along x, y and z.
@group(0) @binding(2) var<storage, read_write> groups: array<u32>;

const MOST_GROUPS: u32 = 65535u;

@compute @workgroup_size(WORKGROUP)
fn arguments(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= sizes.count {
        return;
    }
    // No list is longer than all of them.
    let count = min(lists[sizes.first_count + id.x], arrayLength(&lists));
    let needed = (count + WORKGROUP - 1u) / WORKGROUP;
    let across = min(needed, MOST_GROUPS);
    groups[3u * id.x] = across;
    groups[3u * id.x + 1u] = (needed + max(across, 1u) - 1u) / max(across, 1u);
    groups[3u * id.x + 2u] = 1u;
}
