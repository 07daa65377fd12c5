//! The command line.

mod all_at_once;
mod attributes;
mod batch;
mod bug_report;
pub mod call;
mod cloud;
mod demo;
mod devices;
mod files;
mod follow;
mod heading;
mod inspect;
mod job;
mod licences;
mod markdown;
mod measure;
mod method;
mod points;
mod presets;
mod progress;
mod refine;
mod remesh;
mod render;
mod repair;
mod sample;
mod selection;
mod shell;
mod sizing;
mod table;
mod target_count;
mod terminal;
mod volume;
mod words;
mod wrap;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use rtfmesh::Error;
use rtfmesh::io::Encoding;
use std::ffi::{OsStr, OsString};
use std::path::Path;
use terminal::{check_standard_output, tell};

/// Remesh surfaces on any Vulkan device: well-shaped triangles, exactly N vertices.
#[derive(Parser)]
#[command(version, after_help = SEE_MORE, after_long_help = NOTES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// What the program says without arguments.
const FIRST_STEPS: &str = "Usage: rtfmesh COMMAND [OPTION...]

  rtfmesh demo                               remesh a built-in model and draw it before and after
  rtfmesh remesh scan.ply new.ply -n 10k     remesh a mesh, points or a volume with 10,000 vertices
  rtfmesh measure new.ply --against scan.ply quality, topology and distances of a result
  rtfmesh render scan.ply new.ply both.png   a picture of both
  rtfmesh devices                            GPUs and CPUs that can do the work

rtfmesh --help lists all commands, rtfmesh COMMAND --help the options of one.
";

const SEE_MORE: &str = "COMMAND -h lists the common options of a command, COMMAND --help all of them.";

const NOTES: &str = "COMMAND -h lists the common options of a command, COMMAND --help all of them; the \
    manual (rtfmesh man) explains each.\nrtfmesh IN OUT is short for rtfmesh remesh IN OUT. The Python \
    package adds rtfmesh asset IN OUT.glb, which bakes textures.\nMeshes: .obj, .ply, .stl, .off, .gltf \
    (read only), .glb, .mesh (MEDIT), .3mf, .vtp, .vtu and .vtk (VTK), each also with .gz; - is standard \
    input or output. Points: .ply, .off, .glb, .vtp, .vtk, .pcd, .las, .laz, .e57, .xyz, .txt, .csv. \
    Volumes: .npy, .nrrd, .nii, .mha, .vti, .vtk.\nExit codes: 0 done, 2 usage, 3 input, 4 device or memory, \
    130 stopped by Ctrl-C (also if --keep-partial wrote a mesh), 1 anything else. An error is one line that \
    says what to do.\nEnvironment: RTFMESH_DEVICE selects the device, as --device does; RTFMESH_CACHE_DIR is \
    the folder for compiled kernels; RTFMESH_SELF_TEST=1 repeats the self-test of the device; \
    RTFMESH_VALIDATION=1 runs under the Vulkan validation layers and fails on any message; \
    RTFMESH_FULL_BARRIERS=1 orders all device commands; RTFMESH_LEAST_LIMITS=1 limits the device to what \
    Vulkan guarantees; RTFMESH_DEVICE_POLISH=1 polishes, fits and checks all meshes on the device, 0 none.";

/// The command that the Python package has besides these.
const ASSET: &str = "asset";

#[derive(Subcommand)]
enum Command {
    Remesh(remesh::Args),
    Batch(batch::Args),
    Repair(repair::Args),
    Wrap(Box<wrap::Args>),
    Follow(follow::Args),
    Measure(measure::Args),
    Inspect(inspect::Args),
    Render(render::Args),
    Presets(presets::Args),
    Sample(sample::Args),
    Devices(devices::Args),
    Demo(demo::Args),
    BugReport(bug_report::Args),
    Completions(shell::CompletionsArgs),
    Man(shell::ManArgs),
    #[command(alias = "licenses")]
    Licences(licences::Args),
}

