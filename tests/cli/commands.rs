//! The commands of the program when all goes well: what each prints and writes.

use crate::support::place::Place;
use assert_cmd::Command;
use predicates::prelude::*;
use rtfmesh::io::{read, write};
use rtfmesh::mesh::samples::{names, sample};
use rtfmesh::mesh::topology::topology;
use serde_json::Value;
use std::path::{Path, PathBuf};

fn vertices_of(path: &Path) -> usize {
    read(path).unwrap().mesh.vertices.len()
}

#[test]
fn sample_lists_and_writes_every_model() {
    let place = Place::new();
    let (list, errors) = place.run("sample");
    assert_eq!(errors, "");
    assert_eq!(list.lines().count(), names().len());
    for (name, what) in names() {
        assert!(list.lines().any(|l| l.starts_with(name) && l.ends_with(what)), "{name} is missing: {list}");
        assert_eq!(place.run(&format!("sample {name} {name}.obj")), (String::new(), String::new()));
        let written = topology(&read(place.path(&format!("{name}.obj"))).unwrap().mesh);
        assert_eq!(written, topology(&sample(name).unwrap()), "{name}");
    }
}

#[test]
fn remesh_writes_the_mesh_and_tells_about_it_on_standard_error() {
    let place = Place::with("sphere");
    let (output, table) = place.run("remesh in.ply out.obj -n 120 --iterations 3");
    assert_eq!(output, "", "standard output is for data");
    let starts =
        |table: &str| table.lines().map(|l| l.split("  ").next().unwrap().trim().to_owned()).collect();
    let rows: Vec<String> = starts(&table);
    assert_eq!(rows, ["vertices, triangles", "smallest angle", "mean quality", "time"], "{table}");
    assert!(table.contains("120, 236"), "{table}");
    let (_, table) = place.run("remesh in.ply out.obj -n 120 --iterations 3 --report r.json");
    assert!(table.lines().count() == 5 && table.contains("deviation from the input"), "{table}");
    let (output, table) = place.run("remesh in.ply out.obj -n 120 --iterations 3 -v");
    assert_eq!(output, "", "standard output is for data");
    for row in ["vertices, faces", "120, 236", "quality: minimum, mean", "wall time", "peak device memory"] {
        assert!(table.contains(row), "'{row}' is missing: {table}");
    }
    std::fs::remove_file(place.path("r.json")).unwrap();
    assert_eq!(place.files(), ["in.ply", "out.obj"]);
    assert_eq!(vertices_of(&place.path("out.obj")), 120);
    // And back, over the file that is read.
    let (_, told) = place.run("remesh out.obj ./out.obj -n 100 --iterations 2");
    assert!(told.starts_with("note: ./out.obj will be replaced by the result\n"), "{told}");
    assert_eq!(vertices_of(&place.path("out.obj")), 100);
    let quiet = place.run("remesh out.obj out.obj -n 80 --iterations 2 --quiet");
    assert_eq!(quiet, (String::new(), String::new()));
    assert_eq!(vertices_of(&place.path("out.obj")), 80);
    assert_eq!(place.run("remesh out.obj back.PLY -n 90 --iterations 2 -q"), (String::new(), String::new()));
    assert_eq!(vertices_of(&place.path("back.PLY")), 90);
    assert_eq!(place.files(), ["back.PLY", "in.ply", "out.obj"]);
}

/// A number in the report.
#[track_caller]
#[test]
fn the_command_may_be_left_out_before_the_name_of_a_mesh() {
    let place = Place::with("sphere");
    place.run("in.ply out.obj -n 120 --iterations 3");
    place.run("remesh in.ply again.obj -n 120 --iterations 3");
    assert_eq!(place.bytes("out.obj"), place.bytes("again.obj"));
    // A file of a command's name is none, and neither is a mistyped command.
    std::fs::rename(place.path("in.ply"), place.path("measure")).unwrap();
    assert!(place.run("measure measure").0.contains("genus"));
    let mistyped = place.program("remsh out.obj x.obj").assert().code(2);
    mistyped.stderr(predicate::str::contains("unrecognized subcommand 'remsh'"));
    let elsewhere = place.program("asset out.obj x.glb").assert().code(2);
    elsewhere.stderr(predicate::str::starts_with("error: asset is a command of the Python package"));
}

