//! The report of a run: everything that is needed to judge it and to repeat it, as JSON, as rows and as a page.

pub mod figures;
#[cfg(feature = "html")]
pub mod html;

use crate::gpu::DeviceInfo;
use crate::pipeline::Summary;
use crate::{Error, Options, Result};
use serde::Serialize;

/// What `--report` writes.
#[derive(Debug, Serialize)]
pub struct Report<'a> {
    /// `rtfmesh`.
    pub program: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Input file.
    pub input_file: String,
    /// Output file.
    pub output_file: String,
    /// What reading the input noted.
    pub notes: &'a [String],
    /// Settings of the run.
    pub options: &'a Options,
    /// Device, driver and limits.
    pub device: &'a DeviceInfo,
    /// Topology, measures and timings.
    #[serde(flatten)]
    pub summary: &'a Summary,
}

impl Report<'_> {
    /// The report as indented JSON with a final newline.
    ///
    /// # Errors
    /// [`Error::Internal`] if a value cannot be written as JSON, which no field allows.
    pub fn to_json(&self) -> Result<String> {
        to_json(self)
    }
}

/// Indented JSON with a final newline.
///
/// # Errors
/// [`Error::Internal`] if a value cannot be written as JSON.
pub fn to_json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(value).map(|s| s + "\n").map_err(|e| Error::Internal(e.to_string()))
}
