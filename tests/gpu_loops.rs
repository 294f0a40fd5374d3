//! No loop of a shader is as long as a buffer says: what comes from a buffer goes through `min` before it ends a loop. Without
//! a GPU, in the parsed text: drivers differ in what becomes of a loop that goes on and on. Counts that a function keeps in a
//! variable of its own, or is given, are not followed.
//!
//! Seeded faults: `clamps_taken_away`.
#![cfg(feature = "gpu")]

use knotmesh::backend::gpu::layout::{Counts, Variant};
use knotmesh::backend::gpu::shader;
use knotmesh::database::gpu::shader as fabric;
use knotmesh::knot::table::Grid;
use knotmesh::knot::{self, Kernel};
use knotmesh::scene::{Mode, Stencil};
use knotmesh::template::{Coordinates, TemplateLibrary};
use naga::{AddressSpace, Block, Expression, Function, Handle, MathFunction, Module, Statement};

/// An expression's function, and whether its arguments may be anything.
#[derive(Clone, Copy)]
struct Place<'a> {
    module: &'a Module,
    function: &'a Function,
    wild: bool,
}

impl<'a> Place<'a> {
    /// Whether a number is as large as a buffer says.
    fn unbounded(self, handle: Handle<Expression>) -> bool {
        let inside = |e: &Handle<Expression>| self.unbounded(*e);
        match &self.function.expressions[handle] {
            Expression::Load { pointer } => self.stored(*pointer),
            Expression::FunctionArgument(_) => self.wild,
            Expression::Math { fun: MathFunction::Min, arg, arg1, .. } => {
                inside(arg) && arg1.as_ref().is_none_or(inside)
            }
            Expression::Math { arg, arg1, arg2, .. } => {
                [Some(*arg), *arg1, *arg2].iter().flatten().any(inside)
            }
            Expression::Binary { left, right, .. } => inside(left) || inside(right),
            Expression::Unary { expr, .. } | Expression::As { expr, .. } => inside(expr),
            Expression::Select { accept, reject, .. } => inside(accept) || inside(reject),
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => inside(base),
            Expression::Compose { components, .. } => components.iter().any(inside),
            Expression::CallResult(function) => {
                let called = Place { function: &self.module.functions[*function], wild: true, ..self };
                let mut found = false;
                visit(&called.function.body, &mut |s| {
                    if let Statement::Return { value: Some(value) } = s {
                        found |= called.unbounded(*value);
                    }
                });
                found
            }
            _ => false,
        }
    }

    /// Whether a pointer leads into a buffer, other than of settings.
    fn stored(self, pointer: Handle<Expression>) -> bool {
        match &self.function.expressions[pointer] {
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => self.stored(*base),
            Expression::GlobalVariable(v) => {
                matches!(self.module.global_variables[*v].space, AddressSpace::Storage { .. })
            }
            _ => false,
        }
    }
}

/// All statements, those of inner blocks too.
fn visit<'a>(block: &'a Block, see: &mut impl FnMut(&'a Statement)) {
    for statement in block {
        see(statement);
        match statement {
            Statement::Block(inner) => visit(inner, see),
            Statement::If { accept, reject, .. } => [accept, reject].into_iter().for_each(|b| visit(b, see)),
            Statement::Loop { body, continuing, .. } => {
                [body, continuing].into_iter().for_each(|b| visit(b, see));
            }
            Statement::Switch { cases, .. } => cases.iter().for_each(|case| visit(&case.body, see)),
            _ => {}
        }
    }
}

/// How many loops there are, and how many ends of loops, and counts put aside for them, are what a buffer says.
fn loops(text: &str) -> (usize, usize) {
    let (module, _) = shader::parse(text).unwrap_or_else(|fault| panic!("{}", fault.0));
    let (mut all, mut wild) = (0, 0);
    let entries = module.entry_points.iter().map(|e| &e.function);
    for function in module.functions.iter().map(|(_, f)| f).chain(entries) {
        let place = Place { module: &module, function, wild: false };
        visit(&function.body, &mut |statement| match statement {
            Statement::Loop { body, .. } => {
                all += 1;
                let ends = |s: &&Statement| matches!(s, Statement::If { reject, .. } if reject.iter().any(|s| matches!(s, Statement::Break)));
                let Some(Statement::If { condition, .. }) = body.iter().find(ends) else {
                    panic!("a loop without an end of its own");
                };
                wild += usize::from(place.unbounded(*condition));
            }
            Statement::Store { pointer, value } => {
                let counts = matches!(function.expressions[*pointer], Expression::GlobalVariable(_));
                wild += usize::from(counts && place.unbounded(*value));
            }
            _ => {}
        });
    }
    (all, wild)
}

/// Shaders that serve all stitch types: counts come with them.
fn texts() -> [String; 8] {
    let stencil = |t| Stencil::new(t, Mode::Relax, Coordinates::MeanValue);
    let library = TemplateLibrary::embedded();
    let kernels = library.templates().iter().map(|t| {
        let kernel: Kernel<f32> = Kernel::new(&stencil(t), Mode::Relax, &knot::Settings::default());
        Counts::new(&kernel)
    });
    let room = kernels.fold(Counts::default(), Counts::max);
    let grid = Grid::default();
    let variant = Variant {
        room,
        own: false,
        grid: Some(&grid),
        spaced: true,
        energies: true,
        trace: true,
        count: false,
    };
    [
        shader::stitch(&variant, 64),
        shader::select(&variant, 64),
        shader::surface(64),
        shader::arguments(64),
        shader::curve(64),
        fabric::forms(64),
        fabric::frames(64),
        fabric::yarn(64),
    ]
}

#[test]
fn end_whatever_buffers_hold() {
    let all = texts().map(|text| loops(&text));
    assert_eq!(all.map(|(_, wild)| wild), [0; 8]);
    let [stitch, select, surface, _, curve, forms, _, yarn] = all;
    assert!(
        stitch.0 > 50 && select.0 > 5 && surface.0 > 3 && curve.0 > 1,
        "{stitch:?} {select:?} {surface:?}"
    );
    assert!(forms.0 == 3 && yarn.0 > 3, "{forms:?} {yarn:?}");
}

#[test]
fn clamps_taken_away() {
    let all = texts().concat();
    for (from, to) in [
        ("min(stencil.counts[2], ROOM_KNOTS)", "stencil.counts[2]"),
        ("min(stencil.strand_offsets[s + 1u] - begin, POINTS)", "(stencil.strand_offsets[s + 1u] - begin)"),
        ("2u * min(term.knot_count, 3u)", "2u * term.knot_count"),
        (
            "min(topology[sizes.face_offsets + face + 1u] - begin, sizes.most_corners)",
            "topology[sizes.face_offsets + face + 1u]",
        ),
        (
            "min(topology[sizes.group_offsets + group + 1u] - begin, sizes.most_around)",
            "topology[sizes.group_offsets]",
        ),
        ("min(nodes[node + 1u].normal - begin, settings.most_shares)", "nodes[node + 1u].normal - begin"),
        ("min(nodes[node + 1u].strain - begin, settings.most_shares)", "nodes[node + 1u].strain - begin"),
        ("min(nodes[node + 1u].fit - begin, settings.most_fits)", "nodes[node + 1u].fit - begin"),
    ] {
        assert!(all.contains(from), "{from} is in no shader");
        let found: usize = texts().map(|text| loops(&text.replace(from, to)).1).iter().sum();
        assert!(found > 0, "nobody sees {to} instead of {from}");
    }
}
