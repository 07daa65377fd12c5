//! The presets and their settings, on the command line.

use super::heading::SHAPE;
use rtfmesh::options::{AllAtOnceOptions, Centroid, Face, Neighbours, Normals, Projection, Seeding};
use rtfmesh::{Method, Options, Quality};

/// A preset to start from and an option for each of its settings. What is not given is the preset's.
/// `rtfmesh presets` lists the settings, which are hidden in the help of the other commands.
#[derive(clap::Args)]
#[command(next_help_heading = SHAPE)]
pub struct ResearchArgs {
    /// Method: default, or another that `rtfmesh presets` describes
    ///
    /// The others are the method of a paper and those it compares with. They have further settings.
    #[arg(long, value_enum, default_value_t = Preset::Default, hide_short_help = true)]
    pub preset: Preset,
    #[command(flatten)]
    settings: SettingArgs,
}

/// The settings of the presets other than the default one.
#[derive(clap::Args)]
pub struct SettingArgs {
    /// Kind of cell
    #[arg(long, value_enum, hide = true)]
    face: Option<FaceName>,
    /// Initial positions of the vertices
    #[arg(long, value_enum, hide = true)]
    seeding: Option<SeedingName>,
    /// Source of the tangent planes of tangent and power cells
    #[arg(long, value_enum, hide = true)]
    normals: Option<NormalsName>,
    /// Projection of the vertices back onto the surface, with tangent and power cells
    #[arg(long, value_enum, hide = true)]
    projection: Option<ProjectionName>,
    /// Search for the nearest vertices, with tangent and power cells; the result is the same
    #[arg(long, value_enum, hide = true)]
    neighbours: Option<NeighboursName>,
    /// Point of its tangent or power cell to which a vertex moves
    #[arg(long, value_enum, hide = true)]
    centroid: Option<CentroidName>,
    /// With --normals fit: number of vertices, including the vertex itself, to which its plane is fitted, 3
    /// to 49
    #[arg(long, value_name = "K", hide = true)]
    k_normal: Option<u32>,
    /// Number of nearest vertices that clip a tangent or power cell, 3 to 48
    #[arg(long, value_name = "K", hide = true)]
    k_clip: Option<u32>,
    /// Number of nearest input vertices for --projection nearest-vertices or --normals cloud, 1 to 48
    #[arg(long, value_name = "K", hide = true)]
    k_project: Option<u32>,
    /// Distance between the shadow sites of power cells and their sites, in edge lengths
    #[arg(long, value_name = "LENGTHS", hide = true)]
    offset: Option<f64>,
    /// With exact cells: fraction of the previous motion that is added to a step, 0 to below 1
    #[arg(long, value_name = "FRACTION", hide = true)]
    momentum: Option<f64>,
    /// With exact cells and no momentum: number of steps that L-BFGS remembers, such as 7; 0 is Lloyd's
    /// iteration
    #[arg(long, value_name = "STEPS", hide = true)]
    lbfgs: Option<u32>,
}

/// Settings to start from.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Preset {
    /// Coarse-to-fine, the method for every use
    Default,
    /// Restricted tangent faces, the paper's method
    Rtf,
    /// Restricted power faces
    Rpf,
    /// Cells in planes fitted to the input's vertices as to a point cloud
    Rvc,
    /// Exact restricted Voronoi cells, with Lloyd's iteration
    Rvd,
    /// Exact restricted Voronoi cells, with momentum
    Cvd,
    /// Maximal Poisson-disk sampling, without iterations
    Mps,
}

impl Preset {
    /// The preset's options.
    pub fn options(self, vertices: usize, quality: Quality) -> Options {
        match self {
            Preset::Default => Options::with_quality(vertices, quality),
            Preset::Rtf => Options::rtf(vertices),
            Preset::Rpf => Options::rpf(vertices),
            Preset::Rvc => Options::rvc(vertices),
            Preset::Rvd => Options::rvd(vertices),
            Preset::Cvd => Options::cvd(vertices),
            Preset::Mps => Options::mps(vertices),
        }
    }
}

