//! The library's one error type: only what a caller cannot foresee, each with a remedy.

use std::path::{Path, PathBuf};

/// What can go wrong, by who can mend it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Options that are out of range or do not go together.
    #[error("{problem}; {remedy}")]
    Usage {
        /// What is wrong, with the value that was given.
        problem: String,
        /// What to do about it.
        remedy: String,
        /// The field of [`crate::Options`] or of its groups that is wrong, if it is one. Texts have names of fields
        /// between backticks.
        field: Option<&'static str>,
    },
    /// A mesh that cannot be read or used.
    #[error("{}{problem}; {remedy}", location(.path.as_deref(), .place.as_deref()))]
    Input {
        /// The file, where the mesh came from one.
        path: Option<PathBuf>,
        /// Line, byte, vertex or face of the problem.
        place: Option<String>,
        /// What is wrong there.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// A result that cannot be written.
    #[error("{}: {problem}; {remedy}", .path.display())]
    Output {
        /// The target file.
        path: PathBuf,
        /// What the system said.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// No usable Vulkan device, or a call to it that failed.
    #[error("{problem}; {remedy}")]
    Device {
        /// What is missing or failed, with the buffer's or kernel's name.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// The device or the host has too little memory.
    #[error("{what} needs {bytes} bytes, {problem}; {remedy}")]
    OutOfMemory {
        /// Name of the buffer that did not fit.
        what: String,
        /// Its size in bytes.
        bytes: u64,
        /// The limit that it passes.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// The device stopped answering in the middle of the work.
    #[error(
        "the device was lost while running {0}; nothing was written: update its driver, or use `device` cpu"
    )]
    DeviceLost(String),
    /// The run was stopped by its callback; the device can be used further.
    #[error("cancelled; nothing was written")]
    Cancelled,
    /// A result that breaks the library's own promise; always a bug in rtfmesh.
    #[error("internal error: {0}; please report it with the command and the input")]
    Internal(String),
}

/// The library's result type.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A mesh problem without a file; [`Error::in_file`] adds the file.
    pub fn input(place: Option<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Input { path: None, place, problem: problem.into(), remedy: remedy.into() }
    }

    /// A request that cannot be met.
    pub fn usage(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Usage { problem: problem.into(), remedy: remedy.into(), field: None }
    }

    /// A field of the options that cannot be as it is.
    pub fn option(field: &'static str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Usage { problem: problem.into(), remedy: remedy.into(), field: Some(field) }
    }

    /// A device problem.
    pub fn device(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Device { problem: problem.into(), remedy: remedy.into() }
    }

    /// Names the file of an [`Error::Input`] that has none yet.
    #[must_use]
    pub fn in_file(mut self, file: &Path) -> Self {
        if let Self::Input { path: path @ None, .. } = &mut self {
            *path = Some(file.to_owned());
        }
        self
    }
}

fn location(path: Option<&Path>, place: Option<&str>) -> String {
    match (path, place) {
        (Some(path), Some(place)) => format!("{}: {place}: ", path.display()),
        (Some(path), None) => format!("{}: ", path.display()),
        (None, Some(place)) => format!("{place}: "),
        (None, None) => String::new(),
    }
}
