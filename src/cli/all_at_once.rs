//! The settings that comparisons and experiments use, on the command line.

use super::heading::RESEARCH;
use rtfmesh::{AllAtOnceOptions, Centroid, Face, Neighbours, Normals, Options, Projection, Quality, Seeding};

/// A preset to start from and one option for each of its settings. What is not given is the preset's.
#[derive(clap::Args)]
#[command(next_help_heading = RESEARCH)]
pub struct ResearchArgs {
    /// Method, with its settings: rtf is the paper's; rpf, rvc, rvd, cvd and mps are those the paper compares
    /// with. The options below change a setting each
    #[arg(long, value_enum, default_value_t = Preset::Default, hide_short_help = true)]
    pub preset: Preset,
    /// Kind of cell, in all presets but default [preset rtf, rvc: tangent; rpf: power; rvd, cvd, mps: exact]
    #[arg(long, value_enum, hide_short_help = true)]
    face: Option<FaceName>,
    /// First positions of the vertices, in all presets but default [presets: random; mps: poisson]
    #[arg(long, value_enum, hide_short_help = true)]
    seeding: Option<SeedingName>,
    /// Normals of the planes of tangent and power cells [preset rtf, rpf: fit; rvc: cloud]
    #[arg(long, value_enum, hide_short_help = true)]
    normals: Option<NormalsName>,
    /// Projection of vertices back onto the surface, with tangent and power cells [preset rtf, rpf:
    /// nearest-vertices; rvc: plane]
    #[arg(long, value_enum, hide_short_help = true)]
    projection: Option<ProjectionName>,
    /// Search for the nearest vertices, with tangent and power cells; the result is the same [preset rtf:
    /// brute]
    #[arg(long, value_enum, hide_short_help = true)]
    neighbours: Option<NeighboursName>,
    /// Point of its cell that a vertex moves to, with tangent and power cells [preset rtf:
    /// weighted-corners]
    #[arg(long, value_enum, hide_short_help = true)]
    pub centroid: Option<CentroidName>,
    /// Number of nearest vertices, itself included, whose plane gives a vertex its normal, with --normals
    /// fit: 3 to 49 [preset rtf: 16]
    #[arg(long, value_name = "K", hide_short_help = true)]
    pub k_normal: Option<u32>,
    /// Number of nearest vertices that clip a tangent or power cell: 3 to 48 [preset rtf: 32]
    #[arg(long, value_name = "K", hide_short_help = true)]
    pub k_clip: Option<u32>,
    /// Number of nearest input vertices: those whose triangles are projected onto with --projection
    /// nearest-vertices, or those that the plane fits with --normals cloud: 1 to 48 [presets: 16]
    #[arg(long, value_name = "K", hide_short_help = true)]
    pub k_project: Option<u32>,
    /// Distance of the shadow sites of power cells from their sites, in edge lengths [preset rpf: 0.5]
    #[arg(long, value_name = "LENGTHS", hide_short_help = true)]
    pub offset: Option<f64>,
    /// Momentum of exact cells: largest share of the previous motion added to a step [preset rvd: 0; cvd:
    /// 0.9]
    #[arg(long, value_name = "SHARE", hide_short_help = true)]
    pub momentum: Option<f64>,
    /// Memory of L-BFGS in steps, such as 7, with exact cells and no momentum; 0 is Lloyd's iteration
    /// [presets: 0]
    #[arg(long, value_name = "STEPS", hide_short_help = true)]
    pub lbfgs: Option<u32>,
}

/// Settings to start from.
#[derive(Clone, Copy, clap::ValueEnum)]
pub enum Preset {
    /// Coarse to fine: the method for every use
    Default,
    /// The paper's method: restricted tangent faces
    Rtf,
    /// Restricted power faces, otherwise as rtf
    Rpf,
    /// Cells in planes fitted to the input's vertices as to a point cloud, otherwise as rtf
    Rvc,
    /// Exact restricted Voronoi cells and Lloyd's iteration
    Rvd,
    /// The same with momentum
    Cvd,
    /// Maximal Poisson-disk sampling: random points with a least distance and no gaps, connected as they are
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
pub enum CentroidName {
    /// Mean of the cell's corners (Eq. 7 of the paper)
    Corners,
    /// The same, but corners close together count less, which comes closest to the paper's figures
    WeightedCorners,
    /// Centroid of the cell's area (Eq. 3)
    Area,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum FaceName {
    /// In the tangent plane (restricted tangent faces)
    Tangent,
    /// In the tangent plane, clipped by the neighbours' shadow sites as well (restricted power faces)
    Power,
    /// On the surface itself (restricted Voronoi cells)
    Exact,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum NormalsName {
    /// Planes fitted to the nearest vertices of the result
    Fit,
    /// Normals of the input at that place, as rough as the input is
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
    /// The same, then to the closest point of all triangles that face the same way
    Exact,
    /// Onto the planes of --normals cloud
    Plane,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum SeedingName {
    /// Uniformly random by area
    Random,
    /// One random point in each equal share of the area
    Stratified,
    /// Poisson disks: random points with a least distance and no gaps
    Poisson,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum NeighboursName {
    /// Compare with all vertices
    Brute,
    /// Search a hierarchy of boxes
    Lists,
}

/// Options by name, and whether they are given.
type Given<const N: usize> = [(&'static str, bool); N];

impl ResearchArgs {
    /// Those for all faces, and those for faces in planes.
    pub fn given(&self) -> (Given<2>, Given<3>) {
        (
            [("--face", self.face.is_some()), ("--seeding", self.seeding.is_some())],
            [
                ("--normals", self.normals.is_some()),
                ("--projection", self.projection.is_some()),
                ("--neighbours", self.neighbours.is_some()),
            ],
        )
    }

    /// Puts what is given in place of the preset's.
    pub fn put(&self, options: &mut AllAtOnceOptions) {
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
