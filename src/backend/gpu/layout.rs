//! What CPU and shaders share: the words of a stitch type (`shaders/stencil.wgsl`), the constants by which its
//! shader is compiled, and what a dispatch is told (`shaders/settings.wgsl`, `Sizes` in `shaders/surface.wgsl`).
//!
//! `tests/gpu_layout.rs` holds it against the shaders, without a GPU.

use crate::knot::Kernel;
use crate::knot::solve;
use crate::knot::table::{Grid, Table};
use crate::math::{Real, V2};
use crate::scene::{Role, Term};
use std::fmt::Write;

/// A member of a stitch type's words.
#[derive(Clone, Debug)]
pub struct Field {
    /// The member's name in the shader.
    pub name: &'static str,
    /// Its words.
    pub words: Vec<u32>,
    /// `[word of an element]` whether it is a float.
    pub floats: &'static [bool],
}

/// Collects members.
#[derive(Default)]
struct Fields(Vec<Field>);

const F: bool = true;
const U: bool = false;

impl Fields {
    /// Adds an array of elements.
    fn add<T>(
        &mut self,
        name: &'static str,
        floats: &'static [bool],
        elements: &[T],
        words: impl Fn(&T) -> Vec<u32>,
    ) {
        self.0.push(Field { name, words: elements.iter().flat_map(words).collect(), floats });
    }

    /// Makes room for so many elements of the member added last.
    fn room(&mut self, elements: usize) {
        let last = self.0.last_mut().expect("a member");
        last.words.resize(elements.max(1) * last.floats.len(), 0);
    }

    fn floats(&mut self, name: &'static str, values: &[f32]) {
        self.add(name, &[F], values, |x| vec![x.to_bits()]);
    }

    fn numbers(&mut self, name: &'static str, values: &[u32]) {
        self.add(name, &[U], values, |x| vec![*x]);
    }

    fn pairs(&mut self, name: &'static str, values: &[V2<f32>]) {
        self.add(name, &[F, F], values, |p| vec![p.u.to_bits(), p.v.to_bits()]);
    }

    fn terms(&mut self, name: &'static str, terms: &[Term<f32>]) {
        const FLOATS: [bool; 10] = [U, U, F, U, U, U, U, U, U, U];
        self.add(name, &FLOATS, terms, |t| {
            let mut words = vec![t.point, t.segment, t.rest.to_bits(), t.knot_count];
            words.extend(t.knots);
            words.extend(t.codes);
            words
        });
    }
}

/// How much there is of everything in a stitch type, by the names that shaders have for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Counts([u32; COUNTS.len()]);

/// What is counted, in the order of `counts` in `shaders/stencil.wgsl`; the last two are 0 or 1.
pub const COUNTS: [&str; 14] = [
    "CORNERS",
    "POINTS",
    "KNOTS",
    "UNKNOWNS",
    "STRANDS",
    "LENGTHS",
    "COSINES",
    "OWN_LENGTHS",
    "OWN_COSINES",
    "FIXED_LENGTHS",
    "FIXED_COSINES",
    "CROSS_LENGTHS",
    "CROSS_COSINES",
    // Bits: 1 where there is something to solve, 2 where that is safeguarded.
    "WAYS",
];

impl Counts {
    /// Those of a stitch type.
    pub fn new(kernel: &Kernel<f32>) -> Self {
        let stencil = &kernel.stencil;
        let terms = &stencil.terms;
        let k = stencil.knot_count();
        let counts = [
            stencil.corner_count,
            stencil.points.len(),
            k,
            2 * k,
            stencil.strand_offsets.len() - 1,
            terms.lengths.len(),
            terms.cosines.len(),
            terms.own_lengths.len(),
            terms.own_cosines.len(),
            terms.fixed_lengths.len(),
            terms.fixed_cosines.len(),
            terms.cross_lengths.len(),
            terms.cross_cosines.len(),
        ];
        let safe = kernel.solves() && kernel.solver() == solve::Solver::Safeguarded;
        let mut all = [0; COUNTS.len()];
        for (to, from) in all.iter_mut().zip(counts) {
            *to = from as u32;
        }
        all[COUNTS.len() - 1] = u32::from(kernel.solves()) | u32::from(safe) << 1;
        Self(all)
    }

