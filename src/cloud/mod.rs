//! Point clouds: normals that agree, and the surface through the points.

mod distances;
mod field;
mod fill;
mod neighbours;
mod normals;
mod notches;
mod orient;
mod prepare;
mod signs;
mod sphere;
mod surface;
mod survey;
mod terrain;
mod trim;
mod turn;

pub use distances::{DistanceStatistics, PointDistances, point_distances};
pub use surface::{
    CloudSurface, SurfaceKind, SurfaceOptions, oriented_normals, surface, surface_with_progress,
};
pub use survey::{CloudSurvey, survey, unoriented_normals};

use glam::DVec3;

use crate::io::Loaded;
use crate::mesh::attributes::{Attributes, Role};

/// Points of a surface, in the units of their file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    /// Where they are.
    pub points: Vec<DVec3>,
    /// Outward normals, one for each point and of any length; empty if there are none. A zero or NaN normal
    /// stands for an unknown one. If any is unknown, or if neighbours disagree as normals of random signs do,
    /// all are found from the points.
    pub normals: Vec<DVec3>,
    /// Colours and other values of the points, as attributes of vertices.
    pub attributes: Attributes,
}

impl From<Loaded> for PointCloud {
    /// The vertices of what was read; its faces are left out.
    fn from(loaded: Loaded) -> Self {
        let points = loaded.mesh.vertices;
        let mut attributes = Attributes { vertex: loaded.attributes.vertex, ..Attributes::default() };
        let is_normal = |role| role == Role::Normal;
        let normals = attributes.vertex.iter().find(|a| is_normal(a.role) && a.components == 3);
        let normals = normals
            .map_or(Vec::new(), |normals| normals.values.chunks_exact(3).map(DVec3::from_slice).collect());
        attributes.vertex.retain(|attribute| !is_normal(attribute.role));
        Self { points, normals, attributes }
    }
}
