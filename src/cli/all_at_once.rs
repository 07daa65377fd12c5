//! What a run with all vertices from the start is made of, on the command line.

use rtfmesh::{AllAtOnceOptions, Face, Neighbours, Normals, Projection, Seeding};

/// A stage each. What is not given is the preset's.
#[derive(clap::Args)]
pub struct ChoiceArgs {
    /// All presets but default: what a vertex's cell is cut from [preset rtf, rvc: tangent; rpf: power; rvd, cvd, mps: exact]
    #[arg(long, value_enum)]
    face: Option<FaceName>,
    /// Faces tangent and power: where their planes come from [preset rtf, rpf: fit; rvc: cloud]
    #[arg(long, value_enum)]
    normals: Option<NormalsName>,
    /// Faces tangent and power: how vertices get back onto the surface [preset rtf, rpf: nearest-vertices; rvc: plane]
    #[arg(long, value_enum)]
    projection: Option<ProjectionName>,
    /// All presets but default: where vertices begin [presets: random; mps: poisson]
    #[arg(long, value_enum)]
    seeding: Option<SeedingName>,
    /// Faces tangent and power: how the nearest vertices are found; what is found is the same [preset rtf: brute]
    #[arg(long, value_enum)]
    neighbours: Option<NeighboursName>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum FaceName {
    /// Tangent planes (restricted tangent faces)
    Tangent,
    /// Tangent planes, cut also by the neighbours' shadows (restricted power faces)
    Power,
    /// The surface itself (restricted Voronoi cells)
    Exact,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum NormalsName {
    /// Planes that fit the nearest vertices of the result
    Fit,
    /// The input's own normals there, as rough as the input is
    Surface,
    /// Planes that fit the nearest points of the input, as if it were a point cloud
    Cloud,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum ProjectionName {
    /// Onto the triangles around the input's nearest vertices
    NearestVertices,
    /// Downhill over neighbouring triangles
    Walk,
    /// The same, then to the closest point of all triangles that face the same way
    Exact,
    /// Onto the planes of --normals cloud
    Plane,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum SeedingName {
    /// Anywhere, uniformly by area
    Random,
    /// One in each equal share of the area
    Stratified,
    /// Far from each other, without gaps
    Poisson,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum NeighboursName {
    /// By looking at all
    Brute,
    /// By a hierarchy of boxes
    Lists,
}

/// Options by name, and whether they are given.
type Given<const N: usize> = [(&'static str, bool); N];

impl ChoiceArgs {
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
    }
}
