//! A fabric's buffers on the device.

use super::super::fabric::Fabric;
use super::super::forms::Forms;
use super::super::lookup::Lookup;
use super::super::nodes::Nodes;
use super::super::shell::FaceMap;
use super::super::strain::Axes;
use super::super::surface::NONE;
use super::super::{Bending, skip};
use super::GpuYarn;
use super::layout::{self, FabricFace, FabricSettings, Fit, Home, Node, Share};
use crate::Result;
use crate::backend::gpu::{Device, Maker};
use wgpu::BufferUsages;

/// Rounds of a loop beyond which a driver may end a shader's loops without a word.
const MOST_ROUNDS: u32 = 65_000;

/// The buffers, and what the kernels are told of them.
#[derive(Debug)]
pub struct Buffers {
    pub settings: wgpu::Buffer,
    /// `[vertex]`
    pub places: wgpu::Buffer,
    /// `[face]`
    pub mesh: wgpu::Buffer,
    pub face_forms: wgpu::Buffer,
    pub node_forms: wgpu::Buffer,
    /// `[node]`
    pub nodes: wgpu::Buffer,
    pub shares: wgpu::Buffer,
    pub fits: wgpu::Buffer,
    /// `[face]`
    pub frames: wgpu::Buffer,
    pub changes: wgpu::Buffer,
    pub seen: wgpu::Buffer,
    pub maps: wgpu::Buffer,
    /// Axes, rows, displacements.
    pub pattern: wgpu::Buffer,
    /// `[home]`
    pub homes: wgpu::Buffer,
    pub yarn_places: wgpu::Buffer,
    /// `[point]`
    pub points: wgpu::Buffer,
    pub counts: wgpu::Buffer,
}

/// Bytes of [`Buffers::counts`]: left alone, carried, hidden, outside the table.
pub const COUNTS: u64 = 16;

impl Buffers {
    /// Those of a fabric; no buffer has more bytes than shaders see of one.
    pub fn new(fabric: &Fabric, running: &GpuYarn, device: &Device) -> Result<(Self, FabricSettings)> {
        let maker = Room { maker: Maker(device), most: Maker(device).most(&running.device) };
        let (faces, points) = (fabric.face_count(), fabric.point_count());
        // First the largest: where there is no room, that is known before anything is put together.
        let homes = maker.empty("yarn vertices", points, size_of::<Home>())?;
        let yarn_places = maker.empty("displaced yarn vertices", points, size_of::<layout::Place>())?;
        let points = maker.empty("yarn points", points, size_of::<layout::YarnPoint>())?;
        let frames = maker.empty("face frames", faces, size_of::<layout::FaceFrame>())?;
        let words = Words::new(fabric, running);
        let settings = words.settings;
        let most = settings.most_shares.max(settings.most_fits);
        if device.ends_loops() && most > MOST_ROUNDS {
            return Err(device.fault(&format!(
                "a vertex has {most} neighbours: expected {MOST_ROUNDS} at most, for this driver ends loops: take --device cpu"
            )));
        }
        let buffers = Self {
            settings: maker.maker.uniform("settings of fabrics", &settings),
            places: maker.empty("vertices", fabric.vertex_count, 12)?,
            mesh: maker.words("faces", &words.mesh)?,
            face_forms: maker.empty("forms of faces", faces, size_of::<layout::FaceForm>())?,
            node_forms: maker.empty("forms of nodes", words.nodes.len(), size_of::<layout::NodeForm>())?,
            nodes: maker.words("nodes", &words.nodes)?,
            shares: maker.words("faces around nodes", &words.shares)?,
            fits: maker.words("vertices around nodes", &words.fits)?,
            changes: maker.empty("changes of faces", faces, 4)?,
            seen: maker.empty("faces that are seen", faces.div_ceil(32), 4)?,
            maps: maker.words("edges of faces", &words.maps)?,
            pattern: maker.words("strain table", &words.pattern)?,
            counts: maker.empty("counts", 1, COUNTS as usize)?,
            frames,
            homes,
            yarn_places,
            points,
        };
        device.queue.write_buffer(&buffers.homes, 0, bytemuck::cast_slice(&home_words(fabric)));
        device.check()?;
        Ok((buffers, settings))
    }

