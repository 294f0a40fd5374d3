//! Garbage in buffers: for tests of what shaders make of it.

use super::GpuBackend;
use super::part::Buffers;

impl GpuBackend {
    /// Fills the buffers of that name with some words, over and over, before the next frame; says how many there are.
    #[doc(hidden)]
    pub fn spoil(&self, name: &str, words: &[u32]) -> usize {
        let of_types = self.types.iter().flatten().filter_map(|t| match name {
            "stencil" => Some(&t.stencil),
            // A word stands in where there is none.
            "table" => Some(&t.table).filter(|table| table.size() > 16),
            _ => None,
        });
        let of_parts = self.parts.iter().filter_map(|part| {
            let Buffers { surface, topology, points, knots, results, lists, shapes, known, .. } =
                &part.buffers;
            match name {
                "places and normals" => Some(surface),
                "topology" => Some(topology),
                "control points" => Some(points),
                "knots" => Some(knots),
                "results" => Some(results),
                "lists" => Some(lists),
                "shapes" => Some(shapes),
                "known shapes" => Some(known),
                _ => None,
            }
        });
        let buffers: Vec<_> = of_types.chain(of_parts).collect();
        for buffer in &buffers {
            let all: Vec<u32> = words.iter().copied().cycle().take(buffer.size() as usize / 4).collect();
            self.device.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&all));
        }
        buffers.len()
    }
}
