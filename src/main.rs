//! The `rtfmesh` program: parse, validate, run, report.

fn main() -> std::process::ExitCode {
    rtfmesh::cli::run(std::env::args_os()).into()
}
