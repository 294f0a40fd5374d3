//! A scene's buffers on the device.

use super::adapter::Device;
use super::layout::Sizes;
use crate::scene::{Batch, Scene};
use crate::{Error, Result};
use wgpu::BufferUsages;

/// Words that do not change: topology of the mesh, of batches, of yarns.
#[derive(Debug, Default)]
pub(super) struct Topology {
    pub words: Vec<u32>,
    pub sizes: Sizes,
    /// `[batch]` words where corners and strands begin.
    pub batches: Vec<[u32; 2]>,
}

impl Topology {
    pub fn new(scene: &Scene) -> Result<Self> {
        let mut topology = Self::default();
        let groups = scene.corner_groups.as_ref();
        let seams = &scene.yarns.seams;
        topology.sizes = Sizes {
            vertices: scene.vertex_count as u32,
            faces: scene.face_places.len() as u32,
            groups: groups.map_or(0, |g| g.len() as u32),
            seams: seams.len() as u32,
            points: scene.yarns.point_count() as u32,
            face_offsets: topology.add(&scene.face_offsets)?,
            face_vertices: topology.add(&scene.face_vertices)?,
            group_offsets: topology.add(groups.map_or(&[0][..], |g| &g.offsets))?,
            group_faces: topology.add(groups.map_or(&[][..], |g| &g.faces))?,
            seam_points: topology.add(seams)?,
        };
        for batch in &scene.batches {
            let corners = topology.add(&corners(scene, batch))?;
            let count = scene.stencils[batch.stencil].strand_offsets.len() - 1;
            let strands = &scene.yarns.strands[batch.first_strand..][..batch.faces.len() * count];
            let strands: Vec<u32> = strands.iter().flat_map(|s| s.words()).collect();
            let strands = topology.add(&strands)?;
            topology.batches.push([corners, strands]);
        }
        Ok(topology)
    }

    fn add(&mut self, words: &[u32]) -> Result<u32> {
        let at = u32::try_from(self.words.len())
            .map_err(|_| Error::invalid("more topology than a GPU can number: split the mesh"))?;
        self.words.extend_from_slice(words);
        Ok(at)
    }
}

/// `[face][corner]` vertex and index of the normal in the surface's buffer.
fn corners(scene: &Scene, batch: &Batch) -> Vec<u32> {
    let n = scene.stencils[batch.stencil].corner_count;
    let (vertices, faces) = (scene.vertex_count as u32, scene.face_places.len() as u32);
    let mut words = Vec::with_capacity(2 * batch.corners.len());
    for (i, vertex) in batch.corners.iter().enumerate() {
        let normal = match &scene.corner_groups {
            Some(groups) => vertices + faces + groups.of_vertex[*vertex as usize],
            None => vertices + batch.faces[i / n].0,
        };
        words.extend([*vertex, normal]);
    }
    words
}

/// Makes buffers, within the device's limits.
pub(super) struct Maker<'a>(pub &'a Device);

impl Maker<'_> {
    /// An empty buffer of so many bytes that shaders see.
    pub fn storage(&self, name: &str, bytes: u64, more: BufferUsages) -> Result<wgpu::Buffer> {
        let limits = &self.0.limits;
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes > most {
            return Err(self.0.fault(&format!(
                "the scene's {name} take {bytes} bytes, expected {most} at most as the adapter allows: take --device cpu"
            )));
        }
        Ok(self.any(name, bytes, BufferUsages::STORAGE | more))
    }

    /// A buffer that shaders read, with its words.
    pub fn words<T: bytemuck::Pod>(&self, name: &str, words: &[T]) -> Result<wgpu::Buffer> {
        let bytes: &[u8] = bytemuck::cast_slice(words);
        let buffer = self.storage(name, bytes.len() as u64, BufferUsages::COPY_DST)?;
        self.0.queue.write_buffer(&buffer, 0, bytes);
        Ok(buffer)
    }

    /// A buffer of a few settings.
    pub fn uniform<T: bytemuck::Pod>(&self, name: &str, settings: &T) -> wgpu::Buffer {
        let bytes = bytemuck::bytes_of(settings);
        let buffer = self.any(name, bytes.len() as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        self.0.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }

    /// A buffer that comes back.
    pub fn readback(&self, name: &str, bytes: u64) -> wgpu::Buffer {
        self.any(name, bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST)
    }

    fn any(&self, name: &str, bytes: u64, usage: BufferUsages) -> wgpu::Buffer {
        self.0.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            // Not even an empty scene has empty buffers; copies go by 4 bytes, uniforms by 16.
            size: bytes.max(16).next_multiple_of(16),
            usage,
            mapped_at_creation: false,
        })
    }
}
