//! What CPU and shaders share, as the shaders' text has it: members, offsets, kinds, constants. And SPIR-V without a
//! float operation that might be fused. No GPU is needed.
//!
//! Seeded faults, each seen red: `rest` and `knot_count` of a term swapped, `iterations` moved behind `given`, another
//! number for `STUCK`, `dot` for a product written out, one operation left out of those that may not be fused; of the
//! tables' words, what is expected read backwards.
//! Seen red unasked: a stitch type without knots divided by none of them, which a shader of its own refuses.
#![cfg(feature = "gpu")]

use knotmesh::backend::gpu::layout::{
    self, COUNTS, Counts, CurveSizes, KnotWords, Lists, ResultWords, Settings, Sizes, Variant,
};
use knotmesh::backend::gpu::shader;
use knotmesh::database::gpu::shader as fabric;
use knotmesh::knot::table::{Block, GROUP, Grid, Table};
use knotmesh::knot::{self, Kernel, Solver, Status};
use knotmesh::scene::{Mode, NOT_OWN, Role, Stencil, Term};
use knotmesh::template::{Coordinates, TemplateLibrary};
use naga::{Expression, Module, ScalarKind, TypeInner};
use std::collections::{BTreeMap, BTreeSet};
use std::mem::{offset_of, size_of};

fn parsed(text: &str) -> (Module, naga::valid::ModuleInfo) {
    shader::parse(text).unwrap_or_else(|fault| panic!("{}", fault.0))
}

/// All templates in a mode.
fn kernels(mode: Mode, settings: &knot::Settings) -> Vec<Kernel<f32>> {
    let library = TemplateLibrary::embedded();
    let kernel =
        |template| Kernel::new(&Stencil::new(template, mode, Coordinates::MeanValue), mode, settings);
    library.templates().iter().map(kernel).collect()
}

fn variant<'a>(kernel: &Kernel<f32>, room: Option<Counts>, grid: Option<&'a Grid>) -> Variant<'a> {
    Variant {
        room: room.unwrap_or(Counts::new(kernel)),
        own: room.is_none(),
        grid,
        spaced: false,
        energies: true,
        trace: false,
        count: false,
    }
}

/// Room for all.
fn most(kernels: &[Kernel<f32>]) -> Counts {
    kernels.iter().map(Counts::new).fold(Counts::default(), Counts::max)
}

/// A member of a struct in a shader.
#[derive(Clone, Debug, PartialEq)]
struct Member {
    name: String,
    /// Bytes.
    offset: usize,
    /// Bytes of all of it.
    size: usize,
    /// Bytes of an element; of all of it where it is no array.
    stride: usize,
    /// `[word of an element]` whether it is a float.
    floats: Vec<bool>,
}

/// Whether the words of a type are floats.
fn floats(module: &Module, ty: naga::Handle<naga::Type>) -> Vec<bool> {
    match &module.types[ty].inner {
        TypeInner::Scalar(scalar) => {
            assert_eq!(scalar.width, 4, "a word");
            match scalar.kind {
                ScalarKind::Float => vec![true],
                ScalarKind::Uint => vec![false],
                other => panic!("{other:?} in a shared struct"),
            }
        }
        TypeInner::Array { base, size: naga::ArraySize::Constant(size), .. } => {
            floats(module, *base).repeat(size.get() as usize)
        }
        TypeInner::Struct { members, .. } => members.iter().flat_map(|m| floats(module, m.ty)).collect(),
        other => panic!("{other:?} in a shared struct"),
    }
}

/// A struct's members, and its bytes.
fn members(module: &Module, name: &str) -> (Vec<Member>, usize) {
    let mut found = module.types.iter().filter(|(_, t)| t.name.as_deref() == Some(name));
    let (_, ty) = found.next().unwrap_or_else(|| panic!("no struct {name}"));
    let TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
    let layout = |m: &naga::StructMember| {
        let inner = &module.types[m.ty].inner;
        let size = inner.size(module.to_ctx()) as usize;
        let (stride, element) = match inner {
            TypeInner::Array { base, stride, .. } => (*stride as usize, *base),
            _ => (size, m.ty),
        };
        Member {
            name: m.name.clone().expect("a name"),
            offset: m.offset as usize,
            size,
            stride,
            floats: floats(module, element),
        }
    };
    (members.iter().map(layout).collect(), *span as usize)
}

