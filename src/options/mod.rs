//! What a run is asked to do.

pub(crate) mod all_at_once;
pub(crate) mod target_count;

use crate::io::FeatureLine;
use crate::mesh::correspondence::CorrespondenceRequest;
use crate::mesh::features::FeatureOptions;
use crate::mesh::repair::RepairOptions;
use crate::{Error, Result};

use all_at_once::{Face, Neighbours, Normals, Projection, Seeding};
use serde::{Serialize, Serializer};
use std::path::PathBuf;
use target_count::Length;

/// Which point of its face a site moves to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Centroid {
    /// The mean of the face's corners, close ones counting less (Eq. 7 of the paper, see docs/presets.md).
    #[default]
    Vertex,
    /// The centroid of the face's area (Eq. 3).
    Area,
}

/// What is measured of a run's result: a small mesh is remeshed in less time than it takes to measure it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MeasureDepth {
    /// What the warnings need: topology, shape, valences.
    Basic,
    /// Faces that intersect others, too.
    Intersections,
    /// Distances to the input, too.
    #[default]
    Full,
}

/// How a run goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Few sites first, then more and more: planar faces, neighbour lists, momentum, polish.
    #[default]
    CoarseToFine,
    /// All sites from the start, as in the paper and in those that it compares with. What the run is made of says
    /// [`Options::face`] and what follows it.
    AllAtOnce,
}

/// Time against triangles, coarse to fine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quality {
    /// Quick.
    Draft,
    /// For most uses.
    #[default]
    Normal,
    /// As even as it gets.
    Best,
}

/// What happens if as many vertices as asked for do not make a valid mesh: handles, components or rims are lost, or faces
/// run through others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shortage {
    /// An error says so, and how many would do.
    #[default]
    Refuse,
    /// What there is comes out, with a warning.
    BestEffort,
    /// As many more as it takes are added.
    AddVertices,
}

/// How long edges are where.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sizing {
    /// Equally long everywhere.
    #[default]
    Uniform,
    /// Shorter where the surface bends: in proportion to curvature^(-`gradation` / 2). With 1 the faces stray equally far
    /// from the surface everywhere, with 2 they meet at equal angles, with 0 edges are equally long.
    Curvature {
        /// 0 to [`MAX_GRADATION`].
        gradation: f64,
    },
    /// In proportion to these numbers, one for each vertex of the input, all above 0; reports have their number.
    #[serde(serialize_with = "count")]
    Given(Vec<f64>),
}

/// A user's lines along edges of the input.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FeatureLines {
    /// Where they come from, for errors.
    pub file: Option<PathBuf>,
    /// The lines; reports have their number.
    #[serde(serialize_with = "count")]
    pub lines: Vec<FeatureLine>,
}