    /// What a frame leaves behind, by name.
    pub fn named(&self, name: &str) -> Option<&wgpu::Buffer> {
        match name {
            "places" => Some(&self.places),
            "face forms" => Some(&self.face_forms),
            "node forms" => Some(&self.node_forms),
            "face frames" => Some(&self.frames),
            "changes" => Some(&self.changes),
            "yarn places" => Some(&self.yarn_places),
            "points" => Some(&self.points),
            _ => None,
        }
    }

    /// What never changes, by name.
    pub fn fixed(&self, name: &str) -> Option<&wgpu::Buffer> {
        match name {
            "mesh" => Some(&self.mesh),
            "nodes" => Some(&self.nodes),
            "shares" => Some(&self.shares),
            "fits" => Some(&self.fits),
            "maps" => Some(&self.maps),
            "pattern" => Some(&self.pattern),
            "homes" => Some(&self.homes),
            _ => None,
        }
    }
}

/// Makes buffers that shaders see all of.
struct Room<'a> {
    maker: Maker<'a>,
    most: u64,
}

impl Room<'_> {
    fn empty(&self, name: &str, count: usize, bytes: usize) -> Result<wgpu::Buffer> {
        let all = count as u64 * bytes as u64;
        if all > self.most {
            return Err(self.maker.0.fault(&format!(
                "the fabric's {name} take {all} bytes, expected {} at most as the adapter allows: take --device cpu",
                self.most
            )));
        }
        self.maker.storage(name, all, BufferUsages::COPY_SRC)
    }

    fn words<T: bytemuck::Pod>(&self, name: &str, words: &[T]) -> Result<wgpu::Buffer> {
        let buffer = self.empty(name, words.len(), size_of::<T>())?;
        self.maker.0.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(words));
        Ok(buffer)
    }
}

/// What of a fabric does not change, rounded as its twin does.
struct Words {
    settings: FabricSettings,
    mesh: Vec<FabricFace>,
    nodes: Vec<Node>,
    shares: Vec<Share>,
    fits: Vec<Fit>,
    maps: Vec<layout::FaceMap>,
    pattern: Vec<[u32; 4]>,
}

impl Words {
    fn new(fabric: &Fabric, running: &GpuYarn) -> Self {
        let settings = &fabric.settings;
        let forms = Forms::<f32>::new(&fabric.surface, fabric.nodes.clone(), fabric.vertex_count, settings);
        let axes = Axes::<f32>::new(&fabric.model.table, settings.min_eigenvalue, settings.compat);
        let lookup = Lookup::<f32>::new(&fabric.model.table, settings.displacement);
        let tolerance = skip::Tolerance::<f32>::new(fabric, &running.skip);
        // A third for each difference from the first corner.
        let within = |tolerance: f32| tolerance * (1.0 / 3.0) as f32;
        let (shares, fits) = (shares(&forms), fits(&forms));
        let nodes = nodes(&forms);
        let most = |begin: fn(&Node) -> u32| {
            nodes.windows(2).map(|pair| begin(&pair[1]) - begin(&pair[0])).max().unwrap_or(0)
        };
        let [axis_sx, axis_sa, axis_sy] = axes.axes.each_ref().map(|axis| axis.nodes.len() as u32);
        let pattern = pattern(fabric, &axes, &lookup);
        let first_row = axis_sx + axis_sa + axis_sy;
        let [table_sa, table_sy] = lookup.strides.map(|stride| stride as u32);
        let settings = FabricSettings {
            vertices: fabric.vertex_count as u32,
            faces: fabric.face_count() as u32,
            nodes: forms.nodes.count() as u32,
            homes: fabric.point_count() as u32,
            most_shares: most(|n| n.normal).max(most(|n| n.strain)),
            most_fits: most(|n| n.fit),
            bends: u32::from(settings.bending == Bending::Linearized),
            phong: settings.phong as f32,
            least: axes.least as f32,
            axis_sx,
            axis_sa,
            axis_sy,
            first_row,
            first_value: first_row + fabric.rows.len() as u32,
            table_nodes: lookup.nodes as u32,
            table_sa,
            table_sy,
            continued: 0,
            unmoved: u32::from(running.skip.unmoved),
            rigid: u32::from(running.skip.rigid),
            within_first: within(tolerance.first),
            within_second: within(tolerance.second),
            hides: 0,
        };
        Self { settings, mesh: mesh(&forms), nodes, shares, fits, maps: maps(fabric), pattern }
    }
}

