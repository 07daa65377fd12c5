//! Welds vertices that are close to each other, except where the surface would touch itself.

use super::clean::{Cleaned, clean};
use super::counts::RepairCounts;
use crate::TriMesh;
use crate::mesh::half_edges::{EdgeTable, edge_key};
use crate::mesh::hash_grid::HashGrid;
use crate::mesh::submesh::without_unused_vertices;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Welds vertices within `reach` of an earlier one to it. Welds that would put three faces at an edge, or two
/// faces back to back, are left out.
pub(super) fn weld(mesh: &mut TriMesh, origin: &mut Vec<u32>, reach: f64, counts: &mut RepairCounts) {
    let mut to = nearest_earlier(&mesh.vertices, reach);
    let crowded: HashSet<(u32, u32)> = crowded_edges(&mesh.triangles).collect();
    // Each round undoes at least one weld, or is the last.
    loop {
        let mut counts_of_it = *counts;
        let Cleaned { triangles, origin: number, .. } = clean(mesh, |v| to[v as usize], &mut counts_of_it);
        let was_crowded: HashSet<(u32, u32)> =
            crowded.iter().map(|(a, b)| edge_key(to[*a as usize], to[*b as usize])).collect();
        let edges = crowded_edges(&triangles).filter(|edge| !was_crowded.contains(edge));
        let mut wrong: HashSet<u32> = edges.flat_map(|(a, b)| [a, b]).collect();
        wrong.extend(back_to_back(mesh, &to));
        let mut undone = false;
        for (v, to) in (0..).zip(&mut to) {
            if *to != v && wrong.contains(to) {
                *to = v;
                undone = true;
            }
        }
        if !undone {
            *counts = counts_of_it;
            counts.near_vertices_welded = (0..).zip(&to).filter(|(v, to)| *v != **to).count();
            let before = mesh.vertices.len() - counts.near_vertices_welded;
            *mesh = without_unused_vertices(mesh, triangles);
            *origin = number.iter().map(|t| origin[*t as usize]).collect();
            counts.unreferenced_vertices_dropped += before - mesh.vertices.len();
            return;
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

/// The vertices of faces that would lie on each other with opposite orientations.
fn back_to_back(mesh: &TriMesh, to: &[u32]) -> Vec<u32> {
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
            Some(other) if *other != turn => wrong.extend(welded),
            Some(_) => {}
            None => {
                first.insert(key, turn);
            }
        }
    }
    wrong
}
