//! Shares of equal floats, stage by stage and template by template.

use crate::case::same;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Mutex;

/// What a stage of a template came to.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    pub floats: usize,
    pub identical: usize,
    /// The largest difference, as a share of the larger number or of 1; infinite where only one is a number.
    pub worst: f64,
    /// The largest one that a unit in the last place of the input makes in the twin.
    pub sensitivity: f64,
}

/// How far two numbers are apart.
fn apart(a: f32, b: f32) -> f64 {
    if same(a, b) || a == b {
        return 0.0;
    }
    let (a, b) = (f64::from(a), f64::from(b));
    let apart = (a - b).abs() / a.abs().max(b.abs()).max(1.0);
    if apart.is_nan() { f64::INFINITY } else { apart }
}

impl Row {
    pub fn compare(&mut self, twin: &[f32], device: &[f32]) {
        assert_eq!(twin.len(), device.len());
        for (a, b) in twin.iter().zip(device) {
            self.floats += 1;
            self.identical += usize::from(same(*a, *b));
            self.worst = self.worst.max(apart(*a, *b));
        }
    }

    pub fn nudge(&mut self, twin: &[f32], nudged: &[f32]) {
        let most = twin.iter().zip(nudged).map(|(a, b)| apart(*a, *b)).fold(0.0, f64::max);
        self.sensitivity = self.sensitivity.max(most);
    }
}

/// By case, template and stage (with its number, so that stages stay in order).
pub type Rows = BTreeMap<(String, String, usize, &'static str), Row>;

/// All rows of this run.
static ALL: Mutex<Rows> = Mutex::new(Rows::new());

/// Adds rows to the table, and writes it where `KNOTMESH_PARITY` says.
pub fn record(rows: Rows) {
    let mut all = ALL.lock().expect("no test panics while it writes");
    all.extend(rows);
    let Some(path) = std::env::var_os("KNOTMESH_PARITY").filter(|p| !p.is_empty()) else { return };
    let mut text = String::from("case,template,stage,floats,identical,share,worst,sensitivity\n");
    for ((case, template, _, stage), row) in &*all {
        let share = row.identical as f64 / row.floats.max(1) as f64;
        writeln!(
            text,
            "{case},{template},{stage},{},{},{share:.6},{:.1e},{:.1e}",
            row.floats, row.identical, row.worst, row.sensitivity
        )
        .expect("memory");
    }
    std::fs::write(path, text).expect("the file can be written");
}
