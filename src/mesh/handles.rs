//! Small handles and tunnels removed: those that chance made between points, not ones of the object. After
//! Guskov and Wood, "Topological noise removal", Graphics Interface 2001: where a small part of a surface has
//! a handle, the surface is cut along a shortest loop that does not divide it, and both sides are capped.

mod cut;
mod region;
mod shortest_loop;

use super::TriMesh;
use super::half_edges::twins;
use super::topology::topology;
use crate::{ProgressToken, Result};
use cut::cut_along;
use region::Regions;
use shortest_loop::shortest_loop;

/// At most so many times all regions with handles are looked at again: one handle is cut at a time.
const MOST_PASSES: usize = 16;
/// Any point is this fraction of the radius away from the centre of some region, at most.
const SPREAD: f64 = 0.5;

/// Removes the handles that lie within half of `radius` of a point of the surface, and some of up to twice
/// this size, and returns how many. The mesh must be manifold; its triangles keep their numbers, and further
/// ones come behind them.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn remove_small_handles(
    mesh: &mut TriMesh,
    radius: f64,
    progress: &ProgressToken,
) -> Result<usize> {
    let mut removed = 0;
    // The vertices to look around.
    let mut seeds: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    for _ in 0..MOST_PASSES {
        progress.poll()?;
        if topology(mesh).genus.is_none_or(|genus| genus == 0) {
            break;
        }
        let before = removed;
        let twins = twins(&mesh.triangles);
        let mut regions = Regions::new(mesh, &twins);
        let mut covered = vec![false; mesh.vertices.len()];
        let mut again = Vec::new();
        for (k, seed) in seeds.into_iter().enumerate() {
            if k.is_multiple_of(4096) {
                progress.poll()?;
            }
            if std::mem::replace(&mut covered[seed as usize], true) || !regions.is_free(seed) {
                continue;
            }
            let region = regions.around(mesh, seed, radius, |v| covered[v as usize] = true);
            if region.genus() == 0 {
                continue;
            }
            again.extend_from_slice(&region.vertices);
            if let Some(around) = shortest_loop(mesh, &region) {
                cut_along(mesh, &twins, |v| regions.triangle_at(v), &around);
                regions.leave_out(&region);
                removed += 1;
            }
        }
        if removed == before {
            break;
        }
        again.sort_unstable();
        again.dedup();
        seeds = again;
    }
    Ok(removed)
}

#[cfg(test)]
mod tests;
