//! How rounds are solved: one variant a round, in turn.

use crate::knot::{Settings, Solver, Start};

/// Settings that a round runs under.
#[derive(Clone, Debug)]
pub struct Variant {
    /// As printed.
    pub name: &'static str,
    /// The settings.
    pub settings: Settings,
}

/// All variants.
pub fn variants() -> Vec<Variant> {
    let plain = Settings::default();
    let previous = Settings { start: Start::Previous, ..Settings::default() };
    let paper = Settings { solver: Solver::GaussNewton, ..Settings::default() };
    [
        ("safeguarded, affine, 3 steps", plain),
        ("safeguarded, previous, 3 steps", previous),
        ("safeguarded, affine, 10 steps", Settings { iterations: 10, ..plain }),
        ("gauss-newton, affine, 3 steps", paper),
        ("safeguarded, affine, 1 step", Settings { iterations: 1, ..plain }),
        ("safeguarded, previous, 60 steps", Settings { iterations: 60, ..previous }),
        ("safeguarded, affine, beta 0", Settings { beta: 0.0, ..plain }),
        ("gauss-newton, previous, 10 steps", Settings { start: Start::Previous, iterations: 10, ..paper }),
        ("safeguarded, table, 2 steps", Settings { start: Start::Table, iterations: 2, ..plain }),
        (
            "safeguarded, affine, weights 100 and 1",
            Settings { weight_angle: 100.0, weight_length: 1.0, ..plain },
        ),
    ]
    .map(|(name, settings)| Variant { name, settings })
    .to_vec()
}
