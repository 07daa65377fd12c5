//! Whether a change makes triangles nearby intersect or fold.

use super::graph::Graph;
use crate::mesh::half_edges::edge_key;
use crate::mesh::intersections::count_crossings;
use crate::mesh::triangle::doubled_normal;
use glam::DVec3;
use smallvec::SmallVec;

/// Cosine of the normals of two triangles that are all but back to back: 2.5 degrees.
const FOLDED: f64 = -0.999;

/// Whether no more pairs of the triangles around the vertices `near` intersect or are folded once those that
/// `is_old` names are replaced by the `new` ones.
pub(super) fn stays_apart(
    graph: &Graph,
    near: &[u32],
    is_old: impl Fn(&[u32; 3]) -> bool,
    new: &[[u32; 3]],
) -> bool {
    let mut around: SmallVec<[u32; 128]> =
        near.iter().flat_map(|w| graph.star[*w as usize].iter().copied()).collect();
    around.sort_unstable();
    around.dedup();
    let triangles = around.into_iter().map(|t| graph.triangles[t as usize]);
    let (old, others): (Vec<[u32; 3]>, Vec<[u32; 3]>) = triangles.partition(is_old);
    let at = |w: u32| graph.points[w as usize];
    let count = |some: &[[u32; 3]]| {
        count_crossings(some, &others, at) + folded(some.iter().chain(&others).copied(), at)
    };
    // Mostly none do, and then those before need not be looked at.
    let after = count(new);
    after == 0 || after <= count(&old)
}

/// Pairs of triangles so nearly back to back that rounding decides whether they intersect.
fn folded(triangles: impl Iterator<Item = [u32; 3]>, at: impl Fn(u32) -> DVec3) -> usize {
    let mut normals: SmallVec<[DVec3; 64]> = SmallVec::new();
    // Mostly so few triangles that this takes less time than a table of their edges.
    let mut sides: SmallVec<[((u32, u32), usize); 256]> = SmallVec::new();
    for [a, b, c] in triangles {
        sides.extend([(a, b), (b, c), (c, a)].map(|(a, b)| (edge_key(a, b), normals.len())));
        normals.push(doubled_normal([a, b, c].map(&at)).normalize_or_zero());
    }
    sides.sort_unstable();
    let is_folded = |sides: &&[((u32, u32), usize)]| match sides {
        [(_, one), (_, two)] => normals[*one].dot(normals[*two]) < FOLDED,
        _ => false,
    };
    sides.chunk_by(|one, two| one.0 == two.0).filter(is_folded).count()
}