/// Settings of a run. `Options::new(n)` has the default ones, `Options::rtf(n)` the paper's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Options {
    /// Which pipeline.
    pub method: Method,
    /// What cells are cut from. [`Face::Planar`] with coarse to fine, and only there.
    pub face: Face,
    /// Planes, all at once only: where they come from. What goes with what is checked by [`Options::validate`].
    pub normals: Normals,
    /// Planes, all at once only: how sites get back onto the surface.
    pub projection: Projection,
    /// All at once only: where sites begin.
    pub seeding: Seeding,
    /// Planes, all at once only: how the nearest sites are found.
    pub neighbours: Neighbours,
    /// Vertices of the result, at least 4.
    pub vertices: usize,
    /// Coarse to fine only: the coarsest level has at least this many sites.
    pub coarsest: usize,
    /// Coarse to fine only: most iterations of the first level, from scattered sites.
    pub first_iterations: u32,
    /// Coarse to fine only: most iterations of the levels between the first and the last.
    pub coarse_iterations: u32,
    /// Sites in a normal's plane fit, the site itself included; 3 to [`MAX_NEIGHBOURS`] + 1 (the paper's k_nor).
    pub k_normal: u32,
    /// Sites that clip a cell before the radius of security is checked; 3 to [`MAX_NEIGHBOURS`] (the paper's k_clip).
    pub k_clip: u32,
    /// Input vertices whose triangles a site is projected onto, or points that its plane fits; 1 to [`MAX_NEIGHBOURS`] (the paper's k_proj).
    pub k_project: u32,
    /// Coarse to fine only: rounds of flips and relaxation of the connected mesh.
    pub polish_rounds: u32,
    /// Coarse to fine only: whether vertices leave the surface by a little so that the faces fit it better.
    pub fit: bool,
    /// Coarse to fine only: edges where the surface turns by at least this angle in degrees are sharp and held; above 0 to
    /// 180, which is none.
    pub feature_angle: f64,
    /// Coarse to fine only: lines along edges of the input that are held as well.
    pub features: Option<FeatureLines>,
    /// Vertices of the input closer than this share of its bounding box's diagonal become one; 0 to below 1, 0 for exact
    /// duplicates only.
    pub weld: f64,
    /// Components of the input with less than this share of its area are dropped; 0 to below 1.
    pub min_component: f64,
    /// Most iterations; coarse to fine, of the last level.
    pub iterations: u32,
    /// The run ends early when the root mean square step is below this many spacings.
    pub tolerance: f64,
    /// Seed of the random start.
    pub seed: u64,
    /// Coarse to fine only: what happens if the vertices do not suffice.
    pub shortage: Shortage,
    /// Exact cells only: largest share of the last motion that is added to a step, 0 to below 1. 0 is Lloyd's iteration.
    pub momentum: f64,
    /// Exact cells only: motions that L-BFGS remembers, 0 to [`MAX_LBFGS`], 7 if there is no reason for another number.
    /// 0 is Lloyd's iteration; with more there is no momentum.
    pub lbfgs: u32,
    /// Power faces only: distance of a shadow site from its site in spacings, 0 to [`MAX_OFFSET`] (the paper's d).
    pub offset: f64,
    /// What is measured of the result.
    pub measures: MeasureDepth,
    /// Coarse to fine only: half-edges `3 * triangle + k` of the input, from corner k to the next, that are kept as
    /// curves too; reports have their number. Those of triangles that repair drops do not count.
    #[serde(rename = "held_sides", serialize_with = "count")]
    pub fixed_half_edges: Vec<u32>,
    /// For what to compute where it lies on the input: [`crate::Remeshed::correspondence`].
    #[serde(rename = "source")]
    pub correspondence: CorrespondenceRequest,
    /// Where a site moves.
    pub centroid: Centroid,
    /// Coarse to fine only: how long edges are where.
    pub sizing: Sizing,
    /// Unless edges are equally long: the least length that is wanted anywhere; at most that of a uniform mesh, of which
    /// an eighth if `None`.
    pub min_edge: Option<Length>,
    /// The largest one; at least that of a uniform mesh, of which eight times if `None`.
    pub max_edge: Option<Length>,
    /// How much longer edges may become on a way along the surface, over that way; above 0 to [`MAX_GROWTH`]. With 0.25
    /// they double over four lengths of the longer ones.
    pub growth: f64,
}

/// Longest neighbour list: what the cell kernel's planes and 16 KB of shared memory allow.
pub const MAX_NEIGHBOURS: u32 = 48;

/// Largest offset of shadow sites, in spacings: beyond, they hide sites wherever the surface is hollow.
pub const MAX_OFFSET: f64 = 20.0;

/// Largest [`Options::lbfgs`].
pub const MAX_LBFGS: u32 = 50;

/// Largest [`Sizing::Curvature`].
pub const MAX_GRADATION: f64 = 3.0;

/// Largest [`Options::growth`]: beyond, triangles cannot be even.
pub const MAX_GROWTH: f64 = 1.0;