/// Rust's word types.
trait Word {
    const FLOAT: bool;
}
impl Word for f32 {
    const FLOAT: bool = true;
}
impl Word for u32 {
    const FLOAT: bool = false;
}
fn is_float<S, W: Word>(_: impl Fn(&S) -> W) -> bool {
    W::FLOAT
}

macro_rules! shared {
    ($module:expr, $name:literal, $t:ty, $($member:ident)*) => {{
        let expected = vec![$(Member {
            name: stringify!($member).into(),
            offset: offset_of!($t, $member),
            size: 4,
            stride: 4,
            floats: vec![is_float(|s: &$t| s.$member)],
        }),*];
        // No member of Rust's struct is left out here.
        assert_eq!(4 * expected.len(), size_of::<$t>(), $name);
        assert_eq!(members($module, $name), (expected, size_of::<$t>()), $name);
    }};
}

macro_rules! settings {
    ($module:expr) => {
        shared!($module, "Settings", Settings, beta weight_angle weight_length nan iterations face_count begin
            first_corner first_strand first_mesh_face first_face first_knot point_count given near way first_count
            first_entry first_shape first_known skip tolerance own from_previous bent turned seen face_normals
            group_normals)
    };
}

#[test]
fn what_dispatches_are_told_and_what_comes_back() {
    let kernels = kernels(Mode::Relax, &knot::Settings::default());
    for room in [None, Some(most(&kernels))] {
        let (module, _) = parsed(&shader::stitch(&variant(&kernels[0], room, None), 64));
        let module = &module;
        settings!(module);
        shared!(module, "KnotWords", KnotWords, u v half_length);
        shared!(module, "FaceResult", ResultWords, energy_start energy status);
    }
    let (module, _) = parsed(&shader::select(&variant(&kernels[0], Some(most(&kernels)), None), 64));
    settings!(&module);
    shared!(&module, "KnotWords", KnotWords, u v half_length);
    shared!(&module, "FaceResult", ResultWords, energy_start energy status);
    let (module, _) = parsed(&shader::surface(64));
    shared!(&module, "Sizes", Sizes, vertices faces groups seams points sides face_offsets face_vertices group_offsets
        group_faces seam_points moved bent turned most_corners most_around);
    let (module, _) = parsed(&shader::arguments(64));
    shared!(&module, "Lists", Lists, count first_count);
    let (module, _) = parsed(&shader::curve(64));
    shared!(&module, "CurveSizes", CurveSizes, yarns begin end subdivide step first_sample);
}

/// Names, places and kinds of a stitch type's words, for every template with room of its own and with room for all.
#[test]
fn stitch_types() {
    for mode in [Mode::Relax, Mode::Embed] {
        let kernels = kernels(mode, &knot::Settings::default());
        let most = most(&kernels);
        let mut parsed_before = BTreeMap::new();
        for kernel in &kernels {
            for room in [None, Some(most)] {
                let text = shader::stitch(&variant(kernel, room, None), 64);
                let (members, span) =
                    parsed_before.entry(text).or_insert_with_key(|text| members(&parsed(text).0, "Stencil"));
                let fields = layout::fields(kernel, &room.unwrap_or(Counts::new(kernel)));
                let mut at = 0;
                let place = |field: &layout::Field| {
                    let (offset, size) = (at, 4 * field.words.len());
                    at += size;
                    let (stride, floats) = (4 * field.floats.len(), field.floats.to_vec());
                    Member { name: field.name.into(), offset, size, stride, floats }
                };
                let expected: Vec<_> = fields.iter().map(place).collect();
                assert_eq!(*members, expected);
                assert_eq!(*span, at);
                assert_eq!(layout::words(kernel, &room.unwrap_or(Counts::new(kernel))).len() * 4, at);
            }
        }
    }
}

/// The words of an array's elements, by their members' names.
struct Elements<'a> {
    words: &'a [u32],
    members: Vec<Member>,
    stride: usize,
}

impl Elements<'_> {
    fn get(&self, element: usize, name: &str) -> &[u32] {
        let member = self.members.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no {name}"));
        let at = (element * self.stride + member.offset) / 4;
        &self.words[at..at + member.size / 4]
    }
}

fn constant(module: &Module, name: &str) -> u32 {
    let mut named = module.constants.iter().filter(|(_, c)| c.name.as_deref() == Some(name));
    let (_, found) = named.next().unwrap_or_else(|| panic!("no constant {name}"));
    match module.global_expressions[found.init] {
        Expression::Literal(naga::Literal::U32(value)) => value,
        ref other => panic!("{name} is {other:?}"),
    }
}

