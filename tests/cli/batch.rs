//! `rtfmesh batch`: many meshes in one run, some of them broken; shards, and runs that go on where one
//! stopped.

use crate::support::place::Place;
use rtfmesh::io::{read, write};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use serde_json::Value;
use std::collections::HashMap;

/// Settings that take little time.
const QUICK: &str = "-n 120 --iterations 2 --quality draft";

/// Samples in the folder `in`, in several formats, and a file that is none.
fn with_meshes() -> Place {
    let place = Place::new();
    std::fs::create_dir(place.path("in")).unwrap();
    for (model, file) in [("sphere", "sphere.obj"), ("torus", "torus.ply.gz"), ("box", "box.stl")] {
        write(place.path("in").join(file), &sample(model).unwrap()).unwrap();
    }
    std::fs::write(place.path("in/broken.off"), "OFF\n4 4 0\n0 0 0\n").unwrap();
    std::fs::write(place.path("in/notes.txt"), "no mesh, and no part of the batch\n").unwrap();
    place
}

/// The program's standard error where it ends with this code.
#[track_caller]
fn ends(place: &Place, arguments: &str, code: i32) -> String {
    let done = place.program(arguments).assert().code(code).stdout("");
    String::from_utf8(done.get_output().stderr.clone()).unwrap()
}

