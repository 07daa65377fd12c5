//! What a user meets first, and where something went wrong: `demo`, `bug-report`, `licences`.

use crate::support::place::Place;
use serde_json::Value;
use tiny_skia::Pixmap;

#[test]
fn the_demo_draws_a_model_before_and_after() {
    let place = Place::new();
    let (told, errors) = place.run("demo");
    assert_eq!(errors, "");
    assert!(told.contains("exactly 2000 vertices") && told.contains("rtfmesh-demo.png"), "{told}");
    let row = told.lines().find_map(|line| line.trim().strip_prefix("mean quality")).unwrap();
    let values: Vec<f64> = row.split_whitespace().map(|value| value.parse().unwrap()).collect();
    assert!(values[0] < 0.7 && values[1] > 0.94, "{told}");
    assert_eq!(place.files(), ["rtfmesh-demo.png"]);
    let picture = Pixmap::load_png(place.path("rtfmesh-demo.png")).unwrap();
    let (width, pixels) = (picture.width() as usize, picture.pixels());
    let drawn = |side: usize| {
        let of_row = |row: &[tiny_skia::PremultipliedColorU8]| {
            row[side * width / 2..(side + 1) * width / 2].iter().filter(|p| p.red() < 250).count()
        };
        pixels.chunks(width).map(of_row).sum::<usize>()
    };
    assert!(drawn(0) > 10_000 && drawn(1) > 10_000, "{} {}", drawn(0), drawn(1));
}

#[test]
fn the_demo_refuses_what_is_no_picture() {
    let place = Place::with("box");
    place.program("demo in.ply").assert().code(2).stdout("");
    place.program("demo none/a.png").assert().code(1).stdout("");
    place.program("demo a.png --device none-such").assert().code(4).stdout("");
    assert_eq!(place.files(), ["in.ply"]);
}

#[test]
fn a_bug_report_has_what_developers_ask_for() {
    let place = Place::new();
    let (text, errors) = place.run("bug-report measure secret.ply --against /home/ada/in.obj --json");
    assert_eq!(errors, "");
    let values = |name: &str| -> Vec<&str> {
        let of_row = |line| str::strip_prefix(line, name).filter(|rest| rest.starts_with("  "));
        text.lines().map(str::trim_start).filter_map(of_row).map(str::trim).collect()
    };
    assert_eq!(values("rtfmesh"), [env!("CARGO_PKG_VERSION")], "{text}");
    assert_eq!(values("command"), ["measure FILE.ply --against FILE.obj --json"]);
    assert!(values("target")[0].contains(std::env::consts::OS), "{text}");
    assert!(values("environment").contains(&"RTFMESH_CACHE_DIR=PATH"), "{text}");
    assert!(values("limits").iter().all(|limits| limits.contains("MiB per buffer")), "{text}");
    let devices = values("device");
    assert!(!devices.is_empty() && devices.iter().all(|device| device.contains("Vulkan 1.")), "{text}");
    let test = values("self-test");
    assert!(test.len() == 1 && test[0].starts_with("genus3 with 2000 vertices on "), "{text}");
    assert!(test[0].contains("mean quality 0.9") && !test[0].contains("failed"), "{text}");
    let folders = [place.path(""), place.cache.path().to_owned()];
    assert!(folders.iter().all(|folder| !text.contains(folder.to_str().unwrap())), "{text}");
    assert!(!text.contains("secret") && !text.contains("uuid"), "{text}");
    assert_eq!(place.files(), [] as [&str; 0]);
}

#[test]
fn a_bug_report_is_for_programs_too_and_lists_what_fails() {
    let place = Place::new();
    let json = |arguments: &str| -> Value { serde_json::from_str(&place.run(arguments).0).unwrap() };
    let report = json("bug-report --json --no-self-test");
    assert_eq!((&report["program"], &report["self_test"]), (&"rtfmesh".into(), &Value::Null));
    assert_eq!(report["command"], Value::Null);
    assert!(report["devices"][0]["limits"]["subgroup_size"].as_u64().is_some(), "{report:#}");
    // What fails is told, and is no failure of the report.
    let report = json("bug-report --json --device none-such");
    assert!(report["self_test"]["error"].as_str().unwrap().contains("none-such"), "{report:#}");
}

#[test]
fn the_licences_of_what_the_program_contains_are_in_it() {
    let place = Place::new();
    let (text, errors) = place.run("licences");
    assert_eq!(errors, "");
    assert!(
        text.starts_with(&format!(
            "rtfmesh {} is licensed under MIT OR Apache-2.0",
            env!("CARGO_PKG_VERSION")
        ))
    );
    for part in ["\nash 0.", "\nclap 4.", "\nthree.js 0.", "\nwindows-sys 0.", "Mozilla Public License"] {
        assert!(text.contains(part), "'{part}' is missing");
    }
    assert!(!text.contains("\nshaderc "), "the compiler of kernels is not in the program");
    assert_eq!(place.run("licenses").0, text);
}
