//! Scalars and small vectors of the kernels.
