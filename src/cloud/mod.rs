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
use crate::mesh::attributes::{Attribute, Attributes, Role};
use crate::mesh::quick_hash::GOLDEN_RATIO;

/// Points of a surface, in the units of their file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    /// Positions.
    pub points: Vec<DVec3>,
    /// Outward normals of any length, one for each point, or empty. Zero or NaN means unknown. If any is
    /// unknown, or if neighbouring normals disagree as random signs do, all are computed from the points.
    pub normals: Vec<DVec3>,
    /// Colours and other values of the points, as attributes of vertices.
    pub attributes: Attributes,
}

impl PointCloud {
    /// One point of each `step`, which must not be 0. Which one changes, since scanners repeat themselves.
    fn one_of(&self, step: usize) -> Self {
        let chosen: Vec<usize> = (0..self.points.len() / step)
            .map(|k| k * step + ((k as u64).wrapping_mul(GOLDEN_RATIO) >> 32) as usize % step)
            .collect();
        let normals = if self.normals.is_empty() { &[] } else { chosen.as_slice() };
        let of = |attribute: &Attribute| {
            let values = chosen.iter().flat_map(|i| attribute.at(*i)).copied().collect();
            Attribute { values, ..attribute.clone() }
        };
        let vertex = self.attributes.vertex.iter().map(of).collect();
        Self {
            points: chosen.iter().map(|i| self.points[*i]).collect(),
            normals: normals.iter().map(|i| self.normals[*i]).collect(),
            attributes: Attributes { vertex, ..Attributes::default() },
        }
    }
}

impl From<Loaded> for PointCloud {
    /// The vertices of what was read, without its triangles.
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
