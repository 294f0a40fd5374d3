//! A scene's buffers on the device.

use super::GpuOptions;
use super::adapter::Device;
use super::layout::Sizes;
use super::slice::Slice;
use crate::scene::Scene;
use crate::{Error, Result};
use wgpu::BufferUsages;

/// Where a batch's parts lie in buffers that it shares with others.
#[derive(Debug, Default)]
pub(super) struct BatchPlaces {
    /// Words of the topology.
    pub corners: u32,
    pub strands: u32,
    pub faces: u32,
    /// Among results and knots.
    pub first_face: u32,
    pub first_knot: u32,
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
    /// Own faces, and their knots.
    pub faces: u64,
    pub knots: u64,
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
    /// That of a part of a scene; `None` where it has more words than a shader can number.
    pub fn new(scene: &Scene, slice: &Slice) -> Option<Self> {
        let mut topology = Self::default();
        let numbering = slice.numbering(scene);
        let (vertices, faces) = (slice.vertices.len() as u32, slice.faces.len() as u32);
        let groups = slice.groups.len() as u32;
        let moved = 3 * (u64::from(vertices) + u64::from(faces) + u64::from(groups));
        let bent = moved + u64::from(vertices.div_ceil(32));
        let turned = bent + u64::from(faces);
        let seen = turned + u64::from(groups);
        let [face_offsets, face_vertices] = numbering.face_vertices();
        let [group_offsets, group_faces] = numbering.group_faces();
        let sizes = Sizes {
            vertices,
            faces,
            groups,
            seams: slice.seams.len() as u32,
            points: slice.points.len() as u32,
            sides: slice.side_count() as u32,
            face_offsets: topology.add(&face_offsets)?,
            face_vertices: topology.add(&face_vertices)?,
            group_offsets: topology.add(&group_offsets)?,
            group_faces: topology.add(&group_faces)?,
            seam_points: topology.add(&numbering.seam_points())?,
            moved: word(moved)?,
            bent: word(bent)?,
            turned: word(turned)?,
            most_corners: most(&scene.face_offsets),
            most_around: scene.corner_groups.as_ref().map_or(0, |g| most(&g.offsets)),
        };
        // A float each for x, y and z.
        word(3 * (u64::from(sizes.points) + u64::from(sizes.sides)))?;
        let mut places = Places {
            sizes,
            seen: word(seen)?,
            surface: seen + u64::from(faces.div_ceil(32)),
            lists: (SKIP_COUNTS + 2 * scene.batches.len()) as u64,
            ..Places::default()
        };
        for (b, batch) in scene.batches.iter().enumerate() {
            let stencil = &scene.stencils[batch.stencil];
            let count = slice.batches[b].len();
            places.batches.push(BatchPlaces {
                corners: topology.add(&numbering.corners(b))?,
                strands: topology.add(&numbering.strands(b))?,
                faces: topology.add(&numbering.mesh_faces(b))?,
                first_face: word(places.faces)?,
                first_knot: word(places.knots)?,
                count: word((SKIP_COUNTS + 2 * b) as u64)?,
                entry: word(places.lists)?,
                shape: word(places.shapes)?,
                known: word(places.known)?,
            });
            let (n, k) = (stencil.corner_count, stencil.knot_count());
            places.faces += count as u64;
            places.knots += (count * k) as u64;
            places.lists += count as u64;
            places.shapes += (count * (2 * n - 1)) as u64;
            places.known += 2 * (2 * n + 2 + 3 * k) as u64;
        }
        topology.places = places;
        Some(topology)
    }

    /// Bytes of the largest of the part's buffers that shaders see.
    pub fn largest(&self) -> u64 {
        let places = &self.places;
        let Places { surface, lists, shapes, known, .. } = places;
        let points = 3 * (u64::from(places.sizes.points) + u64::from(places.sizes.sides));
        let words = [*surface, *lists, *shapes, *known, points, 3 * places.knots, 3 * places.faces];
        4 * words.into_iter().fold(self.words.len() as u64, u64::max)
    }

    fn add(&mut self, words: &[u32]) -> Option<u32> {
        let at = word(self.words.len() as u64)?;
        self.words.extend_from_slice(words);
        Some(at)
    }
}

/// The most that lies between two offsets.
fn most(offsets: &[u32]) -> u32 {
    offsets.windows(2).map(|o| o[1] - o[0]).max().unwrap_or(0)
}

fn word(at: u64) -> Option<u32> {
    u32::try_from(at).ok()
}

/// A scene in as few parts as fit a device whose shaders see so many bytes of a buffer.
pub(super) fn parts(scene: &Scene, most: u64) -> Result<Vec<(Slice, Topology)>> {
    let faces = scene.face_places.len() as u64;
    let mut count = 1;
    loop {
        let slice = |i: u64| match count {
            1 => Slice::whole(scene),
            _ => Slice::of_faces(scene, (faces * i / count) as u32..(faces * (i + 1) / count) as u32),
        };
        let (mut parts, mut largest) = (Vec::new(), 0);
        for i in 0..count {
            let slice = slice(i);
            let Some(topology) = Topology::new(scene, &slice) else {
                largest = u64::MAX;
                break;
            };
            largest = largest.max(topology.largest());
            if largest > most {
                break;
            }
            parts.push((slice, topology));
        }
        if largest <= most {
            return Ok(parts);
        }
        if count >= faces {
            return Err(Error::invalid(format_args!(
                "buffers of {most} bytes do not hold a stitch: take --device cpu"
            )));
        }
        // A little more than what one part lacked, for parts share what lies between them.
        let lacking = if largest == u64::MAX { 2.0 } else { largest as f64 / most.max(1) as f64 };
        count = faces.min((count as f64 * lacking * 1.02) as u64 + 1);
    }
}

/// Makes buffers, within the device's limits.
pub(crate) struct Maker<'a>(pub &'a Device);

impl Maker<'_> {
    /// How many bytes of a buffer shaders see at most.
    pub fn most(&self, options: &GpuOptions) -> u64 {
        let limits = &self.0.limits;
        // What comes back of a part is in one buffer: points, knots and results.
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size / 3);
        options.most_bytes.map_or(most, |bytes| bytes.min(most))
    }

    /// An empty buffer of so many bytes that shaders see.
    pub fn storage(&self, name: &str, bytes: u64, more: BufferUsages) -> Result<wgpu::Buffer> {
        let limits = &self.0.limits;
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes > most {
            return Err(self.0.fault(&format!(
                "the scene's {name} take {bytes} bytes, expected {most} at most as the adapter allows: take --device cpu"
            )));
        }
        Ok(self.any(name, bytes, BufferUsages::STORAGE | BufferUsages::COPY_DST | more))
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

    /// A buffer that timestamps are put into.
    pub fn timestamps(&self, bytes: u64) -> wgpu::Buffer {
        self.any("timestamps", bytes, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC)
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
