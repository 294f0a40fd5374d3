//! What is compared: a list of data, a family at a time.

use crate::backend::{Running, Skip};
use crate::knot::{Settings, Solver, Start};
use crate::math::Width;
use crate::scene::Mode;

/// The scalar that kernels run in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Single.
    F32,
    /// Double: the reference.
    F64,
}

impl Precision {
    /// `f32` or `f64`.
    pub fn name(self) -> &'static str {
        match self {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        }
    }
}

/// Who does the work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Engine {
    /// [`crate::backend::CpuBackend`].
    Cpu,
    /// The best GPU adapter.
    Gpu,
    /// A general-purpose solver, stitch by stitch ([`super::baseline`]), until it meets its tolerance
    /// (`ftol`, `xtol` and `gtol`; its own default, 30 times the rounding error, where not given).
    LevenbergMarquardt {
        /// The tolerance.
        tolerance: Option<f64>,
    },
}

/// A way of placing the yarn.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Unique; no commas.
    pub name: String,
    /// What it is drawn as in plots.
    pub family: &'static str,
    /// Who does the work.
    pub engine: Engine,
    /// What is done.
    pub mode: Mode,
    /// In which precision.
    pub precision: Precision,
    /// How.
    pub settings: Settings,
    /// On how many threads, how many stitches side by side, and what is skipped.
    pub running: Running,
}

/// All variants. `base` gives weights and knot spacing, `threads` what all but the family `threads` run on;
/// `quick` takes fewer numbers of steps.
pub fn variants(base: &Settings, threads: usize, quick: bool) -> Vec<Variant> {
    let plain = Variant {
        name: String::new(),
        family: "",
        engine: Engine::Cpu,
        mode: Mode::Relax,
        precision: Precision::F32,
        settings: *base,
        running: Running { threads, skip: Skip::NOTHING, ..Running::default() },
    };
    let steps: &[u32] = if quick { &[1, 3, 10] } else { &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10] };
    let both = [Precision::F32, Precision::F64];
    let mut all = Vec::new();

    for (mode, family) in [(Mode::Embed, "embed"), (Mode::Knots, "knots")] {
        for precision in both {
            let name = format!("{family} {}", precision.name());
            all.push(Variant { name, family, mode, precision, ..plain.clone() });
        }
    }
    for (solver, name, families) in [
        (Solver::GaussNewton, "Gauss-Newton", ["Gauss-Newton f32", "Gauss-Newton f64"]),
        (Solver::Safeguarded, "safeguarded", ["safeguarded f32", "safeguarded f64"]),
    ] {
        for (precision, family) in both.into_iter().zip(families) {
            for iterations in steps {
                let name = format!("{name} {iterations} {}", precision.name());
                let settings = Settings { solver, iterations: *iterations, ..*base };
                all.push(Variant { name, family, precision, settings, ..plain.clone() });
            }
        }
    }
    for (precision, family) in both.into_iter().zip(["table f32", "table f64"]) {
        for iterations in [0, 1, 2, 3] {
            let settings = Settings { solver: Solver::Safeguarded, start: Start::Table, iterations, ..*base };
            let name = format!("table + {iterations} {}", precision.name());
            all.push(Variant { name, family, precision, settings, ..plain.clone() });
        }
    }
    for (width, name) in [(Width::One, "one lane"), (Width::Eight, "8 lanes"), (Width::Sixteen, "16 lanes")] {
        let running = Running { width, ..plain.running };
        let settings = Settings { solver: Solver::Safeguarded, iterations: 3, ..*base };
        let name = format!("safeguarded 3 f32 {name}");
        all.push(Variant { name, family: "lanes", settings, running, ..plain.clone() });
    }
    let running = Running { skip: Skip::default(), ..plain.running };
    let table = Settings { solver: Solver::Safeguarded, start: Start::Table, iterations: 2, ..*base };
    let name = "table + 2 f32 with skips".into();
    all.push(Variant { name, family: "skips", settings: table, running, ..plain.clone() });
    for iterations in [1, 2, 3, 5] {
        let settings = Settings { solver: Solver::Safeguarded, start: Start::Previous, iterations, ..*base };
        let name = format!("previous + {iterations} f32");
        all.push(Variant { name, family: "previous frame", settings, ..plain.clone() });
    }
    let running = Running { threads: 0, ..plain.running };
    let settings = Settings { solver: Solver::Safeguarded, iterations: 3, ..*base };
    for (name, settings) in [
        ("safeguarded 3 f32 all cores", settings),
        ("table + 1 f32 all cores", Settings { iterations: 1, ..table }),
        ("table + 2 f32 all cores", table),
    ] {
        let name = name.into();
        all.push(Variant { name, family: "all cores", settings, running, ..plain.clone() });
    }
    for (tolerance, name) in [(Some(1e-2), "1e-2"), (Some(1e-4), "1e-4"), (None, "default")] {
        all.push(Variant {
            name: format!("levenberg-marquardt {name}"),
            family: "levenberg-marquardt crate",
            engine: Engine::LevenbergMarquardt { tolerance },
            precision: Precision::F64,
            settings: *base,
            running: Running { threads: 1, ..plain.running },
            ..plain.clone()
        });
    }
    all
}

/// The variants that run on a GPU.
pub fn gpu_variants(base: &Settings) -> Vec<Variant> {
    let plain = Variant {
        name: String::new(),
        family: "GPU",
        engine: Engine::Gpu,
        mode: Mode::Relax,
        precision: Precision::F32,
        settings: *base,
        running: Running { skip: Skip::NOTHING, ..Running::default() },
    };
    let gauss_newton = Settings { solver: Solver::GaussNewton, iterations: 3, ..*base };
    let safeguarded = Settings { solver: Solver::Safeguarded, iterations: 3, ..*base };
    let table = |iterations| Settings { start: Start::Table, iterations, ..safeguarded };
    let skipping = Running { skip: Skip::default(), ..plain.running };
    let mut all: Vec<Variant> = [
        ("embed f32 GPU", Mode::Embed, *base),
        ("knots f32 GPU", Mode::Knots, *base),
        ("Gauss-Newton 3 f32 GPU", Mode::Relax, gauss_newton),
        ("safeguarded 3 f32 GPU", Mode::Relax, safeguarded),
        ("table + 1 f32 GPU", Mode::Relax, table(1)),
        ("table + 2 f32 GPU", Mode::Relax, table(2)),
    ]
    .map(|(name, mode, settings)| Variant { name: name.into(), mode, settings, ..plain.clone() })
    .into();
    let name = "table + 2 f32 GPU with skips".into();
    all.push(Variant { name, settings: table(2), running: skipping, ..plain });
    all
}
