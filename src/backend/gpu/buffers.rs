//! A scene's buffers on the device.

use super::adapter::Device;
use super::layout::Sizes;
use crate::scene::{Batch, Scene};
use crate::{Error, Result};
use wgpu::BufferUsages;

/// Where a batch's parts lie in buffers that it shares with others.
#[derive(Debug, Default)]
pub(super) struct BatchPlaces {
    /// Words of the topology.
    pub corners: u32,
    pub strands: u32,
    pub faces: u32,
    /// Words of the lists.
    pub count: u32,
    pub entry: u32,
    /// Word of the remembered shapes.
    pub shape: u32,
    /// Word of the shapes whose solve is known.
    pub known: u32,
}

/// Where everything lies.
#[derive(Debug, Default)]
pub(super) struct Places {
    pub sizes: Sizes,
    /// Word of the surface where bits of faces that are seen begin.
    pub seen: u32,
    pub batches: Vec<BatchPlaces>,
    /// Words of the surface, of the lists, of shapes, of known shapes.
    pub surface: u64,
    pub lists: u64,
    pub shapes: u64,
    pub known: u64,
}

/// Counts of what was skipped, which the lists begin with.
pub(super) const SKIP_COUNTS: usize = 6;

/// Words that do not change: topology of the mesh, of batches, of yarns.
#[derive(Debug, Default)]
pub(super) struct Topology {
    pub words: Vec<u32>,
    pub places: Places,
}

impl Topology {
    pub fn new(scene: &Scene) -> Result<Self> {
        let mut topology = Self::default();
        let groups = scene.corner_groups.as_ref();
        let seams = &scene.yarns.seams;
        let (vertices, faces) = (scene.vertex_count as u32, scene.face_places.len() as u32);
        let group_count = groups.map_or(0, |g| g.len() as u32);
        let moved = 3 * (u64::from(vertices) + u64::from(faces) + u64::from(group_count));
        let bent = moved + u64::from(vertices.div_ceil(32));
        let turned = bent + u64::from(faces);
        let seen = turned + u64::from(group_count);
        let sizes = Sizes {
            vertices,
            faces,
            groups: group_count,
            seams: seams.len() as u32,
            points: scene.yarns.point_count() as u32,
            face_offsets: topology.add(&scene.face_offsets)?,
            face_vertices: topology.add(&scene.face_vertices)?,
            group_offsets: topology.add(groups.map_or(&[0][..], |g| &g.offsets))?,
            group_faces: topology.add(groups.map_or(&[][..], |g| &g.faces))?,
            seam_points: topology.add(seams)?,
            moved: word(moved)?,
            bent: word(bent)?,
            turned: word(turned)?,
            most_corners: most(&scene.face_offsets),
            most_around: groups.map_or(0, |g| most(&g.offsets)),
        };
        let mut places = Places {
            sizes,
            seen: word(seen)?,
            surface: seen + u64::from(faces.div_ceil(32)),
            lists: (SKIP_COUNTS + 2 * scene.batches.len()) as u64,
            ..Places::default()
        };
        for (b, batch) in scene.batches.iter().enumerate() {
            let stencil = &scene.stencils[batch.stencil];
            let count = stencil.strand_offsets.len() - 1;
            let strands = &scene.yarns.strands[batch.first_strand..][..batch.faces.len() * count];
            let strands: Vec<u32> = strands.iter().flat_map(|s| s.words()).collect();
            let faces: Vec<u32> = batch.faces.iter().map(|f| f.0).collect();
            places.batches.push(BatchPlaces {
                corners: topology.add(&corners(scene, batch))?,
                strands: topology.add(&strands)?,
                faces: topology.add(&faces)?,
                count: word((SKIP_COUNTS + 2 * b) as u64)?,
                entry: word(places.lists)?,
                shape: word(places.shapes)?,
                known: word(places.known)?,
            });
            let n = stencil.corner_count;
            places.lists += faces.len() as u64;
            places.shapes += (faces.len() * (2 * n - 1)) as u64;
            places.known += 2 * (2 * n + 2 + 3 * stencil.knot_count()) as u64;
        }
        topology.places = places;
        Ok(topology)
    }

    fn add(&mut self, words: &[u32]) -> Result<u32> {
        let at = word(self.words.len() as u64)?;
        self.words.extend_from_slice(words);
        Ok(at)
    }
}

/// The most that lies between two offsets.
fn most(offsets: &[u32]) -> u32 {
    offsets.windows(2).map(|o| o[1] - o[0]).max().unwrap_or(0)
}

fn word(at: u64) -> Result<u32> {
    u32::try_from(at).map_err(|_| Error::invalid("more words than a GPU can number: split the mesh"))
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
        let buffer = self.any(name, bytes, BufferUsages::STORAGE | BufferUsages::COPY_DST | more);
        self.0.keep(name, &buffer);
        Ok(buffer)
    }

    /// A buffer that shaders read, with its words.
    pub fn words<T: bytemuck::Pod>(&self, name: &str, words: &[T]) -> Result<wgpu::Buffer> {
        let bytes: &[u8] = bytemuck::cast_slice(words);
        let buffer = self.storage(name, bytes.len() as u64, BufferUsages::empty())?;
        self.0.queue.write_buffer(&buffer, 0, bytes);
        Ok(buffer)
    }

    /// A buffer of dispatches' sizes.
    pub fn dispatches(&self, count: usize) -> wgpu::Buffer {
        self.any("dispatches", 12 * count as u64, BufferUsages::STORAGE | BufferUsages::INDIRECT)
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
