//! The library's one error type: only what a caller cannot foresee, each with a remedy.

use std::error::Error as StdError;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The library's errors, by who can fix them. [`source`](StdError::source) is the underlying error of the
/// system, a parser or Vulkan, if there is one; the message already contains its text.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Options that are out of range or exclude each other.
    #[error("{problem}; {remedy}")]
    #[non_exhaustive]
    Usage {
        /// What is wrong, with the value that was given.
        problem: String,
        /// What to do about it.
        remedy: String,
        /// The field of [`crate::Options`] or of its groups that is wrong, if it is one. Texts have names of
        /// fields between backticks.
        field: Option<&'static str>,
    },
    /// A mesh that cannot be read or used.
    #[error("{}{problem}; {remedy}", location(.path.as_deref(), .place.as_deref()))]
    #[non_exhaustive]
    Input {
        /// The file, where the mesh came from one.
        path: Option<PathBuf>,
        /// Line, byte, vertex or face of the problem.
        place: Option<String>,
        /// What is wrong there.
        problem: String,
        /// What to do about it.
        remedy: String,
        /// What caused it.
        source: Option<Cause>,
    },
    /// A result that cannot be written.
    #[error("{}: {problem}; {remedy}", shown(.path))]
    #[non_exhaustive]
    Output {
        /// The target file.
        path: PathBuf,
        /// What the system said.
        problem: String,
        /// What to do about it.
        remedy: String,
        /// What caused it.
        source: Option<Cause>,
    },
    /// No usable Vulkan device, or a failed call to it.
    #[error("{problem}; {remedy}")]
    #[non_exhaustive]
    Device {
        /// What is missing or failed, with the buffer's or kernel's name.
        problem: String,
        /// What to do about it.
        remedy: String,
        /// What caused it.
        source: Option<Cause>,
    },
    /// The device or the host has too little memory.
    #[error("{what} needs {bytes} bytes, {problem}; {remedy}")]
    #[non_exhaustive]
    OutOfMemory {
        /// Name of the buffer that did not fit.
        what: String,
        /// Its size in bytes.
        bytes: u64,
        /// The limit that it passes.
        problem: String,
        /// What to do about it.
        remedy: String,
        /// What caused it.
        source: Option<Cause>,
    },
    /// The device stopped answering in the middle of the work.
    #[error(
        "the device was lost while running {0}; nothing was written: update its driver, or use `device` cpu"
    )]
    DeviceLost(String),
    /// The callback stopped the run; the device remains usable.
    #[error("cancelled; nothing was written")]
    Cancelled,
    /// A broken guarantee of the library; always a bug in rtfmesh.
    #[error("internal error: {0}; please report it with the input and the output of `rtfmesh bug-report`")]
    Internal(String),
}

/// The error that caused another one. Two are equal if their messages are.
#[derive(Debug, Clone)]
pub struct Cause(Arc<dyn StdError + Send + Sync>);

impl Deref for Cause {
    type Target = dyn StdError + Send + Sync;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}

impl PartialEq for Cause {
    fn eq(&self, other: &Self) -> bool {
        self.0.to_string() == other.0.to_string()
    }
}

/// The library's result type.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An [`Error::Input`] without a file; [`Error::in_file`] adds the file.
    pub fn input(place: Option<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Input { path: None, place, problem: problem.into(), remedy: remedy.into(), source: None }
    }

    /// An [`Error::Usage`] without a field.
    pub fn usage(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Usage { problem: problem.into(), remedy: remedy.into(), field: None }
    }

    /// An [`Error::Usage`] about a field of the options.
    pub fn option(field: &'static str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Usage { problem: problem.into(), remedy: remedy.into(), field: Some(field) }
    }

    /// An [`Error::Output`].
    pub fn output(path: impl AsRef<Path>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Output {
            path: path.as_ref().to_owned(),
            problem: problem.into(),
            remedy: remedy.into(),
            source: None,
        }
    }

    /// An [`Error::Device`].
    pub fn device(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Device { problem: problem.into(), remedy: remedy.into(), source: None }
    }

    /// Adds the cause; has no effect on kinds without a cause.
    #[must_use]
    pub fn caused_by(mut self, cause: impl StdError + Send + Sync + 'static) -> Self {
        if let Self::Input { source, .. }
        | Self::Output { source, .. }
        | Self::Device { source, .. }
        | Self::OutOfMemory { source, .. } = &mut self
        {
            *source = Some(Cause(Arc::new(cause)));
        }
        self
    }

    /// Sets the file of an [`Error::Input`] that has none yet.
    #[must_use]
    pub fn in_file(mut self, file: impl AsRef<Path>) -> Self {
        if let Self::Input { path: path @ None, .. } = &mut self {
            *path = Some(file.as_ref().to_owned());
        }
        self
    }
}

fn location(path: Option<&Path>, place: Option<&str>) -> String {
    match (path, place) {
        (Some(path), Some(place)) => format!("{}: {place}: ", shown(path)),
        (Some(path), None) => format!("{}: ", shown(path)),
        (None, Some(place)) => format!("{place}: "),
        (None, None) => String::new(),
    }
}

/// A path as messages show it.
pub(crate) fn shown(path: &Path) -> String {
    escaped(&path.to_string_lossy())
}

/// Text on one line that a terminal shows and does not obey: control characters, and those that change the
/// order of others, are escaped as in Rust.
pub(crate) fn escaped(text: &str) -> String {
    let one = |c: char| if is_control(c) { c.escape_debug().to_string() } else { c.to_string() };
    if text.chars().any(is_control) { text.chars().map(one).collect() } else { text.to_owned() }
}

/// Whether a character acts on a terminal, or on the order of the characters around it.
pub(crate) fn is_control(c: char) -> bool {
    let orders = ['\u{61c}', '\u{200e}', '\u{200f}'];
    c.is_control() || orders.contains(&c) || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_shown_and_other_letters_stay() {
        let path = Path::new("a\u{1b}[31m\nb\u{202e}\u{9b}ä 本.ply");
        assert_eq!(shown(path), "a\\u{1b}[31m\\nb\\u{202e}\\u{9b}ä 本.ply");
        let error = Error::output(path, "it is full", "empty it").to_string();
        assert!(!error.contains(is_control), "{error}");
        assert!(!Error::input(None, "a", "b").in_file(path).to_string().contains(is_control));
    }
    use std::io;

    #[test]
    fn causes_keep_their_type() {
        let cause = io::Error::from(io::ErrorKind::StorageFull);
        let error = Error::output(Path::new("a.ply"), "the disk is full", "free some space").caused_by(cause);
        let source = error.source().and_then(|source| source.downcast_ref::<io::Error>());
        assert_eq!(source.map(io::Error::kind), Some(io::ErrorKind::StorageFull));
        assert_eq!(error.to_string(), "a.ply: the disk is full; free some space");
        assert!(Error::usage("nothing", "something").source().is_none());
    }
}
