//! Boundary loops closed by triangles: of all triangulations the one whose edges are shortest (the dynamic
//! programme of Barequet and Sharir 1995, "Filling gaps in the boundary of a polyhedron").

use std::collections::HashSet;

use glam::DVec3;

use crate::mesh::half_edges::{EdgeSet, EdgeTable, edge_key};
use crate::mesh::{NONE, TriMesh};
use crate::{ProgressToken, Result};

/// Loops longer than this are divided into chains first, since the work grows with the third power.
const MOST: usize = 200;

/// Fills all boundary loops no larger than `largest` across, in the mesh's unit; returns how many. The mesh
/// must be manifold.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn fill(mesh: &mut TriMesh, largest: f64, progress: &ProgressToken) -> Result<usize> {
    let mut filled = 0;
    let loops = boundary_loops(mesh);
    let is_small = |around: &Vec<u32>| {
        let first = mesh.vertices[around[0] as usize];
        let at = around.iter().map(|v| mesh.vertices[*v as usize]);
        let (low, high) = at.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
        high.distance(low) <= largest
    };
    let loops: Vec<Vec<u32>> = loops.into_iter().filter(is_small).collect();
    if loops.is_empty() {
        return Ok(0);
    }
    let on_loops: HashSet<u32> = loops.iter().flatten().copied().collect();
    let mut taken = EdgeSet::new();
    for corners in &mesh.triangles {
        for k in 0..3 {
            let (v, w) = (corners[k], corners[(k + 1) % 3]);
            if on_loops.contains(&v) && on_loops.contains(&w) {
                taken.insert(edge_key(v, w));
            }
        }
    }
    for around in loops {
        progress.poll()?;
        let mut added = Vec::new();
        if close(&around, &mesh.vertices, &taken, &mut added) {
            mesh.triangles.extend(added);
            filled += 1;
        }
    }
    Ok(filled)
}

/// The boundary loops, each in the order that triangles filling it have.
fn boundary_loops(mesh: &TriMesh) -> Vec<Vec<u32>> {
    let corners = mesh.triangles.as_flattened();
    let mut next = vec![NONE; mesh.vertices.len()];
    for edge in EdgeTable::new(&mesh.triangles).edges() {
        if let [one] = edge {
            let (from, to) = one.corners();
            next[corners[to] as usize] = corners[from];
        }
    }
    let mut loops = Vec::new();
    for first in 0..next.len() {
        let mut around = Vec::new();
        let mut at = first;
        while next[at] != NONE {
            around.push(at as u32);
            at = std::mem::replace(&mut next[at], NONE) as usize;
        }
        if !around.is_empty() {
            loops.push(around);
        }
    }
    loops
}

/// Adds triangles for a closed polygon; false if there are none without an edge that is taken already.
fn close(around: &[u32], at: &[DVec3], taken: &EdgeSet, added: &mut Vec<[u32; 3]>) -> bool {
    let count = around.len();
    if count <= MOST {
        return triangulate(around, at, taken, added);
    }
    // Chains between evenly chosen vertices, then what is left between their ends.
    let parts = MOST.min(count / 2);
    let starts: Vec<usize> = (0..parts).map(|k| k * count / parts).collect();
    for (k, start) in starts.iter().enumerate() {
        let end = starts.get(k + 1).copied().unwrap_or(count);
        let chain: Vec<u32> = (*start..=end).map(|i| around[i % count]).collect();
        let is_taken = taken.contains(&edge_key(chain[0], chain[chain.len() - 1]));
        if chain.len() > 2 && (is_taken || !close(&chain, at, taken, added)) {
            return false;
        }
    }
    let rest: Vec<u32> = starts.iter().map(|k| around[*k]).collect();
    triangulate(&rest, at, taken, added)
}

/// Like [`close`], for few vertices.
fn triangulate(around: &[u32], at: &[DVec3], taken: &EdgeSet, added: &mut Vec<[u32; 3]>) -> bool {
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
