//! Settings of [`Method::AllAtOnce`](super::Method::AllAtOnce), in which the presets differ. Each can be set
//! separately.

use super::{MAX_LBFGS, MAX_NEIGHBOURS, MAX_OFFSET, check_range};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Kind of cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Face {
    /// The Voronoi cell in space, cut by the tangent plane (the paper's restricted tangent face).
    #[default]
    Tangent,
    /// Like `Tangent`, also clipped by shadow sites of the neighbours (restricted power face, Xu et al.
    /// 2019).
    Power,
    /// A part of the surface itself (restricted Voronoi cell, Yan et al. 2009). Sites move to the centroids
    /// of their cells; normals, projection, neighbours and `centroid` have no effect.
    Exact,
}

/// Source of the tangent planes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Normals {
    /// Planes fitted to the nearest sites.
    #[default]
    Fit,
    /// Normals of the surface at the projected sites.
    Surface,
    /// Planes fitted to the nearest input vertices, as if they were a point cloud (Chen et al. 2018).
    Cloud,
}

/// Projection of sites back onto the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Projection {
    /// Onto the triangles around the nearest vertices of the input.
    #[default]
    NearestVertices,
    /// Downhill over adjacent triangles, from the one they were on.
    Walk,
    /// Like `Walk`, then to the closest point of all triangles with the same orientation.
    Exact,
    /// Onto the planes of [`Normals::Cloud`].
    Plane,
}

/// Initial positions of the sites.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Seeding {
    /// Uniformly random by area.
    #[default]
    Random,
    /// One random point in each of N parts of equal area.
    Stratified,
    /// Far from each other, without gaps (maximal Poisson-disk sampling, Guo et al. 2015).
    Poisson,
}

/// Search for the nearest sites; the result is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Neighbours {
    /// Compare all sites, as the paper does.
    #[default]
    Brute,
    /// Search a hierarchy of boxes.
    Lists,
}

/// Which point of its face a site moves to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Centroid {
    /// The mean of the face's corners (Eq. 7 of the paper).
    Corners,
    /// The mean of the face's corners with less weight for corners close together. This reproduces the
    /// paper's figures best (docs/presets.md).
    #[default]
    WeightedCorners,
    /// The centroid of the face's area (Eq. 3).
    Area,
}

/// Settings of [`Method::AllAtOnce`](super::Method::AllAtOnce). The defaults, those of
/// [`rtf`](super::Options::rtf), are the paper's except for `centroid`.
/// [`validate`](super::Options::validate) refuses combinations that do not work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(default, deny_unknown_fields)]
pub struct AllAtOnceOptions {
    /// Kind of cell.
    pub face: Face,
    /// Tangent and power faces: source of their planes.
    pub normals: Normals,
    /// Tangent and power faces: projection of sites back onto the surface.
    pub projection: Projection,
    /// Initial positions of the sites.
    pub seeding: Seeding,
    /// Tangent and power faces: search for the nearest sites.
    pub neighbours: Neighbours,
    /// Number of sites to which the plane of a normal is fitted, including the site itself; 3 to
    /// [`MAX_NEIGHBOURS`] + 1 (the paper's k_nor).
    pub k_normal: u32,
    /// Number of sites that clip a cell before the radius of security is checked; 3 to [`MAX_NEIGHBOURS`]
    /// (the paper's k_clip).
    pub k_clip: u32,
    /// Number of input vertices whose triangles a site is projected onto, or to which its plane is fitted; 1
    /// to [`MAX_NEIGHBOURS`] (the paper's k_proj).
    pub k_project: u32,
    /// Tangent and power faces: the point of its face that a site moves to.
    pub centroid: Centroid,
    /// Exact cells: maximum fraction of the previous motion that is added to a step, 0 to below 1. 0 is
    /// Lloyd's iteration.
    pub momentum: f64,
    /// Exact cells: number of steps that L-BFGS remembers, 0 to [`MAX_LBFGS`]; 7 is usual. 0 is Lloyd's
    /// iteration; otherwise `momentum` must be 0.
    pub lbfgs: u32,
    /// Power faces: distance of a shadow site from its site in spacings, 0 to [`MAX_OFFSET`] (the paper's d).
    pub offset: f64,
}

