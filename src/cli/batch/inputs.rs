//! The meshes of a batch, and the names of their results.

use crate::cli::files::is_standard;
use crate::cli::progress::patience;
use crate::cli::remesh::full_path;
use crate::error::shown;
use crate::io;
use rtfmesh::Error;
use rtfmesh::io::{Encoding, Format};
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use walkdir::{DirEntry, WalkDir};

/// A mesh and the file of its result.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Job {
    /// The mesh to read.
    pub input: PathBuf,
    /// The mesh to write.
    pub output: PathBuf,
}

/// A part of the jobs: every `of`-th, beginning with the `number`-th.
#[derive(Debug, Clone, Copy)]
pub struct Shard {
    number: usize,
    of: usize,
}

impl Shard {
    /// The part of the process with this rank, counted from 0, of a number of processes.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no such number.
    pub fn of_rank(rank: usize, world_size: usize) -> rtfmesh::Result<Self> {
        if rank < world_size {
            return Ok(Self { number: rank + 1, of: world_size });
        }
        let problem = format!("--rank {rank} is not below --world-size {world_size}");
        Err(Error::usage(problem, "count ranks from 0"))
    }

    /// Reads `2/8`.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match parts {
            Some((number, of)) if 1 <= number && number <= of => Ok(Self { number, of }),
            _ => Err("give i/n with i from 1 to n, such as 2/8".to_owned()),
        }
    }

    /// Its share of the jobs.
    pub fn select(self, jobs: Vec<Job>) -> Vec<Job> {
        jobs.into_iter().skip(self.number - 1).step_by(self.of).collect()
    }
}

/// A mesh to read, and the path of its result below the folder for all, except for the extension.
type Found = (PathBuf, PathBuf);

/// All meshes that `inputs` name, with a result for each in `folder`, sorted by their paths. Folders are
/// searched with all that are in them, but `folder` itself, and keep their structure.
///
/// # Errors
/// [`Error::Usage`] if there is none, or two results would have one name, or a result would replace a mesh of
/// the batch; [`Error::Input`] for a list or folder that cannot be read.
pub fn jobs(inputs: &[PathBuf], folder: &Path, encoding: Encoding) -> rtfmesh::Result<Vec<Job>> {
    let mut paths = Vec::new();
    for input in inputs {
        match input.to_str().and_then(|text| text.strip_prefix('@')) {
            Some(list) => {
                for line in lines(Path::new(list))? {
                    add(Path::new(&line), folder, &mut paths)?;
                }
            }
            None => add(input, folder, &mut paths)?,
        }
    }
    if paths.is_empty() {
        return Err(Error::usage(
            "no mesh among the inputs",
            "give mesh files, or folders that contain some",
        ));
    }
    paths.sort();
    let job = |(input, place): Found| Job { output: folder.join(result_path(&place, encoding)), input };
    let jobs: Vec<Job> = paths.into_iter().map(job).collect();
    refuse_clashes(&jobs)?;
    Ok(jobs)
}

/// A file, or the meshes of a folder and of those in it.
fn add(path: &Path, results: &Path, found: &mut Vec<Found>) -> rtfmesh::Result<()> {
    if is_standard(path) {
        return Err(Error::usage("standard input cannot be one of several inputs", "give files or folders"));
    }
    if !path.is_dir() {
        found.push((path.to_owned(), path.file_name().map_or_else(PathBuf::new, PathBuf::from)));
        return Ok(());
    }
    let results = full_path(results);
    let is_input = |entry: &DirEntry| {
        entry.depth() == 0 || !entry.file_type().is_dir() || full_path(entry.path()) != results
    };
    for entry in WalkDir::new(path).into_iter().filter_entry(is_input) {
        let entry = entry.map_err(|error| {
            let at = error.path().unwrap_or(path).to_owned();
            unreadable(&at, &error.into())
        })?;
        // A link to a file counts as one, a link to a folder does not.
        let mesh = entry.into_path();
        let named = Encoding::of_name(&mesh).map(|named| named.format);
        // Text files in a folder may be anything.
        if named.is_some_and(|format| format != Format::Xyz || is_of_points(&mesh)) && mesh.is_file() {
            let place = mesh.strip_prefix(path).unwrap_or(&mesh).to_owned();
            found.push((mesh, place));
        }
    }
    Ok(())
}

/// Whether a file of lines of numbers is named after points.
fn is_of_points(path: &Path) -> bool {
    let plain = without_gz(path);
    let ends = plain.extension().unwrap_or_default();
    ["xyz", "xyzn", "xyzrgb", "pts"].iter().any(|own| ends.eq_ignore_ascii_case(own))
}

/// The path without the `.gz` of a packed file.
fn without_gz(path: &Path) -> PathBuf {
    let packed = Encoding::of_name(path).is_some_and(|named| named.gzip);
    if packed { path.with_extension("") } else { path.to_owned() }
}

fn lines(list: &Path) -> rtfmesh::Result<Vec<String>> {
    let bytes = io::read_file_bytes(list, &patience()).map_err(|error| error.in_file(list))?;
    let text = String::from_utf8(bytes).map_err(|_| {
        Error::input(None, "the list is not UTF-8 text", "write a path on each line").in_file(list)
    })?;
    Ok(text.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned).collect())
}

fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    let remedy = "check its name and its permissions";
    Error::input(None, format!("it cannot be read ({error})"), remedy).in_file(path)
}

/// `chairs/scan.obj.gz` becomes `chairs/scan.ply`.
fn result_path(place: &Path, encoding: Encoding) -> PathBuf {
    let plain = without_gz(place);
    let mut name = plain.file_stem().unwrap_or_default().to_owned();
    name.push(format!(".{encoding}"));
    plain.with_file_name(name)
}

fn refuse_clashes(jobs: &[Job]) -> rtfmesh::Result<()> {
    let mut seen = BTreeMap::new();
    for Job { input, output } in jobs {
        if let Some(other) = seen.insert(output, input) {
            let problem =
                format!("{} and {} would both become {}", shown(other), shown(input), shown(output));
            return Err(Error::usage(problem, "rename one, or use another --out folder for it"));
        }
    }
    let inputs: HashSet<PathBuf> = jobs.iter().filter_map(|job| full_path(&job.input)).collect();
    match jobs.iter().find(|job| full_path(&job.output).is_some_and(|path| inputs.contains(&path))) {
        Some(job) => Err(Error::usage(
            format!("the result {} would overwrite an input", shown(&job.output)),
            "choose another folder for --out",
        )),
        None => Ok(()),
    }
}
