//! Scalars and small vectors of the kernels.

mod real;
mod vector;

pub use real::Real;
pub use vector::{V2, V3};
