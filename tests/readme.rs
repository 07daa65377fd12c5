//! The recipes of README.md, run as they stand there, save that they make smaller meshes.

use crate::cli::Place;
use rtfmesh::mesh::io::{read, write};
use rtfmesh::mesh::samples::sample;
use std::path::Path;

/// Commands of the section: the lines of its shell blocks, and pipes within its sentences.
fn commands(readme: &str) -> Vec<String> {
    let section = readme.split("\n## ").find(|part| part.starts_with("Recipes\n")).unwrap();
    let mut found = Vec::new();
    // Between fences, every second part is a block.
    for (place, part) in section.split("```").enumerate() {
        if place % 2 == 1 {
            found.extend(part.strip_prefix("sh\n").unwrap().lines().map(str::to_owned));
        } else {
            let spans = part.split('`').skip(1).step_by(2);
            found
                .extend(spans.filter(|span| span.contains("| rtfmesh ")).map(|span| span.replace('\n', " ")));
        }
    }
    found
}

/// The same command for a mesh that takes little time.
fn smaller(command: &str) -> String {
    let mut counts = false;
    let word = |word: &str| {
        let smaller = if counts { "200" } else { word };
        counts = word == "-n";
        if word == "1%" { "10%".to_owned() } else { smaller.to_owned() }
    };
    command.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// A folder with everything that the recipes name.
fn kitchen() -> Place {
    let place = Place::new();
    let (scan, part) = (sample("bumpy-sphere").unwrap(), sample("box").unwrap());
    std::fs::create_dir(place.path("scans")).unwrap();
    for name in ["scan.ply", "scan.ply.gz", "scans/one.ply", "scans/two.ply"] {
        write(&place.path(name), &scan).unwrap();
    }
    write(&place.path("part.ply"), &part).unwrap();
    let [a, b, _] = part.corners(0).map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
    std::fs::write(place.path("lines.obj"), format!("{a}{b}l 1 2\n")).unwrap();
    place
}

#[test]
fn every_recipe_works() {
    let readme = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    let commands = commands(&readme);
    assert!(commands.len() >= 9, "recipes are missing: {commands:?}");
    let place = kitchen();
    let program = assert_cmd::cargo::cargo_bin!("rtfmesh");
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
    for command in commands {
        let mut shell = assert_cmd::Command::new("bash");
        shell.current_dir(place.path("")).env("PATH", &path).env("RTFMESH_CACHE_DIR", place.path("cache"));
        let done = shell.args(["-c", &format!("set -o pipefail; {}", smaller(&command))]).ok();
        assert!(done.is_ok(), "{command}: {done:?}");
    }
    for (name, fewest) in [("scan-10k.ply", 200), ("even.ply", 200), ("out.glb", 50)] {
        assert!(read(&place.path(name)).unwrap().mesh.vertices.len() >= fewest, "{name}");
    }
}
