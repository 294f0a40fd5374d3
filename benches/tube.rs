//! The main job as a user runs it, by size: a helical stockinette tube is read, compiled, relaxed for one frame
//! and written as `.bcc`, on one thread. Prints CSV: wall-clock seconds (median of the runs) and peak memory.
//!
//! `cargo bench --bench tube [-- RUNS [FACES...]]`; figures are kept in `benches/runs/`.

use knotmesh::measure::machine::heading;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

#[path = "../examples/tube/mod.rs"]
#[allow(dead_code)]
mod tube;

fn main() {
    println!("{}", heading("tube"));
    // Cargo adds flags of its own.
    let numbers: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let runs = numbers.first().copied().unwrap_or(5).max(1);
    let sizes = if numbers.len() > 1 { &numbers[1..] } else { &[1_000, 10_000, 100_000][..] };
    let folder = tempfile::tempdir().expect("a folder for the files");
    let (mesh, report) = (folder.path().join("tube.smobj"), folder.path().join("report.json"));
    println!("faces,seconds,parse,compile,solve,write,peak_mb");
    for faces in sizes {
        std::fs::write(&mesh, tube::smobj(*faces, tube::Vertices::Own)).expect("a writable folder");
        let mut seconds: Vec<f64> = (0..runs).map(|_| relax(&mesh, None)).collect();
        seconds.sort_by(f64::total_cmp);
        // Stages come from a run of their own: measuring for the report takes time and memory.
        relax(&mesh, Some(&report));
        let text = std::fs::read(&report).expect("a report");
        let report: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        let stage = |name: &str| report["seconds"][name].as_f64().unwrap_or(f64::NAN);
        println!(
            "{faces},{:.3},{:.3},{:.3},{:.3},{:.3},{:.1}",
            seconds[runs / 2],
            stage("parse"),
            stage("compile"),
            stage("solve"),
            stage("write"),
            report["peak_memory_bytes"].as_f64().map_or(f64::NAN, |b| b / 1e6)
        );
    }
}

/// Runs the command on one thread and gives its wall-clock seconds.
fn relax(mesh: &Path, report: Option<&Path>) -> f64 {
    let mut command = Command::new(env!("CARGO_BIN_EXE_knotmesh"));
    command.args(["relax", "--quiet", "--threads", "1"]).arg(mesh);
    command.arg("-o").arg(mesh.with_extension("bcc"));
    if let Some(report) = report {
        command.arg("--report").arg(report);
    }
    let began = Instant::now();
    let status = command.status().expect("the command starts");
    assert!(status.success());
    began.elapsed().as_secs_f64()
}