fn number(report: &Value, pointer: &str) -> f64 {
    let value = report.pointer(pointer).and_then(Value::as_f64);
    value.unwrap_or_else(|| panic!("no number at {pointer}: {report:#}"))
}

#[test]
fn the_report_says_what_was_asked_and_what_came_out() {
    let place = Place::with("torus");
    let options =
        "--iterations 10 --seed 7 --centroid area --k-normal 12 --k-clip 24 --k-project 8 --tolerance 0.002";
    place.run(&format!("remesh in.ply out.ply -n 200 --preset rtf {options} --report r.json -q"));
    let r = place.json("r.json");
    assert_eq!((&r["program"], &r["version"]), (&"rtfmesh".into(), &env!("CARGO_PKG_VERSION").into()));
    assert_eq!((&r["input_file"], &r["output_file"]), (&"in.ply".into(), &"out.ply".into()));
    let asked = serde_json::json!({
        "method": "all-at-once", "vertices": 200, "iterations": 10, "tolerance": 0.002, "seed": 7,
        "weld": 0.0, "min_component": 0.0, "smooth_boundary": 0.0, "fill_holes": null,
        "smooth_spikes": false, "outer": false,
        "shortage": "best-effort",
        "measures": "full", "accuracy": 0.01, "format": "ply",
        "faces": null,
        "correspondence": {"vertices": false, "faces": false},
        "cells": false,
        "all_at_once": {
            "face": "tangent", "normals": "fit", "projection": "nearest-vertices", "seeding": "random",
            "neighbours": "brute", "k_normal": 12, "k_clip": 24, "k_project": 8, "centroid": "area",
            "momentum": 0.0, "lbfgs": 0, "offset": 0.5,
        },
    });
    assert_eq!(r["options"], asked);
    assert!(r["device"]["name"].is_string() && r["device"]["driver"].is_string(), "{:#}", r["device"]);
    assert!(number(&r, "/device/limits/storage_buffer_bytes") >= f64::from(1 << 27));
    for (of, vertices, faces) in [("/input", 1728.0, 3456.0), ("/output/topology", 200.0, 400.0)] {
        let want = [vertices, faces, 1.0, 0.0, 1.0];
        let got =
            ["vertices", "faces", "components", "euler", "genus"].map(|f| number(&r, &format!("{of}/{f}")));
        assert_eq!(got, want, "{of}");
    }
    assert!((0.5..=1.0).contains(&number(&r, "/output/quality/mean_quality")));
    assert!((0.0..=60.0).contains(&number(&r, "/output/quality/min_angle")));
    assert!((0.0..10.0).contains(&number(&r, "/output/distances/hausdorff")));
    assert_eq!(r["steps"].as_array().map(Vec::len), Some(10));
    assert_eq!(number(&r, "/iterations"), 10.0);
    // So few vertices lie on the surface, not around it.
    let warnings = r["warnings"].as_array().unwrap();
    assert!(warnings.len() == 1 && warnings[0].as_str().unwrap().contains("% smaller than the input's"));
    assert_eq!(r["warning_codes"], serde_json::json!(["volume"]));
    assert_eq!(r["notes"], serde_json::json!([]));
}

#[test]
fn hausdorff_distances_are_as_close_as_asked_for() {
    let place = Place::with("torus");
    let gap = |distances: &Value| {
        let [lower, upper] = ["/hausdorff_lower", "/hausdorff"].map(|end| number(distances, end));
        assert!(lower > 0.01 && lower <= upper, "{lower} {upper}");
        upper / lower - 1.0
    };
    place.run("remesh in.ply out.ply -n 150 --report r.json --accuracy 0.0001 -q");
    assert!(gap(&place.json("r.json")["output"]["distances"]) < 1.5e-4);
    let measured = |accuracy: &str| -> Value {
        let text = place.run(&format!("measure out.ply --against in.ply --json {accuracy}")).0;
        serde_json::from_str::<Value>(&text).unwrap()["distances"].clone()
    };
    assert!(gap(&measured("--accuracy 0.0001")) < 1.5e-4);
    assert!((1.5e-4..0.02).contains(&gap(&measured(""))));
}

