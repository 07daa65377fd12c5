//! Closed polygons in space triangulated with the least area (the dynamic programme of Barequet and Sharir
//! 1995, "Filling gaps in the boundary of a polyhedron").

use glam::DVec3;

use crate::mesh::half_edges::{EdgeSet, edge_key};
use crate::mesh::triangle::doubled_normal;

/// Longer polygons are made shorter first, since the work grows with the third power.
const MOST: usize = 300;
/// The weight of the square of an edge's length beside areas: of equal areas, those with shorter edges count.
const EDGES: f64 = 1e-3;
/// A polygon that loses a smaller share of its corners also loses some where it turns outwards.
const LEAST_LOSS: f64 = 0.1;

/// Adds triangles for a closed polygon; false if there are none without an edge that is taken already.
pub(crate) fn triangulate(around: &[u32], at: &[DVec3], taken: &EdgeSet, added: &mut Vec<[u32; 3]>) -> bool {
    let mut around = around.to_vec();
    while around.len() > MOST {
        let before = around.len();
        let inwards = normal(&around, at);
        let is_ear = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - b).dot(inwards) > 0.0;
        around = without_ears(&around, taken, added, |ear| is_ear(ear.map(|v| at[v as usize])));
        if ((before - around.len()) as f64) < LEAST_LOSS * before as f64 {
            around = without_ears(&around, taken, added, |_| true);
        }
        if around.len() == before {
            return false;
        }
    }
    triangulate_few(&around, at, taken, added)
}

/// The normal of a polygon by Newell's method, of any length.
pub(super) fn normal(around: &[u32], at: &[DVec3]) -> DVec3 {
    let origin = at[around[0] as usize];
    let place = |k: usize| at[around[k % around.len()] as usize] - origin;
    (0..around.len()).map(|k| place(k).cross(place(k + 1))).sum()
}

/// The polygon without every other corner, where triangles that cut these off meet the condition; they are
/// added.
fn without_ears(
    around: &[u32],
    taken: &EdgeSet,
    added: &mut Vec<[u32; 3]>,
    is_ear: impl Fn([u32; 3]) -> bool,
) -> Vec<u32> {
    let count = around.len();
    let (mut left, mut k) = (Vec::with_capacity(count), 0);
    while k < count {
        left.push(around[k]);
        k += 1;
        if k < count {
            let ear = [around[k - 1], around[k], around[(k + 1) % count]];
            if !taken.contains(&edge_key(ear[0], ear[2])) && is_ear(ear) {
                added.push(ear);
                k += 1;
            }
        }
    }
    left
}

/// Like [`triangulate`], for few vertices.
fn triangulate_few(around: &[u32], at: &[DVec3], taken: &EdgeSet, added: &mut Vec<[u32; 3]>) -> bool {
    let count = around.len();
    let place = |k: usize| at[around[k] as usize];
    // The edge between neighbours, and between the first and the last, is that of the polygon.
    let edge = |i: usize, j: usize| {
        let is_side = j == i + 1 || (i == 0 && j == count - 1);
        let is_taken = !is_side && taken.contains(&edge_key(around[i], around[j]));
        if is_taken { f64::INFINITY } else { EDGES * place(i).distance_squared(place(j)) }
    };
    // For each chain from i to j, the least sum and the vertex with which it is had.
    let mut best = vec![(0.0_f64, 0_usize); count * count];
    for span in 2..count {
        for i in 0..count - span {
            let j = i + span;
            let sum = |k: usize| {
                let area = 0.5 * doubled_normal([place(i), place(k), place(j)]).length();
                best[i * count + k].0 + best[k * count + j].0 + area
            };
            let least = (i + 1..j).map(|k| (sum(k), k)).min_by(|a, b| a.0.total_cmp(&b.0));
            let (sum, k) = least.unwrap_or((f64::INFINITY, i + 1));
            best[i * count + j] = (sum + edge(i, j), k);
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
