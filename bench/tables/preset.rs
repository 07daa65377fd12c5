//! The methods that are compared.

use rtfmesh::Options;
use serde::Serialize;

/// A value of `--preset`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Coarse to fine.
    Default,
    /// The paper's.
    Rtf,
    /// Restricted power faces.
    Rpf,
    /// Best-fit planes.
    Rvc,
    /// Exact cells.
    Rvd,
    /// Exact cells with momentum.
    Cvd,
    /// Maximal Poisson disks.
    Mps,
}

impl Preset {
    /// In the order of the paper's Table 2.
    pub const ALL: [Self; 7] =
        [Self::Mps, Self::Rvd, Self::Cvd, Self::Rpf, Self::Rvc, Self::Rtf, Self::Default];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Rtf => "rtf",
            Self::Rpf => "rpf",
            Self::Rvc => "rvc",
            Self::Rvd => "rvd",
            Self::Cvd => "cvd",
            Self::Mps => "mps",
        }
    }

    /// Its settings.
    pub fn options(self, vertices: usize) -> Options {
        match self {
            Self::Default => Options::new(vertices),
            Self::Rtf => Options::rtf(vertices),
            Self::Rpf => Options::rpf(vertices),
            Self::Rvc => Options::rvc(vertices),
            Self::Rvd => Options::rvd(vertices),
            Self::Cvd => Options::cvd(vertices),
            Self::Mps => Options::mps(vertices),
        }
    }

    /// Whether a row of the paper with this label belongs to this method.
    pub fn is_labelled(self, label: &str) -> bool {
        match self {
            Self::Rtf => label.starts_with("Ours"),
            Self::Default => false,
            other => label.eq_ignore_ascii_case(other.name()),
        }
    }
}
