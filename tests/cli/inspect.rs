//! `rtfmesh inspect`.

use crate::support::place::Place;
use rtfmesh::io::write;
use rtfmesh::mesh::samples::sample;
use serde_json::Value;

fn json(place: &Place, arguments: &str) -> Value {
    let (output, errors) = place.run(&format!("inspect {arguments} --json"));
    assert_eq!(errors, "");
    serde_json::from_str(&output).unwrap()
}

#[track_caller]
fn refused(place: &Place, arguments: &str, code: i32, words: &[&str]) {
    let before = place.files();
    let done = place.program(arguments).assert().code(code).stdout("");
    let line = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(line.starts_with("error: ") && line.lines().count() == 1 && line.contains("; "), "{line}");
    for word in words {
        assert!(line.contains(word), "'{word}' is missing in: {line}");
    }
    assert_eq!(place.files(), before, "{arguments}");
}

#[test]
fn a_box_is_six_sides_and_twelve_edges() {
    let place = Place::with("box");
    let (text, errors) = place.run("inspect in.ply");
    assert_eq!(errors, "");
    for row in ["patches, corners", "6, 8", "sharp        12 (0 loops), 12 edges, length 12.0", "Euler"] {
        assert!(text.contains(row), "'{row}' is missing: {text}");
    }
    assert!(text.lines().all(|l| l == l.trim_end()), "{text}");
    let found = json(&place, "in.ply -n 500");
    assert_eq!((&found["patches"], &found["corners"]), (&6.into(), &8.into()));
    assert_eq!((&found["topology"]["euler"], &found["area"]), (&2.into(), &6.0.into()));
    assert_eq!(found["curves"][0]["kind"], "sharp");
    let blunt = json(&place, "in.ply --feature-angle 180");
    assert_eq!((&blunt["patches"], &blunt["curves"]), (&1.into(), &serde_json::json!([])));
}

#[test]
fn the_curves_are_written_and_read_back_as_features() {
    let place = Place::with("box");
    let first = json(&place, "in.ply --curves s.obj");
    let text = std::fs::read_to_string(place.path("s.obj")).unwrap();
    let lines = |start: &str| text.lines().filter(|l| l.starts_with(start)).count();
    assert_eq!((lines("v "), lines("l "), lines("p "), lines("g ")), (8, 12, 8, 2), "{text}");
    let again = json(&place, "in.ply --feature-angle 180 --features s.obj");
    assert_eq!((&again["patches"], &again["corners"]), (&first["patches"], &first["corners"]));
    assert_eq!((&again["curves"][0]["kind"], &again["curves"][0]["curves"]), (&"user".into(), &12.into()));
    assert_eq!(place.files(), ["in.ply", "s.obj"]);
    // A loop is closed in the file.
    write(place.path("open.ply"), &sample("open-hemisphere").unwrap()).unwrap();
    place.run("inspect open.ply --curves s.obj");
    let text = std::fs::read_to_string(place.path("s.obj")).unwrap();
    let rim: Vec<&str> = text.lines().find(|l| l.starts_with("l ")).unwrap().split(' ').collect();
    assert_eq!((rim.len(), rim[1]), (66, rim[65]), "{text}");
}

#[test]
fn what_was_cleaned_is_said() {
    let place = Place::new();
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nf 1 2 3\nf 4 3 2\nl 1 2\n";
    std::fs::write(place.path("in.obj"), faces).unwrap();
    let (text, _) = place.run("inspect in.obj");
    assert!(text.contains("welded, unused vertices") && text.contains("ignored"), "{text}");
    let found = json(&place, "in.obj");
    assert_eq!(found["repairs"]["duplicate_vertices_welded"], 1);
    assert_eq!((&found["topology"]["faces"], &found["corners"]), (&1.into(), &3.into()));
}

#[test]
fn features_that_fit_no_edge_are_refused() {
    let place = Place::with("box");
    let bad = |content: &str, words: &[&str]| {
        std::fs::write(place.path("f.obj"), content).unwrap();
        let words: Vec<&str> = words.iter().copied().chain(["f.obj"]).collect();
        refused(&place, "inspect in.ply --features f.obj --curves s.obj", 3, &words);
    };
    bad("v 0 0 0\nv 0 0 1\n", &["no line elements"]);
    bad("v 0 0 0\nv 0 0 0.5\n\nl 1 2\n", &["line 4", "no vertex", "0.5"]);
    bad("v 0 0 0\nv 1 1 1\nl -2 -1\n", &["line 3", "no edge", "(1, 1, 1)"]);
    bad("v 0 0 0\nl 1 2\n", &["line 2", "no vertex 2"]);
    bad("v 0 0 0\nl 1\n", &["line 2", "at least 2"]);
    bad("v 0 0 0\nl 1 x\n", &["line 2", "'x'"]);
    bad("v 0 0\nl 1 1\n", &["line 1", "three finite"]);
}

#[test]
fn mistakes_in_the_arguments() {
    let place = Place::with("box");
    refused(&place, "inspect none.ply", 3, &["none.ply", "no such file"]);
    refused(&place, "inspect in.ply --features none.obj", 3, &["none.obj", "no such file"]);
    refused(&place, "inspect in.ply --feature-angle 0", 2, &["feature angle 0"]);
    refused(&place, "inspect in.ply -n 0", 2, &["-n must be at least 1"]);
    refused(&place, "inspect in.ply --curves in.ply", 2, &["overwrite"]);
    refused(&place, "inspect in.ply --curves none/s.obj", 1, &["no folder"]);
}
