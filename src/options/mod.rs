//! What a run is asked to do.

pub(crate) mod all_at_once;
mod builder;
pub(crate) mod coarse_to_fine;
pub(crate) mod refine;
pub(crate) mod target_count;

use crate::grammar::counted;
use crate::io::Format;
use crate::mesh::correspondence::CorrespondenceRequest;
use crate::mesh::distance::{DEFAULT_ACCURACY, check_accuracy};
use crate::mesh::repair::RepairOptions;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

pub use all_at_once::{AllAtOnceOptions, Centroid, Face, Neighbours, Normals, Projection, Seeding};
pub use coarse_to_fine::{CoarseToFineOptions, FeatureLines, Quality, Shortage, Sizing, Symmetry};
pub use refine::{Refinement, Region};
pub use target_count::{Length, Size};

/// Which measures of a run's result are taken. Remeshing a small mesh takes less time than measuring it
/// fully.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "lowercase")]
pub enum MeasureDepth {
    /// What the warnings need: topology, shape, valences; of the default method also self-intersections.
    Basic,
    /// Everything in `Basic`, and self-intersections of any method.
    Intersections,
    /// Everything in `Intersections`, and distances to the input.
    #[default]
    Full,
}

/// The remeshing method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Few sites first, then a new one at the middle of every edge, until there are N; then polish and fit.
    /// Its settings are [`Options::coarse_to_fine`].
    #[default]
    CoarseToFine,
    /// All sites exist from the start, as in the paper and in the methods it compares with. Its settings are
    /// [`Options::all_at_once`].
    AllAtOnce,
}

/// Settings of a run. `Options::new(n)` are the defaults, `Options::rtf(n)` the paper's settings. For each
/// field, also of `coarse_to_fine` and `all_at_once`, a method of the same name sets it.
///
/// ```
/// use rtfmesh::Options;
///
/// let options = Options::new(10_000).feature_angle(30.0).seed(7);
/// assert_eq!(options.coarse_to_fine.feature_angle, 30.0);
/// options.validate()?;
/// # Ok::<(), rtfmesh::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(default = "Options::without_vertices", deny_unknown_fields)]
pub struct Options {
    /// Number of vertices of the result, at least 4. With [`Sizing::Deviation`], 0 means as few as possible.
    pub vertices: usize,
    /// Number of triangles of the result, at least 4, in place of `vertices`. If Euler's formula allows no
    /// mesh of so many, there are one or two fewer.
    pub faces: Option<usize>,
    /// The remeshing method.
    pub method: Method,
    /// Maximum number of iterations (of the last level, for coarse-to-fine), up to [`MAX_ITERATIONS`].
    pub iterations: u32,
    /// Iterations end early when the root mean square step is below this many spacings.
    pub tolerance: f64,
    /// Seed of the random start.
    pub seed: u64,
    /// Input vertices closer than this fraction of the bounding box's diagonal are welded; 0 to below 1. 0
    /// welds exact duplicates only.
    pub weld: f64,
    /// Components of the input below this fraction of its area are removed; 0 to below 1.
    pub min_component: f64,
    /// Ragged boundaries of the input are smoothed by at most this fraction of the bounding box's diagonal; 0
    /// to below 1. 0 leaves them unchanged.
    pub smooth_boundary: f64,
    /// Spikes of the input are smoothed: vertices that stick out alone like needles, around which all angles
    /// sum to less than 90 degrees.
    pub smooth_spikes: bool,
    /// Holes of the input are filled if the diagonal of their bounding box is at most this long.
    pub fill_holes: Option<Length>,
    /// Components of the input inside closed ones are removed, such as inner shells and hidden parts.
    pub outer: bool,
    /// What to do if N is too small for a valid mesh.
    pub shortage: Shortage,
    /// Which measures are taken of the result.
    pub measures: MeasureDepth,
    /// Width of the Hausdorff intervals relative to their upper ends; 1e-6 to 0.5. See
    /// [`distances_within`](crate::mesh::distance::distances_within).
    pub accuracy: f64,
    /// Which parts of [`crate::Remeshed::correspondence`] (places on the input) to compute.
    pub correspondence: CorrespondenceRequest,
    /// Whether to compute [`crate::Remeshed::cells`]: the tangent faces of [`Method::AllAtOnce`], or exact
    /// cells with methods that have none.
    pub cells: bool,
    /// The format in which the result will be written. Its positions are rounded as in the file
    /// ([`crate::io::rounded`]), so that the measures are those of the file; a warning says if 32-bit numbers
    /// are too coarse. `None` keeps 64-bit numbers.
    pub format: Option<Format>,
    /// Settings of [`Method::CoarseToFine`]; must be the defaults with any other method.
    pub coarse_to_fine: CoarseToFineOptions,
    /// Settings of [`Method::AllAtOnce`]; must be the defaults with any other method.
    pub all_at_once: AllAtOnceOptions,
}

