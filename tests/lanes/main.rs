//! Lanes against the scalar f32, bit for bit.

#[path = "../common/mod.rs"]
mod common;
mod frames;
mod operations;

use knotmesh::math::{Real, Scalar, Wide, Width};

struct Count;
impl Wide<f32> for Count {
    type Output = usize;
    fn run<R: Real<Scalar = f32>>(self) -> usize {
        R::LANES
    }
}

/// The widths that this machine has lanes for, the scalar not counted; says which are skipped.
fn widths() -> Vec<Width> {
    let mut widths = Vec::new();
    let candidates = if cfg!(target_arch = "aarch64") {
        vec![(Width::Auto, 4, "NEON")]
    } else {
        vec![(Width::Eight, 8, "AVX2"), (Width::Sixteen, 16, "AVX-512")]
    };
    for (width, lanes, name) in candidates {
        if f32::widen(width, Count) == lanes {
            println!("{name}: {lanes} lanes");
            widths.push(width);
        } else {
            println!("skipped: no {name}");
        }
    }
    assert_eq!(f32::widen(Width::One, Count), 1);
    widths
}

/// Bits that are to agree: any NaN is as good as another.
fn bits(x: f32) -> u32 {
    if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }
}
