//! Text for standard output and standard error.

use crate::error::is_control;
use anyhow::Result;
use rtfmesh::Error;
use std::borrow::Cow;
use std::io::Write;

/// Prints to standard error. Where nobody can be told, there is nothing left to do about it.
pub fn tell(text: &str) {
    let _ = std::io::stderr().lock().write_all(plain(text).as_bytes());
}

/// Prints to standard output, with errors instead of panics.
///
/// # Errors
/// [`Error::Usage`] if standard output is closed, or what it says.
pub fn print(text: &str) -> Result<()> {
    check_standard_output()?;
    let mut out = std::io::stdout().lock();
    out.write_all(plain(text).as_bytes())?;
    Ok(out.flush()?)
}

/// The text with control characters escaped but for line ends and tabs: names in files may be anything, and a
/// terminal would obey them.
fn plain(text: &str) -> Cow<'_, str> {
    let acts = |c: char| is_control(c) && c != '\n' && c != '\t';
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let one = |c: char| if acts(c) { c.escape_debug().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(one).collect())
}

/// Refuses a standard output that takes nothing.
///
/// # Errors
/// [`Error::Usage`].
pub fn check_standard_output() -> rtfmesh::Result<()> {
    if !is_lost(&std::io::stdout()) {
        return Ok(());
    }
    let problem = "standard output is closed, or /dev/null for reading and writing";
    Err(Error::usage(problem, "redirect standard output to a file or a pipe"))
}

/// Whether nothing that is written gets anywhere. Rust puts `/dev/null`, open for reading and writing, in
/// place of a closed standard output; what a shell redirects to `/dev/null` is open for writing alone.
#[cfg(unix)]
fn is_lost(out: &std::io::Stdout) -> bool {
    use rustix::fs::{OFlags, fcntl_getfl, fstat, stat};
    let both = fcntl_getfl(out).is_ok_and(|flags| flags & OFlags::ACCMODE == OFlags::RDWR);
    let devices = (fstat(out).map(|file| file.st_rdev), stat("/dev/null").map(|null| null.st_rdev));
    both && matches!(devices, (Ok(out), Ok(null)) if out == null && null != 0)
}

#[cfg(not(unix))]
fn is_lost(_: &std::io::Stdout) -> bool {
    false
}
