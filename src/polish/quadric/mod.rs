//! Vertices on ridges that no curve marks: fillets and chamfers narrower than an edge, and creases that were
//! given up for want of vertices.
//!
//! Every site minimizes `∫ |x − s|² + α (n(x)·(x − s))² dA` over its cell, again and again, while α grows
//! ([`pull_sites`]). In a flat cell, the second term only holds the site to the plane. Where a cell lies
//! across a ridge, the minimum is near it, and where three sides meet, near their corner; so sites line up,
//! and edges between them run along the ridge. Nothing is detected. The connected mesh goes on with the same
//! energy and with flips that judge distances ([`line_up`]). Its ridges are curves for the passes that mend
//! it ([`add_ridges`]).
//!
//! The sum of squared distances from planes is the quadric of Garland and Heckbert (1997). Valette et al.
//! (2008) used it to place the vertices of clusters, and CWF (Xu et al. 2024) added it to the energy of
//! centroidal cells.

mod cell_quadric;
mod cells;
mod chains;
mod flips;
mod line_up;

pub(crate) use chains::add_ridges;
pub(crate) use line_up::line_up;

use glam::DVec3;

use super::Target;
use crate::mesh::sizing::SizeField;
use crate::{ProgressToken, Result, TriMesh};
use cell_quadric::CellQuadric;
use cells::Cells;

/// Rounds in which all sites move.
const ROUNDS: u32 = 40;
/// Fraction of the rounds in which the weight of the normals' term grows.
const GROWING: f64 = 0.5;
/// The weight of the normals' term in the end.
const WEIGHT: f64 = 10.0;
/// A cell lies across a ridge if the surface turns by more: two sides of the same area at 45 degrees make
/// 0.15, at 90 degrees 0.5.
const ACROSS_RIDGE: f64 = 0.15;

/// A site that was relaxed with the normals' term.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PulledSite {
    /// Where it is, which may be off the surface.
    pub at: DVec3,
    /// The mean normal of its cell.
    pub normal: DVec3,
    /// Whether it moved and its cell lies across a ridge.
    pub is_on_ridge: bool,
}

/// Relaxes the vertices of a mesh, other than the `fixed` ones, as sites with the normals' term, in cells as
/// large as `sizes` say. The mesh only tells which vertex is near each place of the surface at first.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn pull_sites(
    mesh: &TriMesh,
    fixed: &[bool],
    (target, sizes): (&Target, &SizeField),
    progress: &ProgressToken,
) -> Result<Vec<PulledSite>> {
    let mut sites = mesh.vertices.clone();
    let mut cells = Cells::new(mesh, (target, sizes));
    let mut quadrics = cells.quadrics(&sites);
    let is_fixed = |v: usize| fixed.get(v).copied().unwrap_or(false);
    for round in 0..ROUNDS {
        progress.poll()?;
        let grown = (f64::from(round) / (GROWING * f64::from(ROUNDS))).min(1.0);
        let weight = WEIGHT * grown * grown;
        for (v, (site, quadric)) in sites.iter_mut().zip(&quadrics).enumerate() {
            if !is_fixed(v) {
                *site += quadric.minimum(weight);
            }
        }
        let normals: Vec<DVec3> = quadrics.iter().map(mean_normal).collect();
        cells.assign(&sites, &normals);
        quadrics = cells.quadrics(&sites);
    }
    let pulled = |(v, (site, quadric)): (usize, (&DVec3, &CellQuadric))| PulledSite {
        at: *site,
        normal: mean_normal(quadric),
        is_on_ridge: !is_fixed(v) && quadric.turn() > ACROSS_RIDGE,
    };
    Ok(sites.iter().zip(&quadrics).enumerate().map(pulled).collect())
}

fn mean_normal(quadric: &CellQuadric) -> DVec3 {
    quadric.normal.normalize_or_zero()
}
