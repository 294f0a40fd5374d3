// What a thread of the other kernels did, block by block: src/backend/gpu/counters.rs adds the counting, and a call of
// `put_counts` wherever a thread ends.

@group(0) @binding(COUNTS_BINDING) var<storage, read_write> counts: array<u32>;

const COUNTERS: u32 = 64u;

// How often each block ran that costs anything.
var<private> counted: array<u32, COUNTERS>;

// Kernels that share the buffer have counters of their own, so that sums tell them apart.
fn put_counts(id: vec3<u32>, groups: vec3<u32>) {
    let thread = thread_of(id, groups);
    if thread >= arrayLength(&counts) / COUNTERS {
        return;
    }
    for (var i = 0u; i < COUNTERS; i++) {
        counts[thread * COUNTERS + i] += counted[i];
    }
}
