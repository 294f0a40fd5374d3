// A thread's number, where a dispatch has more workgroups than go in a row.
fn thread_of(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.x + id.y * groups.x * WORKGROUP;
}