    /// The larger ones.
    pub fn max(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].max(other.0[i])))
    }

    fn get(&self, name: &str) -> usize {
        COUNTS.iter().position(|n| *n == name).map_or(0, |i| self.0[i] as usize)
    }
}

/// The members of a stitch type's words, in order, with room for so much of everything.
pub fn fields(kernel: &Kernel<f32>, room: &Counts) -> Vec<Field> {
    let stencil = &kernel.stencil;
    let mut fields = Fields::default();
    fields.numbers("counts", &Counts::new(kernel).0);
    fields.floats("rest_spread", &[stencil.rest_spread]);
    fields.floats("yarn_radius", &[stencil.yarn_radius]);
    let [corners, points, knots] = ["CORNERS", "POINTS", "KNOTS"].map(|name| room.get(name));
    fields.add("points", &[U, U, F, F], &stencil.points, |p| {
        let role = match p.role {
            Role::Boundary => 0,
            Role::Contact => 1,
            Role::Control => 2,
            Role::Free => 3,
        };
        vec![role, p.knot, p.sign.to_bits(), p.z.to_bits()]
    });
    fields.room(points);
    fields.floats("weights", &stencil.weights);
    fields.room(points * corners);
    fields.pairs("frame_gradients", &stencil.frame_gradients);
    fields.room(corners);
    fields.pairs("knot_direction", &stencil.knot_direction);
    fields.room(knots);
    fields.floats("knot_half_length", &stencil.knot_half_length);
    fields.room(knots);
    fields.floats("knot_weights", &stencil.knot_weights);
    fields.room(knots * corners);
    fields.pairs("knot_gradients", &stencil.knot_gradients);
    fields.room(knots * corners);
    let offsets: Vec<u32> = stencil.strand_offsets.iter().map(|o| *o as u32).collect();
    fields.numbers("strand_offsets", &offsets);
    fields.room(room.get("STRANDS") + 1);
    let terms = &stencil.terms;
    fields.terms("lengths", &terms.lengths);
    fields.room(room.get("LENGTHS"));
    fields.terms("cosines", &terms.cosines);
    fields.room(room.get("COSINES"));
    fields.floats("rises", &terms.rises);
    fields.room(room.get("LENGTHS"));
    fields.numbers("own", &terms.own);
    fields.room(room.get("LENGTHS"));
    fields.add("own_lengths", &[U, F, F, F], &terms.own_lengths, |o| {
        vec![o.knot, o.square.to_bits(), o.rest.to_bits(), o.count.to_bits()]
    });
    fields.room(room.get("OWN_LENGTHS"));
    fields.add("own_cosines", &[U, F, F, F, F], &terms.own_cosines, |o| {
        vec![o.length, o.sign.to_bits(), o.offset.to_bits(), o.rest.to_bits(), o.count.to_bits()]
    });
    fields.room(room.get("OWN_COSINES"));
    for (name, list, most) in [
        ("fixed_lengths", &terms.fixed_lengths, "LENGTHS"),
        ("fixed_cosines", &terms.fixed_cosines, "COSINES"),
        ("cross_lengths", &terms.cross_lengths, "LENGTHS"),
        ("cross_cosines", &terms.cross_cosines, "COSINES"),
    ] {
        fields.numbers(name, list);
        fields.room(room.get(most));
    }
    fields.0
}

/// A stitch type's words, with room for so much of everything.
pub fn words(kernel: &Kernel<f32>, room: &Counts) -> Vec<u32> {
    fields(kernel, room).into_iter().flat_map(|f| f.words).collect()
}

/// What a stitch's shader is compiled for.
#[derive(Clone, Copy, Debug)]
pub struct Variant<'a> {
    /// Room for so much of everything.
    pub room: Counts,
    /// Whether that is exactly what there is: then counts are known to the compiler, else they come with the stitch type.
    pub own: bool,
    /// Grid of the tables that solves start from.
    pub grid: Option<&'a Grid>,
    /// Whether knots are spaced otherwise than by plain interpolation.
    pub spaced: bool,
    /// Whether energies are worked out that the method does not need.
    pub energies: bool,
    /// Whether stages are told.
    pub trace: bool,
    /// Whether what threads do is counted, see [`super::counters`]; not where stages are told.
    pub count: bool,
}

