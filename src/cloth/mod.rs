//! Cloth at the level of stitches: how large faces want to be, what it costs to make them otherwise, the shape of least
//! energy, and motion.
//!
//! Lengths are metres, forces newtons, masses kilograms, times seconds: a mesh in other units is scaled first. Nodes are the
//! places of the fabric where corners meet ([`crate::mesh::corners::CornerGroups`]), in an order of their own; see
//! [`Cloth::node_of_vertex`].
//!
//! The energies are those of Yuksel et al. 2012 (mesh-based relaxation) and Huang et al. 2025 (section 5.1): course and wale
//! edges towards their natural lengths, diagonals of faces against shear, and bending. [`natural`] says how long.

mod align;
mod assemble;
mod descend;
mod dissect;
mod energy;
mod factor;
mod folds;
mod implicit;
mod inflate;
mod linear;
pub mod natural;
mod order;
pub mod relax;
mod ribs;
pub mod step;
mod watch;

pub use natural::{Factors, Front, Sizes};
pub use relax::{RelaxOptions, RelaxReport, SMOOTH, relax};
pub use ribs::Ribs;
pub use step::{FrameReport, StepOptions, Stepper, Support, Surroundings};

use crate::mesh::StitchMesh;
use crate::template::TemplateLibrary;
use crate::{Error, Result};
use glam::DVec3;
use order::Blocks;
use std::collections::BTreeMap;

/// How hard fabric is to deform.
///
/// Defaults are of the order of what a hand-knitted fabric of wool shows at small strains (a strip of 0.1 m stretches by a few
/// per cent under 0.2 N); they are not of one measured fabric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    /// Stretch along the course: force per width and strain, N/m.
    pub course: f64,
    /// Stretch along the wale, N/m.
    pub wale: f64,
    /// Shear: force per width and radian, N/m.
    pub shear: f64,
    /// Bending rigidity per width, N m.
    pub bending: f64,
}

impl Default for Stiffness {
    fn default() -> Self {
        Self { course: 40.0, wale: 60.0, shear: 15.0, bending: 3e-5 }
    }
}

/// How a mesh becomes cloth.
#[derive(Clone, Debug, PartialEq)]
pub struct ClothOptions {
    /// Natural size of a plain knit face, metres; where not given, what the mesh was made to, else measured
    /// on it (its area over that of its templates).
    pub sizes: Option<Sizes>,
    /// How knits and purls side by side draw in.
    pub factors: Factors,
    /// Further factors `[along the course, along the wale]` by the name of a stitch type, e.g. `tuck+`.
    pub types: BTreeMap<String, [f64; 2]>,
    /// How hard it is to deform.
    pub stiffness: Stiffness,
    /// Mass of plain fabric at its natural size, kg/m2. Ribs are heavier for their area: their stitches take as much yarn.
    pub density: f64,
}

impl Default for ClothOptions {
    fn default() -> Self {
        Self {
            sizes: None,
            factors: Factors::default(),
            types: BTreeMap::new(),
            stiffness: Stiffness::default(),
            density: 0.3,
        }
    }
}

/// A spring between two nodes: `E = stiffness (l - length)^2 / 2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Its nodes.
    pub nodes: [u32; 2],
    /// Natural length, m.
    pub length: f64,
    /// N/m.
    pub stiffness: f64,
    /// What it stands for.
    pub kind: SpringKind,
}

/// What a spring stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SpringKind {
    /// An edge that runs along the course: a stitch's width.
    Course,
    /// An edge that runs along the wale: a stitch's height.
    Wale,
    /// A diagonal of a face.
    Shear,
}

/// Bending at a node: `E = stiffness |k|^2 / 2` with the curvature `k = sum weight x` (1/m). Where there are three nodes, the
/// last one counts nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bend {
    pub nodes: [u32; 4],
    pub weights: [f64; 4],
    pub stiffness: f64,
}

/// A mesh compiled into nodes, springs and bends; never changed after.
#[derive(Clone, Debug)]
pub struct Cloth {
    node_of_vertex: Vec<u32>,
    rest: Vec<DVec3>,
    masses: Vec<f64>,
    triangles: Vec<[u32; 3]>,
    /// `[triangle]` the mesh's face that it was cut from.
    triangle_faces: Vec<u32>,
    springs: Vec<Spring>,
    bends: Vec<Bend>,
    blocks: Blocks,
    sizes: Sizes,
    /// Force by which residuals are measured, N.
    force_unit: f64,
}