/// Maximum length of a neighbour list, limited by the planes of the cell kernel in 16 KB of shared memory.
pub const MAX_NEIGHBOURS: u32 = 48;

/// Maximum offset of shadow sites, in spacings. Larger ones would hide sites wherever the surface is concave.
pub const MAX_OFFSET: f64 = 20.0;

/// Maximum of [`AllAtOnceOptions::lbfgs`].
pub const MAX_LBFGS: u32 = 50;

/// Maximum gradation of [`Sizing::Curvature`].
pub const MAX_GRADATION: f64 = 3.0;

/// Maximum aspect of [`Sizing::Anisotropic`].
pub const MAX_ASPECT: f64 = 100.0;

/// Maximum of [`CoarseToFineOptions::growth`]. Larger values prevent well-shaped triangles.
pub const MAX_GROWTH: f64 = 1.0;

/// Maximum number of iterations of a level; each keeps a few words on the device.
pub const MAX_ITERATIONS: u32 = 1_000_000;

impl Options {
    /// The default settings, which give good triangles quickly.
    pub fn new(vertices: usize) -> Self {
        Self {
            vertices,
            faces: None,
            method: Method::CoarseToFine,
            iterations: 10,
            tolerance: 1e-4,
            seed: 1,
            weld: 0.0,
            min_component: 0.0,
            smooth_boundary: 0.0,
            smooth_spikes: false,
            fill_holes: None,
            outer: false,
            shortage: Shortage::BestEffort,
            measures: MeasureDepth::Full,
            accuracy: DEFAULT_ACCURACY,
            correspondence: CorrespondenceRequest::NONE,
            cells: false,
            format: None,
            coarse_to_fine: CoarseToFineOptions::default(),
            all_at_once: AllAtOnceOptions::default(),
        }
    }

    /// The defaults for deserialization, where the number of vertices must be given.
    fn without_vertices() -> Self {
        Self::new(0)
    }

    /// The default method with settings for speed or quality.
    pub fn with_quality(vertices: usize, quality: Quality) -> Self {
        let mut options = Self::new(vertices);
        match quality {
            Quality::Draft => {
                // No further attempts for places that even edges miss.
                options.coarse_to_fine.sizing = Sizing::Uniform;
                options.first_iterations(30).coarse_iterations(10).iterations(5).polish_rounds(4)
            }
            Quality::Normal => options,
            Quality::Best => {
                options.first_iterations(150).coarse_iterations(100).iterations(80).polish_rounds(30)
            }
        }
    }

    /// The paper's settings (Sect. 5): k = 16, 32 and 16, and 160 iterations of Lloyd from a uniformly random
    /// start. Only the weights of [`Centroid::WeightedCorners`] are not from the paper.
    pub fn rtf(vertices: usize) -> Self {
        Self { method: Method::AllAtOnce, iterations: 160, ..Self::new(vertices) }
    }

