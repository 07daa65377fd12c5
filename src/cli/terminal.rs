//! Text for standard output and standard error.

use anyhow::Result;
use std::io::Write;

/// Prints to standard error. Where nobody can be told, there is nothing left to do about it.
pub fn tell(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Prints to standard output, with errors instead of panics.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}