impl Default for AllAtOnceOptions {
    fn default() -> Self {
        Self {
            face: Face::Tangent,
            normals: Normals::Fit,
            projection: Projection::NearestVertices,
            seeding: Seeding::Random,
            neighbours: Neighbours::Brute,
            k_normal: 16,
            k_clip: 32,
            k_project: 16,
            centroid: Centroid::WeightedCorners,
            momentum: 0.0,
            lbfgs: 0,
            offset: 0.5,
        }
    }
}

/// Longest list that the hierarchy of boxes makes.
const MAX_LISTED: u32 = 32;

impl AllAtOnceOptions {
    /// Whether sites look for the nearest vertices of the input.
    pub(crate) fn looks_for_vertices(&self) -> bool {
        let near = self.projection == Projection::NearestVertices || self.normals == Normals::Cloud;
        self.face != Face::Exact && near
    }

    /// Neighbours of a site that are looked for: one search serves normals and cells, and the fit counts the
    /// site itself.
    pub(crate) fn neighbour_count(&self) -> u32 {
        self.k_clip.max(self.k_normal - 1)
    }

    /// Checks each range.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the field.
    pub(super) fn check_ranges(&self) -> Result<()> {
        check_range("k_normal", self.k_normal, 3..=MAX_NEIGHBOURS + 1)?;
        check_range("k_clip", self.k_clip, 3..=MAX_NEIGHBOURS)?;
        check_range("k_project", self.k_project, 1..=MAX_NEIGHBOURS)?;
        check_range("lbfgs", self.lbfgs, 0..=MAX_LBFGS)?;
        if !(0.0..1.0).contains(&self.momentum) {
            let problem = format!("`momentum` {} is out of range", self.momentum);
            return Err(Error::option(
                "momentum",
                problem,
                "use a number from 0 up to but not including 1, such as 0.9",
            ));
        }
        if !(0.0..=MAX_OFFSET).contains(&self.offset) {
            let problem = format!("`offset` {} is out of range", self.offset);
            return Err(Error::option("offset", problem, format!("use 0 to {MAX_OFFSET} edge lengths")));
        }
        Ok(())
    }

    /// Refuses what does not go together.
    ///
    /// # Errors
    /// [`Error::Usage`] that says why, and what does.
    pub(super) fn check_combination(&self, iterations: u32) -> Result<()> {
        self.check_lbfgs(iterations)?;
        if self.face == Face::Exact {
            return Ok(());
        }
        match (self.normals, self.projection) {
            (Normals::Fit | Normals::Surface, Projection::Plane) => {
                return Err(Error::option(
                    "projection",
                    "`projection` plane needs the planes of `normals` cloud",
                    "use `normals` cloud, or choose another projection",
                ));
            }
            (Normals::Surface, Projection::NearestVertices) => {
                return Err(Error::option(
                    "normals",
                    "`normals` surface needs a walk over the surface, which `projection` nearest-vertices \
                    does not do",
                    "use `projection` walk or exact, or `normals` fit",
                ));
            }
            _ => {}
        }
        if self.neighbours == Neighbours::Lists && self.neighbour_count() > MAX_LISTED {
            let field = if self.k_clip > MAX_LISTED { "k_clip" } else { "k_normal" };
            return Err(Error::option(
                field,
                format!(
                    "`neighbours` lists finds at most {MAX_LISTED} neighbours, fewer than `{field}` needs"
                ),
                "use `neighbours` brute, or a smaller number",
            ));
        }
        Ok(())
    }

    /// Refuses settings that L-BFGS cannot work with.
    fn check_lbfgs(&self, iterations: u32) -> Result<()> {
        let (problem, remedy) = if self.lbfgs == 0 {
            return Ok(());
        } else if self.face != Face::Exact {
            ("`lbfgs` works only with exact cells", "use `face` exact")
        } else if self.momentum > 0.0 {
            ("`lbfgs` and `momentum` exclude each other", "use `momentum` 0")
        } else if iterations == 0 {
            ("`lbfgs` has nothing to do without iterations", "use `iterations` 160")
        } else {
            return Ok(());
        };
        Err(Error::option("lbfgs", problem, format!("{remedy}, or leave `lbfgs` at 0")))
    }
}