/// Each value stands where the shader looks for it by name.
#[test]
fn values_by_name() {
    let kernels = kernels(Mode::Relax, &knot::Settings::default());
    let most = most(&kernels);
    let (module, _) = parsed(&shader::stitch(&variant(&kernels[0], Some(most), None), 64));
    let roles = ["BOUNDARY", "CONTACT", "CONTROL", "FREE"].map(|name| constant(&module, name));
    for kernel in &kernels {
        let fields = layout::fields(kernel, &most);
        let stencil = &kernel.stencil;
        let elements = |field: &str, of: &str| {
            let (members, stride) = members(&module, of);
            let field = fields.iter().find(|f| f.name == field).expect("a member");
            Elements { words: &field.words, members, stride }
        };
        let points = elements("points", "StencilPoint");
        for (i, p) in stencil.points.iter().enumerate() {
            let role = match p.role {
                Role::Boundary => roles[0],
                Role::Contact => roles[1],
                Role::Control => roles[2],
                Role::Free => roles[3],
            };
            let got = ["role", "knot", "sign", "z"].map(|name| points.get(i, name)[0]);
            assert_eq!(got, [role, p.knot, p.sign.to_bits(), p.z.to_bits()]);
        }
        let terms = &stencil.terms;
        for (name, list) in [("lengths", &terms.lengths), ("cosines", &terms.cosines)] {
            let words = elements(name, "Term");
            for (i, Term { point, segment, rest, knots, knot_count, codes }) in list.iter().enumerate() {
                let got = ["point", "segment", "rest", "knot_count"].map(|name| words.get(i, name)[0]);
                assert_eq!(got, [*point, *segment, rest.to_bits(), *knot_count]);
                assert_eq!((words.get(i, "knots"), words.get(i, "codes")), (&knots[..], &codes[..]));
            }
        }
        let words = elements("own_lengths", "OwnLength");
        for (i, own) in terms.own_lengths.iter().enumerate() {
            let got = ["knot", "square", "rest", "count"].map(|name| words.get(i, name)[0]);
            assert_eq!(got, [own.knot, own.square.to_bits(), own.rest.to_bits(), own.count.to_bits()]);
        }
        let words = elements("own_cosines", "OwnCosine");
        for (i, own) in terms.own_cosines.iter().enumerate() {
            let got = ["length", "sign", "offset", "rest", "count"].map(|name| words.get(i, name)[0]);
            let floats = [own.sign, own.offset, own.rest, own.count].map(f32::to_bits);
            assert_eq!((got[0], &got[1..]), (own.length, &floats[..]));
        }
        for (name, pairs) in
            [("frame_gradients", &stencil.frame_gradients), ("knot_direction", &stencil.knot_direction)]
        {
            let words = elements(name, "Pair");
            for (i, p) in pairs.iter().enumerate() {
                assert_eq!(["u", "v"].map(|name| words.get(i, name)[0]), [p.u.to_bits(), p.v.to_bits()]);
            }
        }
    }
}

/// Numbers that both sides write down.
#[test]
fn constants() {
    let kernels = kernels(Mode::Relax, &knot::Settings::default());
    let grid = Grid::default();
    let (module, _) = parsed(&shader::stitch(&variant(&kernels[0], None, Some(&grid)), 64));
    for (name, status) in [
        ("INTERPOLATED", Status::Interpolated),
        ("STEPPED", Status::Stepped),
        ("HAS_CONVERGED", Status::Converged),
        ("AT_REST", Status::AtRest),
        ("STUCK", Status::Stuck),
        ("FELL_BACK", Status::FellBack),
    ] {
        assert_eq!(constant(&module, name), status as u32, "{name}");
    }
    assert_eq!(constant(&module, "NOT_OWN"), NOT_OWN);
    assert_eq!(constant(&module, "COUNTS"), COUNTS.len() as u32);
    assert_eq!(constant(&module, "GROUP") as usize, GROUP);
    assert_eq!(constant(&module, "GRID_NODES") as usize, grid.node_count());
    // Counts known to the compiler are those that come with the stitch type elsewhere.
    for kernel in &kernels {
        let (module, _) = parsed(&shader::stitch(&variant(kernel, None, None), 64));
        let counts = &layout::fields(kernel, &Counts::new(kernel))[0];
        assert_eq!(counts.words, COUNTS.map(|name| constant(&module, name)));
    }
}