fn mesh(forms: &Forms<f32>) -> Vec<FabricFace> {
    let face = |face: usize| FabricFace {
        vertices: forms.faces[face],
        nodes: forms.nodes.of_faces[face],
        inverse: forms.inverses[face],
        edges: bytemuck::cast(forms.edges[face]),
    };
    (0..forms.faces.len()).map(face).collect()
}

/// Nodes, and one more where the last one ends.
fn nodes(forms: &Forms<f32>) -> Vec<Node> {
    let Nodes { vertices, normal, strain, .. } = &forms.nodes;
    let first_strain = normal.faces.len() as u32;
    let node = |node: usize| Node {
        vertex: vertices.get(node).copied().unwrap_or(0),
        normal: normal.offsets[node],
        strain: first_strain + strain.offsets[node],
        fit: forms.fits.offsets[node],
    };
    (0..=vertices.len()).map(node).collect()
}

fn shares(forms: &Forms<f32>) -> Vec<Share> {
    let of_normals = forms.nodes.normal.faces.iter().zip(&forms.normal);
    let of_strains = forms.nodes.strain.faces.iter().zip(&forms.strain);
    of_normals.chain(of_strains).map(|(face, weight)| Share { face: *face, weight: *weight }).collect()
}

fn fits(forms: &Forms<f32>) -> Vec<Fit> {
    let all = forms.fits.vertices.iter().zip(&forms.fit_weights);
    all.map(|(vertex, [uu, uv, vv])| Fit { vertex: *vertex, uu: *uu, uv: *uv, vv: *vv }).collect()
}

fn maps(fabric: &Fabric) -> Vec<layout::FaceMap> {
    let step = |step: &super::super::shell::Step<f32>| layout::Step {
        face: step.face,
        corners: step.corners,
        opposite: step.opposite,
    };
    let maps = FaceMap::<f32>::all(&fabric.surface, false).into_iter();
    maps.map(|map| layout::FaceMap { inverse: map.inverse, steps: map.steps.each_ref().map(step) }).collect()
}

/// In fours, as shaders read them: nodes of axes, rows, displacements.
fn pattern(fabric: &Fabric, axes: &Axes<f32>, lookup: &Lookup<f32>) -> Vec<[u32; 4]> {
    let nodes = axes.axes.iter().flat_map(|axis| {
        let inverses = axis.inverses.iter().copied().chain([0.0]);
        axis.nodes.iter().zip(inverses).map(|(node, inverse)| [node.to_bits(), inverse.to_bits(), 0, 0])
    });
    let row = |(vertex, height, twist): &(u32, f64, f64)| {
        [*vertex, (*height as f32).to_bits(), (*twist as f32).to_bits(), 0]
    };
    let values = lookup.values.iter().map(|value| value.map(f32::to_bits));
    nodes.chain(fabric.rows.iter().map(row)).chain(values).collect()
}

fn home_words(fabric: &Fabric) -> Vec<Home> {
    let homes = &fabric.homes;
    let mut faces = vec![NONE; homes.points.len()];
    for (face, range) in homes.runs(0..faces.len()) {
        faces[range].fill(face);
    }
    let home = |home: usize| Home {
        face: faces[home],
        row: homes.rows[home],
        point: homes.points[home],
        b: homes.barycentric[0][home],
        c: homes.barycentric[1][home],
    };
    (0..faces.len()).map(home).collect()
}
