//! Arguments to plain structs, library calls, exit codes: 0 done, 1 done but some faces fell back, 2 error.

mod convert;
mod info;
mod inputs;
mod relax;
mod report;
mod templates;

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
    /// Relax the yarn of a stitch mesh.
    Relax(Box<relax::Arguments>),
    /// Say what is in a mesh, library or curve file; for a mesh also what would go wrong with it.
    Info(info::Arguments),
    /// List the stitches that a library offers.
    Templates(templates::Arguments),
    /// Convert between the curve formats.
    Convert(convert::Arguments),
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
            eprintln!("knotmesh: warning: {message}");
        }
    }

    fn say(self, message: impl std::fmt::Display) {
        if self.verbose {
            eprintln!("knotmesh: {message}");
        }
    }
}

/// How a command ended, unless in an error.
enum Ending {
    Done,
    FellBack,
}

/// Runs the command line.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    let console = Console { quiet: cli.quiet, verbose: cli.verbose };
    let result: Result<Ending> = match cli.command {
        Command::Relax(arguments) => relax::run(&arguments, console),
        Command::Info(arguments) => info::run(&arguments).map(|()| Ending::Done),
        Command::Templates(arguments) => templates::run(&arguments).map(|()| Ending::Done),
        Command::Convert(arguments) => convert::run(&arguments, console).map(|()| Ending::Done),
    };
    match result {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::FellBack) => ExitCode::from(1),
        Err(error) => {
            eprintln!("knotmesh: {error}");
            ExitCode::from(2)
        }
    }
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
