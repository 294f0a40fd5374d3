//! `knotmesh stress`: random faces far beyond what cloth does, and what must hold of each.

use super::device::DeviceName;
use super::{Console, Ending, print};
use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use knotmesh::knot::Status;
use knotmesh::measure::stress::checks::Check;
use knotmesh::measure::stress::precision::LEVELS;
use knotmesh::measure::stress::shapes::Kind;
use knotmesh::measure::stress::tally::Report;
use knotmesh::measure::stress::{Length, Options, run as run_all, run_one};
use knotmesh::{Error, Result};
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Faces run where neither a number nor a time is given.
const FACES: u64 = 100_000;

#[derive(clap::Args)]
pub struct Arguments {
    /// How many faces [default: 100000].
    #[arg(long, value_name = "N", conflicts_with = "seconds")]
    count: Option<u64>,
    /// Go on for so long.
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Of all random numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Run this face by itself and say what it gives: its number as a run printed it.
    #[arg(long, value_name = "FACE", conflicts_with_all = ["count", "seconds"])]
    only: Option<u64>,
    /// Threads that must give the same bytes as one; 0 takes one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Where that run of several threads is made in f32: on a GPU, the bytes are the same where its driver leaves sums,
    /// quotients and roots as they are [default: cpu, or gpu where an adapter is named].
    #[arg(long, value_enum)]
    device: Option<DeviceName>,
    /// The adapter to take, by a part of its name; `knotmesh info --adapters` lists them.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

impl Arguments {
    fn device(&self) -> DeviceName {
        match (self.device, &self.adapter) {
            (Some(device), _) => device,
            (None, Some(_)) => DeviceName::Gpu,
            (None, None) => DeviceName::Cpu,
        }
    }

    /// What another run needs to be made on the same device.
    fn again(&self) -> String {
        let device = self.device.as_ref().and_then(ValueEnum::to_possible_value);
        let device = device.map_or(String::new(), |value| format!(" --device {}", value.get_name()));
        device + &self.adapter.as_ref().map_or(String::new(), |name| format!(" --adapter '{name}'"))
    }
}

/// Runs faces and prints what was found.
pub fn run(arguments: &Arguments, console: Console) -> Result<Ending> {
    let length = match arguments.seconds {
        Some(seconds) if !(0.0..=1e9).contains(&seconds) => {
            return Err(Error::invalid(format_args!("--seconds {seconds}: expected a number from 0 to 1e9")));
        }
        Some(seconds) => Length::Time(Duration::from_secs_f64(seconds)),
        None => Length::Count(arguments.count.unwrap_or(FACES)),
    };
    let options = Options {
        seed: arguments.seed,
        length,
        threads: arguments.threads,
        device: arguments.device().into(),
        adapter: arguments.adapter.as_deref(),
    };
    let report = match arguments.only {
        Some(number) => run_one(&options, number)?,
        None => {
            let bar = bar(length, console.quiet);
            let began = Instant::now();
            let report = run_all(&options, |faces| {
                bar.set_position(match length {
                    Length::Count(_) => faces,
                    Length::Time(_) => began.elapsed().as_secs(),
                });
            });
            bar.finish_and_clear();
            report?
        }
    };
    let text = match arguments.only {
        Some(_) => report.description.clone() + &findings(&report, &arguments.again()),
        None => listing(&report, &arguments.again()),
    };
    print(&text)?;
    Ok(if report.holds() { Ending::Done } else { Ending::Broken })
}

/// A bar on a terminal.
fn bar(length: Length, quiet: bool) -> ProgressBar {
    let (total, template) = match length {
        Length::Count(count) => (count, "{bar:40} {pos}/{len} faces, {eta} left"),
        Length::Time(time) => (time.as_secs(), "{bar:40} {pos}/{len} s"),
    };
    // Draws nothing unless standard error is a terminal.
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    bar.set_style(ProgressStyle::with_template(template).expect("a valid template"));
    bar
}

fn listing(report: &Report, again: &str) -> String {
    let mut text = String::new();
    for (side, precision) in ["f32", "f64"].into_iter().enumerate() {
        let _ = write!(text, "{:22}", format!("ended in {precision}"));
        // Nothing is left out of these meshes.
        let statuses = Status::ALL.iter().filter(|s| **s != Status::Skipped);
        statuses.clone().for_each(|s| text += &format!("{:>13}", format!("{s:?}").to_lowercase()));
        text += "\n";
        for kind in Kind::ALL {
            let _ = write!(text, "  {:20}", kind.name());
            for status in statuses.clone() {
                let _ = write!(text, "{:>13}", report.outcomes[side][kind as usize][*status as usize]);
            }
            text += "\n";
        }
    }
    let _ = write!(text, "{:22}", "f32 from f64, in r");
    LEVELS.iter().for_each(|level| {
        let name = if level.is_finite() { format!("to {level:e}") } else { "more".into() };
        text += &format!("{name:>13}");
    });
    let _ = writeln!(text, "{:>13}", "one energy");
    for kind in Kind::ALL {
        let counts = report.apart[kind as usize];
        let total: u64 = counts.iter().sum();
        let _ = write!(text, "  {:20}", kind.name());
        for count in counts {
            let share = 100.0 * count as f64 / total.max(1) as f64;
            let _ = write!(text, "{:>13}", if total == 0 { "-".into() } else { format!("{share:.3} %") });
        }
        let [total, one] = report.one_energy[kind as usize];
        let share = 100.0 * one as f64 / total.max(1) as f64;
        let _ = writeln!(text, "{:>13}", if total == 0 { "-".into() } else { format!("{share:.3} %") });
    }
    text += &findings(report, again);
    let seconds = report.time.as_secs_f64();
    let _ = writeln!(
        text,
        "{} faces in {seconds:.1} s: {:.0} a second",
        report.faces,
        report.faces as f64 / seconds.max(1e-9)
    );
    text
}

/// One line a check, and the first face that breaks it as a command.
fn findings(report: &Report, again: &str) -> String {
    let mut text = format!("{:42}{:>12}{:>10}\n", "what must hold", "checked", "broken");
    for check in Check::ALL {
        let tally = report.tally(check);
        let _ = write!(text, "  {:40}{:>12}{:>10}", check.name(), tally.tested, tally.failed);
        if tally.worst > 0.0 {
            let _ = write!(text, "  at most {:.3} of the bound", tally.worst);
        }
        text += "\n";
        if let Some(first) = &tally.first {
            let _ = writeln!(
                text,
                "    knotmesh stress --seed {} --only {}{again}: {}",
                report.seed, first.number, first.words
            );
        }
    }
    text
}
