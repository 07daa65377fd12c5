//! Drivers without a Vulkan loader: a file that is no library, where the system looks first, hides it.

use crate::support::place::Place;
use assert_cmd::Command;
use serde_json::Value;

fn place() -> Place {
    let place = Place::with("sphere");
    std::fs::create_dir(place.path("hidden")).unwrap();
    std::fs::write(place.path("hidden/libvulkan.so.1"), "no library").unwrap();
    place
}

/// The program without a loader, and so without validation.
fn without_loader(place: &Place, arguments: &str) -> Command {
    let mut program = place.program(arguments);
    program.env("LD_LIBRARY_PATH", place.path("hidden")).env("RTFMESH_VALIDATION", "0");
    program
}

/// The one line on standard error of a run that fails for want of a device.
#[track_caller]
fn refusal(program: &mut Command) -> String {
    let done = program.assert().code(4).stdout("");
    let line = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(line.starts_with("error: ") && line.lines().count() == 1 && line.contains("; "), "{line}");
    assert!(line.contains("no Vulkan loader") && line.contains("libvulkan.so.1"), "{line}");
    line
}

#[test]
fn a_driver_opened_without_a_loader_gives_the_same_bytes() {
    let place = place();
    let device = std::env::var("RTFMESH_DEVICE").unwrap_or_else(|_| "cpu".to_owned());
    let line = |out: &str| format!("remesh in.ply {out} -n 1000 --device {device}");
    place.program(&line("with.ply")).assert().success();
    without_loader(&place, &line("without.ply")).assert().success();
    assert!(place.bytes("with.ply") == place.bytes("without.ply"));
    let names = |mut program: Command| -> Vec<String> {
        let done = program.assert().success();
        let list: Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
        let mut names: Vec<String> =
            list.as_array().unwrap().iter().map(|device| device["uuid"].to_string()).collect();
        names.sort();
        names
    };
    let all = names(place.program("devices --json"));
    assert_eq!(names(without_loader(&place, "devices --json")), all);
}

#[test]
fn without_a_loader_there_is_no_validation() {
    let place = place();
    let mut program = without_loader(&place, "remesh in.ply out.ply -n 100");
    let line = refusal(program.env("RTFMESH_VALIDATION", "1"));
    assert!(line.contains("which validation needs") && line.contains("vulkan-validationlayers"), "{line}");
}

#[test]
fn drivers_that_do_not_open_are_told_with_the_reason() {
    let place = place();
    std::fs::write(place.path("text.json"), "no JSON").unwrap();
    std::fs::write(place.path("lib.json"), r#"{"ICD": {"library_path": "./hidden/libvulkan.so.1"}}"#)
        .unwrap();
    std::fs::write(place.path("c.json"), r#"{"ICD": {"library_path": "libc.so.6"}}"#).unwrap();
    let manifests = std::env::join_paths(["none.json", "text.json", "lib.json", "c.json"]).unwrap();
    let mut program = without_loader(&place, "remesh in.ply out.ply -n 100");
    let line = refusal(program.env("VK_DRIVER_FILES", manifests));
    for part in ["none.json: ", "text.json: ", "hidden/libvulkan.so.1: ", "libc.so.6: ", "; install one"] {
        assert!(line.contains(part), "'{part}' is missing in: {line}");
    }
    let empty = place.path("nothing");
    std::fs::create_dir(&empty).unwrap();
    let mut program = without_loader(&place, "devices");
    let line = refusal(program.env("VK_DRIVER_FILES", &empty));
    assert!(line.contains("no manifest names a driver; install one"), "{line}");
}
