//! Arguments to plain structs, library calls, exit codes: 0 done, 1 done but some faces fell back (or, under
//! stress, something does not hold), 2 error.

mod cloth;
mod convert;
mod database;
mod device;
mod drape;
mod info;
mod inputs;
mod knit;
#[cfg(feature = "measure")]
mod measure;
#[cfg(feature = "measure")]
mod measure_database;
mod outputs;
mod progress;
mod relax;
mod relax_mesh;
#[cfg(feature = "gpu")]
mod render;
mod report;
mod skip;
mod stress;
mod templates;
#[cfg(feature = "view")]
mod view;

use clap::{Parser, Subcommand};
use knotmesh::Result;
use std::process::ExitCode;

/// Turns a deformed stitch mesh into physically plausible yarn.
#[derive(Parser)]
#[command(version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print errors only.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Say more about what is read and done.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    verbose: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Knit a pattern or chart: it becomes a stitch mesh.
    Knit(knit::Arguments),
    /// Relax the yarn of a stitch mesh.
    Relax(Box<relax::Arguments>),
    /// Draw yarn: pictures of a mesh, a pattern or a curve file, still or moving.
    #[cfg(feature = "gpu")]
    Render(Box<render::Arguments>),
    /// Step a mesh as cloth through a scene: held and moved borders, colliders, wind.
    Drape(drape::Arguments),
    /// Relax a stitch mesh to the natural sizes of its stitches.
    RelaxMesh(relax_mesh::Arguments),
    /// Say what is in a mesh, library or curve file; for a mesh also what would go wrong with it.
    Info(info::Arguments),
    /// List the stitches that a library offers.
    Templates(templates::Arguments),
    /// Convert between the formats of curves or of yarn models, or from a sequence of cloth.
    Convert(convert::Arguments),
    /// Run random faces, far beyond what cloth does, and say whether all holds that must.
    Stress(stress::Arguments),
    /// Open a window: a pattern, chart or mesh, and its yarn, which follows every edit.
    #[cfg(feature = "view")]
    View(Box<view::Arguments>),
    /// Measure run time against error: every mode and solver on a mesh, as table, CSV and plot.
    #[cfg(feature = "measure")]
    Measure(Box<measure::Arguments>),
}

/// Where messages for people go.
#[derive(Clone, Copy)]
struct Console {
    quiet: bool,
    verbose: bool,
}

impl Console {
    fn warn(self, message: impl std::fmt::Display) {
        if !self.quiet {
            complain(format_args!("warning: {message}"));
        }
    }

    fn say(self, message: impl std::fmt::Display) {
        if self.verbose {
            complain(message);
        }
    }
}

/// How a command ended, unless in an error.
enum Ending {
    Done,
    FellBack,
    /// Something that must hold does not.
    Broken,
}

/// Runs the command line.
pub fn run() -> ExitCode {
    // Whatever stops the program, no half-written file stays behind.
    let _ = ctrlc::set_handler(|| {
        knotmesh::io::output::discard_unfinished();
        std::process::exit(130);
    });
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let console = Console { quiet: cli.quiet, verbose: cli.verbose };
    let result: Result<Ending> = match cli.command {
        Command::Knit(arguments) => knit::run(&arguments, console),
        Command::Relax(arguments) => relax::run(&arguments, console),
        #[cfg(feature = "gpu")]
        Command::Render(arguments) => render::run(&arguments, console),
        Command::Drape(arguments) => drape::run(&arguments, console),
        Command::RelaxMesh(arguments) => relax_mesh::run(&arguments, console),
        Command::Info(arguments) => info::run(&arguments).map(|()| Ending::Done),
        Command::Templates(arguments) => templates::run(&arguments).map(|()| Ending::Done),
        Command::Convert(arguments) => convert::run(&arguments, console).map(|()| Ending::Done),
        Command::Stress(arguments) => stress::run(&arguments, console),
        #[cfg(feature = "view")]
        Command::View(arguments) => view::run(&arguments),
        #[cfg(feature = "measure")]
        Command::Measure(arguments) => measure::run(&arguments, console).map(|()| Ending::Done),
    };
    match result {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::FellBack | Ending::Broken) => ExitCode::from(1),
        Err(error) => {
            complain(error);
            ExitCode::from(2)
        }
    }
}

/// One line on standard error; one that cannot be written to is no reason to stop.
fn complain(message: impl std::fmt::Display) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "knotmesh: {message}");
}

/// Help and version as clap prints them; errors in one line, like all others.
fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let text = error.to_string();
    // What is missing or possible stands in indented lines below the first.
    let lines =
        text.lines().take_while(|l| !l.starts_with("Usage:") && !l.starts_with("For more")).map(str::trim);
    let line = lines.filter(|l| !l.is_empty()).collect::<Vec<_>>().join(" ");
    let line = line.strip_prefix("error: ").unwrap_or(&line);
    let line = if line.is_empty() || text.contains("Commands:") { "no command given" } else { line };
    complain(format_args!("{line} (see 'knotmesh --help')"));
    ExitCode::from(2)
}

/// Prints to standard output; a reader that has gone away (`| head`) is no error.
fn print(text: &str) -> Result<()> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(knotmesh::Error::io("standard output".as_ref(), e))
        }
        _ => Ok(()),
    }
}
