//! Settings of [`Method::CoarseToFine`](super::Method::CoarseToFine), the default method.

use super::refine::Refinement;
use super::target_count::Length;
use super::{MAX_ASPECT, MAX_GRADATION, MAX_GROWTH, MAX_ITERATIONS, check_range};
use crate::io::read_feature_lines;
use crate::mesh::features::{FeatureLine, FeatureOptions};
use crate::{Error, Result};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Maximum of [`CoarseToFineOptions::min_angle`].
pub const MAX_MIN_ANGLE: f64 = 40.0;

/// Speed or quality.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Quality {
    /// Fast.
    Draft,
    /// For most uses.
    #[default]
    Normal,
    /// Slow, with the most even triangles.
    Best,
}

/// What to do if no valid mesh with N vertices can be built: handles, components or boundary loops would be
/// lost, or new self-intersections appear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Shortage {
    /// Return the mesh with the smallest fault, with a warning.
    #[default]
    BestEffort,
    /// Fail with an error that says what is wrong and where.
    Refuse,
    /// Add vertices until the mesh is valid; only with [`Method::CoarseToFine`](super::Method::CoarseToFine).
    AddVertices,
}

/// The axis along which an input is its own mirror image. The plane of symmetry is across it, through the
/// middle of the bounding box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "lowercase")]
pub enum Symmetry {
    /// The x axis.
    X,
    /// The y axis.
    Y,
    /// The z axis.
    Z,
    /// The axis along which the mirror image is closest.
    #[serde(rename = "auto")]
    Automatic,
}

/// The edge lengths over the surface.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Sizing {
    /// Equal, but shorter, down to 0.6 times their length, on the fillets and small holes of CAD parts that
    /// equal edges would cut off, and around places that they would miss, such as a narrow fold.
    #[default]
    Automatic,
    /// Equal everywhere.
    Uniform,
    /// Shorter where the surface is curved: proportional to curvature^(-`gradation` / 2). With 0 all edges
    /// are equally long, with 1 triangles deviate equally far everywhere, with 2 they meet at equal angles.
    Curvature {
        /// 0 to [`MAX_GRADATION`].
        gradation: f64,
    },
    /// Proportional to these numbers, one for each input vertex, all above 0.
    Given(Vec<f64>),
    /// Chosen in several runs so that input and result are nowhere farther apart than this, in both
    /// directions. If [`Options::vertices`](crate::Options::vertices) is 0, the result has as few vertices as
    /// possible; otherwise it has that number, at the smallest distance possible.
    Deviation(Length),
    /// Shorter where the surface is curved, and longer along the direction in which it bends least: in
    /// proportion to the inverse roots of the two principal curvatures. Triangles are even in the metric of
    /// these lengths, and stretched on the surface. Made by local operations.
    Anisotropic {
        /// Largest quotient of the two lengths at a place, 1 to [`MAX_ASPECT`].
        aspect: f64,
        /// As for [`Sizing::Deviation`]; `None` for a number of vertices alone.
        deviation: Option<Length>,
    },
}

impl Sizing {
    /// The largest distance between input and result, if one is asked for.
    #[must_use]
    pub fn deviation(&self) -> Option<Length> {
        match self {
            Self::Deviation(most) => Some(*most),
            Self::Anisotropic { deviation, .. } => *deviation,
            _ => None,
        }
    }

    /// The largest quotient of two lengths at one place, if lengths depend on the direction.
    pub(crate) fn aspect(&self) -> Option<f64> {
        match self {
            Self::Anisotropic { aspect, .. } => Some(*aspect),
            _ => None,
        }
    }

    /// Whether edges are equally long but where that would cut off or miss a part of the surface.
    pub(crate) fn is_even(&self) -> bool {
        matches!(self, Self::Automatic | Self::Uniform)
    }
}

/// Polylines along input edges that the result keeps.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FeatureLines {
    /// The file they come from, for error messages.
    pub file: Option<PathBuf>,
    /// The lines.
    pub lines: Vec<FeatureLine>,
}

impl FeatureLines {
    /// These lines, without a file.
    pub fn new(lines: Vec<FeatureLine>) -> Self {
        Self { file: None, lines }
    }

    /// The lines of an OBJ file: its `v` and `l` elements, whatever its extension.
    ///
    /// # Errors
    /// [`Error::Input`] with the path and the line: the file cannot be read, a coordinate or an index is
    /// invalid, an element has fewer than two points, or there are no elements.
    pub fn read(file: impl AsRef<Path>) -> Result<Self> {
        let file = file.as_ref();
        Ok(Self { lines: read_feature_lines(file)?, file: Some(file.to_owned()) })
    }
}