#[test]
fn the_report_tells_where_time_and_memory_went() {
    let place = Place::with("torus");
    place.run("remesh in.ply out.ply -n 100 --preset rtf --iterations 3 --report r.json -q");
    let r = place.json("r.json");
    let kernels = r["timings"]["stages"].as_array().unwrap();
    for (name, calls) in
        [("step.step", 3), ("face.cell", 4), ("centroid.weighted_corners", 3), ("neighbours.knn", 7)]
    {
        let kernel = kernels.iter().find(|k| k["name"] == name).unwrap_or_else(|| panic!("no {name}"));
        assert_eq!(kernel["calls"], calls, "{name}");
        // A device without timestamps says null.
        assert!(kernel["milliseconds"].is_null() || kernel["milliseconds"].as_f64() > Some(0.0), "{kernel}");
    }
    // Kernels are timed for reports alone.
    let (_, table) =
        place.run("remesh in.ply out.ply -n 1000 --preset rtf --iterations 3 --report r.json -v");
    assert!(table.contains("device time") && table.contains("face.cell"), "{table}");
    let (_, table) = place.run("remesh in.ply out.ply -n 1000 --preset rtf --iterations 3 -v");
    assert!(
        table.contains("wall time")
            && table.contains("waiting for the device")
            && !table.contains("device time"),
        "{table}"
    );
    let phases = r["timings"]["phases"].as_array().unwrap();
    let names: Vec<_> = phases.iter().filter_map(|p| p["name"].as_str()).collect();
    assert_eq!(names, ["prepare", "seed", "compile", "iterate", "connect", "check", "connect", "measure"]);
    let sum: f64 = phases.iter().filter_map(|p| p["milliseconds"].as_f64()).sum();
    assert!((number(&r, "/timings/wall_milliseconds") - sum).abs() < 1e-6 * sum);
    // Kernels run, so the host waits, but not all the time.
    let waiting: f64 = phases.iter().filter_map(|p| p["waiting_milliseconds"].as_f64()).sum();
    assert!(waiting > 0.0 && waiting < sum);
    assert!((number(&r, "/timings/waiting_milliseconds") - waiting).abs() < 1e-6 * waiting);
    for phase in phases {
        assert!(phase["waiting_milliseconds"].as_f64() <= phase["milliseconds"].as_f64(), "{phase}");
    }
    // At least the sites and the lists of their neighbours.
    assert!(number(&r, "/timings/peak_device_bytes") > 100.0 * (16.0 + 4.0 * 32.0));
}

#[test]
fn reruns_write_the_same_bytes_and_seeds_differ() {
    let place = Place::with("torus");
    for (preset, other) in
        [("default", "--quality draft --no-fit"), ("rtf", "--centroid area"), ("rvd", "--lbfgs 7")]
    {
        for (name, more) in [("a.ply", ""), ("b.ply", ""), ("c.ply", "--seed 2"), ("d.ply", other)] {
            place.run(&format!("remesh in.ply {name} -n 100 --preset {preset} --iterations 4 -q {more}"));
        }
        assert_eq!(place.bytes("a.ply"), place.bytes("b.ply"), "{preset}");
        assert_ne!(place.bytes("a.ply"), place.bytes("c.ply"), "{preset}");
        assert_ne!(place.bytes("a.ply"), place.bytes("d.ply"), "{preset}");
    }
}

#[test]
fn size_and_place_do_not_matter() {
    for (scale, shift) in [(1e30, 0.0), (1e-30, 0.0), (1.0, 1e7)] {
        let place = Place::new();
        let mut mesh = sample("sphere").unwrap();
        mesh.vertices.iter_mut().for_each(|v| *v = *v * scale + glam::DVec3::splat(shift));
        write(place.path("in.obj"), &mesh).unwrap();
        let (out, said) =
            place.run("remesh in.obj out.obj -n 150 --iterations 4 --preset rtf --centroid area -q");
        assert_eq!((out.as_str(), said.lines().count()), ("", 1), "{said}");
        assert!(said.contains("% smaller than the input's"), "{said}");
        let got = read(place.path("out.obj")).unwrap().mesh;
        let size = |mesh: &rtfmesh::TriMesh| mesh.bounds().map(|[low, high]| (high - low) / scale).unwrap();
        assert!(size(&got).distance(size(&mesh)) < 0.2, "{scale} {shift}: {} of {}", size(&got), size(&mesh));
    }
}

