//! Scalars, lanes and small vectors of the kernels.

mod lanes;
mod real;
mod vector;

pub use lanes::{Wide, Width};
pub use real::{Real, Scalar};
pub use vector::{V2, V3};
