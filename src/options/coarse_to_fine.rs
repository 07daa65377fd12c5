//! Settings of [`Method::CoarseToFine`](super::Method::CoarseToFine), the default method.

use super::target_count::Length;
use super::{MAX_GRADATION, MAX_GROWTH, MAX_ITERATIONS, check_range};
use crate::io::read_feature_lines;
use crate::mesh::features::{FeatureLine, FeatureOptions};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Largest [`CoarseToFineOptions::min_angle`].
pub const MAX_MIN_ANGLE: f64 = 40.0;

/// Speed or quality.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Quality {
    /// Quick.
    Draft,
    /// For most uses.
    #[default]
    Normal,
    /// As even as it gets.
    Best,
}

/// What happens if there is no mesh of the vertices asked for without a fault: handles, components or
/// boundary loops are lost, or faces intersect that did not in the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Shortage {
    /// The mesh with the least fault, and a warning.
    #[default]
    BestEffort,
    /// An error that says what is wrong and where.
    Refuse,
    /// As many more vertices as it takes; only with [`Method::CoarseToFine`](super::Method::CoarseToFine).
    AddVertices,
}

/// How long edges are in different places.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Sizing {
    /// Equally long, but shorter around places that are left out then, such as a fold that edges bridge.
    /// Where the first attempt leaves out none, that is the result.
    #[default]
    Automatic,
    /// Equally long everywhere.
    Uniform,
    /// Shorter where the surface is curved: in proportion to curvature^(-`gradation` / 2). With 0 edges are
    /// equally long, with 1 faces are equally far from the surface everywhere, with 2 they meet at equal
    /// angles.
    Curvature {
        /// 0 to [`MAX_GRADATION`].
        gradation: f64,
    },
    /// In proportion to these numbers, one for each vertex of the input, all above 0.
    Given(Vec<f64>),
    /// As long as it takes for no point of the result to be farther than this from the input, nor the other
    /// way round, in several runs. With [`Options::vertices`](crate::Options::vertices) 0 the result has as
    /// few vertices as that takes, else as many as asked for and the smallest distance that these allow.
    Deviation(Length),
}

impl Sizing {
    /// Whether edges are equally long, in a first attempt at least.
    pub(crate) fn is_even(&self) -> bool {
        matches!(self, Self::Automatic | Self::Uniform)
    }
}

/// Lines along edges of the input that the result keeps.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FeatureLines {
    /// The file that they come from, for errors.
    pub file: Option<PathBuf>,
    /// The lines.
    pub lines: Vec<FeatureLine>,
}

impl FeatureLines {
    /// These lines, from no file.
    pub fn new(lines: Vec<FeatureLine>) -> Self {
        Self { file: None, lines }
    }

    /// The lines of an OBJ file.
    ///
    /// # Errors
    /// As [`crate::io::read_feature_lines`].
    pub fn read(file: &Path) -> Result<Self> {
        Ok(Self { lines: read_feature_lines(file)?, file: Some(file.to_owned()) })
    }
}

/// Most edges that borders of labels may move by.
const MAX_SMOOTH_LABELS: f64 = 10.0;

/// Settings of [`Method::CoarseToFine`](super::Method::CoarseToFine); the default ones are those of
/// [`Quality::Normal`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(default, deny_unknown_fields)]
pub struct CoarseToFineOptions {
    /// The coarsest level has at least this many sites.
    pub coarsest: usize,
    /// Most iterations of the first level, from scattered sites.
    pub first_iterations: u32,
    /// Most iterations of the levels between the first and the last.
    pub coarse_iterations: u32,
    /// Rounds of edge flips and relaxation of the connected mesh.
    pub polish_rounds: u32,
    /// Whether to remesh by local operations on the host instead of with cells: splits, collapses and flips
    /// of edges. That is what components get where cells fail.
    pub local: bool,
    /// Whether vertices leave the surface by a little so that the faces fit it better.
    pub fit: bool,
    /// Triangles with an angle below this, in degrees, are mended by local edits, and obtuse ones on sharp
    /// edges and boundaries with them; 0 to 40, 0 for none.
    pub min_angle: f64,
    /// Edges where the surface turns by at least this angle in degrees are sharp and kept; above 0 to 180,
    /// which is none.
    pub feature_angle: f64,
    /// Lines along edges of the input that are kept as well.
    pub features: Option<FeatureLines>,
    /// Half-edges `3 * triangle + k` of the input, from corner k of the triangle to the next, that are kept
    /// as well. Those of triangles that repair drops do not count.
    pub fixed_half_edges: Vec<u32>,
    /// Half-edges of the input between labels, kept like the fixed ones. Ragged ones are made smooth first.
    pub label_borders: Vec<u32>,
    /// Vertices of `label_borders` move by at most so many edges of the input, along the surface, so that
    /// borders do not follow its triangles to and fro; 0 for borders as they are. Sharp edges, boundaries,
    /// and borders that are not ragged stay.
    pub smooth_labels: f64,
    /// Whether `fixed_half_edges` are given up, with a warning, where there are too few vertices for them.
    pub may_give_up_fixed: bool,
    /// How long edges are in different places.
    pub sizing: Sizing,
    /// Unless edges are equally long: the least length that is wanted anywhere; at most that of a uniform
    /// mesh, of which an eighth if `None`.
    pub min_edge: Option<Length>,
    /// The largest one; at least that of a uniform mesh, of which eight times if `None`.
    pub max_edge: Option<Length>,
    /// Largest growth of edge length per unit of distance along the surface; above 0 to [`MAX_GROWTH`]. With
    /// 0.25 edges double over four lengths of the longer ones.
    pub growth: f64,
}