/// Most iterations of a level; each keeps a few words on the device.
pub const MAX_ITERATIONS: u32 = 1_000_000;

impl Options {
    /// Whether sites move with cells in planes, all from the start.
    pub(crate) fn has_plane_faces(&self) -> bool {
        matches!(self.face, Face::Tangent | Face::Power)
    }
}

impl Options {
    /// Coarse to fine, for good triangles in short time.
    pub fn new(vertices: usize) -> Self {
        Self::with_quality(vertices, Quality::Normal)
    }

    /// Coarse to fine, with more or less time for better or worse triangles.
    pub fn with_quality(vertices: usize, quality: Quality) -> Self {
        let (first_iterations, coarse_iterations, iterations, polish_rounds) = match quality {
            Quality::Draft => (30, 10, 5, 4),
            Quality::Normal => (60, 40, 10, 15),
            Quality::Best => (150, 100, 80, 30),
        };
        Self {
            method: Method::CoarseToFine,
            face: Face::Planar,
            normals: Normals::Surface,
            projection: Projection::Walk,
            seeding: Seeding::Stratified,
            neighbours: Neighbours::Lists,
            coarsest: 300,
            first_iterations,
            coarse_iterations,
            iterations,
            polish_rounds,
            fit: true,
            centroid: Centroid::Area,
            ..Self::rtf(vertices)
        }
    }

    /// The paper's settings (Sect. 5): k = 16, 32, 16 and 160 iterations of Lloyd from a uniformly random start.
    pub fn rtf(vertices: usize) -> Self {
        Self {
            method: Method::AllAtOnce,
            face: Face::Tangent,
            normals: Normals::Fit,
            projection: Projection::NearestVertices,
            seeding: Seeding::Random,
            neighbours: Neighbours::Brute,
            vertices,
            coarsest: 0,
            first_iterations: 0,
            coarse_iterations: 0,
            polish_rounds: 0,
            fit: false,
            feature_angle: FeatureOptions::FEATURE_ANGLE,
            features: None,
            weld: 0.0,
            min_component: 0.0,
            k_normal: 16,
            k_clip: 32,
            k_project: 16,
            iterations: 160,
            tolerance: 1e-4,
            seed: 1,
            shortage: Shortage::Refuse,
            momentum: 0.0,
            lbfgs: 0,
            offset: 0.5,
            measures: MeasureDepth::Full,
            fixed_half_edges: Vec::new(),
            correspondence: CorrespondenceRequest::NONE,
            centroid: Centroid::Vertex,
            sizing: Sizing::Uniform,
            min_edge: None,
            max_edge: None,
            growth: 0.25,
        }
    }

    /// Lloyd's iteration with exact restricted Voronoi cells (Yan et al. 2009), 160 times from a uniformly random start.
    pub fn rvd(vertices: usize) -> Self {
        Self {
            face: Face::Exact,
            centroid: Centroid::Area,
            neighbours: Neighbours::Lists,
            ..Self::rtf(vertices)
        }
    }

    /// The same with momentum.
    pub fn cvd(vertices: usize) -> Self {
        Self { momentum: 0.9, ..Self::rvd(vertices) }
    }

    /// Restricted power faces (Xu et al. 2019), otherwise as [`Options::rtf`]. The paper names no offset for them; see
    /// docs/presets.md for the one taken.
    pub fn rpf(vertices: usize) -> Self {
        Self { face: Face::Power, ..Self::rtf(vertices) }
    }

    /// Cells on the planes that best fit the input's points (Chen et al. 2018), otherwise as [`Options::rtf`].
    pub fn rvc(vertices: usize) -> Self {
        Self { normals: Normals::Cloud, projection: Projection::Plane, ..Self::rtf(vertices) }
    }

    /// Maximal Poisson-disk sampling (Guo et al. 2015): no iterations.
    pub fn mps(vertices: usize) -> Self {
        Self { seeding: Seeding::Poisson, iterations: 0, ..Self::rvd(vertices) }
    }