/// Where a vertex moves to.
#[derive(Clone, Copy, clap::ValueEnum)]
enum CentroidName {
    /// Mean of the cell's corners (Eq. 7 of the paper)
    Corners,
    /// The same with less weight for corners close together, which reproduces the paper's figures best
    WeightedCorners,
    /// Centroid of the cell's area (Eq. 3)
    Area,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum FaceName {
    /// Polygon in the tangent plane (restricted tangent face)
    Tangent,
    /// The same, clipped also by the neighbours' shadow sites (restricted power face)
    Power,
    /// Part of the surface itself (restricted Voronoi cell)
    Exact,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum NormalsName {
    /// Planes fitted to the nearest vertices of the result
    Fit,
    /// Normals of the input, as rough as the input is
    Surface,
    /// Planes fitted to the nearest vertices of the input, as if it were a point cloud
    Cloud,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum ProjectionName {
    /// Onto the triangles around the input's nearest vertices
    NearestVertices,
    /// Downhill from triangle to triangle
    Walk,
    /// The same, then to the closest point of all triangles with the same orientation
    Exact,
    /// Onto the planes of --normals cloud
    Plane,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum SeedingName {
    /// Uniformly random by area
    Random,
    /// One random point in each of N parts of equal area
    Stratified,
    /// Poisson disks: random points with a minimum distance and no gaps
    Poisson,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum NeighboursName {
    /// Compare all vertices
    Brute,
    /// Search a hierarchy of boxes
    Lists,
}

/// What a setting needs, where it does anything.
#[derive(Clone, Copy)]
pub enum Needs {
    /// A preset other than the default one.
    AllAtOnce,
    /// Tangent or power cells.
    Planes,
    /// Planes fitted to vertices of the result.
    FittedPlanes,
    /// A search for vertices of the input.
    InputVertices,
    /// Power cells.
    PowerCells,
    /// Exact cells.
    ExactCells,
    /// Exact cells without momentum.
    Lloyd,
}

impl Needs {
    /// Whether these options have it.
    pub fn are_met(self, options: &Options) -> bool {
        let AllAtOnceOptions { face, normals, projection, .. } = options.all_at_once;
        let is_near = projection == Projection::NearestVertices || normals == Normals::Cloud;
        options.method == Method::AllAtOnce
            && match self {
                Needs::AllAtOnce => true,
                Needs::Planes => face != Face::Exact,
                Needs::FittedPlanes => face != Face::Exact && normals == Normals::Fit,
                Needs::InputVertices => face != Face::Exact && is_near,
                Needs::PowerCells => face == Face::Power,
                Needs::ExactCells | Needs::Lloyd => face == Face::Exact,
            }
    }

    /// The need in words, and an option that meets it.
    pub fn words(self) -> (&'static str, &'static str) {
        let near = "--projection nearest-vertices or --normals cloud (presets rtf, rpf, rvc)";
        match self {
            Needs::AllAtOnce => ("presets other than default", "--preset rtf"),
            Needs::Planes => ("tangent and power cells (presets rtf, rpf, rvc)", "--preset rtf"),
            Needs::FittedPlanes => ("--normals fit (presets rtf, rpf)", "--preset rtf"),
            Needs::InputVertices => (near, "--preset rtf"),
            Needs::PowerCells => ("--face power (preset rpf)", "--preset rpf"),
            Needs::ExactCells => ("--face exact (presets rvd, cvd)", "--preset cvd"),
            Needs::Lloyd => ("--face exact without momentum (preset rvd)", "--preset rvd"),
        }
    }
}

/// The settings by their names in [`AllAtOnceOptions`], with what each needs.
pub const SETTINGS: [(&str, Needs); 12] = [
    ("face", Needs::AllAtOnce),
    ("seeding", Needs::AllAtOnce),
    ("normals", Needs::Planes),
    ("projection", Needs::Planes),
    ("neighbours", Needs::Planes),
    ("centroid", Needs::Planes),
    ("k_normal", Needs::FittedPlanes),
    ("k_clip", Needs::Planes),
    ("k_project", Needs::InputVertices),
    ("offset", Needs::PowerCells),
    ("momentum", Needs::ExactCells),
    ("lbfgs", Needs::Lloyd),
];

impl ResearchArgs {
    /// The first setting that is given and does nothing with these options.
    pub fn idle_setting(&self, options: &Options) -> Option<(&'static str, Needs)> {
        let is_given = self.settings.are_given();
        let settings = SETTINGS.into_iter().zip(is_given);
        settings
            .filter(|(_, is_given)| *is_given)
            .map(|(it, _)| it)
            .find(|(_, needs)| !needs.are_met(options))
    }

    /// Puts what is given in place of the preset's.
    pub fn put(&self, options: &mut AllAtOnceOptions) {
        self.settings.put(options);
    }

    /// Whether a centroid is given.
    pub fn names_centroid(&self) -> bool {
        self.settings.centroid.is_some()
    }
}

impl SettingArgs {
    /// In the order of [`SETTINGS`].
    fn are_given(&self) -> [bool; 12] {
        [
            self.face.is_some(),
            self.seeding.is_some(),
            self.normals.is_some(),
            self.projection.is_some(),
            self.neighbours.is_some(),
            self.centroid.is_some(),
            self.k_normal.is_some(),
            self.k_clip.is_some(),
            self.k_project.is_some(),
            self.offset.is_some(),
            self.momentum.is_some(),
            self.lbfgs.is_some(),
        ]
    }

    fn put(&self, options: &mut AllAtOnceOptions) {
        options.face = self.face.map_or(options.face, |name| match name {
            FaceName::Tangent => Face::Tangent,
            FaceName::Power => Face::Power,
            FaceName::Exact => Face::Exact,
        });
        options.normals = self.normals.map_or(options.normals, |name| match name {
            NormalsName::Fit => Normals::Fit,
            NormalsName::Surface => Normals::Surface,
            NormalsName::Cloud => Normals::Cloud,
        });
        options.projection = self.projection.map_or(options.projection, |name| match name {
            ProjectionName::NearestVertices => Projection::NearestVertices,
            ProjectionName::Walk => Projection::Walk,
            ProjectionName::Exact => Projection::Exact,
            ProjectionName::Plane => Projection::Plane,
        });
        options.seeding = self.seeding.map_or(options.seeding, |name| match name {
            SeedingName::Random => Seeding::Random,
            SeedingName::Stratified => Seeding::Stratified,
            SeedingName::Poisson => Seeding::Poisson,
        });
        options.neighbours = self.neighbours.map_or(options.neighbours, |name| match name {
            NeighboursName::Brute => Neighbours::Brute,
            NeighboursName::Lists => Neighbours::Lists,
        });
        options.centroid = self.centroid.map_or(options.centroid, |name| match name {
            CentroidName::Corners => Centroid::Corners,
            CentroidName::WeightedCorners => Centroid::WeightedCorners,
            CentroidName::Area => Centroid::Area,
        });
        options.k_normal = self.k_normal.unwrap_or(options.k_normal);
        options.k_clip = self.k_clip.unwrap_or(options.k_clip);
        options.k_project = self.k_project.unwrap_or(options.k_project);
        options.offset = self.offset.unwrap_or(options.offset);
        options.momentum = self.momentum.unwrap_or(options.momentum);
        options.lbfgs = self.lbfgs.unwrap_or(options.lbfgs);
    }
}
