//! Meshes of fewer vertices by edge collapses that preserve the topology.
//!
//! Slower than cells and with worse triangles, but the result has the topology of the input, however few
//! vertices it gets: components, handles, boundaries and junctions smaller than an edge survive.

use super::TriMesh;
use crate::{ProgressToken, Result};
use collapse::Collapser;
use graph::Graph;
pub use graph::{Preserved, Simplified};

mod apart;
mod changes;
mod collapse;
mod flip;
mod graph;
mod split;

/// The surface with `count` vertices, all of them vertices of `mesh` if that has as many; else the longest
/// edges are halved. If no mesh with so few vertices can be reached without a change of topology or, unless
/// faces may intersect, new self-intersections, one with more is returned: the smallest possible for 0, but
/// perhaps not for a number below what the topology needs. Vertices move along curves only, and corners not
/// at all. Panics if an index is out of range.
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
    if graph.used > count {
        Collapser::new(&mut graph, mesh, preserved, progress).collapse(count)?;
    } else {
        split::split(&mut graph, count);
    }
    Ok(graph.into_mesh())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::mesh::samples::sample;

    #[test]
    fn cancelled_work_gives_no_mesh() {
        let mesh = sample("torus").unwrap();
        let progress = ProgressToken::default();
        progress.cancel();
        let made = with_vertices(&mesh, Preserved::default(), 50, &progress);
        assert_eq!(made, Err(Error::Cancelled));
    }
}
