//! Files with odd names, modes and kinds, as inputs and outputs of the program.

use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;

use predicates::prelude::*;

use crate::support::place::Place;

const QUICK: &str = "-n 100 --iterations 2 --quality draft";

/// A name that would colour a terminal, begin a line of its own and turn the rest around.
const NAME: &str = "a\u{1b}[31m\nerror\u{202e}\u{9b}.ply";

fn is_control(c: char) -> bool {
    (c.is_control() && c != '\n') || c == '\u{202e}'
}

fn mode(place: &Place, name: &str) -> u32 {
    std::fs::metadata(place.path(name)).unwrap().permissions().mode() & 0o777
}

fn set_mode(place: &Place, name: &str, mode: u32) {
    std::fs::set_permissions(place.path(name), std::fs::Permissions::from_mode(mode)).unwrap();
}

#[test]
fn control_characters_in_names_do_not_reach_the_terminal() {
    let place = Place::new();
    let told = |line: &str, code: i32| {
        let done = place.program(line).arg(NAME).assert().code(code);
        let output = done.get_output();
        let text = String::from_utf8([output.stdout.clone(), output.stderr.clone()].concat()).unwrap();
        assert!(!text.contains(is_control), "{text:?}");
        text
    };
    let missing = told("inspect", 3);
    assert!(missing.starts_with("error: a\\u{1b}[31m\\nerror\\u{202e}\\u{9b}.ply: there is no such file"));
    assert_eq!(missing.lines().count(), 1, "{missing}");
    // With a note, in a batch, with a wrong option, and with an output.
    std::fs::write(place.path(NAME), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").unwrap();
    assert!(told(&format!("remesh --dry-run {QUICK}"), 0).contains("note: a\\u{1b}"));
    told("measure --json", 0);
    told(&format!("batch --out out {QUICK}"), 0);
    told("inspect --nothing=", 2);
    // Names in the file: of a keyword, and of a property.
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl \u{1b}c\nk\u{1b}]0;x 1\nf 1 2 3\n";
    std::fs::write(place.path(NAME), obj).unwrap();
    told("inspect", 0);
    told("inspect --json", 0);
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float \u{9b}31m\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n";
    std::fs::write(place.path(NAME), ply).unwrap();
    told("inspect", 0);
    told("inspect --json", 0);
}

#[test]
fn a_table_has_no_formulas() {
    let place = Place::with("box");
    std::fs::rename(place.path("in.ply"), place.path("=1+2.ply")).unwrap();
    std::fs::write(place.path("@broken.off"), "OFF").unwrap();
    let line = format!("batch =1+2.ply ./@broken.off --out out --table out/table.csv {QUICK}");
    place.program(&line).assert().code(1);
    let mut table = csv::Reader::from_path(place.path("out/table.csv")).unwrap();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let cells: Vec<&str> = rows.iter().flat_map(|row| row.iter()).collect();
    assert!(cells.contains(&"'=1+2.ply") && cells.contains(&"./@broken.off"), "{cells:?}");
    assert!(!cells.iter().any(|cell| cell.starts_with(['=', '+', '-', '@'])), "{cells:?}");
}

#[test]
fn what_is_replaced_keeps_its_mode() {
    let place = Place::with("box");
    set_mode(&place, "in.ply", 0o600);
    place.run(&format!("remesh in.ply in.ply {QUICK}"));
    assert_eq!(mode(&place, "in.ply"), 0o600);
    for name in ["out.ply", "report.json"] {
        std::fs::write(place.path(name), "").unwrap();
    }
    set_mode(&place, "out.ply", 0o640);
    set_mode(&place, "report.json", 0o666);
    place.run(&format!("remesh in.ply out.ply --report report.json {QUICK}"));
    assert_eq!([mode(&place, "out.ply"), mode(&place, "report.json")], [0o640, 0o666]);
    // A new file has the mode of any other new file.
    std::fs::write(place.path("usual"), "").unwrap();
    place.run(&format!("remesh in.ply new.ply {QUICK}"));
    assert_eq!(mode(&place, "new.ply"), mode(&place, "usual"));
}

