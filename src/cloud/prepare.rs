//! Points made ready: checked, in the unit frame, each place once, neighbours in space close in memory.

use glam::DVec3;

use super::PointCloud;
use crate::grammar::counted;
use crate::mesh::unit_frame::UnitFrame;
use crate::mesh::{TriMesh, position_key};
use crate::sites::morton::morton_order;
use crate::{Error, Result};

/// Fewer points than this make no surface.
pub(super) const LEAST: usize = 10;

/// Points in Morton order of the unit frame.
pub(super) struct Points {
    pub at: Vec<DVec3>,
    /// Given normals of length 1, or zero where one is unknown; empty if none are given.
    pub normals: Vec<DVec3>,
    /// Of each, the point of the cloud.
    pub origin: Vec<u32>,
    pub frame: UnitFrame,
    /// Points left out because others are at the same place.
    pub duplicates: usize,
}

impl Points {
    /// # Errors
    /// [`Error::Input`] for coordinates that are not finite, for fewer than `least` places or all at one
    /// point, and for normals that are not as many as points.
    pub fn new(cloud: &PointCloud, least: usize) -> Result<Self> {
        check(cloud)?;
        let PointCloud { points, normals, .. } = cloud;
        if points.len() < least {
            return Err(too_few(points.len()));
        }
        let frame = UnitFrame::of(&TriMesh { vertices: points.clone(), triangles: Vec::new() })?;
        let unit: Vec<DVec3> = points.iter().map(|p| frame.to_unit(*p)).collect();
        let mut origin = morton_order(&unit);
        // Equal places have equal codes, but so have others; the order of places decides among them.
        let mut seen = std::collections::HashSet::with_capacity(points.len());
        origin.retain(|i| seen.insert(position_key(unit[*i as usize])));
        if origin.len() < least {
            return Err(too_few(origin.len()));
        }
        let duplicates = points.len() - origin.len();
        let at = origin.iter().map(|i| unit[*i as usize]).collect();
        let of = |i: &u32| normals[*i as usize].try_normalize().unwrap_or(DVec3::ZERO);
        let normals = if normals.is_empty() { Vec::new() } else { origin.iter().map(of).collect() };
        Ok(Self { at, normals, origin, frame, duplicates })
    }

    /// Keeps those with these numbers, ascending.
    pub fn keep(&mut self, kept: &[u32]) {
        let pick = |all: &[DVec3]| kept.iter().map(|i| all[*i as usize]).collect();
        self.at = pick(&self.at);
        if !self.normals.is_empty() {
            self.normals = pick(&self.normals);
        }
        self.origin = kept.iter().map(|i| self.origin[*i as usize]).collect();
    }
}

/// # Errors
/// [`Error::Input`] for coordinates that are not finite, and for normals that are not as many as points.
pub(super) fn check(cloud: &PointCloud) -> Result<()> {
    let PointCloud { points, normals, .. } = cloud;
    if u32::try_from(points.len()).is_err() {
        let problem = format!("the cloud has {} points, more than an index can count", points.len());
        return Err(Error::input(None, problem, "thin it out"));
    }
    if let Some(point) = points.iter().position(|p| !p.is_finite()) {
        let place = Some(format!("point {point}"));
        return Err(Error::input(place, "a coordinate is not finite", "remove the point"));
    }
    if !normals.is_empty() && normals.len() != points.len() {
        let normals = counted(normals.len(), ["normal", "normals"]);
        let problem = format!("the cloud has {normals} for {}", counted(points.len(), ["point", "points"]));
        return Err(Error::input(None, problem, "give one for each point, or none"));
    }
    Ok(())
}

pub(super) fn too_few(places: usize) -> Error {
    let problem = format!("there are no faces, and {places} different points are too few for a surface");
    Error::input(None, problem, format!("give at least {LEAST}, and many more for a good surface"))
}
