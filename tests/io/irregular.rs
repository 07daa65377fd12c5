//! What is no regular file: pipes, devices, and links to them, as inputs and as files that a file names.

use std::os::unix::fs::symlink;
use std::path::Path;
use std::time::{Duration, Instant};

use predicates::prelude::*;
use rtfmesh::io::{Patience, Reader, read};
use rtfmesh::{Error, ProgressToken};
use rustix::fs::{CWD, Mode, mkfifoat};

use crate::support::place::Place;

/// Makes a pipe with a name.
fn pipe(path: &Path) {
    mkfifoat(CWD, path, Mode::RUSR | Mode::WUSR).unwrap();
}

#[test]
fn a_pipe_given_by_name_is_read_to_its_end() {
    let place = Place::with("box");
    let content = place.bytes("in.ply");
    pipe(&place.path("pipe.ply"));
    symlink("pipe.ply", place.path("link.ply")).unwrap();
    for name in ["pipe.ply", "link.ply"] {
        let writer = {
            let (path, content) = (place.path("pipe.ply"), content.clone());
            std::thread::spawn(move || std::fs::write(path, content).unwrap())
        };
        assert_eq!(read(place.path(name)).unwrap(), read(place.path("in.ply")).unwrap());
        writer.join().unwrap();
    }
}

#[test]
fn waiting_for_a_pipe_ends_with_the_token_or_the_deadline() {
    let place = Place::new();
    let path = place.path("pipe.ply");
    pipe(&path);
    let token = ProgressToken::default();
    let patience = Patience { token: token.clone(), deadline: None };
    let options = Reader::new().patience(patience);
    let canceller = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(200));
        token.cancel();
    });
    assert_eq!(options.read_any(&path).unwrap_err(), Error::Cancelled);
    canceller.join().unwrap();
    let patience = Patience { deadline: Some(Instant::now()), ..Patience::default() };
    let error = Reader::new().patience(patience).read_any(&path).unwrap_err();
    assert!(error.to_string().contains("pipe.ply: the program that writes to the pipe"), "{error}");
    let line = "remesh pipe.ply out.ply -n 100 --time-limit 0.2";
    place.program(line).assert().code(3).stderr(predicate::str::contains("within the time limit"));
    assert_eq!(place.files(), ["pipe.ply"]);
}

#[test]
fn endless_devices_are_refused_wherever_a_file_is_read() {
    let place = Place::with("box");
    symlink("/dev/zero", place.path("zero.ply")).unwrap();
    symlink("/dev/zero", place.path("zero.jsonl")).unwrap();
    let words = predicate::str::contains("not a regular file");
    for line in [
        "inspect zero.ply",
        "measure in.ply --against zero.ply",
        "remesh zero.ply out.ply -n 100",
        "remesh in.ply out.ply -n 100 --features zero.ply",
        "batch @zero.ply --out folder -n 100",
    ] {
        place.program(line).assert().code(3).stderr(words.clone());
    }
    let line = "batch in.ply --out . --format off -n 100 --log zero.jsonl";
    place.program(line).assert().code(1).stderr(words);
    assert_eq!(place.files(), ["in.ply", "zero.jsonl", "zero.ply"]);
}

#[test]
fn values_of_a_volume_are_in_a_regular_file() {
    let place = Place::new();
    let header = |more: &str| {
        format!("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n{more}\n\n01234567")
    };
    pipe(&place.path("pipe.raw"));
    symlink("pipe.raw", place.path("link.raw")).unwrap();
    symlink("/dev/zero", place.path("zero.raw")).unwrap();
    for (name, skip) in [("pipe.raw", ""), ("link.raw", "\nline skip: 3"), ("zero.raw", "\nbyte skip: 1000")]
    {
        std::fs::write(place.path("a.nhdr"), header(&format!("data file: {name}{skip}"))).unwrap();
        let error = Reader::new().read_any(place.path("a.nhdr")).unwrap_err().to_string();
        assert!(error.contains("data file: "), "{error}");
        let words = if name == "zero.raw" { "outside the folder" } else { "not a regular file" };
        assert!(error.contains(words), "{error}");
    }
    // More lines than there are.
    std::fs::write(place.path("a.nrrd"), header("line skip: 9223372036854775807")).unwrap();
    let error = Reader::new().read_any(place.path("a.nrrd")).unwrap_err();
    assert!(error.to_string().contains("cut off"), "{error}");
}
