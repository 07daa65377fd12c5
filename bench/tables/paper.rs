//! What the paper published, as typed from it in paper.json.

use anyhow::{Context as _, Result};
use serde::Deserialize;

/// Figures of the paper.
#[derive(Debug, Deserialize)]
pub struct Paper {
    /// The paper, and the tables and figures in it.
    pub source: String,
    /// The machine that it ran on.
    pub machine: String,
    /// Rows "Input" of Tables 1 and 2.
    pub inputs: Vec<Published>,
    /// The other rows.
    pub outputs: Vec<Published>,
    /// Fig. 7: shares of sites with fewer than five or more than seven neighbours.
    pub irregular: Vec<Irregular>,
    /// Fig. 8: times on one model.
    pub fertility: Vec<Timed>,
}

/// A row of Table 1 or 2. Figures that are not printed or illegible are `None`.
#[derive(Debug, Clone, Deserialize)]
pub struct Published {
    /// 1 or 2.
    pub table: u8,
    /// The name as in [`crate::models`].
    pub model: String,
    /// The method as printed, such as `RPF` or `Ours1`.
    pub method: String,
    /// Rounded to hundreds.
    pub vertices: usize,
    /// Rounded to hundreds.
    pub faces: usize,
    /// Smallest quality of a triangle.
    pub q_min: Option<f64>,
    /// Mean quality.
    pub q_avg: Option<f64>,
    /// Smallest angle in degrees.
    pub theta_min: Option<f64>,
    /// Mean of the triangles' smallest angles in degrees.
    pub theta_min_avg: Option<f64>,
    /// Share of triangles with an angle below 30 degrees, 0..=1.
    pub below_30: Option<f64>,
    /// Share of triangles with an angle above 90 degrees, 0..=1.
    pub above_90: Option<f64>,
    /// Hausdorff distance in percent of the bounding box's diagonal.
    pub hausdorff: Option<f64>,
    /// Time in seconds.
    pub seconds: Option<f64>,
}

/// A result of Fig. 7.
#[derive(Debug, Deserialize)]
pub struct Irregular {
    /// The name as in [`crate::models`].
    pub model: String,
    /// Vertices of the result.
    pub vertices: usize,
    /// 0..=1.
    pub share: f64,
}

/// A result of Fig. 8.
#[derive(Debug, Deserialize)]
pub struct Timed {
    /// Vertices of the result.
    pub vertices: usize,
    /// Seconds of the whole run.
    pub seconds: f64,
}

impl Paper {
    /// The figures that are compiled in.
    ///
    /// # Errors
    /// If paper.json is not as declared here.
    pub fn read() -> Result<Self> {
        serde_json::from_str(include_str!("paper.json")).context("paper.json")
    }
}