/// Maximum number of edges that borders of labels may move by.
const MAX_SMOOTH_LABELS: f64 = 10.0;

/// Settings of [`Method::CoarseToFine`](super::Method::CoarseToFine); the defaults are those of
/// [`Quality::Normal`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(default, deny_unknown_fields)]
pub struct CoarseToFineOptions {
    /// Minimum number of sites of the coarsest level.
    pub coarsest: usize,
    /// Maximum iterations of the first level, which starts from scattered sites.
    pub first_iterations: u32,
    /// Maximum iterations of the levels between the first and the last.
    pub coarse_iterations: u32,
    /// Number of rounds of edge flips and relaxation of the connected mesh.
    pub polish_rounds: u32,
    /// Whether to remesh everything by local operations (edge splits, collapses and flips) on the host, as is
    /// otherwise done only where cells fail.
    pub local: bool,
    /// Whether vertices may leave the surface slightly so that the triangles fit it better.
    pub fit: bool,
    /// Triangles with an angle below this, in degrees, are improved by local edits, and so are obtuse ones on
    /// sharp edges and boundaries; 0 to 40. 0 disables.
    pub min_angle: f64,
    /// Edges where the surface turns by at least this angle, in degrees, are sharp and kept; above 0, up to
    /// 180. 180 disables.
    pub feature_angle: f64,
    /// Polylines along input edges that are also kept.
    pub features: Option<FeatureLines>,
    /// Points of the surface, in the input's units, that become vertices exactly. One farther from the
    /// surface than a ten-thousandth of the diagonal becomes the nearest point of it, with a warning; one
    /// farther than a twentieth is left out.
    pub points: Vec<DVec3>,
    /// Triangles of the input that stay as they are, with their vertices; the rest is joined to them, and
    /// counted with them. Those that repair changes stay as it leaves them.
    pub keep: Vec<u32>,
    /// Whether the vertices and edges of the input's boundary are those of the result, exactly.
    pub keep_boundary: bool,
    /// Makes the result its own mirror image, vertex by vertex, along an axis; the input must be symmetric
    /// within 0.1 % of the diagonal. One half is remeshed and mirrored, so there may be a vertex more or
    /// fewer than asked for, or several if there are very few. `None` does not care.
    pub symmetric: Option<Symmetry>,
    /// Input half-edges that are also kept: `3 * triangle + k` goes from corner k of the triangle to the
    /// next. Half-edges of triangles that repair removes are ignored.
    pub fixed_half_edges: Vec<u32>,
    /// Input half-edges between labels, kept like the fixed ones. Ragged borders are smoothed first.
    pub label_borders: Vec<u32>,
    /// Vertices of ragged `label_borders` move along the surface by at most this many input edges; 0 keeps
    /// borders as they are. Sharp edges, boundaries, and borders that are not ragged stay.
    pub smooth_labels: f64,
    /// Whether `fixed_half_edges` are given up, with a warning, if there are too few vertices for them.
    pub may_give_up_fixed: bool,
    /// The edge lengths over the surface.
    pub sizing: Sizing,
    /// Parts of the surface with edges of a given length, from which lengths change by the growth. The rest
    /// gets the vertices that are left. Not with [`Sizing::Deviation`] and [`Sizing::Anisotropic`].
    pub refine: Vec<Refinement>,
    /// Minimum edge length, if lengths vary; at most that of a uniform mesh. `None`: an eighth of that.
    pub min_edge: Option<Length>,
    /// Maximum edge length, if lengths vary; at least that of a uniform mesh. `None`: eight times that.
    pub max_edge: Option<Length>,
    /// Maximum growth of edge length per unit of distance along the surface; above 0, up to [`MAX_GROWTH`].
    /// With 0.25, the length doubles over a distance of two of the longer edges.
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
            points: Vec::new(),
            keep: Vec::new(),
            keep_boundary: false,
            symmetric: None,
            fixed_half_edges: Vec::new(),
            label_borders: Vec::new(),
            smooth_labels: 1.0,
            may_give_up_fixed: false,
            sizing: Sizing::Automatic,
            refine: Vec::new(),
            min_edge: None,
            max_edge: None,
            growth: 0.25,
        }
    }
}

