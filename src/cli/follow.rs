//! `rtfmesh follow`.

use super::batch::inputs::{Job, jobs};
use super::batch::make_folder;
use super::files::{InputFormat, Target, input_name, tell_notes};
use super::heading::{DEVICE, OUTPUT};
use super::progress;
use super::progress::{RunProgress, begin_writing, seconds};
use super::remesh::same_file;
use super::terminal::tell;
use crate::error::shown;
use anyhow::Result;
use clap::ArgAction;
use rtfmesh::io;
use rtfmesh::io::{Encoding, Format};
use rtfmesh::mesh::attributes::{Attributes, Role};
use rtfmesh::mesh::distance::distances;
use rtfmesh::{Error, Follower, ProgressToken, TriMesh};
use std::path::{Path, PathBuf};
use std::time::Duration;

const EXAMPLES: &str = "Examples:
  rtfmesh follow rest.ply rest-5k.ply walk --out walk-5k
  rtfmesh follow rest.obj rest-5k.obj pose1.obj pose2.obj --out poses --format obj";

/// Carry a result over to other poses of its input: one connectivity for an animation
///
/// Each pose is a file with the input's vertices elsewhere, in the same order, and with the same triangles or
/// none. Its result has the triangles and attributes of RESULT, and each vertex is at the same place on the
/// surface, on the same features. Poses are worked on by name; the first that does not fit ends the run.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, disable_help_flag = true)]
pub struct Args {
    /// Mesh that was remeshed
    input: PathBuf,
    /// Its result
    result: PathBuf,
    /// Files of other poses of the input, folders, or @LIST with a path on each line
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// Folder for the results, created if missing; each is named after its pose
    #[arg(long, value_name = "DIR", help_heading = OUTPUT)]
    out: PathBuf,
    /// Format of the results, such as obj or ply.gz
    ///
    /// One of obj, ply, stl, off, glb, mesh, vtp, vtu, vtk and 3mf, each also with .gz.
    #[arg(long, value_name = "FORMAT", help_heading = OUTPUT,
        default_value_t = Encoding { format: Format::Ply, gzip: false })]
    format: Encoding,
    /// Measure the distances between each result and its pose
    #[arg(long, help_heading = OUTPUT)]
    distances: bool,
    /// Do not print a line for each pose
    #[arg(long, short, help_heading = OUTPUT)]
    quiet: bool,
    #[command(flatten)]
    input_format: InputFormat,
    /// Stop after this time, with an error; poses that are done by then are written [default: none]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, help_heading = DEVICE)]
    time_limit: Option<Duration>,
    /// Print help: -h the common options, --help all
    #[arg(long, short, action = ArgAction::Help, help_heading = OUTPUT)]
    help: Option<bool>,
}

/// Carries the result over to one pose after another; the first that does not fit ends it.
pub fn run(args: &Args) -> Result<()> {
    let run = RunProgress::with_limit(args.time_limit);
    io::target_encoding(Path::new(&format!("result.{}", args.format)))?;
    let jobs = jobs(&args.frames, &args.out, args.format)?;
    refuse_overwriting(args, &jobs)?;
    progress::handle_interrupts()?;
    let load = |path: &PathBuf| {
        let (format, path) = (args.input_format.clone(), path.clone());
        let name = input_name(&path).to_owned();
        run.begin_reading(move || format.load(&path)).wait(&name)
    };
    let (input, mut result) = (load(&args.input)?.mesh, load(&args.result)?);
    leave_out_pose(args, &mut result.attributes);
    let triangles = input.triangles.clone();
    let follower = run.work(|token| Follower::new(input, &result.mesh, token));
    let follower = follower.map_err(|error| ended(error, &run, [0, jobs.len()], &args.result))?;
    make_folder(&args.out)?;
    for (done, job) in jobs.iter().enumerate() {
        let counts = [done, jobs.len() - done];
        progress::set_cancel_message(format!("stopped: {done} done, {} left", counts[1]));
        if progress::is_cancelled() || run.is_over() {
            return Err(ended(Error::Cancelled, &run, counts, &job.input));
        }
        let format = args.input_format.clone();
        let path = job.input.clone();
        let pose = run.begin_reading(move || format.load_other_or_points(&path)).wait(&job.input)?.mesh;
        result.mesh.vertices = follower.follow(&pose).map_err(|error| error.in_file(&job.input))?;
        let pose = TriMesh { triangles: triangles.clone(), ..pose };
        let distance = args.distances.then(|| run.work(|token| rms(&result.mesh, &pose, token))).transpose();
        let distance = distance.map_err(|error| ended(error, &run, counts, &job.input))?;
        make_folder(job.output.parent().unwrap_or(&job.output))?;
        let target = Target::new(&job.output, Some(args.format))?;
        let writing = begin_writing()?;
        target.write(&result.mesh, &result.attributes, true)?;
        drop(writing);
        if !args.quiet {
            let distance = distance.map(|rms| format!(", RMS {rms:.4} %")).unwrap_or_default();
            let names = [&job.input, &job.output].map(|path| shown(path).to_string());
            tell(&format!("{}/{} {}{distance}\n", done + 1, jobs.len(), names.join(" -> ")));
        }
    }
    Ok(())
}

/// No result may replace what was read.
fn refuse_overwriting(args: &Args, jobs: &[Job]) -> rtfmesh::Result<()> {
    for job in jobs {
        if let Some(read) = [&args.input, &args.result].into_iter().find(|read| same_file(read, &job.output))
        {
            let problem = format!("the result {} would overwrite {}", shown(&job.output), shown(read));
            return Err(Error::usage(problem, "choose another folder for --out"));
        }
    }
    Ok(())
}

/// Leaves out attributes that only one pose has.
fn leave_out_pose(args: &Args, attributes: &mut Attributes) {
    let before = attributes.vertex.len() + attributes.face.len();
    for list in [&mut attributes.vertex, &mut attributes.face] {
        list.retain(|attribute| attribute.role != Role::Normal);
    }
    let left_out = [
        ("normals", attributes.vertex.len() + attributes.face.len() < before),
        ("joints and weights", attributes.skin.take().is_some()),
    ];
    for (what, _) in left_out.iter().filter(|(_, is_left_out)| *is_left_out && !args.quiet) {
        tell_notes(&args.result, &[format!("left out {what}, which belong to one pose")]);
    }
}

/// The root mean square distance between a result and its pose, in percent of the pose's diagonal.
fn rms(result: &TriMesh, pose: &TriMesh, progress: &ProgressToken) -> rtfmesh::Result<f64> {
    Ok(distances(result, pose, progress)?.rms)
}

/// What ended the work on a file, of which so many are done and so many left: the time limit, Ctrl-C, or an
/// error.
fn ended(error: Error, run: &RunProgress, [done, left]: [usize; 2], file: &Path) -> anyhow::Error {
    match error {
        Error::Cancelled if progress::is_cancelled() => progress::cancelled().into(),
        Error::Cancelled if run.is_over() => {
            anyhow::anyhow!("the time limit ended the run: {done} done, {left} left; allow more time")
        }
        error => error.in_file(file).into(),
    }
}