impl Cloth {
    /// Compiles a mesh whose positions are metres.
    ///
    /// Stitches that the library lacks are taken as plain ones, by their edge labels.
    ///
    /// # Errors
    /// Positions that are not finite, options out of range, no faces, or faces without area where the size is to be measured.
    pub fn new(mesh: &StitchMesh, library: &TemplateLibrary, options: &ClothOptions) -> Result<Self> {
        assemble::cloth(mesh, library, options)
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.rest.len()
    }

    /// `[vertex]` the node of each vertex of the mesh. Nodes are numbered so that neighbours are near each other.
    pub fn node_of_vertex(&self) -> &[u32] {
        &self.node_of_vertex
    }

    /// `[node]` the mesh's own positions, m: of joined corners the mean.
    pub fn rest_positions(&self) -> &[DVec3] {
        &self.rest
    }

    /// `[node]` kg. Vertices of no face have none, and stay where they are.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// The edges of the mesh, each once.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        self.springs.iter().filter(|s| s.kind != SpringKind::Shear).map(|s| s.nodes)
    }

    /// Edges and diagonals with their natural lengths.
    pub fn springs(&self) -> &[Spring] {
        &self.springs
    }

    /// Bends: nodes, weights (1/m2) and stiffness (N m3), of the energy `stiffness |sum weight x|^2 / 2`. Where there are three
    /// nodes, the fourth is the first with weight 0.
    pub fn bending(&self) -> impl Iterator<Item = ([u32; 4], [f64; 4], f64)> {
        self.bends.iter().map(|b| (b.nodes, b.weights, b.stiffness))
    }

    /// Faces cut into triangles, from their first corner on; seen from the front they run counter-clockwise.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Natural size of a plain knit face, m: as given, or as measured.
    pub fn sizes(&self) -> Sizes {
        self.sizes
    }

    /// By what forces are divided to make a residual, N: the mean stretch stiffness times the mean natural length.
    pub fn force_unit(&self) -> f64 {
        self.force_unit
    }

    /// Elastic energy of node positions, J.
    ///
    /// # Panics
    /// If there are not as many positions as nodes.
    pub fn energy(&self, nodes: &[DVec3]) -> f64 {
        let mut parts = vec![0.0; self.part_count()];
        self.energy_in(nodes, &mut parts)
    }

    /// Elastic forces on the nodes, N: minus the gradient of [`Cloth::energy`].
    ///
    /// # Panics
    /// If there are not as many positions or forces as nodes.
    pub fn forces(&self, nodes: &[DVec3], out: &mut [DVec3]) {
        energy::forces(self, nodes, out);
    }

    /// The same, so many times as stiff against bending.
    pub fn stiffer(&self, times: f64) -> Self {
        let mut stiff = self.clone();
        stiff.bends.iter_mut().for_each(|b| b.stiffness *= times);
        stiff
    }

    /// Root mean square of the edges' strains: how much longer or shorter they are than their natural lengths, relative to those.
    ///
    /// # Panics
    /// If there are not as many positions as nodes.
    pub fn strain(&self, nodes: &[DVec3]) -> f64 {
        assert_eq!(nodes.len(), self.node_count(), "a position for each node");
        let edges = self.springs.iter().filter(|s| s.kind != SpringKind::Shear);
        let (mut sum, mut count) = (0.0, 0.0);
        for s in edges {
            let [a, b] = s.nodes.map(|n| nodes[n as usize]);
            sum += (a.distance(b) / s.length - 1.0).powi(2);
            count += 1.0;
        }
        f64::sqrt(sum / f64::max(count, 1.0))
    }

    /// Gives every vertex the place of its node.
    ///
    /// # Panics
    /// If there are not as many positions as nodes, or vertices as the mesh had.
    pub fn write_back(&self, nodes: &[DVec3], vertices: &mut [DVec3]) {
        assert_eq!(nodes.len(), self.node_count(), "a position for each node");
        assert_eq!(vertices.len(), self.node_of_vertex.len(), "a vertex for each of the mesh");
        for (vertex, node) in vertices.iter_mut().zip(&self.node_of_vertex) {
            *vertex = nodes[*node as usize];
        }
    }

    /// Node positions of vertices: of joined corners the mean.
    ///
    /// # Errors
    /// Another number of vertices than the mesh had, or positions that are not finite.
    pub fn nodes_of(&self, vertices: &[DVec3]) -> Result<Vec<DVec3>> {
        if vertices.len() != self.node_of_vertex.len() {
            return Err(Error::invalid(format_args!(
                "{} positions, expected {}, one for each vertex of the mesh",
                vertices.len(),
                self.node_of_vertex.len()
            )));
        }
        assemble::check_finite(vertices)?;
        Ok(assemble::means(&self.node_of_vertex, vertices, self.node_count()))
    }
}
