//! What a run with all vertices from the start is made of. The presets are settings of these; each can be chosen by itself.

use super::{Method, Options};
use crate::{Error, Result};
use serde::Serialize;

/// What a site's cell is cut from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Face {
    /// The tangent plane, by the bisectors as lines in it; coarse to fine only, and nothing else there.
    #[default]
    Planar,
    /// The tangent plane, as a cut of the Voronoi cell in space (the paper's restricted tangent faces).
    Tangent,
    /// The same, cut also by shadows of the neighbours (restricted power faces, Xu et al. 2019).
    Power,
    /// The surface itself (restricted Voronoi cells, Yan et al. 2009). Normals, projection, neighbours and `centroid` are
    /// not asked: cells need no planes, sites are their centroids.
    Exact,
}

/// Where tangent planes come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Normals {
    /// Planes that fit the nearest sites.
    Fit,
    /// The surface's own normals where the sites are projected to.
    #[default]
    Surface,
    /// Planes that fit the nearest points of the input, as if that were a point cloud (Chen et al. 2018).
    Cloud,
}

/// How sites get back onto the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Projection {
    /// Onto the triangles around the nearest vertices of the input.
    NearestVertices,
    /// Downhill over neighbouring triangles from the one they were on.
    #[default]
    Walk,
    /// The same, then to the closest point of all triangles that face the same way.
    Exact,
    /// Onto the planes of [`Normals::Cloud`].
    Plane,
}

/// Where sites begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Seeding {
    /// Anywhere, uniformly by area.
    Random,
    /// One in each equal share of the area.
    #[default]
    Stratified,
    /// Far from each other, without gaps (maximal Poisson-disk sampling, Guo et al. 2015).
    Poisson,
}

/// How the nearest sites are found. What is found is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Neighbours {
    /// By looking at all sites, as the paper does.
    Brute,
    /// By a hierarchy of boxes.
    #[default]
    Lists,
}

/// Longest list that the hierarchy of boxes makes.
const MAX_LISTED: u32 = 32;

/// Refuses what does not go together.
///
/// # Errors
/// [`Error::Usage`] that says why, and what does.
pub(crate) fn check(options: &Options) -> Result<()> {
    let refuse = |problem: &str, remedy: &str| Err(Error::usage(problem, remedy));
    check_lbfgs(options)?;
    match (options.method, options.face) {
        (Method::CoarseToFine, Face::Planar) | (Method::AllAtOnce, Face::Exact) => return Ok(()),
        (Method::CoarseToFine, _) => {
            return refuse(
                "the default method has planar faces alone",
                "leave --face out, or add --preset rtf",
            );
        }
        (Method::AllAtOnce, Face::Planar) => {
            return refuse("planar faces are made by the default method alone", "use --face tangent");
        }
        (Method::AllAtOnce, Face::Tangent | Face::Power) => {}
    }
    match (options.normals, options.projection) {
        (Normals::Fit | Normals::Surface, Projection::Plane) => {
            return refuse(
                "--projection plane pulls sites to the planes of --normals cloud, and there are none",
                "add --normals cloud, or choose another projection",
            );
        }
        (Normals::Surface, Projection::NearestVertices) => {
            return refuse(
                "--normals surface are found by a walk over the surface, and nearest vertices take none",
                "add --projection walk or --projection exact, or use --normals fit",
            );
        }
        _ => {}
    }
    if options.neighbours == Neighbours::Lists && listed(options) > MAX_LISTED {
        return refuse(
            &format!("lists have at most {MAX_LISTED} neighbours, fewer than --k-clip or --k-normal ask for"),
            "use --neighbours brute, or ask for fewer",
        );
    }
    Ok(())
}

/// Refuses what L-BFGS cannot be.
fn check_lbfgs(options: &Options) -> Result<()> {
    let (problem, remedy) = if options.lbfgs == 0 {
        return Ok(());
    } else if options.face != Face::Exact {
        ("L-BFGS needs the energy of cells on the surface, and faces in planes have none", "add --face exact")
    } else if options.momentum > 0.0 {
        (
            "momentum lengthens Lloyd's steps, and L-BFGS makes its own",
            "use --preset rvd, or add --momentum 0",
        )
    } else if options.iterations == 0 {
        ("without iterations there is nothing to do for L-BFGS", "add --iterations 160")
    } else {
        return Ok(());
    };
    Err(Error::usage(problem, format!("{remedy}, or leave --lbfgs out")))
}

/// Whether sites look for the nearest vertices of the input.
pub(crate) fn looks_for_vertices(options: &Options) -> bool {
    let in_planes = matches!(options.face, Face::Tangent | Face::Power);
    in_planes && (options.projection == Projection::NearestVertices || options.normals == Normals::Cloud)
}

/// Neighbours of a site that are looked for: one search serves normals and cells, and the fit counts the site itself.
pub(crate) fn listed(options: &Options) -> u32 {
    options.k_clip.max(options.k_normal - 1)
}
