//! Text for standard output and standard error.

use crate::error::is_control;
use anyhow::Result;
use std::borrow::Cow;
use std::io::Write;

/// Prints to standard error. Where nobody can be told, there is nothing left to do about it.
pub fn tell(text: &str) {
    let _ = std::io::stderr().lock().write_all(plain(text).as_bytes());
}

/// Prints to standard output, with errors instead of panics.
pub fn print(text: &str) -> Result<()> {
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