/// A table's words: blocks of 16, `[node][group]`, each row of a block side by side, then a word a node.
#[test]
fn tables() {
    let grid = Grid { density: 2, below: [1, 1, 1], above: [1, 1, 1] };
    let (nodes, groups) = (grid.node_count(), Table::<f32>::groups_of(3));
    let mut count = 0.0;
    let mut next = || {
        count += 1.0;
        count
    };
    let blocks: Vec<_> =
        (0..nodes * groups).map(|_| Block([(); 4].map(|()| [(); 4].map(|()| next())))).collect();
    let whole: Vec<_> = (0..nodes).map(|_| next()).collect();
    let table = Table::new(grid, 3, 0.1, blocks, whole).expect("sizes fit");
    let expected: Vec<f32> = (1..=nodes * groups * 16 + nodes).map(|i| i as f32).collect();
    assert_eq!(layout::table_words(&table), expected);
}

/// Shaders of all kinds.
fn texts() -> Vec<String> {
    let grid = Grid::default();
    let mut texts = vec![shader::surface(64), shader::curve(64)];
    texts.extend([fabric::forms(64), fabric::frames(64), fabric::yarn(64)]);
    for mode in [Mode::Relax, Mode::Embed] {
        for solver in [Solver::Safeguarded, Solver::GaussNewton] {
            let kernels = kernels(mode, &knot::Settings { solver, ..knot::Settings::default() });
            let room = most(&kernels);
            for own in [false, true] {
                for table in [None, Some(&grid)] {
                    for (bits, kernel) in kernels.iter().enumerate().take(8) {
                        let [spaced, energies, trace] = [1, 2, 4].map(|bit| bits & bit != 0);
                        let of = variant(kernel, (!own).then_some(room), table);
                        texts.push(shader::stitch(&Variant { spaced, energies, trace, ..of }, 64));
                    }
                }
            }
        }
    }
    texts
}

/// SPIR-V's operations on floats that a compiler may fuse or reorder: negation, sum, difference, product, quotient,
/// remainders, products of vectors and matrices.
const ARITHMETIC: [u32; 14] = [127, 129, 131, 133, 136, 140, 141, 142, 143, 144, 145, 146, 147, 148];

/// Sums and products of floats in the parsed shader, and the built-in functions that it calls.
fn operations(module: &Module, info: &naga::valid::ModuleInfo) -> (usize, BTreeSet<String>) {
    let (mut count, mut calls) = (0, BTreeSet::new());
    let functions = module.functions.iter().map(|(handle, f)| (f, &info[handle]));
    let entries = module.entry_points.iter().enumerate();
    for (function, info) in functions.chain(entries.map(|(i, e)| (&e.function, info.get_entry_point(i)))) {
        for (handle, expression) in function.expressions.iter() {
            let inner = info[handle].ty.inner_with(&module.types);
            let float = inner.scalar_kind() == Some(ScalarKind::Float);
            match expression {
                Expression::Binary { op, .. } => {
                    use naga::BinaryOperator::{Add, Divide, Modulo, Multiply, Subtract};
                    count += usize::from(float && matches!(op, Add | Subtract | Multiply | Divide | Modulo));
                }
                Expression::Unary { op: naga::UnaryOperator::Negate, .. } => count += usize::from(float),
                Expression::Math { fun, .. } if float => {
                    calls.insert(format!("{fun:?}"));
                }
                _ => {}
            }
        }
    }
    (count, calls)
}

#[test]
fn nothing_may_be_fused() {
    let mut total = 0;
    for text in texts() {
        let (module, info) = parsed(&text);
        let (count, calls) = operations(&module, &info);
        // Others leave their order of sums open, or what becomes of NaN.
        let exact = BTreeSet::from(["Abs", "Floor", "Sqrt"].map(String::from));
        assert!(calls.is_subset(&exact), "{calls:?}");
        for rolled in [false, true] {
            let words = shader::spirv(&text, rolled).unwrap_or_else(|fault| panic!("{}", fault.0));
            let (mut results, mut forbidden) = (BTreeSet::new(), Vec::new());
            let mut at = 5;
            while at < words.len() {
                let (length, op) = ((words[at] >> 16) as usize, words[at] & 0xffff);
                if ARITHMETIC.contains(&op) {
                    results.insert(words[at + 2]);
                }
                // OpDecorate, NoContraction.
                if op == 71 && words[at + 2] == 42 {
                    forbidden.push(words[at + 1]);
                }
                at += length;
            }
            assert_eq!(at, words.len());
            assert_eq!(forbidden.len(), count, "as many as the text has");
            assert_eq!(results, forbidden.into_iter().collect());
            total += count;
        }
    }
    println!("{total} operations");
}