#[test]
fn warnings_remain_when_quiet_and_notes_do_not() {
    let place = Place::new();
    write(place.path("open.ply"), &sample("open-hemisphere").unwrap()).unwrap();
    let (output, errors) = place.run("remesh open.ply out.ply -n 60 --iterations 2 --preset rtf -q");
    assert_eq!(output, "");
    assert!(
        errors.lines().all(|l| l.starts_with("warning: ")) && errors.contains("not a closed"),
        "{errors}"
    );
    // A tetrahedron with a line element, which is left out.
    let faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nl 1 2\n";
    std::fs::write(place.path("note.obj"), format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{faces}")).unwrap();
    let (_, loud) = place.run("remesh note.obj out.ply -n 60 --iterations 2");
    let (_, quiet) = place.run("remesh note.obj out.ply -n 60 --iterations 2 -q");
    assert!(loud.starts_with("note: note.obj: ") && !quiet.contains("note"), "{loud}\n{quiet}");
}

/// The file of the only device that was used, with this extension.
#[track_caller]
fn kept_file(place: &Place, extension: &str) -> PathBuf {
    let files = std::fs::read_dir(place.cache.path()).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|end| end == extension)).collect();
    assert_eq!(found.len(), 1, "{found:?}");
    found.remove(0)
}

#[test]
fn the_cache_of_compiled_kernels_is_kept() {
    let place = Place::with("torus");
    place.run("remesh in.ply out.ply -n 60 --iterations 1 -q");
    let kept = kept_file(&place, "pipelines");
    // The same again is not written again.
    let written = || std::fs::metadata(&kept).unwrap().modified().unwrap();
    let first = written();
    place.run("remesh in.ply out.ply -n 60 --iterations 1 -q");
    assert_eq!(written(), first);
    // A damaged one is no fault.
    std::fs::write(&kept, b"damaged").unwrap();
    place.run("remesh in.ply out.ply -n 60 --iterations 1 -q");
}

#[test]
fn measure_speaks_to_people_and_programs() {
    let place = Place::with("torus");
    write(place.path("even.obj"), &sample("sphere").unwrap()).unwrap();
    let (text, errors) = place.run("measure in.ply");
    assert_eq!(errors, "");
    assert!(text.contains("1728, 3456") && !text.contains("Hausdorff"), "{text}");
    assert!(text.lines().all(|l| l == l.trim_end()), "blanks at line ends: {text}");
    let (text, _) = place.run("measure even.obj --against in.ply");
    assert!(text.contains("Hausdorff") && text.contains("RMS"), "{text}");
    let alone: Value = serde_json::from_str(&place.run("measure in.ply --json").0).unwrap();
    assert_eq!((&alone["vertices"], &alone["distances"]), (&1728.into(), &Value::Null));
    let against: Value =
        serde_json::from_str(&place.run("measure in.ply --json --against in.ply").0).unwrap();
    assert!(number(&against, "/distances/hausdorff") < 1e-9, "a mesh lies on itself");
    assert_eq!(number(&against, "/topology/genus"), 1.0);
    assert_eq!(place.files(), ["even.obj", "in.ply"]);
}

#[test]
fn features_are_measured_both_ways() {
    let place = Place::with("box");
    let mut bevelled = sample("box").unwrap();
    let corner = bevelled.vertices.iter().copied().reduce(glam::DVec3::max).unwrap();
    bevelled.vertices.iter_mut().filter(|p| **p == corner).for_each(|p| *p -= 0.1);
    write(place.path("other.obj"), &bevelled).unwrap();
    let (text, errors) = place.run("measure other.obj --against in.ply --features");
    assert!(errors.is_empty() && text.contains("features: maximum distance to, from"), "{text}{errors}");
    let found = |arguments: &str| -> Value {
        serde_json::from_str(&place.run(&format!("measure other.obj --against in.ply --json {arguments}")).0)
            .unwrap()
    };
    assert_eq!(found("")["features"], Value::Null);
    let both = found("--features");
    // The corner is as far from the box's sides as it moved along two axes; its former place as far as the
    // moved corner.
    let diagonal = 3f64.sqrt();
    let to = number(&both, "/features/to_reference/largest");
    assert!((to - 100.0 * 0.1 * 2f64.sqrt() / diagonal).abs() < 1e-3, "{both}");
    assert!(number(&both, "/features/from_reference/largest") > to, "{both}");
    // Nothing is that sharp.
    assert_eq!(number(&found("--features --feature-angle 170"), "/features/length"), 0.0);
}

