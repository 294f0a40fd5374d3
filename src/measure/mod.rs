//! Measures of results: how well a mesh fits its library, how near a solve comes to the optimum, how near
//! yarns come, how far they stretch, what the error costs in time, how near physics it is,
//! what holds under stress.

pub mod accuracy;
pub mod clearance;
#[cfg(feature = "measure")]
pub mod database;
pub mod machine;
pub mod misfit;
#[cfg(any(feature = "gpu", feature = "measure"))]
pub(crate) mod picture;
pub mod stress;
pub mod stretch;
#[cfg(feature = "measure")]
pub mod tradeoff;

/// The value below which the share `q` of the values lie (the values are reordered); NaN for none.
pub fn quantile(values: &mut [f64], q: f64) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let k = ((values.len() - 1) as f64 * q).round() as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}
