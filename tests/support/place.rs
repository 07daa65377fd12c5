//! The program in a folder of its own.

use assert_cmd::Command;
use rtfmesh::io::write;
use rtfmesh::mesh::samples::sample;
use serde_json::Value;
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder of its own, in which the program runs, validated.
pub struct Place {
    pub folder: TempDir,
    /// Compiled pipelines.
    pub cache: TempDir,
}

impl Place {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap(), cache: tempfile::tempdir().unwrap() }
    }

    /// A place with one of the models as `in.ply`.
    pub fn with(model: &str) -> Self {
        let place = Self::new();
        write(place.path("in.ply"), &sample(model).unwrap()).unwrap();
        place
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The program with these arguments, separated by blanks, in this folder.
    pub fn program(&self, arguments: &str) -> Command {
        let mut command = assert_cmd::cargo::cargo_bin_cmd!("rtfmesh");
        command.current_dir(self.folder.path()).args(arguments.split_whitespace());
        command.env("RTFMESH_VALIDATION", "1").env("RTFMESH_CACHE_DIR", self.cache.path());
        command
    }

    /// Runs without fault; gives standard output and standard error.
    #[track_caller]
    pub fn run(&self, arguments: &str) -> (String, String) {
        let done = self.program(arguments).assert().success();
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        (text(&done.get_output().stdout), text(&done.get_output().stderr))
    }

    /// The names of all files, sorted.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.bytes(name)).unwrap()
    }
}
