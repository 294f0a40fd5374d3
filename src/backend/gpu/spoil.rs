//! Garbage in buffers: for tests of what shaders make of it.

use super::GpuBackend;

impl GpuBackend {
    /// Fills the buffers of that name with some words, over and over, before the next frame; says how many there are.
    #[doc(hidden)]
    pub fn spoil(&self, name: &str, words: &[u32]) -> usize {
        let buffers = self.device.kept(name);
        for buffer in &buffers {
            let all: Vec<u32> = words.iter().copied().cycle().take(buffer.size() as usize / 4).collect();
            self.device.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&all));
        }
        buffers.len()
    }
}
