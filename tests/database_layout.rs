//! What CPU and shaders of fabrics share, as the shaders' text has it: members, offsets, kinds. No GPU is needed.
//! `tests/gpu_layout.rs` holds down besides that none of their float operations may be fused.
//!
//! Seeded faults: `members_moved`.
#![cfg(feature = "gpu")]

use knotmesh::backend::gpu::shader::parse;
use knotmesh::database::gpu::layout::{
    FabricFace, FabricSettings, FaceForm, FaceFrame, FaceMap, Fit, Home, Node, NodeForm, Place, Share, Step,
    YarnPoint,
};
use knotmesh::database::gpu::shader;
use naga::{Handle, Module, ScalarKind, Type, TypeInner};
use std::mem::{offset_of, size_of};

/// A member's name, its offset in bytes, and of each of its words whether it is a float.
type Member = (String, usize, Vec<bool>);

/// Words that a shader has side by side, without room between them.
trait Words {
    fn floats() -> Vec<bool>;
}

impl Words for f32 {
    fn floats() -> Vec<bool> {
        vec![true]
    }
}

impl Words for u32 {
    fn floats() -> Vec<bool> {
        vec![false]
    }
}

impl<T: Words, const N: usize> Words for [T; N] {
    fn floats() -> Vec<bool> {
        T::floats().repeat(N)
    }
}

impl Words for Step {
    fn floats() -> Vec<bool> {
        [u32::floats(), u32::floats(), <[f32; 3]>::floats()].concat()
    }
}

fn of<S, W: Words>(_: impl Fn(&S) -> W) -> Vec<bool> {
    W::floats()
}

/// The words of a type in a shader; room between them is nobody's word.
fn floats(module: &Module, ty: Handle<Type>) -> Vec<bool> {
    let inner = &module.types[ty].inner;
    let words = match inner {
        TypeInner::Scalar(scalar) => vec![scalar.kind == ScalarKind::Float],
        TypeInner::Vector { size, scalar } => vec![scalar.kind == ScalarKind::Float; *size as usize],
        TypeInner::Array { base, size: naga::ArraySize::Constant(size), .. } => {
            floats(module, *base).repeat(size.get() as usize)
        }
        TypeInner::Struct { members, .. } => members.iter().flat_map(|m| floats(module, m.ty)).collect(),
        other => panic!("{other:?} in a shared struct"),
    };
    assert_eq!(inner.size(module.to_ctx()) as usize, 4 * words.len(), "{inner:?} has room between its words");
    words
}

fn members(module: &Module, name: &str) -> Option<Vec<Member>> {
    let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name))?;
    let TypeInner::Struct { members, .. } = &ty.inner else { panic!("{name} is no struct") };
    let member =
        |m: &naga::StructMember| (m.name.clone().expect("a name"), m.offset as usize, floats(module, m.ty));
    Some(members.iter().map(member).collect())
}

macro_rules! shared {
    ($t:ident, $($member:ident)*) => {{
        let members: Vec<Member> = vec![
            $((stringify!($member).into(), offset_of!($t, $member), of(|s: &$t| s.$member))),*
        ];
        let words: usize = members.iter().map(|(_, _, floats)| floats.len()).sum();
        assert_eq!(4 * words, size_of::<$t>(), "no member of Rust's struct is left out here");
        (stringify!($t), members)
    }};
}

fn structs() -> Vec<(&'static str, Vec<Member>)> {
    vec![
        shared!(FabricSettings, vertices faces nodes homes most_shares most_fits bends phong least axis_sx axis_sa
            axis_sy first_row first_value table_nodes table_sa table_sy continued unmoved rigid within_first
            within_second hides),
        shared!(FabricFace, vertices nodes inverse edges),
        shared!(Node, vertex normal strain fit),
        shared!(Share, face weight),
        shared!(Fit, vertex uu uv vv),
        shared!(FaceForm, normal u v first),
        shared!(NodeForm, normal u v first second),
        shared!(FaceFrame, place phong normal first second),
        shared!(Step, face corners opposite),
        shared!(FaceMap, inverse steps),
        shared!(Home, face row point b c),
        shared!(Place, face b c height),
        shared!(YarnPoint, x y z twist),
    ]
}

fn texts() -> [String; 3] {
    [shader::forms(64), shader::frames(64), shader::yarn(64)]
}

/// Structs that a shader has otherwise, and how many it shares.
fn different(text: &str) -> (Vec<&'static str>, usize) {
    let (module, _) = parse(text).unwrap_or_else(|fault| panic!("{}", fault.0));
    let (mut different, mut count) = (Vec::new(), 0);
    for (name, expected) in structs() {
        if let Some(found) = members(&module, name) {
            count += 1;
            if found != expected {
                different.push(name);
            }
        }
    }
    (different, count)
}

#[test]
fn members_agree() {
    let counts = texts().map(|text| {
        let (different, count) = different(&text);
        assert!(different.is_empty(), "{different:?}");
        count
    });
    // All three have settings and frames of faces, two have faces and forms of nodes.
    assert_eq!(counts.iter().sum::<usize>(), structs().len() + 4 + 2, "{counts:?}");
}

#[test]
fn members_moved() {
    for (from, to, name) in [
        ("most_fits: u32,\n    // Whether bending", "// Whether bending", "FabricSettings"),
        ("unmoved: u32,\n    rigid: u32,", "rigid: u32,\n    unmoved: u32,", "FabricSettings"),
        ("b: f32,\n    c: f32,\n    height: f32,", "height: f32,\n    b: f32,\n    c: f32,", "Place"),
        ("row: u32,\n    point: u32,", "row: f32,\n    point: u32,", "Home"),
        ("second: array<f32, 3>,", "second: array<f32, 4>,", "NodeForm"),
    ] {
        let all = texts().map(|text| text.replace(from, to));
        assert!(all.concat() != texts().concat(), "{from} is in no shader");
        // A fault may keep a shader from being one at all.
        let valid = all.iter().filter(|text| parse(text).is_ok());
        let found: Vec<_> = valid.flat_map(|text| different(text).0).collect();
        assert!(found.contains(&name) || all.iter().any(|text| parse(text).is_err()), "{to}: {found:?}");
    }
}