    /// Lloyd's iteration with exact restricted Voronoi cells (Yan et al. 2009), 160 times from a uniformly
    /// random start.
    pub fn rvd(vertices: usize) -> Self {
        Self::rtf(vertices).face(Face::Exact).centroid(Centroid::Area).neighbours(Neighbours::Lists)
    }

    /// Like [`Options::rvd`], with momentum.
    pub fn cvd(vertices: usize) -> Self {
        Self::rvd(vertices).momentum(0.9)
    }

    /// Restricted power faces (Xu et al. 2019), otherwise as [`Options::rtf`]. The paper states no offset for
    /// them; docs/presets.md explains the one chosen here.
    pub fn rpf(vertices: usize) -> Self {
        Self::rtf(vertices).face(Face::Power)
    }

    /// Cells on the planes that best fit the input's points (Chen et al. 2018), otherwise as
    /// [`Options::rtf`].
    pub fn rvc(vertices: usize) -> Self {
        Self::rtf(vertices).normals(Normals::Cloud).projection(Projection::Plane)
    }

    /// Maximal Poisson-disk sampling (Guo et al. 2015): no iterations.
    pub fn mps(vertices: usize) -> Self {
        Self::rvd(vertices).seeding(Seeding::Poisson).iterations(0)
    }

    /// The repairs that a run makes on its input.
    pub fn repairs(&self) -> RepairOptions {
        RepairOptions {
            weld: self.weld,
            min_component: self.min_component,
            smooth_boundary: self.smooth_boundary,
            smooth_spikes: self.smooth_spikes,
            fill_holes: self.fill_holes,
            outer: self.outer,
        }
    }

    /// Sets all repairs at once.
    pub(crate) fn set_repairs(&mut self, repairs: RepairOptions) {
        let RepairOptions { weld, min_component, smooth_boundary, smooth_spikes, fill_holes, outer } =
            repairs;
        (self.weld, self.min_component, self.smooth_boundary) = (weld, min_component, smooth_boundary);
        (self.smooth_spikes, self.fill_holes, self.outer) = (smooth_spikes, fill_holes, outer);
    }

    /// Whether sites move with tangent or power faces.
    pub(crate) fn has_plane_faces(&self) -> bool {
        self.method == Method::AllAtOnce && self.all_at_once.face != Face::Exact
    }

    /// Whether sites move with restricted Voronoi cells.
    pub(crate) fn has_exact_faces(&self) -> bool {
        self.method == Method::AllAtOnce && self.all_at_once.face == Face::Exact
    }

    /// Whether faces in tangent planes may be weighted by edge lengths. Sites that are projected onto planes
    /// are on no triangle, which would have a length.
    pub(crate) fn has_weights(&self) -> bool {
        let AllAtOnceOptions { face, projection, .. } = self.all_at_once;
        self.method == Method::AllAtOnce && face == Face::Tangent && projection != Projection::Plane
    }

    /// Whether they are, since lengths vary.
    pub(crate) fn is_weighted(&self) -> bool {
        let sizing = &self.coarse_to_fine.sizing;
        self.has_weights() && matches!(sizing, Sizing::Curvature { .. } | Sizing::Given(_))
    }

    /// The defaults of the other method, with the edge lengths if this one has some.
    fn sizes_alone(&self) -> CoarseToFineOptions {
        let defaults = CoarseToFineOptions::default();
        if !self.is_weighted() {
            return defaults;
        }
        let CoarseToFineOptions { sizing, min_edge, max_edge, growth, .. } = self.coarse_to_fine.clone();
        CoarseToFineOptions { sizing, min_edge, max_edge, growth, ..defaults }
    }

