//! The meshes of a batch, and the names of their results.

use crate::cli::files::is_standard;
use crate::cli::remesh::full_path;
use rtfmesh::Error;
use rtfmesh::io::Encoding;
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

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
    pub fn of(self, jobs: Vec<Job>) -> Vec<Job> {
        jobs.into_iter().skip(self.number - 1).step_by(self.of).collect()
    }
}

/// All meshes that `inputs` name, with a result for each in `folder`, sorted by their paths.
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
                    add(Path::new(&line), &mut paths)?;
                }
            }
            None => add(input, &mut paths)?,
        }
    }
    if paths.is_empty() {
        return Err(Error::usage(
            "there is no mesh among the inputs",
            "name mesh files, or folders with some",
        ));
    }
    paths.sort();
    let job = |input: PathBuf| Job { output: folder.join(result_name(&input, encoding)), input };
    let jobs: Vec<Job> = paths.into_iter().map(job).collect();
    refuse_clashes(&jobs)?;
    Ok(jobs)
}

/// A file, or the meshes of a folder.
fn add(path: &Path, paths: &mut Vec<PathBuf>) -> rtfmesh::Result<()> {
    if is_standard(path) {
        return Err(Error::usage(
            "a batch does not read standard input",
            "name files, or use `rtfmesh remesh`",
        ));
    }
    if !path.is_dir() {
        paths.push(path.to_owned());
        return Ok(());
    }
    for entry in std::fs::read_dir(path).map_err(|error| unreadable(path, &error))? {
        let found = entry.map_err(|error| unreadable(path, &error))?.path();
        if Encoding::of_name(&found).is_some() && found.is_file() {
            paths.push(found);
        }
    }
    Ok(())
}

fn lines(list: &Path) -> rtfmesh::Result<Vec<String>> {
    let text = std::fs::read_to_string(list).map_err(|error| unreadable(list, &error))?;
    Ok(text.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned).collect())
}

fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    let remedy = "check its name and its permissions";
    Error::input(None, format!("it cannot be read ({error})"), remedy).in_file(path)
}

/// `scan.obj.gz` becomes `scan.ply`.
fn result_name(input: &Path, encoding: Encoding) -> String {
    let packed = Encoding::of_name(input).is_some_and(|named| named.gzip);
    let plain = if packed { input.with_extension("") } else { input.to_owned() };
    format!("{}.{encoding}", plain.file_stem().unwrap_or_default().display())
}

fn refuse_clashes(jobs: &[Job]) -> rtfmesh::Result<()> {
    let mut seen = BTreeMap::new();
    for Job { input, output } in jobs {
        if let Some(other) = seen.insert(output, input) {
            let problem =
                format!("{} and {} would both become {}", other.display(), input.display(), output.display());
            return Err(Error::usage(problem, "rename one, or run two batches with folders of their own"));
        }
    }
    let inputs: HashSet<PathBuf> = jobs.iter().filter_map(|job| full_path(&job.input)).collect();
    match jobs.iter().find(|job| full_path(&job.output).is_some_and(|path| inputs.contains(&path))) {
        Some(job) => Err(Error::usage(
            format!("the result {} would replace a mesh that is read", job.output.display()),
            "name another folder after --out",
        )),
        None => Ok(()),
    }
}
