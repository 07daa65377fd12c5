//! Work without the interpreter's lock, in processes of any origin.

use crate::errors::exception;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use rtfmesh::{Error, ProgressToken};
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// How often Python is asked for signals and told of the progress: often enough for a bar, seldom enough that
/// other threads keep the interpreter's lock.
pub const INTERVAL: Duration = Duration::from_millis(50);

/// The process that has worked here first, to which the global thread pool belongs; 0 for none.
static FIRST: AtomicU32 = AtomicU32::new(0);

/// The process that has worked here last, and its calls that are at work. A forked process finds here what
/// was going on when it was forked.
static LAST: AtomicU32 = AtomicU32::new(0);
static AT_WORK: AtomicUsize = AtomicUsize::new(0);

/// The thread pool of a forked process, with the process. Never freed, since it would wait for its threads in
/// a fork of that one.
static POOL: Mutex<Option<(u32, &'static ThreadPool)>> = Mutex::new(None);

/// A call that is at work.
struct Work {
    process: u32,
    /// Where it works, if not in the global thread pool, whose threads a forked process does not have.
    pool: Option<&'static ThreadPool>,
}

impl Work {
    /// # Errors
    /// `DeviceError` in a process that was forked while another thread was at work, which may have left locks
    /// behind that nobody will ever open.
    fn begin(py: Python<'_>) -> PyResult<Self> {
        Self::new().map_err(|error| exception(py, &error))
    }

    fn new() -> rtfmesh::Result<Self> {
        let process = std::process::id();
        let last = LAST.load(Ordering::SeqCst);
        if last != process && AT_WORK.load(Ordering::SeqCst) > 0 && last != 0 {
            return Err(Error::device(
                "this process was forked while another thread was using rtfmesh",
                "start processes with multiprocessing.get_context(\"spawn\")",
            ));
        }
        LAST.store(process, Ordering::SeqCst);
        AT_WORK.fetch_add(1, Ordering::SeqCst);
        let mut work = Self { process, pool: None };
        let first = FIRST.compare_exchange(0, process, Ordering::SeqCst, Ordering::SeqCst);
        if first.is_err_and(|first| first != process) {
            work.pool = Some(own_pool(process)?);
        }
        Ok(work)
    }

    fn run<T: Send>(&self, job: impl FnOnce() -> T + Send) -> T {
        match self.pool {
            Some(pool) => pool.install(job),
            None => job(),
        }
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        // In a fork from within the call, it stays at work for ever.
        if self.process == std::process::id() {
            AT_WORK.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

/// The thread pool of this process, which was forked.
fn own_pool(process: u32) -> rtfmesh::Result<&'static ThreadPool> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((of, pool)) = *pool
        && of == process
    {
        return Ok(pool);
    }
    let made = ThreadPoolBuilder::new().build().map_err(|error| {
        Error::device(format!("no threads could be started: {error}"), "set RAYON_NUM_THREADS to fewer")
    })?;
    let made: &'static ThreadPool = Box::leak(Box::new(made));
    *pool = Some((process, made));
    Ok(made)
}

/// Does work without the interpreter's lock, so that other threads of Python go on.
///
/// # Errors
/// Those of the work, as exceptions, and `DeviceError` in a process that was forked at a bad moment.
pub fn work<T: Send>(py: Python<'_>, job: impl FnOnce() -> rtfmesh::Result<T> + Send) -> PyResult<T> {
    let at_work = Work::begin(py)?;
    py.detach(|| at_work.run(job)).map_err(|error| exception(py, &error))
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
    let at_work = Work::begin(py)?;
    let token = ProgressToken::default();
    let (sender, receiver) = channel();
    let (token, at_work) = (&token, &at_work);
    let (done, raised) = py.detach(move || {
        std::thread::scope(|scope| {
            // Somebody receives, since this function waits.
            scope.spawn(move || drop(sender.send(at_work.run(|| job(token)))));
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

/// As [`work`], for a job that looks for signals itself while it is on the caller's thread, and stops when
/// the token says so while it is not.
///
/// # Errors
/// As [`watched_work`].
pub fn own_work<T: Send>(
    py: Python<'_>,
    job: impl FnOnce(&ProgressToken) -> rtfmesh::Result<T> + Send,
) -> PyResult<T> {
    let at_work = Work::begin(py)?;
    if at_work.pool.is_some() {
        return watched_work(py, job);
    }
    py.detach(|| job(&ProgressToken::default())).map_err(|error| exception(py, &error))
}
