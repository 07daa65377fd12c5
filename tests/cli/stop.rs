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
    let mesh = read(place.path("out.ply")).unwrap().mesh;
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
    use rustix::fs::{CWD, Mode, OFlags, mkfifoat, open};
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use std::fs::File;
    use std::io::Read;
    use std::process::{Child, Command, ExitStatus, Stdio};
    use std::sync::{Arc, Mutex};
    use std::thread::JoinHandle;

    /// The program while it runs, with a terminal as its standard error, on which the progress bar shows what
    /// it does.
    struct Running {
        child: Child,
        /// What the terminal has shown so far.
        shown: Arc<Mutex<String>>,
        reader: JoinHandle<()>,
    }

    impl Running {
        fn start(place: &Place, line: &str) -> Self {
            let program = place.program(line);
            let terminal = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
            grantpt(&terminal).unwrap();
            unlockpt(&terminal).unwrap();
            let name = ptsname(&terminal, Vec::new()).unwrap();
            let of_program =
                open(name.as_c_str(), OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())
                    .unwrap();
            let mut command = Command::new(program.get_program());
            command.args(program.get_args()).current_dir(place.path("")).env("TERM", "xterm");
            command.envs(program.get_envs().filter_map(|(name, value)| Some((name, value?))));
            let child = command.stdout(Stdio::null()).stderr(of_program).spawn().unwrap();
            // With it goes the last of the terminal's other ends in this process.
            drop(command);
            let shown = Arc::new(Mutex::new(String::new()));
            let (mut from, to) = (File::from(terminal), Arc::clone(&shown));
            let reader = std::thread::spawn(move || {
                let mut part = [0; 4096];
                // At the end, systems report an error.
                while let Ok(length @ 1..) = from.read(&mut part) {
                    to.lock().unwrap().push_str(&String::from_utf8_lossy(&part[..length]));
                }
            });
            Self { child, shown, reader }
        }

        /// Starts a long run, and waits until it iterates.
        #[track_caller]
        fn long(place: &Place, more: &str) -> Self {
            let mut running = Self::start(place, &format!("{LONG} {more}"));
            running.wait_until(|shown| shown.contains(", iteration "));
            running
        }

        /// Waits until `is_there` is true of what the terminal has shown. A run that ends or goes on for too
        /// long before that fails.
        #[track_caller]
        fn wait_until(&mut self, is_there: impl Fn(&str) -> bool) {
            let begun = Instant::now();
            while !is_there(&self.shown.lock().unwrap()) {
                let ended = self.child.try_wait().unwrap();
                if ended.is_some() || begun.elapsed() > LIMIT {
                    self.child.kill().unwrap();
                    panic!("{ended:?}, and it has shown: {}", self.shown.lock().unwrap());
                }
                std::thread::sleep(Duration::from_millis(5));
            }
        }

        fn signal(&self, name: &str) {
            let line = format!("kill -{name} {}", self.child.id());
            assert!(Command::new("sh").args(["-c", &line]).status().unwrap().success());
        }

        /// Its exit code, and what it has shown; a run that does not end is killed.
        #[track_caller]
        fn ended(mut self) -> (Option<i32>, String) {
            let code = status(&mut self.child).code();
            self.reader.join().unwrap();
            let shown = self.shown.lock().unwrap().clone();
            (code, shown)
        }
    }

    #[track_caller]
    fn status(child: &mut Child) -> ExitStatus {
        let begun = Instant::now();
        loop {
            if let Some(status) = child.try_wait().unwrap() {
                return status;
            }
            if begun.elapsed() > LIMIT {
                child.kill().unwrap();
                panic!("the run goes on");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Checks that the program says this in the end, and no other error.
    #[track_caller]
    fn assert_last(shown: &str, line: &str) {
        assert!(shown.ends_with(&format!("{line}\r\n")), "{shown}");
        assert_eq!(shown.matches("error:").count(), 1, "{shown}");
    }

    #[test]
    fn ctrl_c_ends_the_run_and_leaves_nothing() {
        for name in ["INT", "TERM"] {
            let place = Place::with("torus");
            let running = Running::long(&place, "-n 3000 --report out.json");
            running.signal(name);
            let (code, shown) = running.ended();
            assert_eq!(code, Some(130), "{shown}");
            assert_last(&shown, "error: cancelled; nothing was written");
            assert_eq!(place.files(), ["in.ply"]);
        }
    }

    #[test]
    fn ctrl_c_keeps_the_best_so_far_if_asked_to() {
        let place = Place::with("torus");
        let running = Running::long(&place, "-n 3000 --keep-partial");
        running.signal("INT");
        let (code, shown) = running.ended();
        assert_eq!(code, Some(130), "{shown}");
        assert!(shown.contains("warning: the run was ended early"), "{shown}");
        assert_eq!(place.files(), ["in.ply", "out.ply"]);
        let mesh = read(place.path("out.ply")).unwrap().mesh;
        assert_eq!(mesh.vertices.len(), 3000);
        assert!(topology(&mesh).is_closed_manifold());
    }

    #[test]
    fn a_second_ctrl_c_stops() {
        let place = Place::with("torus");
        let mut running = Running::long(&place, "-n 60000 --keep-partial");
        running.signal("INT");
        running.wait_until(|shown| shown.contains("press Ctrl-C again to stop"));
        running.signal("INT");
        let (code, shown) = running.ended();
        assert_eq!(code, Some(130), "{shown}");
        assert_eq!(place.files(), ["in.ply"]);
    }

    #[test]
    fn ctrl_c_is_heard_while_a_pipe_is_waited_for() {
        for line in [
            "remesh pipe.ply out.ply -n 100 --keep-partial",
            "remesh in.ply out.ply -n 100 --points pipe.ply --keep-partial",
        ] {
            let place = Place::with("torus");
            let path = place.path("pipe.ply");
            mkfifoat(CWD, &path, Mode::RUSR | Mode::WUSR).unwrap();
            // So that nothing but the reader itself ends the program at the first Ctrl-C.
            let mut running = Running::start(&place, line);
            // Only a pipe that somebody reads can be opened for writing at once.
            let writing = OFlags::WRONLY | OFlags::NONBLOCK | OFlags::CLOEXEC;
            let writer = std::cell::OnceCell::new();
            running.wait_until(|_| {
                open(&path, writing, Mode::empty()).is_ok_and(|pipe| writer.set(pipe).is_ok())
            });
            running.signal("INT");
            let (code, shown) = running.ended();
            assert_eq!(code, Some(130), "{shown}");
            assert_last(&shown, "error: cancelled; nothing was written");
            assert!(!place.path("out.ply").exists());
        }
    }

    #[test]
    fn ctrl_c_ends_a_batch_and_keeps_what_is_done() {
        let place = Place::with("torus");
        std::fs::create_dir_all(place.path("more/long")).unwrap();
        std::fs::rename(place.path("in.ply"), place.path("more/long/in.ply")).unwrap();
        std::fs::copy(place.path("more/long/in.ply"), place.path("also.ply")).unwrap();
        let options = "--out out -n 200 --tolerance 0 --resume";
        place.run(&format!("batch also.ply {options} --iterations 5 -q"));
        let mut running = Running::start(&place, &format!("batch more {options} --iterations 1000000"));
        // The folder is made when the work on the mesh begins.
        running.wait_until(|_| place.path("out/long").exists());
        running.signal("INT");
        let (code, shown) = running.ended();
        assert_eq!(code, Some(130), "{shown}");
        assert_eq!(shown, "error: stopped: 0 done, 0 failed, 1 left; --resume continues\r\n");
        let endings = || {
            let log = std::fs::read_to_string(place.path("out/batch.jsonl")).unwrap();
            let status =
                |line: &str| serde_json::from_str::<serde_json::Value>(line).unwrap()["status"].clone();
            log.lines().map(|line| status(line).as_str().unwrap().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(endings(), ["done"]);
        assert_eq!(std::fs::read_dir(place.path("out/long")).unwrap().count(), 0, "nothing half-written");
        place.run(&format!("batch also.ply more {options} --iterations 5 -q"));
        assert_eq!(endings(), ["done", "skipped", "done"]);
        assert_eq!(read(place.path("out/long/in.ply")).unwrap().mesh.vertices.len(), 200);
    }
}
