//! Meshes of fewer vertices by edge collapses that preserve the topology.
//!
//! Slower than cells and with worse triangles, but the result has the topology of the input, however few
//! vertices it gets: components, handles, boundaries and junctions smaller than an edge survive.

use super::TriMesh;
use crate::{ProgressToken, Result};
use collapse::Collapser;
use graph::Graph;
pub use graph::{Preserved, Simplified};
pub use insert::Site;

mod collapse;
mod flip;
mod graph;
mod insert;
mod split;

/// The surface with `count` vertices, all of them vertices of `mesh` if that has as many; else the longest
/// edges are halved. If no mesh of so few vertices can be reached without changing the topology or running
/// through itself, one with more comes back. Vertices move along curves only, and corners not at all. Panics
/// if an index is out of range.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn with_vertices(
    mesh: &TriMesh,
    preserved: Preserved,
    count: usize,
    progress: &ProgressToken,
) -> Result<Simplified> {
    let mut graph = Graph::new(mesh, preserved);
    reach(&mut graph, count, progress)?;
    Ok(graph.into_mesh())
}

/// As [`with_vertices`], but vertices are at `sites` as far as the topology allows: where it needs others, as
/// at handles smaller than an edge, some sites are left out for them.
///
/// # Errors
/// As [`with_vertices`].
pub fn at_sites(
    mesh: &TriMesh,
    preserved: Preserved,
    sites: &[Site],
    count: usize,
    progress: &ProgressToken,
) -> Result<Simplified> {
    let mut graph = Graph::new(mesh, preserved);
    let fixed = graph.fixed.clone();
    for v in insert::insert(&mut graph, sites) {
        graph.fixed[v as usize] = true;
    }
    let inserted = graph.fixed.len();
    Collapser::new(&mut graph, progress).collapse(count)?;
    graph.fixed = fixed;
    graph.fixed.resize(inserted, false);
    reach(&mut graph, count, progress)?;
    Ok(graph.into_mesh())
}

/// Removes or adds vertices until there are `count`.
fn reach(graph: &mut Graph, count: usize, progress: &ProgressToken) -> Result<()> {
    if graph.used > count {
        return Collapser::new(graph, progress).collapse(count);
    }
    split::split(graph, count);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::mesh::samples::sample;
    use glam::DVec3;

    #[test]
    fn cancelled_work_gives_no_mesh() {
        let mesh = sample("torus").unwrap();
        let progress = ProgressToken::default();
        progress.cancel();
        let made = with_vertices(&mesh, Preserved::default(), 50, &progress);
        assert_eq!(made, Err(Error::Cancelled));
        let site = Site { at: mesh.corners(0).iter().sum::<DVec3>() / 3.0, triangle: 0 };
        let made = at_sites(&mesh, Preserved::default(), &[site], 50, &progress);
        assert_eq!(made, Err(Error::Cancelled));
    }
}
