//! Pieces of borders far smaller than a voxel, drawn together to points. Where four labels or more meet,
//! chance in the labels of single nodes makes such pieces, which do not belong to the object.

use std::collections::HashMap;

use glam::DVec3;

use super::extract::Borders;
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::topology::Partition;

/// Borders of two labels become a point below this area, in squares of nodes.
const AREA: f64 = 1.5;
/// Curves between points where more than three labels meet become one below this length, in nodes.
const LENGTH: f64 = 1.5;

/// Draws small pieces together; returns whether there were any.
pub(super) fn contract(borders: &mut Borders) -> bool {
    let edges = EdgeTable::new(&borders.triangles);
    let mut joined = Partition::new(borders.vertices.len());
    join_small_patches(borders, &edges, &mut joined);
    join_short_curves(borders, &edges, &mut joined);
    let roots: Vec<u32> = (0..borders.vertices.len() as u32).map(|v| joined.root(v)).collect();
    let mut means: HashMap<u32, (DVec3, u32)> = HashMap::new();
    for (v, root) in roots.iter().enumerate().filter(|(v, root)| *v != **root as usize) {
        let first = (borders.vertices[*root as usize], 1);
        let sum = means.entry(*root).or_insert(first);
        *sum = (sum.0 + borders.vertices[v], sum.1 + 1);
        // It no longer lies on a sharp edge.
        borders.is_sharp[*root as usize] = false;
    }
    if means.is_empty() {
        return false;
    }
    let mut is_changed = vec![false; roots.len()];
    for (root, (sum, count)) in means {
        is_changed[root as usize] = true;
        borders.vertices[root as usize] = sum / f64::from(count);
    }
    for triangle in &mut borders.triangles {
        *triangle = triangle.map(|v| roots[v as usize]);
    }
    drop_flat(borders, &is_changed);
    true
}

/// Joins the vertices of patches that have hardly any area, parts of a voxel's size among them.
fn join_small_patches(borders: &Borders, edges: &EdgeTable, joined: &mut Partition) {
    let count = borders.triangles.len();
    let mut patches = Partition::new(count);
    for edge in edges.edges() {
        if let [a, b] = edge {
            patches.join(a.triangle() as u32, b.triangle() as u32);
        }
    }
    let patch: Vec<u32> = (0..count as u32).map(|t| patches.root(t)).collect();
    let mut areas = vec![0.0; count];
    for (t, triangle) in borders.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|v| borders.vertices[v as usize]);
        areas[patch[t] as usize] += 0.5 * (b - a).cross(c - a).length();
    }
    for (t, [a, b, c]) in borders.triangles.iter().enumerate() {
        if areas[patch[t] as usize] < AREA {
            joined.join(*a, *b);
            joined.join(*a, *c);
        }
    }
}

/// Joins the vertices of short curves between two points where more curves meet.
fn join_short_curves(borders: &Borders, edges: &EdgeTable, joined: &mut Partition) {
    let corners = borders.triangles.as_flattened();
    let many = edges.edges().filter(|edge| edge.len() > 2);
    let segments: Vec<[u32; 2]> = many
        .map(|edge| {
            let (from, to) = edge[0].corners();
            [corners[from], corners[to]]
        })
        .collect();
    // Segments on each vertex; two of them go on.
    let mut on: HashMap<u32, Vec<u32>> = HashMap::new();
    for (s, ends) in segments.iter().enumerate() {
        ends.iter().for_each(|v| on.entry(*v).or_default().push(s as u32));
    }
    let mut curves = Partition::new(segments.len());
    for own in on.values() {
        if let [a, b] = own[..] {
            curves.join(a, b);
        }
    }
    let curve: Vec<u32> = (0..segments.len() as u32).map(|s| curves.root(s)).collect();
    let mut lengths = vec![0.0; segments.len()];
    let mut ends = vec![0; segments.len()];
    for (s, [a, b]) in segments.iter().enumerate() {
        let own = curve[s] as usize;
        lengths[own] += borders.vertices[*a as usize].distance(borders.vertices[*b as usize]);
        ends[own] += [a, b].iter().filter(|v| on[v].len() > 2).count();
    }
    for (s, [a, b]) in segments.iter().enumerate() {
        let own = curve[s] as usize;
        if ends[own] == 2 && lengths[own] < LENGTH {
            joined.join(*a, *b);
        }
    }
}

/// Drops triangles without area. Those that have come to lie on each other become one between the labels
/// that are left on either side, or none. Only triangles with vertices that others have been joined to are
/// of either kind.
pub(super) fn drop_flat(borders: &mut Borders, is_changed: &[bool]) {
    // Of each place, the triangles there with the labels on both sides, as its corners ascend.
    let mut places: HashMap<[u32; 3], Vec<(usize, [u32; 2])>> = HashMap::new();
    let mut kept: Vec<(usize, [u32; 3], [u32; 2])> = Vec::new();
    for (t, triangle) in borders.triangles.iter().enumerate() {
        if !triangle.iter().any(|v| is_changed[*v as usize]) {
            kept.push((t, *triangle, borders.sides[t]));
            continue;
        }
        let mut key = *triangle;
        key.sort_unstable();
        if key[0] != key[1] && key[1] != key[2] {
            let [behind, before] = borders.sides[t];
            let first = triangle.iter().position(|v| *v == key[0]).unwrap_or(0);
            let ascends = triangle[(first + 1) % 3] == key[1];
            let sides = if ascends { [before, behind] } else { [behind, before] };
            places.entry(key).or_default().push((t, sides));
        }
    }
    for (key, stack) in places {
        let [mut over, mut under] = [0, 1].map(|side| stack.iter().map(|(_, s)| s[side]).collect::<Vec<_>>());
        over.retain(|label| match under.iter().position(|other| other == label) {
            Some(same) => {
                under.swap_remove(same);
                false
            }
            None => true,
        });
        if let ([over], [under]) = (&over[..], &under[..]) {
            let [a, b, c] = key;
            let triangle = if over < under { key } else { [a, c, b] };
            kept.push((stack[0].0, triangle, [*over.max(under), *over.min(under)]));
        }
    }
    kept.sort_unstable();
    borders.triangles = kept.iter().map(|(_, triangle, _)| *triangle).collect();
    borders.sides = kept.iter().map(|(_, _, sides)| *sides).collect();
}
