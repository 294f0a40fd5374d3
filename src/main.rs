//! The `knotmesh` command.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
