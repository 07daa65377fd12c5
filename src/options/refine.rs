//! Parts of the surface with edges of a given length.

use super::target_count::Length;
use crate::{Error, Result};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A part of the surface and how long the edges are in it. Where several overlap, the shortest length counts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Refinement {
    /// The part.
    pub region: Region,
    /// The edge length in it.
    pub length: Length,
}

/// A part of the input's surface, in its units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Region {
    /// What is within a distance of a point.
    Sphere {
        /// The point.
        centre: DVec3,
        /// The distance, above 0.
        radius: f64,
    },
    /// What is in a box along the axes.
    Box {
        /// Its corner with the smallest coordinates.
        low: DVec3,
        /// Its corner with the largest coordinates.
        high: DVec3,
    },
    /// These triangles of the input.
    Triangles {
        /// What messages call them.
        name: String,
        /// Their indices.
        triangles: Vec<u32>,
    },
}

impl Region {
    /// What messages call it.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Sphere { centre: DVec3 { x, y, z }, radius } => format!("sphere:{x},{y},{z},{radius}"),
            Self::Box { low, high } => {
                format!("box:{},{},{},{},{},{}", low.x, low.y, low.z, high.x, high.y, high.z)
            }
            Self::Triangles { name, .. } => name.clone(),
        }
    }
}

/// Checks all that can be checked without a mesh.
///
/// # Errors
/// [`Error::Usage`] for a length that is not above 0, and for a sphere or box without extent.
pub(super) fn check(list: &[Refinement]) -> Result<()> {
    for Refinement { region, length } in list {
        let (Length::Units(value) | Length::OfDiagonal(value)) = length;
        let refuse = |what: &str, remedy: &str| {
            Err(Error::option("refine", format!("`refine` {}: {what}", region.name()), remedy))
        };
        if !(*value > 0.0 && value.is_finite()) {
            return refuse(&format!("the length {value} is out of range"), "give a length above 0");
        }
        match region {
            Region::Sphere { centre, radius }
                if !(centre.is_finite() && radius.is_finite() && *radius > 0.0) =>
            {
                return refuse("the radius is out of range", "give a centre, and a radius above 0");
            }
            Region::Box { low, high } if !(low.is_finite() && high.is_finite() && low.cmple(*high).all()) => {
                return refuse("the box is empty", "give the smaller X, Y and Z first, then the larger ones");
            }
            _ => {}
        }
    }
    Ok(())
}
