//! Makes one of vertices that are close to each other, except where the surface would touch itself.

use super::boundary::BoundaryEdge;
use super::clean::{Cleaned, clean};
use super::counts::RepairCounts;
use super::cracks::closing;
use crate::TriMesh;
use crate::mesh::half_edges::{EdgeTable, edge_key};
use crate::mesh::hash_grid::HashGrid;
use crate::mesh::submesh::without_unused_vertices;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Welds vertices within `reach` of an earlier one to it, as [`merge`] does.
pub(super) fn weld(mesh: &mut TriMesh, origin: &mut Vec<u32>, reach: f64, counts: &mut RepairCounts) {
    let to = nearest_earlier(&mesh.vertices, reach);
    counts.near_vertices_welded = merge(mesh, origin, to, None, counts);
}

/// Makes each vertex the one that it goes `to`, which goes to itself; returns how many went. Those that would
/// put three faces at an edge, or two faces back to back, are left out; with `open` edges also those that
/// would put faces on each other any way, or not make one of two of these edges.
pub(super) fn merge(
    mesh: &mut TriMesh,
    origin: &mut Vec<u32>,
    mut to: Vec<u32>,
    open: Option<&[BoundaryEdge]>,
    counts: &mut RepairCounts,
) -> usize {
    let crowded: HashSet<(u32, u32)> = crowded_edges(&mesh.triangles).collect();
    // Each round undoes at least one weld, or is the last.
    loop {
        let mut counts_of_it = *counts;
        let Cleaned { triangles, origin: number, .. } = clean(mesh, |v| to[v as usize], &mut counts_of_it);
        let was_crowded: HashSet<(u32, u32)> =
            crowded.iter().map(|(a, b)| edge_key(to[*a as usize], to[*b as usize])).collect();
        let edges = crowded_edges(&triangles).filter(|edge| !was_crowded.contains(edge));
        let mut wrong: HashSet<u32> = edges.flat_map(|(a, b)| [a, b]).collect();
        wrong.extend(on_each_other(mesh, &to, open.is_some()));
        let closes = open.map(|open| closing(open, &to));
        let mut undone = false;
        for (v, to) in (0..).zip(&mut to) {
            let is_idle = closes.as_ref().is_some_and(|closes| !closes[v as usize]);
            if *to != v && (is_idle || wrong.contains(to)) {
                *to = v;
                undone = true;
            }
        }
        if !undone {
            *counts = counts_of_it;
            let merged = (0..).zip(&to).filter(|(v, to)| *v != **to).count();
            let before = mesh.vertices.len() - merged;
            *mesh = without_unused_vertices(mesh, triangles);
            *origin = number.iter().map(|t| origin[*t as usize]).collect();
            counts.unreferenced_vertices_removed += before - mesh.vertices.len();
            return merged;
        }
    }
}

/// For each vertex the nearest of the earlier ones that stay, if it is within `reach`; else itself.
fn nearest_earlier(vertices: &[DVec3], reach: f64) -> Vec<u32> {
    let mut grid = HashGrid::new(reach, vertices.len());
    let mut welded = Vec::with_capacity(vertices.len());
    for (v, at) in (0..).zip(vertices) {
        let mut nearest: Option<(f64, u32)> = None;
        grid.any(*at, |w: u32| {
            let distance_sq = vertices[w as usize].distance_squared(*at);
            if distance_sq <= reach * reach && nearest.is_none_or(|best| (distance_sq, w) < best) {
                nearest = Some((distance_sq, w));
            }
            false
        });
        if nearest.is_none() {
            grid.insert(*at, v);
        }
        welded.push(nearest.map_or(v, |(_, w)| w));
    }
    welded
}

fn crowded_edges(triangles: &[[u32; 3]]) -> impl Iterator<Item = (u32, u32)> {
    let table = EdgeTable::new(triangles);
    let crowded: Vec<_> =
        table.edges().filter(|sides| sides.len() > 2).map(|sides| sides[0].ends()).collect();
    crowded.into_iter()
}

/// The vertices of faces that would lie on each other with opposite orientations, or with any.
fn on_each_other(mesh: &TriMesh, to: &[u32], any: bool) -> Vec<u32> {
    let mut first: HashMap<[u32; 3], bool> = HashMap::new();
    let mut wrong = Vec::new();
    for triangle in &mesh.triangles {
        let welded = triangle.map(|v| to[v as usize]);
        let mut key = welded;
        key.sort_unstable();
        if key[0] == key[1] || key[1] == key[2] {
            continue;
        }
        let turn = (0..3).filter(|k| welded[*k] < welded[(k + 1) % 3]).count() == 2;
        match first.get(&key) {
            Some(other) if any || *other != turn => wrong.extend(welded),
            Some(_) => {}
            None => {
                first.insert(key, turn);
            }
        }
    }
    wrong
}