impl Default for CoarseToFineOptions {
    fn default() -> Self {
        Self {
            coarsest: 300,
            first_iterations: 60,
            coarse_iterations: 40,
            polish_rounds: 15,
            local: false,
            fit: true,
            min_angle: 30.0,
            feature_angle: FeatureOptions::FEATURE_ANGLE,
            features: None,
            fixed_half_edges: Vec::new(),
            label_borders: Vec::new(),
            smooth_labels: 1.0,
            may_give_up_fixed: false,
            sizing: Sizing::Automatic,
            min_edge: None,
            max_edge: None,
            growth: 0.25,
        }
    }
}

impl CoarseToFineOptions {
    /// Checks each range, as far as that takes no mesh.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the field.
    pub(super) fn check_ranges(&self) -> Result<()> {
        check_range("first_iterations", self.first_iterations, 0..=MAX_ITERATIONS)?;
        check_range("coarse_iterations", self.coarse_iterations, 0..=MAX_ITERATIONS)?;
        if !(self.feature_angle > 0.0 && self.feature_angle <= 180.0) {
            let problem = format!("`feature_angle` {} is out of range", self.feature_angle);
            let remedy = "use more than 0 to 180 degrees, 180 for no sharp edges";
            return Err(Error::option("feature_angle", problem, remedy));
        }
        if !(0.0..=MAX_MIN_ANGLE).contains(&self.min_angle) {
            let problem = format!("`min_angle` {} is out of range", self.min_angle);
            return Err(Error::option("min_angle", problem, format!("use 0 to {MAX_MIN_ANGLE}, such as 30")));
        }
        if let Sizing::Curvature { gradation } = self.sizing
            && !(0.0..=MAX_GRADATION).contains(&gradation)
        {
            let problem = format!("`gradation` {gradation} is out of range");
            return Err(Error::option("sizing", problem, format!("use 0 to {MAX_GRADATION}, such as 1")));
        }
        if let Sizing::Deviation(Length::Units(most) | Length::OfDiagonal(most)) = self.sizing
            && !(most > 0.0 && most.is_finite())
        {
            let problem = format!("the largest deviation {most} is out of range");
            return Err(Error::option(
                "sizing",
                problem,
                "give a length above 0, such as 0.1 % of the diagonal",
            ));
        }
        if !(self.growth > 0.0 && self.growth <= MAX_GROWTH) {
            let problem = format!("`growth` {} is out of range", self.growth);
            return Err(Error::option(
                "growth",
                problem,
                format!("use more than 0 to {MAX_GROWTH}, such as 0.25"),
            ));
        }
        if !(0.0..=MAX_SMOOTH_LABELS).contains(&self.smooth_labels) {
            let problem = format!("`smooth_labels` {} is out of range", self.smooth_labels);
            return Err(Error::option("smooth_labels", problem, "use 0 to 10 edges, such as 1"));
        }
        for (name, length) in [("min_edge", self.min_edge), ("max_edge", self.max_edge)] {
            if let Some(Length::Units(value) | Length::OfDiagonal(value)) = length
                && !(value > 0.0 && value.is_finite())
            {
                let problem = format!("`{name}` {value} is out of range");
                return Err(Error::option(name, problem, "give a length above 0"));
            }
        }
        Ok(())
    }
}