/// Runs the program with these arguments, its own name first, and returns its exit code; errors are one line
/// on standard error.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args = with_command(args.into_iter().collect());
    if args.get(1).is_some_and(|first| first == ASSET) {
        return tell_outcome(Err(Error::usage(
            format!("{ASSET} is a command of the Python package"),
            "install that: pip install 'rtfmesh[asset]'",
        )
        .into()));
    }
    if args.len() <= 1 {
        tell(FIRST_STEPS);
        return 2;
    }
    let cli = match Cli::try_parse_from(&args) {
        Ok(cli) => cli,
        Err(error) if error.kind() == ErrorKind::DisplayHelp => return no_command(&help(&args, error)),
        Err(error) => return no_command(&error),
    };
    let outcome = match cli.command {
        Command::Remesh(args) => return tell_outcome(remesh::run(&args)),
        Command::Wrap(args) => return tell_outcome(wrap::run(*args)),
        Command::Batch(args) => batch::run(&args),
        Command::Repair(args) => repair::run(&args),
        Command::Follow(args) => follow::run(&args),
        Command::Measure(args) => measure::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Render(args) => render::run(&args),
        Command::Presets(args) => presets::run(&args),
        Command::Sample(args) => sample::run(&args),
        Command::Devices(args) => devices::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::BugReport(args) => bug_report::run(&args, &Cli::command()),
        Command::Completions(args) => shell::completions(&args, Cli::command()),
        Command::Man(args) => shell::man(&args, Cli::command()),
        Command::Licences(_) => licences::run(),
    };
    tell_outcome(outcome.map(|()| 0))
}

/// The arguments with the command that `rtfmesh scan.ply out.ply` leaves out: where the first one names a
/// mesh, `remesh`.
fn with_command(mut args: Vec<OsString>) -> Vec<OsString> {
    let is_mesh = |first: &OsStr| {
        let is_command = Cli::command().get_subcommands().any(|command| command.get_name() == first);
        !is_command && (first == "-" || Encoding::of_name(Path::new(first)).is_some())
    };
    if args.get(1).is_some_and(|first| is_mesh(first)) {
        args.insert(1, "remesh".into());
    }
    args
}

/// The help asked for, where `--help` and `help COMMAND` list all options in the layout of `-h`, a line or
/// two for each; the manual has the explanations.
fn help(args: &[OsString], short: clap::Error) -> clap::Error {
    let words = args.get(1..).unwrap_or_default();
    if !words.iter().any(|word| word == "--help") && words.first().is_none_or(|word| word != "help") {
        return short;
    }
    let mut program = with_short_layout(Cli::command());
    let mut names = program.get_subcommands().map(|command| command.get_name().to_owned());
    let command = names.find(|name| words.iter().any(|word| word == name.as_str()));
    drop(names);
    if let Some(name) = &command {
        program = program.mut_subcommand(name, with_short_layout);
    }
    let asked = [Some(env!("CARGO_PKG_NAME")), command.as_deref(), Some("-h")];
    program.try_get_matches_from(asked.into_iter().flatten()).err().unwrap_or(short)
}

/// A command whose short help has everything that its long help has, but for explanations of options.
fn with_short_layout(mut command: clap::Command) -> clap::Command {
    if let Some(about) = command.get_long_about().cloned() {
        command = command.about(about);
    }
    if let Some(after) = command.get_after_long_help().cloned() {
        command = command.after_help(after);
    }
    command.mut_args(|arg| arg.hide_short_help(false))
}

/// The exit code, after telling of an error.
fn tell_outcome(outcome: anyhow::Result<u8>) -> u8 {
    progress::end_by_itself();
    match outcome {
        Ok(code) => code,
        Err(error) if is_closed_pipe(&error) => 0,
        Err(error) => {
            tell(&format!("error: {}\n", words::line(&error)));
            exit_code(&error)
        }
    }
}

/// Help and the version as clap writes them; a mistake in the arguments on one line, as every other error.
fn no_command(error: &clap::Error) -> u8 {
    let text = error.render().to_string();
    if !text.starts_with("error:") {
        // Help goes to standard output if it was asked for, else to standard error as the error that it is.
        if error.use_stderr() {
            let _ = error.print();
            return 2;
        }
        let printed = check_standard_output().map_err(Into::into).and_then(|()| Ok(error.print()?));
        return tell_outcome(printed.map(|()| 0));
    }
    // Clap puts tips in paragraphs of their own, and the usage last.
    let sentences = text.split("\n\n").take_while(|part| !part.starts_with("Usage:"));
    let words = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ");
    let sentences: Vec<_> = sentences.map(words).filter(|s| !s.starts_with("For more information")).collect();
    tell(&format!("{}; see `rtfmesh --help` or `rtfmesh COMMAND --help`\n", sentences.join("; ")));
    2
}

fn exit_code(error: &anyhow::Error) -> u8 {
    match error.downcast_ref::<Error>() {
        Some(Error::Usage { .. }) => 2,
        Some(Error::Input { .. }) => 3,
        Some(Error::Device { .. } | Error::OutOfMemory { .. } | Error::DeviceLost(_)) => 4,
        Some(Error::Cancelled) => progress::CANCELLED,
        None if error.is::<progress::CancelledByUser>() => progress::CANCELLED,
        Some(_) | None => 1,
    }
}

/// Whoever reads standard output may stop reading (`| head`); that is no failure.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
}