/// The constants by which a stitch's shader is compiled.
pub fn constants(variant: &Variant) -> String {
    let mut text = String::new();
    let room = &variant.room;
    let mut line = |arguments: std::fmt::Arguments| text.write_fmt(arguments).expect("memory");
    // Arrays have at least one element.
    let [corners, points, knots] = ["CORNERS", "POINTS", "KNOTS"].map(|name| room.get(name));
    let products = [
        ("WEIGHTS", points * corners),
        ("KNOT_WEIGHTS", knots * corners),
        ("MATRIX", 4 * knots * knots),
        ("OFFSETS", room.get("STRANDS") + 1),
    ];
    for (name, value) in COUNTS.map(|name| (name, room.get(name))).into_iter().chain(products) {
        line(format_args!("const ROOM_{name}: u32 = {}u;\n", value.max(1)));
    }
    line(format_args!("const COUNTS: u32 = {}u;\n", COUNTS.len()));
    // Names in capitals are constants to those who use them.
    let (kind, ways) = if variant.own { ("const", room.get("WAYS")) } else { ("var<private>", 0) };
    for (name, value) in COUNTS.iter().zip(room.0) {
        match variant.own {
            true => line(format_args!("{kind} {name}: u32 = {value}u;\n")),
            false => line(format_args!("{kind} {name}: u32;\n")),
        }
    }
    for (i, name) in ["SOLVES", "SAFE"].into_iter().enumerate() {
        match variant.own {
            true => line(format_args!("{kind} {name}: bool = {};\n", ways >> i & 1 == 1)),
            false => line(format_args!("{kind} {name}: bool;\n")),
        }
    }
    line(format_args!("fn know_counts() {{\n"));
    if !variant.own {
        // No more than there is room for, whatever the buffer holds.
        for (i, name) in COUNTS.iter().enumerate() {
            line(format_args!("    {name} = min(stencil.counts[{i}], ROOM_{name});\n"));
        }
        line(format_args!("    SOLVES = (WAYS & 1u) != 0u;\n    SAFE = (WAYS & 2u) != 0u;\n"));
    }
    line(format_args!("}}\n"));
    line(format_args!("const SPACED: bool = {};\n", variant.spaced));
    line(format_args!("const ENERGIES: bool = {};\n", variant.energies));
    let first = if variant.grid.is_some() { solve::DAMPING_TABLE } else { solve::DAMPING };
    for (name, value) in [
        ("REST_ENERGY", f32::REST_ENERGY),
        ("CONVERGED", f32::CONVERGED),
        ("CONVERGED_BELOW", f32::CONVERGED_BELOW),
        ("NOISE", solve::NOISE),
        ("LEAST_DAMPING", solve::LEAST_DAMPING),
        ("DAMPING_AFTER_SUCCESS", solve::DAMPING_AFTER_SUCCESS),
        ("DAMPING_AFTER_FAILURE", solve::DAMPING_AFTER_FAILURE),
        ("DAMPING_PREVIOUS", solve::DAMPING_PREVIOUS),
        ("FIRST_DAMPING", first),
        ("LEAP", crate::knot::LEAP),
    ] {
        // Shortest digits that read back as the same f32.
        line(format_args!("const {name}: f32 = {:e}f;\n", value as f32));
    }
    if let Some(grid) = variant.grid {
        line(format_args!("const GRID_NODES: u32 = {}u;\n", grid.node_count()));
        line(format_args!("const GRID_DENSITY: f32 = {}.0;\n", grid.density));
        for (name, [x, y, z]) in [
            ("GRID_STRIDES", grid.strides().map(|s| s as u32)),
            ("GRID_BELOW", grid.below),
            ("GRID_ABOVE", grid.above),
        ] {
            line(format_args!("const {name}: vec3<f32> = vec3<f32>({x}.0, {y}.0, {z}.0);\n"));
        }
    }
    text
}

/// A table's words: its blocks, then which of its cells are whole.
pub fn table_words(table: &Table<f32>) -> Vec<f32> {
    let blocks = table.blocks().iter().flat_map(|block| block.0.into_iter().flatten());
    blocks.chain(table.whole().iter().copied()).collect()
}

/// All faces of the batch.
pub const DIRECT: u32 = 0;
/// Those on the list to be solved.
pub const SOLVE_LIST: u32 = 1;
/// Those on the list to be lifted only.
pub const LIFT_LIST: u32 = 2;
/// All faces, their knots solved already.
pub const DIRECT_LIFT: u32 = 3;
/// The bit of [`Settings::skip`] that says that no face is hidden; below it, unmoved, rigid, rest and shared.
pub const SEEN_ALL: u32 = 16;