    /// What a run repairs.
    pub fn repairs(&self) -> RepairOptions {
        RepairOptions { weld: self.weld, min_component: self.min_component }
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the option.
    pub fn validate(&self) -> Result<()> {
        if self.vertices < 4 {
            return Err(Error::usage(
                format!("{} vertices cannot make a closed surface", self.vertices),
                "ask for at least 4",
            ));
        }
        if self.vertices as u64 >= u64::from(u32::MAX) {
            return Err(Error::usage(
                format!("{} vertices are more than an index can count", self.vertices),
                format!("ask for fewer than {}", u32::MAX),
            ));
        }
        let most = self.first_iterations.max(self.coarse_iterations).max(self.iterations);
        if most > MAX_ITERATIONS {
            return Err(Error::usage(
                format!("--iterations {most} is out of range"),
                format!("use at most {MAX_ITERATIONS}"),
            ));
        }
        let ranges = [
            ("k-normal", self.k_normal, 3, MAX_NEIGHBOURS + 1),
            ("k-clip", self.k_clip, 3, MAX_NEIGHBOURS),
            ("k-project", self.k_project, 1, MAX_NEIGHBOURS),
            ("lbfgs", self.lbfgs, 0, MAX_LBFGS),
        ];
        for (name, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err(Error::usage(
                    format!("--{name} {value} is out of range"),
                    format!("use {low} to {high}"),
                ));
            }
        }
        if !(self.feature_angle > 0.0 && self.feature_angle <= 180.0) {
            return Err(Error::usage(
                format!("--feature-angle {} is out of range", self.feature_angle),
                "use more than 0 to 180 degrees, 180 for no sharp edges",
            ));
        }
        if !(0.0..1.0).contains(&self.momentum) {
            return Err(Error::usage(
                format!("--momentum {} is out of range", self.momentum),
                "use 0 to below 1, such as 0.9",
            ));
        }
        if !(0.0..=MAX_OFFSET).contains(&self.offset) {
            return Err(Error::usage(
                format!("--offset {} is out of range", self.offset),
                format!("use 0 to {MAX_OFFSET} edge lengths"),
            ));
        }
        all_at_once::check(self)?;
        self.validate_sizing()?;
        if !(self.tolerance >= 0.0 && self.tolerance.is_finite()) {
            return Err(Error::usage(
                format!("--tolerance {} is out of range", self.tolerance),
                "use 0 or a small number such as 1e-4",
            ));
        }
        Ok(())
    }
}

impl Options {
    /// What can be checked of sizes without a mesh.
    fn validate_sizing(&self) -> Result<()> {
        if let Sizing::Curvature { gradation } = self.sizing
            && !(0.0..=MAX_GRADATION).contains(&gradation)
        {
            let problem = format!("--gradation {gradation} is out of range");
            return Err(Error::usage(problem, format!("use 0 to {MAX_GRADATION}, such as 1")));
        }
        if self.sizing != Sizing::Uniform && self.method != Method::CoarseToFine {
            let problem = "edge lengths that differ are made by the default method alone";
            return Err(Error::usage(problem, "leave --sizing out, or add --preset default"));
        }
        if !(self.growth > 0.0 && self.growth <= MAX_GROWTH) {
            let problem = format!("--growth {} is out of range", self.growth);
            return Err(Error::usage(problem, format!("use more than 0 to {MAX_GROWTH}, such as 0.25")));
        }
        for (name, length) in [("min-edge", self.min_edge), ("max-edge", self.max_edge)] {
            if let Some(Length::Units(value) | Length::OfDiagonal(value)) = length
                && !(value > 0.0 && value.is_finite())
            {
                let problem = format!("--{name} {value} is out of range");
                return Err(Error::usage(problem, "give a length above 0"));
            }
        }
        Ok(())
    }
}

fn count<T, S: Serializer>(list: &[T], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_u64(list.len() as u64)
}
