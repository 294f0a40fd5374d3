// Nothing is told of the stages.

fn trace_start(frame: Frame, face: u32) {
}

fn trace_first(energy: f32) {
}

fn trace_step() {
}

fn trace_end(face: u32) {
}
