//! The library's errors as exceptions, and long work without the interpreter's lock.

use pyo3::prelude::*;
use pyo3::types::PyString;
use rtfmesh::{Error, ProgressToken};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How often Python is asked for signals and told of the progress: often enough for a bar, seldom enough that
/// other threads keep the interpreter's lock.
pub const INTERVAL: Duration = Duration::from_millis(50);

/// The process that has worked here first; 0 for none.
static WORKED_IN: AtomicU32 = AtomicU32::new(0);

/// The exception for an error: which class and with which words, `rtfmesh._errors` knows.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let (kind, field) = match error {
        Error::Usage { field, .. } => ("usage", *field),
        Error::Input { .. } => ("input", None),
        Error::Output { .. } => ("output", None),
        Error::Device { .. } | Error::DeviceLost(_) => ("device", None),
        Error::OutOfMemory { .. } => ("memory", None),
        Error::Cancelled => ("cancelled", None),
        _ => ("internal", None),
    };
    let made = py
        .import("rtfmesh._errors")
        .and_then(|errors| errors.call_method1("exception", (kind, field, error.to_string())));
    made.map_or_else(|failed| failed, PyErr::from_value)
}

/// Does work without the interpreter's lock, so that other threads of Python go on.
///
/// # Errors
/// Those of the work, as exceptions; also in a forked process, where the threads that the parent worked with
/// do not exist and nothing would ever be done.
pub fn work<T: Send>(py: Python<'_>, job: impl FnOnce() -> rtfmesh::Result<T> + Send) -> PyResult<T> {
    refuse_forks(py)?;
    py.detach(job).map_err(|error| exception(py, &error))
}

/// As [`work`], for jobs that take long: on another thread, so that this one can look for signals such as
/// Ctrl-C, which Python delivers to its main thread alone.
///
/// # Errors
/// As [`work`]; also what a signal's handler raises.
pub fn watched_work<T: Send>(
    py: Python<'_>,
    job: impl FnOnce(&ProgressToken) -> rtfmesh::Result<T> + Send,
) -> PyResult<T> {
    refuse_forks(py)?;
    let token = ProgressToken::default();
    let (sender, receiver) = channel();
    let (done, raised) = py.detach(move || {
        std::thread::scope(|scope| {
            let token = &token;
            // Somebody receives, since this function waits.
            scope.spawn(move || drop(sender.send(job(token))));
            let mut raised = None;
            loop {
                match receiver.recv_timeout(INTERVAL) {
                    Err(RecvTimeoutError::Timeout) => {
                        if let Err(error) = Python::attach(|py| py.check_signals()) {
                            raised = Some(error);
                            token.cancel();
                        }
                    }
                    // The scope passes a panic of the job on.
                    done => return (done.ok(), raised),
                }
            }
        })
    });
    match (done, raised) {
        (_, Some(raised)) => Err(raised),
        (Some(done), None) => done.map_err(|error| exception(py, &error)),
        (None, None) => Err(exception(py, &Error::Internal("work ended without a result".to_owned()))),
    }
}

/// See [`work`].
pub fn refuse_forks(py: Python<'_>) -> PyResult<()> {
    let own = std::process::id();
    match WORKED_IN.compare_exchange(0, own, Ordering::SeqCst, Ordering::SeqCst) {
        Err(first) if first != own => {
            let problem = "this process was forked from one that has used rtfmesh";
            let remedy = "start workers with multiprocessing.get_context(\"spawn\")";
            Err(exception(py, &Error::device(problem, remedy)))
        }
        _ => Ok(()),
    }
}

/// A word that has one of these values.
///
/// # Errors
/// `InputError` that names the argument and the values.
pub fn one_of<T: Copy>(word: &Bound<'_, PyString>, argument: &str, values: &[(&str, T)]) -> PyResult<T> {
    let text = word.to_cow()?;
    if let Some((_, value)) = values.iter().find(|(name, _)| *name == text) {
        return Ok(*value);
    }
    let names: Vec<&str> = values.iter().map(|(name, _)| *name).collect();
    let error =
        Error::usage(format!("`{argument}` '{text}' is unknown"), format!("use {}", names.join(", ")));
    Err(exception(word.py(), &error))
}
