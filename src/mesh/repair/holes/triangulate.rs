//! Closed polygons in space triangulated with the shortest edges (the dynamic programme of Barequet and
//! Sharir 1995, "Filling gaps in the boundary of a polyhedron").

use glam::DVec3;

use crate::mesh::half_edges::{EdgeSet, edge_key};

/// Loops longer than this are divided into chains first, since the work grows with the third power.
const MOST: usize = 200;

/// Adds triangles for a closed polygon; false if there are none without an edge that is taken already.
pub(crate) fn triangulate(around: &[u32], at: &[DVec3], taken: &EdgeSet, added: &mut Vec<[u32; 3]>) -> bool {
    let count = around.len();
    if count <= MOST {
        return triangulate_few(around, at, taken, added);
    }
    // Chains between evenly chosen vertices, then what is left between their ends.
    let parts = MOST.min(count / 2);
    let starts: Vec<usize> = (0..parts).map(|k| k * count / parts).collect();
    for (k, start) in starts.iter().enumerate() {
        let end = starts.get(k + 1).copied().unwrap_or(count);
        let chain: Vec<u32> = (*start..=end).map(|i| around[i % count]).collect();
        let is_taken = taken.contains(&edge_key(chain[0], chain[chain.len() - 1]));
        if chain.len() > 2 && (is_taken || !triangulate(&chain, at, taken, added)) {
            return false;
        }
    }
    let rest: Vec<u32> = starts.iter().map(|k| around[*k]).collect();
    triangulate_few(&rest, at, taken, added)
}

/// Like [`triangulate`], for few vertices.
fn triangulate_few(around: &[u32], at: &[DVec3], taken: &EdgeSet, added: &mut Vec<[u32; 3]>) -> bool {
    let count = around.len();
    let place = |k: usize| at[around[k] as usize];
    // The edge between neighbours, and between the first and the last, is that of the polygon.
    let length = |i: usize, j: usize| {
        let is_side = j == i + 1 || (i == 0 && j == count - 1);
        let is_taken = !is_side && taken.contains(&edge_key(around[i], around[j]));
        if is_taken { f64::INFINITY } else { place(i).distance_squared(place(j)) }
    };
    // For each chain from i to j, the least sum and the vertex with which it is had.
    let mut best = vec![(0.0_f64, 0_usize); count * count];
    for span in 2..count {
        for i in 0..count - span {
            let j = i + span;
            let sum = |k: usize| best[i * count + k].0 + best[k * count + j].0;
            let least = (i + 1..j).map(|k| (sum(k), k)).min_by(|a, b| a.0.total_cmp(&b.0));
            let (sum, k) = least.unwrap_or((f64::INFINITY, i + 1));
            best[i * count + j] = (sum + length(i, j), k);
        }
    }
    if count < 3 || !best[count - 1].0.is_finite() {
        return false;
    }
    let mut open = vec![(0, count - 1)];
    while let Some((i, j)) = open.pop() {
        if j > i + 1 {
            let k = best[i * count + j].1;
            added.push([around[i], around[k], around[j]]);
            open.extend([(i, k), (k, j)]);
        }
    }
    true
}