#[test]
fn a_link_to_nothing_is_no_output() {
    let place = Place::with("box");
    symlink("nowhere.ply", place.path("out.ply")).unwrap();
    let told = predicate::str::contains("link to a file that does not exist");
    place.program(&format!("remesh in.ply out.ply {QUICK}")).assert().code(1).stderr(told);
    assert_eq!(place.files(), ["in.ply", "out.ply"]);
    assert!(std::fs::symlink_metadata(place.path("out.ply")).unwrap().is_symlink());
}

#[test]
fn a_closed_standard_output_is_an_error_and_a_closed_pipe_is_none() {
    let place = Place::with("box");
    let program = assert_cmd::cargo::cargo_bin!("rtfmesh");
    let shell = |line: String| {
        let mut command = std::process::Command::new("sh");
        command.args(["-c", &line]).current_dir(place.path("."));
        command.env("RTFMESH_CACHE_DIR", place.cache.path()).output().unwrap()
    };
    let run = format!("\"{}\" remesh in.ply - --format off {QUICK}", program.display());
    let others =
        ["inspect in.ply", "measure in.ply --json", "presets", "sample", "--help", "--version", "man"];
    let others = others.map(|words| format!("\"{}\" {words}", program.display()));
    for line in others.iter().chain([&run]) {
        let closed = shell(format!("{line} >&-"));
        let told = String::from_utf8(closed.stderr).unwrap();
        assert!(
            closed.status.code() == Some(2) && told.contains("standard output is closed"),
            "{line}: {told}"
        );
        if Path::new("/dev/full").exists() {
            let full = shell(format!("{line} >/dev/full"));
            let told = String::from_utf8(full.stderr).unwrap();
            assert!(full.status.code() == Some(1) && told.starts_with("error: "), "{line}: {told}");
        }
    }
    assert_eq!(shell(format!("{run} >/dev/null")).status.code(), Some(0));
    let headed = shell(format!("{{ {run} -q; echo $? >code; }} | head -n 0"));
    assert_eq!(String::from_utf8(headed.stderr).unwrap(), "");
    assert_eq!(place.bytes("code"), b"0\n");
}

#[test]
fn the_log_of_a_batch_is_no_device() {
    let place = Place::with("box");
    for log in ["/dev/zero", "/dev/null", "."] {
        let told = predicate::str::contains("this is not a regular file");
        place.program(&format!("batch in.ply --out out --log {log} {QUICK}")).assert().code(1).stderr(told);
    }
    assert_eq!(std::fs::read_dir(place.path("out")).unwrap().count(), 0);
}

#[test]
fn a_resumed_batch_makes_what_has_changed_again() {
    let place = Place::with("box");
    let batch = format!("batch in.ply --out out --resume {QUICK}");
    let done = |words: &str| {
        let (_, told) = place.run(&batch);
        assert!(told.contains(words), "{told}");
    };
    done("1 done, 0 failed, 0 skipped");
    done("0 done, 0 failed, 1 skipped");
    let whole = place.bytes("out/in.ply");
    std::fs::write(place.path("out/in.ply"), &whole[..whole.len() / 2]).unwrap();
    done("1 done, 0 failed, 0 skipped");
    assert_eq!(place.bytes("out/in.ply"), whole);
    let mut input = place.bytes("in.ply");
    input.push(b' ');
    std::fs::write(place.path("in.ply"), input).unwrap();
    done("1 done, 0 failed, 0 skipped");
    done("0 done, 0 failed, 1 skipped");
}

#[test]
fn what_only_attributes_decide_is_told_before_a_surface_is_made() {
    let place = Place::new();
    // No surface can be made of these points.
    std::fs::write(place.path("two.xyz"), "0 0 0\n1 0 0\n").unwrap();
    let line = "remesh two.xyz out.ply -n 100 --sizing property:none";
    place.program(line).assert().code(3).stderr(predicate::str::contains("none"));
}
