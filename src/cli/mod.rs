//! The command line.

mod devices;
mod measure;
mod remesh;
mod sample;
mod table;

use anyhow::Result;
use clap::{Parser, Subcommand};
use rtfmesh::Error;
use std::process::ExitCode;

/// Surface remeshing on any Vulkan device: well-shaped triangles with exactly the vertex count you ask for.
#[derive(Parser)]
#[command(version, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 done, 2 usage, 3 input, 4 device or memory, 1 anything else.\n\
    Environment: RTFMESH_DEVICE as --device; RTFMESH_VALIDATION=1 runs under the Vulkan validation layers and fails \
    on any message; RTFMESH_FULL_BARRIERS=1 orders every device command; RTFMESH_CACHE_DIR keeps compiled kernels.";

#[derive(Subcommand)]
enum Command {
    Remesh(remesh::Args),
    Measure(measure::Args),
    Sample(sample::Args),
    Devices(devices::Args),
}

/// Runs the program; errors are one line on standard error.
pub fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Remesh(args) => remesh::run(&args),
        Command::Measure(args) => measure::run(&args),
        Command::Sample(args) => sample::run(&args),
        Command::Devices(args) => devices::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(exit_code(&error))
        }
    }
}

fn exit_code(error: &anyhow::Error) -> u8 {
    match error.downcast_ref::<Error>() {
        Some(Error::Usage { .. }) => 2,
        Some(Error::Input { .. }) => 3,
        Some(Error::Device { .. } | Error::OutOfMemory { .. } | Error::DeviceLost(_)) => 4,
        Some(Error::Output { .. } | Error::Internal(_)) | None => 1,
    }
}

/// Whoever reads standard output may stop reading (`| head`); that is no failure.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
}

/// Prints to standard output, with errors instead of panics.
fn print(text: &str) -> Result<()> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}