/// The lines of a log.
#[track_caller]
fn entries(place: &Place, name: &str) -> Vec<Value> {
    let text = std::fs::read_to_string(place.path(name)).unwrap();
    assert!(text.is_empty() || text.ends_with('\n'), "{text}");
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Inputs and how they ended, in the order of the log.
fn endings(entries: &[Value]) -> Vec<(&str, &str)> {
    entries.iter().map(|e| (e["input"].as_str().unwrap(), e["status"].as_str().unwrap())).collect()
}

fn names_in(place: &Place, folder: &str) -> Vec<String> {
    let found = std::fs::read_dir(place.path(folder)).unwrap();
    let mut names: Vec<String> = found.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn every_failure_names_its_file() {
    let place = with_meshes();
    // Neither error is about a file.
    for options in ["-n 500000000", "--edge-length 1e-7"] {
        let errors = ends(&place, &format!("batch in --out out {options} --iterations 1"), 1);
        let failed: Vec<&str> = errors.lines().filter(|line| line.contains(" failed: ")).collect();
        assert_eq!(failed.len(), 4, "{errors}");
        for (line, name) in failed.iter().zip(["box.stl", "broken.off", "sphere.obj", "torus.ply.gz"]) {
            assert_eq!(line.matches(&format!("in/{name}")).count(), 1, "{line}");
        }
    }
}

#[test]
fn a_broken_mesh_stops_no_other_and_is_tried_again() {
    let place = with_meshes();
    let batch = format!("batch in --out made/out {QUICK} --distances");
    let errors = ends(&place, &batch, 1);
    let lines: Vec<_> = errors.lines().collect();
    assert_eq!(lines.len(), 5, "a line for each mesh and one at the end: {errors}");
    assert!(lines[0].starts_with("1/4 in/box.stl -> made/out/box.ply: 120 vertices, quality 0."), "{errors}");
    assert!(lines[1].starts_with("2/4 in/broken.off failed: "), "{errors}");
    assert!(lines[4].starts_with("error: 3 done, 1 failed, 0 skipped in "), "{errors}");
    assert_eq!(names_in(&place, "made/out"), ["batch.jsonl", "box.ply", "sphere.ply", "torus.ply"]);
    let log = entries(&place, "made/out/batch.jsonl");
    let first = [
        ("in/box.stl", "done"),
        ("in/broken.off", "failed"),
        ("in/sphere.obj", "done"),
        ("in/torus.ply.gz", "done"),
    ];
    assert_eq!(endings(&log), first);
    for entry in &log {
        assert!(entry["seconds"].as_f64() > Some(0.0), "{entry}");
        let failed = entry["status"] == "failed";
        assert_eq!((entry["error"].is_string(), entry["vertices"].is_null()), (failed, failed), "{entry}");
        // One that cannot be read has none.
        assert_eq!(entry["options"].is_null(), failed, "{entry}");
        if !failed {
            let mesh = read(place.path(entry["output"].as_str().unwrap())).unwrap().mesh;
            assert!(topology(&mesh).is_closed_manifold() && mesh.vertices.len() == 120, "{entry}");
            assert_eq!((&entry["vertices"], &entry["warnings"]), (&120.into(), &serde_json::json!([])));
            let options = &entry["options"];
            assert_eq!((&options["vertices"], &options["iterations"]), (&120.into(), &2.into()), "{entry}");
            assert!(
                entry["mean_quality"].as_f64() > Some(0.7) && entry["min_angle"].as_f64() > Some(1.0),
                "{entry}"
            );
            assert!(entry["rms"].as_f64() <= entry["hausdorff"].as_f64(), "{entry}");
            assert!(entry["hausdorff"].as_f64() > Some(0.0), "{entry}");
        }
    }

    // A batch that was killed leaves half a line at worst.
    let path = place.path("made/out/batch.jsonl");
    let mut text = std::fs::read_to_string(&path).unwrap();
    text.push_str("{\"input\": \"in/sph");
    std::fs::write(&path, &text).unwrap();
    let before = std::fs::metadata(place.path("made/out/box.ply")).unwrap().modified().unwrap();
    let errors = ends(&place, &format!("{batch} --resume -q"), 1);
    assert!(
        errors.starts_with("error: 0 done, 1 failed, 3 skipped in ") && errors.lines().count() == 1,
        "{errors}"
    );
    let after = std::fs::metadata(place.path("made/out/box.ply")).unwrap().modified().unwrap();
    assert_eq!(before, after, "what was done is left alone");
    let text = std::fs::read_to_string(&path).unwrap();
    let again: Vec<Value> = text.lines().skip(5).map(|line| serde_json::from_str(line).unwrap()).collect();
    let second = [
        ("in/box.stl", "skipped"),
        ("in/sphere.obj", "skipped"),
        ("in/torus.ply.gz", "skipped"),
        ("in/broken.off", "failed"),
    ];
    assert_eq!(endings(&again), second);

    // Mended, and one result lost: both are made.
    write(place.path("in/broken.off"), &sample("tetrahedron").unwrap()).unwrap();
    std::fs::remove_file(place.path("made/out/box.ply")).unwrap();
    let errors = ends(&place, &format!("{batch} --resume"), 0);
    assert!(errors.contains("\n2 done, 0 failed, 2 skipped in "), "{errors}");
    assert_eq!(
        names_in(&place, "made/out"),
        ["batch.jsonl", "box.ply", "broken.ply", "sphere.ply", "torus.ply"]
    );
}

/// The rows of a table by the names of their columns.
#[track_caller]
fn rows(place: &Place, name: &str) -> Vec<HashMap<String, String>> {
    let mut table = csv::Reader::from_path(place.path(name)).unwrap();
    table.deserialize().map(|row| row.unwrap()).collect()
}

#[test]
fn a_table_has_a_row_for_each_mesh_however_often_it_was_tried() {
    let place = with_meshes();
    let batch = format!("batch in --out out {QUICK} --distances --table out/table.csv");
    ends(&place, &batch, 1);
    let first = rows(&place, "out/table.csv");
    let (inputs, statuses): (Vec<&str>, Vec<&str>) =
        first.iter().map(|row| (row["input"].as_str(), row["status"].as_str())).unzip();
    assert_eq!(inputs, ["in/box.stl", "in/broken.off", "in/sphere.obj", "in/torus.ply.gz"]);
    assert_eq!(statuses, ["done", "failed", "done", "done"]);
    // Numbers are those of the log, and nothing stands for what there is not.
    let log = entries(&place, "out/batch.jsonl");
    for (row, entry) in first.iter().zip(&log) {
        for name in ["vertices", "mean_quality", "min_angle", "rms", "hausdorff", "seconds"] {
            let value: Option<f64> = entry[name].as_f64();
            assert_eq!(row[name].parse().ok(), value, "{name} of {entry}");
        }
        assert_eq!(row["error"], entry["error"].as_str().unwrap_or_default());
        assert_eq!(row["asked"], entry["asked"].as_str().unwrap());
    }
    assert!(first[1]["error"].contains("broken.off") && first[1]["vertices"].is_empty());
    let notes: Vec<&str> = log[0]["notes"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    assert_eq!(first[0]["notes"], notes.join("; "));
    // What is skipped keeps its figures, and what is mended has new ones.
    write(place.path("in/broken.off"), &sample("box").unwrap()).unwrap();
    ends(&place, &format!("{batch} --resume"), 0);
    let second = rows(&place, "out/table.csv");
    assert_eq!(second.len(), 4);
    assert!(second[1]["status"] == "done" && second[1]["vertices"] == "120" && second[1]["error"].is_empty());
    for k in [0, 2, 3] {
        assert_eq!(second[k], first[k]);
    }
}

#[test]
fn what_was_made_with_other_options_is_made_again() {
    let place = with_meshes();
    let batch = format!("batch in/box.stl in/sphere.obj --out out -q {QUICK}");
    let ended = |options: &str| {
        ends(&place, &format!("{batch} --resume --log log.jsonl {options}"), 0);
        let log = entries(&place, "log.jsonl");
        let last = log.iter().rev().take(2).map(|entry| entry["status"].as_str().unwrap().to_owned());
        last.collect::<Vec<_>>()
    };
    for (options, status) in [("", "done"), ("", "skipped"), ("--seed 7", "done"), ("--seed 7", "skipped")] {
        assert_eq!(ended(options), [status; 2], "{options}");
    }
    // The last time counts, and so do attributes.
    assert_eq!(
        (ended(""), ended("--no-attributes")),
        (vec!["done".to_owned(); 2], vec!["done".to_owned(); 2])
    );
}

#[test]
fn several_at_a_time_give_the_same_results() {
    let place = with_meshes();
    let endings_of = |out: &str, options: &str| {
        let errors = ends(&place, &format!("batch in --out {out} --log {out}.jsonl {QUICK} {options}"), 1);
        assert!(errors.contains("error: 3 done, 1 failed, 0 skipped in "), "{errors}");
        // They are counted as they end.
        let places: Vec<_> = errors.lines().take(4).map(|line| &line[..4]).collect();
        assert_eq!(places, ["1/4 ", "2/4 ", "3/4 ", "4/4 "], "{errors}");
        let log = entries(&place, &format!("{out}.jsonl"));
        let mut endings: Vec<_> =
            endings(&log).into_iter().map(|(input, status)| (input.to_owned(), status.to_owned())).collect();
        endings.sort();
        endings
    };
    assert_eq!(endings_of("three", "--jobs 3"), endings_of("one", ""));
    for name in ["box.ply", "sphere.ply", "torus.ply"] {
        let made = |out: &str| std::fs::read(place.path(&format!("{out}/{name}"))).unwrap();
        assert!(made("three") == made("one"), "{name} differs");
    }
    // Where one worker cannot begin, all end, and nothing hangs.
    let errors = ends(&place, &format!("batch in --out none --device none --jobs 3 {QUICK}"), 4);
    assert!(errors.contains("none"), "{errors}");
}

#[test]
fn results_are_those_of_remesh() {
    let place = with_meshes();
    let options = "--ratio 0.2 --iterations 3 --seed 5 --no-fit";
    // A list has a path on each line, blank ones aside, and may name folders.
    std::fs::write(place.path("list.txt"), "in/sphere.obj\n\n  in/torus.ply.gz\n").unwrap();
    ends(&place, &format!("batch @list.txt --out out --log log.jsonl --format obj.gz -q {options}"), 0);
    assert_eq!(names_in(&place, "out"), ["sphere.obj.gz", "torus.obj.gz"]);
    for (input, name) in [("in/sphere.obj", "sphere.obj.gz"), ("in/torus.ply.gz", "torus.obj.gz")] {
        place.run(&format!("remesh {input} {name} -q {options}"));
        let made = |path: String| std::fs::read(place.path(&path)).unwrap();
        assert!(made(format!("out/{name}")) == made(name.to_owned()), "{name} differs");
    }
    // Without --distances there are none.
    let log = entries(&place, "log.jsonl");
    assert!(log.iter().all(|entry| entry["rms"].is_null() && entry["error"].is_null()), "{log:?}");
}

#[test]
fn shards_together_are_the_whole() {
    let place = Place::new();
    for (model, file) in [("sphere", "c.ply"), ("box", "a.ply"), ("torus", "b.ply")] {
        write(place.path(file), &sample(model).unwrap()).unwrap();
    }
    let batch = format!("batch c.ply a.ply b.ply {QUICK} -q");
    ends(&place, &format!("{batch} --out whole"), 0);
    for share in ["--shard 1/2", "--rank 1 --world-size 2"] {
        ends(&place, &format!("{batch} --out parts {share}"), 0);
    }
    let log = entries(&place, "parts/batch.jsonl");
    assert_eq!(endings(&log), [("a.ply", "done"), ("c.ply", "done"), ("b.ply", "done")]);
    assert_eq!(names_in(&place, "whole"), names_in(&place, "parts"));
    for name in ["a.ply", "b.ply", "c.ply"] {
        let bytes = |folder: &str| std::fs::read(place.path(folder).join(name)).unwrap();
        assert!(bytes("whole") == bytes("parts"), "{name} differs");
    }
    // More jobs than meshes: some have nothing to do.
    let errors = ends(&place, &format!("batch a.ply b.ply {QUICK} --out parts --shard 3/3"), 0);
    assert!(errors.starts_with("0 done, 0 failed, 0 skipped"), "{errors}");
    assert_eq!(entries(&place, "parts/batch.jsonl").len(), 3);
}

#[test]
fn folders_keep_their_structure() {
    let place = Place::new();
    for (folder, file) in
        [("in", "a.ply"), ("in/one", "a.ply"), ("in/one/two", "b.obj"), ("in/out", "old.ply")]
    {
        std::fs::create_dir_all(place.path(folder)).unwrap();
        write(place.path(folder).join(file), &sample("box").unwrap()).unwrap();
    }
    // What an earlier batch wrote is not read.
    ends(&place, &format!("batch in --out in/out {QUICK} -q"), 0);
    let log = entries(&place, "in/out/batch.jsonl");
    assert_eq!(endings(&log), [("in/a.ply", "done"), ("in/one/a.ply", "done"), ("in/one/two/b.obj", "done")]);
    for result in ["a.ply", "one/a.ply", "one/two/b.ply"] {
        assert!(place.path("in/out").join(result).is_file(), "{result}");
    }
    assert_eq!(names_in(&place, "in/out"), ["a.ply", "batch.jsonl", "old.ply", "one"]);
}

#[test]
fn batches_that_cannot_be_are_refused_before_anything_is_written() {
    let place = Place::new();
    for folder in ["in", "other", "empty"] {
        std::fs::create_dir(place.path(folder)).unwrap();
    }
    for file in ["in/a.ply", "in/b.ply", "other/a.obj", "other/c.obj.gz"] {
        write(place.path(file), &sample("box").unwrap()).unwrap();
    }
    std::fs::write(place.path("lines.obj"), "v 0 0 0\nv 1 0 0\nl 1 2\n").unwrap();
    for (arguments, code, words) in [
        ("batch in other --out out", 2, ["in/a.ply and other/a.obj", "out/a.ply"]),
        ("batch in in/b.ply --out out", 2, ["in/b.ply and in/b.ply", "rename"]),
        ("batch in --out in", 2, ["in/a.ply would overwrite an input", "--out"]),
        ("batch empty --out out", 2, ["no mesh", "give mesh files"]),
        ("batch - --out out", 2, ["standard input", "give files or folders"]),
        ("batch in --out out --shard 3/2", 2, ["3/2", "i from 1 to n"]),
        ("batch in --out out --shard 0/2", 2, ["0/2", "i from 1 to n"]),
        ("batch in --out out --shard two", 2, ["two", "2/8"]),
        ("batch in --out out --rank 2 --world-size 2", 2, ["--rank 2", "from 0"]),
        ("batch in --out out --rank 1", 2, ["--world-size", "--help"]),
        ("batch in --out out --log in/a.ply", 2, ["in/a.ply", "--log"]),
        ("batch in --out out --features lines.obj --log lines.obj", 2, ["lines.obj", "--features"]),
        ("batch in --out out -n 3", 2, ["3", "at least 4"]),
        ("batch in --out out --preset rtf --no-fit", 2, ["--no-fit", "preset default"]),
        ("batch in --out out --format gltf", 1, ["glTF", ".glb"]),
        ("batch @none.txt --out out", 3, ["none.txt", "there is no such file"]),
        ("batch in --out in/a.ply", 1, ["in/a.ply", "--out"]),
        ("batch in --out out --table in/a.ply", 2, ["in/a.ply", ".csv"]),
        ("batch in --out out --table t.csv --log t.csv", 2, ["t.csv", "--table"]),
        ("batch in --out out --table none/t.csv", 1, ["none/t.csv", "folder"]),
        ("batch in --out out --log none/log.jsonl", 1, ["none/log.jsonl", "--log"]),
        ("batch in", 2, ["--out", "rtfmesh COMMAND --help"]),
    ] {
        let errors = ends(&place, arguments, code);
        assert!(errors.starts_with("error: ") && errors.lines().count() == 1, "{arguments}: {errors}");
        for word in words {
            assert!(errors.contains(word), "{arguments}: '{word}' is missing in {errors}");
        }
        assert_eq!(names_in(&place, "in"), ["a.ply", "b.ply"], "{arguments}");
        assert!(!place.path("out/a.ply").exists(), "{arguments}");
    }
}