    /// Checks every range, and that the settings go together. [`Options::weld`] and
    /// [`Options::min_component`] are checked by [`repair_with`](crate::mesh::repair::repair_with).
    ///
    /// # Errors
    /// [`Error::Usage`] that names the field.
    pub fn validate(&self) -> Result<()> {
        let are_counted = self.vertices > 0 || self.coarse_to_fine.sizing.deviation().is_none();
        if let Some(faces) = self.faces
            && !(4..2 * u64::from(u32::MAX / 2)).contains(&(faces as u64))
        {
            let problem = format!("`faces` {faces} is out of range");
            return Err(Error::option("faces", problem, "ask for at least 4 triangles"));
        }
        if are_counted && self.faces.is_none() && self.vertices < 4 {
            let problem = format!(
                "{} too few for a closed surface",
                counted(self.vertices, ["vertex is", "vertices are"])
            );
            return Err(Error::option("vertices", problem, "ask for at least 4"));
        }
        if self.vertices as u64 >= u64::from(u32::MAX) {
            let problem = format!("{} vertices are more than an index can count", self.vertices);
            return Err(Error::option("vertices", problem, format!("ask for fewer than {}", u32::MAX)));
        }
        check_range("iterations", self.iterations, 0..=MAX_ITERATIONS)?;
        self.coarse_to_fine.check_ranges()?;
        self.all_at_once.check_ranges()?;
        if self.coarse_to_fine.symmetric.is_some() && self.faces.is_some() {
            let problem = "`symmetric` does not go together with `faces`";
            return Err(Error::option("symmetric", problem, "ask for a number of vertices"));
        }
        let keeps_triangles = !self.coarse_to_fine.keep.is_empty();
        let kept = [("keep_boundary", self.coarse_to_fine.keep_boundary), ("keep", keeps_triangles)];
        let changes = [
            ("smooth_boundary` moves", self.smooth_boundary > 0.0),
            ("fill_holes` closes", self.fill_holes.is_some()),
            ("outer` removes", self.outer),
            // Boundaries stay.
            ("smooth_spikes` moves", self.smooth_spikes && keeps_triangles),
        ];
        for (name, _) in kept.into_iter().filter(|(_, is_set)| *is_set) {
            if let Some((change, _)) = changes.iter().find(|(_, is_set)| *is_set) {
                let problem = format!("`{name}` keeps what `{change}");
                return Err(Error::option(name, problem, "remove one of them"));
            }
        }
        if !(self.tolerance >= 0.0 && self.tolerance.is_finite()) {
            let problem = format!("`tolerance` {} is out of range", self.tolerance);
            return Err(Error::option("tolerance", problem, "use 0 or a small number such as 1e-4"));
        }
        check_accuracy(self.accuracy)?;
        // Settings that do nothing would go unnoticed.
        let foreign = |group, method| {
            let problem = format!("`{group}` has settings of another method than the one chosen");
            Err(Error::option(group, problem, format!("leave them at their defaults, or choose {method}")))
        };
        match self.method {
            Method::CoarseToFine if self.all_at_once != AllAtOnceOptions::default() => {
                foreign("all_at_once", "Method::AllAtOnce")
            }
            Method::AllAtOnce if self.coarse_to_fine != self.sizes_alone() => {
                foreign("coarse_to_fine", "Method::CoarseToFine")
            }
            Method::AllAtOnce if self.shortage == Shortage::AddVertices => {
                let problem = "`shortage` add-vertices works only with Method::CoarseToFine";
                Err(Error::option("shortage", problem, "use `shortage` best-effort or refuse"))
            }
            Method::CoarseToFine
                if self.shortage == Shortage::AddVertices
                    && self.coarse_to_fine.sizing.aspect().is_some() =>
            {
                let problem = "`shortage` add-vertices does not go together with anisotropic sizing";
                Err(Error::option("shortage", problem, "use `shortage` best-effort or refuse"))
            }
            Method::CoarseToFine => Ok(()),
            Method::AllAtOnce => self.all_at_once.check_combination(self.iterations),
        }
    }
}

fn check_range(field: &'static str, value: u32, range: RangeInclusive<u32>) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    let problem = format!("`{field}` {value} is out of range");
    Err(Error::option(field, problem, format!("use {} to {}", range.start(), range.end())))
}