#[test]
fn devices_are_listed_with_what_matters() {
    let place = Place::new();
    let (text, errors) = place.run("devices");
    assert_eq!(errors, "");
    let (json, _) = place.run("devices --json");
    let list: Value = serde_json::from_str(&json).unwrap();
    let first = &list[0];
    assert!(text.contains(first["name"].as_str().unwrap()) && text.contains("yes"), "{text}");
    assert!(number(first, "/limits/shared_memory_bytes") >= f64::from(16 << 10));
    assert_eq!((&first["index"], &first["self_test"]), (&0.into(), &"passed".into()));
}

#[test]
fn the_self_test_runs_once_for_each_driver_and_a_device_that_fails_is_left_out() {
    let place = Place::with("sphere");
    let run = |arguments: &str| place.program(&format!("{arguments} --device 0"));
    run("remesh in.ply out.ply -n 300 -q").assert().success().stderr("");
    let (bytes, path) = (place.bytes("out.ply"), kept_file(&place, "selftest"));
    let kept = std::fs::read_to_string(&path).unwrap();
    assert!(kept.contains("passed"), "{kept}");
    // It is not run again.
    let text = kept.replace("\"passed\"", "{\"failed\":\"wrong results of kernel selftest.none\"}");
    std::fs::write(&path, &text).unwrap();
    let (table, _) = place.run("devices");
    assert!(table.contains("only by name") && table.contains("selftest.none"), "{table}");
    let (report, _) = place.run("bug-report --no-self-test");
    assert!(report.contains("0: self-test failed: wrong results of kernel selftest.none"), "{report}");
    let done = run("remesh in.ply out.ply -n 300 -q").assert().success();
    let errors = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    let warnings: Vec<&str> = errors.lines().filter(|line| line.starts_with("warning: ")).collect();
    assert!(warnings.len() == 1 && warnings[0].contains("selftest.none") && place.bytes("out.ply") == bytes);
    let list: Value = serde_json::from_str(&place.run("devices --json").0).unwrap();
    if list.as_array().unwrap().len() == 1 {
        let mut program = place.program("remesh in.ply out.ply -n 300 -q");
        let refused = program.env("RTFMESH_DEVICE", "").assert().code(4).stdout("");
        let line = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
        let remedy = "or use it in spite of that as --device 0";
        assert!(line.contains("fails the self-test") && line.contains(remedy), "{line}");
    }
    // On request, it is, and that is not kept.
    let mut program = run("remesh in.ply out.ply -n 300 -q");
    program.env("RTFMESH_SELF_TEST", "1").assert().success().stderr("");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    // Nor is it taken for another driver's, or read from a damaged file.
    let (start, end) = kept.split_once("\"identity\":\"").unwrap();
    for other in [format!("{start}\"identity\":\"x{end}"), text[..text.len() - 1].to_owned(), String::new()] {
        std::fs::write(&path, &other).unwrap();
        run("remesh in.ply out.ply -n 300 -q").assert().success().stderr("");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), kept, "{other}");
    }
}

#[test]
fn every_command_has_help_with_an_example_or_a_list() {
    let place = Place::new();
    for (command, wanted) in [
        ("--help", "Exit codes: 0 done"),
        ("remesh --help", "Examples:\n  rtfmesh remesh"),
        ("measure --help", "Examples:\n  rtfmesh measure"),
        ("sample --help", "Examples:\n  rtfmesh sample"),
        ("devices --help", "--json"),
        ("help remesh", "--gradation"),
    ] {
        let help = place.program(command).assert().success().stderr("");
        help.stdout(predicate::str::contains(wanted).and(predicate::str::contains("Usage: rtfmesh")));
    }
    place
        .program("--version")
        .assert()
        .success()
        .stderr("")
        .stdout(format!("rtfmesh {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn a_reader_that_stops_early_is_no_fault() {
    let place = Place::new();
    let program = assert_cmd::cargo::cargo_bin!("rtfmesh");
    let script = format!("set -o pipefail; '{}' sample | true", program.display());
    for _ in 0..3 {
        let mut shell = Command::new("bash");
        shell.current_dir(place.folder.path()).args(["-c", &script]).assert().success().stderr("");
    }
}
