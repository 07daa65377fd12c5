//! The report of a run: everything needed to judge and to repeat it, as JSON, as rows of text and as a page.

pub mod figures;
#[cfg(feature = "html")]
pub mod html;

use crate::error::is_control;
use crate::gpu::DeviceInfo;
use crate::{Error, Method, Options, Result};
use serde::{Serialize, Serializer};
use serde_json::Value;

pub use crate::gpu::StageTime;
pub use crate::pipeline::{
    DeviationSummary, ExactSummary, FeatureSummary, MetricQuality, PhaseTime, RunTimings, ShorterEdges,
    SmallAngleSummary, Summary,
};
pub use crate::sites::connect::ConnectCounts;
pub use crate::sites::poisson::DiskSummary;
pub use crate::stages::flags::FlagCounts;

/// A report of a run.
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
    /// Notes about the input.
    pub notes: &'a [String],
    /// Settings of the run, as [`Settings`].
    #[serde(serialize_with = "settings")]
    pub options: &'a Options,
    /// Device, driver and limits.
    pub device: &'a DeviceInfo,
    /// Topology, measures and timings.
    #[serde(flatten)]
    pub summary: &'a Summary,
}

/// Settings of a run as reports show them: only those of the chosen method, and only the lengths of long
/// lists.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Settings(Value);

impl Settings {
    /// The settings in `options`.
    pub fn of(options: &Options) -> Self {
        let mut all = serde_json::to_value(options).unwrap_or_default();
        if let Some(groups) = all.as_object_mut() {
            groups.remove(match options.method {
                Method::CoarseToFine => "all_at_once",
                Method::AllAtOnce => "coarse_to_fine",
            });
        }
        for list in ["fixed_half_edges", "label_borders", "sizing/given", "features/lines"] {
            if let Some(list) = all.pointer_mut(&format!("/coarse_to_fine/{list}"))
                && let Some(count) = list.as_array().map(Vec::len)
            {
                *list = count.into();
            }
        }
        Self(all)
    }
}

fn settings<S: Serializer>(options: &&Options, serializer: S) -> std::result::Result<S::Ok, S::Error> {
    Settings::of(options).serialize(serializer)
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
    let text = serde_json::to_string_pretty(value).map_err(|e| Error::Internal(e.to_string()))?;
    // JSON is shown by terminals, too. Such characters are only in texts, where they may be escaped.
    let one = |c: char| match c {
        '\n' => c.to_string(),
        c if is_control(c) => format!("\\u{:04x}", u32::from(c)),
        c => c.to_string(),
    };
    let text = if text.contains(|c: char| c != '\n' && is_control(c)) {
        text.chars().map(one).collect()
    } else {
        text
    };
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    #[test]
    fn control_characters_are_escaped_in_json_and_come_back() {
        let text = "a\u{1b}[31m\u{9b}\u{202e}\u{7f}\n\u{2028}ä\"";
        let json = super::to_json(&[text]).unwrap();
        assert!(!json.contains(|c: char| c != '\n' && crate::error::is_control(c)), "{json:?}");
        assert_eq!(serde_json::from_str::<Vec<String>>(&json).unwrap(), [text]);
    }
}
