//! Small handles and tunnels removed: those that chance made between points, not ones of the object. After
//! Guskov and Wood, "Topological noise removal", Graphics Interface 2001: where a small part of a surface has
//! a handle, the surface is cut along a shortest loop that does not divide it, and both sides are capped.

mod cut;
mod region;
mod short_loops;

use super::TriMesh;
use super::bvh::Bvh;
use super::half_edges::twins;
use super::topology::topology;
use crate::{ProgressToken, Result};
use cut::cut_along;
use region::Regions;
use short_loops::short_loops;

/// Maximum number of passes over all regions with handles: one handle is cut at a time.
const MOST_PASSES: usize = 16;
/// Of a volume, a surface with a handle for this many triangles or fewer is left as it is: its handles are
/// intended, as those of a lattice.
const TRIANGLES_PER_HANDLE: usize = 500;
/// Of a volume, a surface with more handles than this is left as it is, since it would take long.
const MOST_HANDLES: usize = 2000;
/// Any point is this fraction of the radius away from the centre of some region, at most.
const SPREAD: f64 = 0.5;

/// The number of handles, if there are so many that they may be those of a lattice.
pub(crate) fn many_handles(mesh: &TriMesh) -> Option<usize> {
    let handles = handles(mesh);
    (handles > most_handles(mesh)).then_some(handles)
}

fn handles(mesh: &TriMesh) -> usize {
    topology(mesh).genus.unwrap_or(0).max(0) as usize
}

/// The greatest number of handles that are not many.
pub(crate) fn most_handles(mesh: &TriMesh) -> usize {
    MOST_HANDLES.min(mesh.triangles.len() / TRIANGLES_PER_HANDLE)
}

/// Removes the handles that lie within half of `radius` of a point of the surface, and some of up to twice
/// this size, and returns how many; none where the surface has more than `most` in all. The mesh must be
/// manifold; its triangles keep their numbers, and further ones come behind them.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn remove_small_handles(
    mesh: &mut TriMesh,
    radius: f64,
    most: usize,
    progress: &ProgressToken,
) -> Result<usize> {
    let mut removed = 0;
    // The vertices to look around.
    let mut seeds: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    for _ in 0..MOST_PASSES {
        progress.poll()?;
        let handles = handles(mesh);
        if handles == 0 || (removed == 0 && handles > most) {
            break;
        }
        let before = removed;
        let twins = twins(&mesh.triangles);
        let mut regions = Regions::new(mesh, &twins);
        let mut covered = vec![false; mesh.vertices.len()];
        let mut again = Vec::new();
        let mut tree = None;
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
            progress.poll()?;
            again.extend_from_slice(&region.vertices);
            let loops = short_loops(mesh, &region);
            let tree = tree.get_or_insert_with(|| Bvh::new(mesh));
            let mut cut =
                |around: &Vec<u32>| cut_along(mesh, tree, &twins, |v| regions.triangle_at(v), around);
            if loops.iter().any(&mut cut) {
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
