// What a thread of stitches did, block by block: src/backend/gpu/counters.rs adds the counting.

@group(0) @binding(9) var<storage, read_write> counts: array<u32>;

const COUNTERS: u32 = 256u;

// How often each block ran that costs anything.
var<private> counted: array<u32, COUNTERS>;

fn trace_start(frame: Frame, face: u32) {
}

fn trace_first(energy: f32) {
}

fn trace_step() {
}

fn trace_end(face: u32) {
    for (var i = 0u; i < COUNTERS; i++) {
        counts[face * COUNTERS + i] = counted[i];
    }
}