impl CoarseToFineOptions {
    /// Checks what is to be kept exactly.
    fn check_kept(&self) -> Result<()> {
        if let Some(point) = self.points.iter().position(|point| !point.is_finite()) {
            let problem = format!("point {point} of `points` has a coordinate that is not finite");
            return Err(Error::option("points", problem, "remove it"));
        }
        let points = ("points", !self.points.is_empty());
        let boundary = ("keep_boundary", self.keep_boundary);
        let kept = ("keep", !self.keep.is_empty());
        let local = ("local", self.local);
        let deviation = ("max_deviation", self.sizing.deviation().is_some());
        let contradictions = [
            (points, local),
            (points, deviation),
            (kept, local),
            (kept, deviation),
            (boundary, local),
            (boundary, deviation),
        ];
        for ((name, is_given), (other, is_other_given)) in contradictions {
            if is_given && is_other_given {
                let problem = format!("`{name}` does not go together with `{other}`");
                return Err(Error::option(name, problem, "remove one of them"));
            }
        }
        Ok(())
    }

    /// Refuses what has other lengths, and what local operations do not keep.
    fn check_anisotropic(&self) -> Result<()> {
        if self.sizing.aspect().is_none() {
            return Ok(());
        }
        let others = [
            ("local", self.local),
            ("refine", !self.refine.is_empty()),
            ("keep", !self.keep.is_empty()),
            ("keep_boundary", self.keep_boundary),
            ("points", !self.points.is_empty()),
        ];
        let Some((other, _)) = others.into_iter().find(|(_, is_given)| *is_given) else { return Ok(()) };
        let problem = format!("`{other}` does not go together with anisotropic sizing");
        Err(Error::option(other, problem, "remove one of them"))
    }

    /// Refuses what is known for the whole input but not for its half.
    fn check_symmetric(&self) -> Result<()> {
        if self.symmetric.is_none() {
            return Ok(());
        }
        let of_input = [
            ("`features`", self.features.is_some()),
            ("`points`", !self.points.is_empty()),
            ("`keep_boundary`", self.keep_boundary),
            ("`keep`", !self.keep.is_empty()),
            ("`refine`", !self.refine.is_empty()),
            ("kept labels, texture seams or rims", !self.label_borders.is_empty()),
            ("kept labels, texture seams or rims", !self.fixed_half_edges.is_empty()),
            ("edge lengths for each vertex", matches!(self.sizing, Sizing::Given(_))),
            ("a maximum deviation", self.sizing.deviation().is_some()),
        ];
        let Some((other, _)) = of_input.into_iter().find(|(_, is_given)| *is_given) else { return Ok(()) };
        let problem = format!("`symmetric` does not go together with {other}");
        Err(Error::option("symmetric", problem, "remove one of them"))
    }

    /// Checks each range, as far as that takes no mesh.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the field.
    pub(crate) fn check_ranges(&self) -> Result<()> {
        check_range("first_iterations", self.first_iterations, 0..=MAX_ITERATIONS)?;
        check_range("coarse_iterations", self.coarse_iterations, 0..=MAX_ITERATIONS)?;
        if !(self.feature_angle > 0.0 && self.feature_angle <= 180.0) {
            let problem = format!("`feature_angle` {} is out of range", self.feature_angle);
            let remedy = "use a number above 0 and at most 180 degrees; 180 disables sharp edges";
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
        if let Some(aspect) = self.sizing.aspect()
            && !(1.0..=MAX_ASPECT).contains(&aspect)
        {
            let problem = format!("`aspect` {aspect} is out of range");
            return Err(Error::option("sizing", problem, format!("use 1 to {MAX_ASPECT}, such as 8")));
        }
        if let Some(Length::Units(most) | Length::OfDiagonal(most)) = self.sizing.deviation()
            && !(most > 0.0 && most.is_finite())
        {
            let problem = format!("the maximum deviation {most} is out of range");
            return Err(Error::option(
                "sizing",
                problem,
                "give a length above 0, such as 0.1 % of the diagonal",
            ));
        }
        super::refine::check(&self.refine)?;
        self.check_anisotropic()?;
        self.check_kept()?;
        self.check_symmetric()?;
        if !self.refine.is_empty() && self.sizing.deviation().is_some() {
            let problem = "`refine` sets edge lengths, and so does a maximum deviation";
            return Err(Error::option("refine", problem, "remove one of them"));
        }
        if !(self.growth > 0.0 && self.growth <= MAX_GROWTH) {
            let problem = format!("`growth` {} is out of range", self.growth);
            return Err(Error::option(
                "growth",
                problem,
                format!("use a number above 0 and at most {MAX_GROWTH}, such as 0.25"),
            ));
        }
        if !(0.0..=MAX_SMOOTH_LABELS).contains(&self.smooth_labels) {
            let problem = format!("`smooth_labels` {} is out of range", self.smooth_labels);
            return Err(Error::option("smooth_labels", problem, "use 0 to 10 input edges, such as 1"));
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
