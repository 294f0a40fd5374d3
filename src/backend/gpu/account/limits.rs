//! The least time that a device takes for what is on the account.

use super::{Costs, Kind};

/// What a device can do at most.
#[derive(Clone, Copy, Debug)]
pub struct Peak {
    /// Its name.
    pub name: &'static str,
    /// Bytes of memory a second.
    pub bytes: f64,
    /// Operations on f32 a second, a fused product and sum counted as two.
    pub operations: f64,
}

/// Devices that the account is worked out for, as their maker states them.
pub const PEAKS: [Peak; 2] = [
    Peak { name: "RTX 3090", bytes: 936e9, operations: 35.6e12 },
    // Without tensor cores.
    Peak { name: "H100 SXM", bytes: 3350e9, operations: 67e12 },
];

/// The least time for some stitches, by what would have to be the only thing in the way; seconds.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Memory, where caches answer for what stitches share.
    pub memory: f64,
    /// Memory, where no cache answers anything.
    pub memory_without_caches: f64,
    /// Arithmetic at its peak.
    pub arithmetic: f64,
    /// Arithmetic where nothing is fused, as shaders are compiled here: half of the peak.
    pub arithmetic_unfused: f64,
}

impl Peak {
    /// The limits for so many stitches of a cost each.
    pub fn limits(&self, costs: &Costs, stitches: f64) -> Limits {
        let [own, shared] = costs.all_bytes();
        let arithmetic = stitches * costs.total(Kind::Operations) as f64 / self.operations;
        Limits {
            memory: stitches * own as f64 / self.bytes,
            memory_without_caches: stitches * (own + shared) as f64 / self.bytes,
            arithmetic,
            arithmetic_unfused: 2.0 * arithmetic,
        }
    }
}
