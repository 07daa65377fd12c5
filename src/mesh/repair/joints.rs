//! Joins boundary edges to the boundary vertices that lie on them (T-junctions), as where a long edge meets
//! two short ones.

use super::boundary::{BoundaryEdge, boundary_edges, vertices_of};
use super::counts::RepairCounts;
use crate::TriMesh;
use crate::mesh::half_edges::{EdgeTable, edge_key};
use crate::mesh::kd_tree::KdTree;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Passes over all boundary edges: a triangle may have three.
const ROUNDS: usize = 4;

/// Splits triangles at boundary vertices on their boundary edges, where that closes a part of an edge and
/// puts no third face at one. A vertex is on an edge within its `reach`; never if it has none.
pub(super) fn join(
    mesh: &mut TriMesh,
    origin: &mut Vec<u32>,
    reach: impl Fn(u32) -> Option<f64>,
    counts: &mut RepairCounts,
) {
    for _ in 0..ROUNDS {
        let mut faces: HashMap<(u32, u32), u32> = HashMap::new();
        let table = EdgeTable::new(&mesh.triangles);
        for sides in table.edges() {
            faces.insert(sides[0].ends(), sides.len() as u32);
        }
        let open = boundary_edges(mesh, &table);
        let boundary: Vec<u32> = vertices_of(&open).into_iter().filter(|v| reach(*v).is_some()).collect();
        let points: Vec<DVec3> = boundary.iter().map(|v| mesh.vertices[*v as usize]).collect();
        let tree = KdTree::new(&points);
        // Far from the origin, rounding alone may be much more than any of them.
        let farthest = boundary.iter().filter_map(|v| reach(*v)).fold(0.0, f64::max);
        let mut split = HashSet::new();
        let before = counts.edges_joined;
        for edge in &open {
            if split.contains(&edge.triangle) || faces.get(&edge_key(edge.from, edge.to)) != Some(&1) {
                continue;
            }
            let inside = vertices_on(mesh, edge, &tree, &boundary, farthest, &reach);
            if let Some(new) = parts_of(edge, &inside, &faces) {
                split.insert(edge.triangle);
                counts.edges_joined += inside.len();
                replace(mesh, edge, new, &mut faces);
                // Parts of a triangle are where it was.
                origin.resize(mesh.triangles.len(), origin[edge.triangle]);
            }
        }
        if counts.edges_joined == before {
            return;
        }
    }
}

/// The boundary vertices near the inside of an edge, in their order along it.
fn vertices_on(
    mesh: &TriMesh,
    edge: &BoundaryEdge,
    tree: &KdTree,
    boundary: &[u32],
    farthest: f64,
    reach: impl Fn(u32) -> Option<f64>,
) -> Vec<u32> {
    let at = |v: u32| mesh.vertices[v as usize];
    let [from, to] = [edge.from, edge.to].map(at);
    // Rounding must not depend on the way the face goes around.
    let is_forwards = from.to_array() < to.to_array();
    let [a, b] = if is_forwards { [from, to] } else { [to, from] };
    let direction = b - a;
    let length = direction.length();
    let mut near = Vec::new();
    // A vertex with a longer reach is at an end.
    tree.along([a, b], farthest.min(0.5 * length), &mut near);
    let mut found: Vec<(f64, u32)> = near
        .iter()
        .map(|place| boundary[*place as usize])
        .filter(|v| ![edge.from, edge.to, edge.apex].contains(v))
        .filter_map(|v| {
            let reach = reach(v)?;
            let along = (at(v) - a).dot(direction) / length;
            let off = (at(v) - a - direction * (along / length)).length();
            (off <= reach && along > reach && along < length - reach).then_some((along, v))
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    if !is_forwards {
        found.reverse();
    }
    found.into_iter().map(|(_, v)| v).collect()
}

/// The triangles in place of an edge's, or `None` if they close nothing or crowd an edge.
fn parts_of(edge: &BoundaryEdge, inside: &[u32], faces: &HashMap<(u32, u32), u32>) -> Option<Vec<[u32; 3]>> {
    let chain: Vec<u32> = [edge.from].into_iter().chain(inside.iter().copied()).chain([edge.to]).collect();
    let count = |a: u32, b: u32| faces.get(&edge_key(a, b)).copied().unwrap_or(0);
    let along: Vec<u32> = chain.windows(2).map(|pair| count(pair[0], pair[1])).collect();
    let free = along.iter().all(|count| *count < 2) && inside.iter().all(|v| count(*v, edge.apex) == 0);
    let closes = along.contains(&1);
    (!inside.is_empty() && free && closes)
        .then(|| chain.windows(2).map(|pair| [pair[0], pair[1], edge.apex]).collect())
}

fn replace(
    mesh: &mut TriMesh,
    edge: &BoundaryEdge,
    new: Vec<[u32; 3]>,
    faces: &mut HashMap<(u32, u32), u32>,
) {
    faces.remove(&edge_key(edge.from, edge.to));
    for [a, b, apex] in &new {
        *faces.entry(edge_key(*a, *b)).or_default() += 1;
        for v in [a, b] {
            // Those from the ends were there.
            if *v != edge.from && *v != edge.to {
                *faces.entry(edge_key(*v, *apex)).or_default() += 1;
            }
        }
    }
    let mut new = new.into_iter();
    if let Some(first) = new.next() {
        mesh.triangles[edge.triangle] = first;
    }
    mesh.triangles.extend(new);
}