/// What a dispatch of stitches is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Settings {
    /// Knot spacing.
    pub beta: f32,
    /// sqrt(w_angle).
    pub weight_angle: f32,
    /// sqrt(w_length).
    pub weight_length: f32,
    /// The bits of a NaN.
    pub nan: u32,
    /// Steps at most.
    pub iterations: u32,
    /// Faces of the batch.
    pub face_count: u32,
    /// Where a direct dispatch begins among them.
    pub begin: u32,
    /// Word of the topology where the batch's corners begin.
    pub first_corner: u32,
    /// Where its strands begin.
    pub first_strand: u32,
    /// Where its faces of the mesh begin.
    pub first_mesh_face: u32,
    /// Its first face, in batch order.
    pub first_face: u32,
    /// Its first knot.
    pub first_knot: u32,
    /// Number of control points.
    pub point_count: u32,
    /// Whether knots hold starts.
    pub given: u32,
    /// Whether the output holds the frame before.
    pub near: u32,
    /// Which faces: [`DIRECT`], [`SOLVE_LIST`], [`LIFT_LIST`].
    pub way: u32,
    /// Where the counts of the batch's lists begin.
    pub first_count: u32,
    /// Where their entries do.
    pub first_entry: u32,
    /// Where its remembered shapes begin.
    pub first_shape: u32,
    /// Where the shapes begin whose solve is known.
    pub first_known: u32,
    /// Bits of what may be skipped.
    pub skip: u32,
    /// Of shapes, template units.
    pub tolerance: f32,
    /// Whether the output holds a frame of this backend.
    pub own: u32,
    /// Whether solves start from the frame before.
    pub from_previous: u32,
    /// Word of the surface where flags of faces begin whose area changed.
    pub bent: u32,
    /// Of corner groups whose normal changed.
    pub turned: u32,
    /// Of bits of faces that are seen.
    pub seen: u32,
    /// The first face among places and normals.
    pub face_normals: u32,
    /// The first corner group there.
    pub group_normals: u32,
}

/// What the kernels of surfaces and seams are told; see `shaders/surface.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sizes {
    /// Number of vertices.
    pub vertices: u32,
    /// Number of faces of the mesh.
    pub faces: u32,
    /// Number of corner groups.
    pub groups: u32,
    /// Number of seams.
    pub seams: u32,
    /// Number of control points.
    pub points: u32,
    /// Sides of seams: two each, then those whose other side is elsewhere.
    pub sides: u32,
    /// Words of the topology where these begin.
    pub face_offsets: u32,
    /// Vertices of faces.
    pub face_vertices: u32,
    /// Offsets of corner groups.
    pub group_offsets: u32,
    /// Faces around them.
    pub group_faces: u32,
    /// Control points of seams.
    pub seam_points: u32,
    /// Words of the surface where flags of vertices, faces and corner groups begin.
    pub moved: u32,
    /// Of faces.
    pub bent: u32,
    /// Of corner groups.
    pub turned: u32,
    /// Corners of a face, and faces around a corner group, at most.
    pub most_corners: u32,
    /// See there.
    pub most_around: u32,
}

/// A knot's state in a buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct KnotWords {
    /// d along the course.
    pub u: f32,
    /// d along the wale.
    pub v: f32,
    /// l.
    pub half_length: f32,
}

/// What is known of a face, in a buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct ResultWords {
    /// E at the start.
    pub energy_start: f32,
    /// E at the end.
    pub energy: f32,
    /// Number of the [`crate::knot::Status`].
    pub status: u32,
}

/// What the kernel is told that turns counts into dispatches; see `shaders/arguments.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Lists {
    /// Number of lists.
    pub count: u32,
    /// Where their counts begin.
    pub first_count: u32,
}

/// A motion of all points as one, its columns padded to four.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Turn(pub [[f32; 4]; 4]);

/// What the kernel of curves is told; see `shaders/curve.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct CurveSizes {
    /// Number of yarns.
    pub yarns: u32,
    /// The first control point of the dispatch.
    pub begin: u32,
    /// The one after the last.
    pub end: u32,
    /// Extra points a segment.
    pub subdivide: u32,
    /// 1 / (subdivide + 1).
    pub step: f32,
    /// The sample that the buffer begins with.
    pub first_sample: u32,
}
