//! The `rtfmesh` program: parse, validate, run, report.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
