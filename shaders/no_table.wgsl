// No tabulated start.

fn correct_start(frame: Frame) {
}
