//! Runs of the program stopped by a signal or a time limit.

use crate::support::place::Place;
use predicates::prelude::*;
use rtfmesh::io::read;
use rtfmesh::mesh::topology::topology;
use std::time::{Duration, Instant};

/// Iterates for longer than anybody waits.
const LONG: &str = "remesh in.ply out.ply --iterations 1000000 --tolerance 0";
/// Longer than any run takes that was told to stop, on any machine.
const LIMIT: Duration = Duration::from_secs(120);

#[test]
fn a_time_limit_ends_a_long_run_with_a_valid_mesh() {
    let place = Place::with("torus");
    let begun = Instant::now();
    let (_, told) = place.run(&format!("{LONG} -n 3000 --time-limit 1 --report out.json"));
    assert!(begun.elapsed() < LIMIT);
    assert!(told.contains("warning: the time limit of 1 s ended the run early"), "{told}");
    let report = std::fs::read_to_string(place.path("out.json")).unwrap();
    assert!(report.contains("the time limit of 1 s") && report.contains("\"finished_early\": true"));
    let mesh = read(&place.path("out.ply")).unwrap().mesh;
    assert_eq!(mesh.vertices.len(), 3000);
    assert!(topology(&mesh).is_closed_manifold());
}

#[test]
fn a_time_limit_that_is_not_reached_changes_nothing() {
    let place = Place::with("torus");
    let line = "remesh in.ply out.ply -n 300 --iterations 5 -q";
    place.run(line);
    let whole = std::fs::read(place.path("out.ply")).unwrap();
    assert_eq!(place.run(&format!("{line} --time-limit 100000 --keep-partial")).1, "");
    assert_eq!(std::fs::read(place.path("out.ply")).unwrap(), whole);
    for wrong in ["0", "-1", "soon", "nan", "inf"] {
        let done = place.program(&format!("{line} --time-limit={wrong}")).assert().code(2);
        done.stderr(predicate::str::contains("a number of seconds above 0"));
    }
}

#[cfg(unix)]
mod signals {
    use super::*;
    use std::process::{Child, Command, Stdio};

    /// Starts a long run and lets it get going.
    fn start(place: &Place, more: &str) -> Child {
        going(place, &place.program(&format!("{LONG} {more}")))
    }

    fn going(place: &Place, program: &assert_cmd::Command) -> Child {
        let mut command = Command::new(program.get_program());
        command.args(program.get_args()).current_dir(place.path(""));
        command.envs(program.get_envs().filter_map(|(name, value)| Some((name, value?))));
        let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_secs(4));
        child
    }

    fn signal(child: &Child, name: &str) {
        let id = child.id().to_string();
        assert!(Command::new("sh").args(["-c", &format!("kill -{name} {id}")]).status().unwrap().success());
    }

    /// Its exit code and standard error; a run that does not end is killed.
    #[track_caller]
    fn ended(mut child: Child) -> (Option<i32>, String) {
        let begun = Instant::now();
        while child.try_wait().unwrap().is_none() {
            if begun.elapsed() > LIMIT {
                child.kill().unwrap();
                panic!("the run goes on");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let output = child.wait_with_output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    }

    #[test]
    fn ctrl_c_ends_the_run_and_leaves_nothing() {
        for name in ["INT", "TERM"] {
            let place = Place::with("torus");
            let child = start(&place, "-n 3000 --report out.json");
            signal(&child, name);
            assert_eq!(ended(child), (Some(130), "error: cancelled; nothing was written\n".to_owned()));
            assert_eq!(place.files(), ["in.ply"]);
        }
    }

    #[test]
    fn ctrl_c_keeps_the_best_so_far_if_asked_to() {
        let place = Place::with("torus");
        let child = start(&place, "-n 3000 --keep-partial -q");
        signal(&child, "INT");
        let (code, told) = ended(child);
        assert_eq!(code, Some(130), "{told}");
        assert!(told.contains("warning: the run was ended early"), "{told}");
        assert_eq!(place.files(), ["in.ply", "out.ply"]);
        let mesh = read(&place.path("out.ply")).unwrap().mesh;
        assert_eq!(mesh.vertices.len(), 3000);
        assert!(topology(&mesh).is_closed_manifold());
    }

    #[test]
    fn a_second_ctrl_c_stops() {
        let place = Place::with("torus");
        let child = start(&place, "-n 60000 --keep-partial");
        signal(&child, "INT");
        std::thread::sleep(Duration::from_millis(50));
        signal(&child, "INT");
        let (code, told) = ended(child);
        assert_eq!(code, Some(130), "{told}");
        assert_eq!(place.files(), ["in.ply"]);
    }

    #[test]
    fn ctrl_c_ends_a_batch_and_keeps_what_is_done() {
        let place = Place::with("torus");
        std::fs::copy(place.path("in.ply"), place.path("also.ply")).unwrap();
        let options = "--out out -n 200 --tolerance 0 --resume";
        place.run(&format!("batch also.ply {options} --iterations 5 -q"));
        let long = place.program(&format!("batch in.ply {options} --iterations 1000000"));
        let child = going(&place, &long);
        signal(&child, "INT");
        let begun = Instant::now();
        let (code, told) = ended(child);
        assert!(begun.elapsed() < Duration::from_secs(5));
        assert_eq!(code, Some(130), "{told}");
        assert_eq!(told, "error: stopped: 0 done, 0 failed, 1 left; --resume continues\n");
        assert!(!place.path("out/in.ply").exists());
        let endings = || {
            let log = std::fs::read_to_string(place.path("out/batch.jsonl")).unwrap();
            let status =
                |line: &str| serde_json::from_str::<serde_json::Value>(line).unwrap()["status"].clone();
            log.lines().map(|line| status(line).as_str().unwrap().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(endings(), ["done"]);
        assert_eq!(std::fs::read_dir(place.path("out")).unwrap().count(), 2, "nothing half-written");
        place.run(&format!("batch also.ply in.ply {options} --iterations 5 -q"));
        assert_eq!(endings(), ["done", "skipped", "done"]);
        assert_eq!(read(&place.path("out/in.ply")).unwrap().mesh.vertices.len(), 200);
    }
}
