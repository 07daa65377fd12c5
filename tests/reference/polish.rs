//! Flips and relaxation of a closed mesh, from their definitions: every edge is looked up in the list of
//! triangles.

use super::closest::onto_triangle;
use glam::DVec3;
use rtfmesh::TriMesh;
use std::collections::{HashMap, HashSet};

/// Half-edge `3 * t + k` from corner `k` of triangle `t`, by its two vertices.
pub fn half_edges(mesh: &TriMesh) -> HashMap<(u32, u32), u32> {
    let corner = |t: usize, k: usize| mesh.triangles[t][k % 3];
    let of = |h: usize| ((corner(h / 3, h % 3), corner(h / 3, h % 3 + 1)), h as u32);
    (0..3 * mesh.triangles.len()).map(of).collect()
}

/// The vertices around each vertex.
pub fn neighbours(mesh: &TriMesh) -> Vec<HashSet<u32>> {
    let mut around = vec![HashSet::new(); mesh.vertices.len()];
    half_edges(mesh).keys().for_each(|(a, b)| {
        around[*a as usize].insert(*b);
        around[*b as usize].insert(*a);
    });
    around
}

/// An edge and the vertices `[a, b, c, d]` of its triangles `abc` and `bad`.
pub struct Edge {
    pub half_edge: u32,
    pub around: [u32; 4],
}

/// All edges with two triangles, by the lower of their half-edges.
pub fn edges(mesh: &TriMesh) -> Vec<Edge> {
    let known = half_edges(mesh);
    let opposite = |h: u32| mesh.triangles[h as usize / 3][(h as usize % 3 + 2) % 3];
    let both = known.iter().filter_map(|(&(a, b), &h)| Some((a, b, h, *known.get(&(b, a))?)));
    let mut edges: Vec<Edge> = both
        .filter(|(_, _, h, twin)| h < twin)
        .map(|(a, b, h, twin)| Edge { half_edge: h, around: [a, b, opposite(h), opposite(twin)] })
        .collect();
    edges.sort_by_key(|edge| edge.half_edge);
    edges
}

fn cotangent(at: DVec3, p: DVec3, q: DVec3) -> f64 {
    1.0 / (p - at).angle_between(q - at).tan()
}

/// What the flip of an edge gains: by the angles opposite to it, and half of what the sum of squared
/// differences of the valences to six loses.
pub fn flip_gain(mesh: &TriMesh, edge: &Edge, valences: &[usize], valence_weight: f64) -> f64 {
    let [a, b, c, d] = edge.around.map(|v| mesh.vertices[v as usize]);
    let square = |v: u32, change: f64| (valences[v as usize] as f64 + change - 6.0).powi(2);
    let sum = |sign: f64| {
        let changes = [-sign, -sign, sign, sign];
        edge.around.iter().zip(changes).map(|(v, change)| square(*v, change)).sum::<f64>()
    };
    -cotangent(c, a, b) - cotangent(d, b, a) + valence_weight * 0.5 * (sum(0.0) - sum(1.0))
}

/// Whether an edge may be flipped: both ends keep three edges, the new one is not there yet, and the new
/// triangles face as the old ones did, are no sharp edge, and have no angle above 126.87 degrees.
pub fn may_flip(mesh: &TriMesh, edge: &Edge, around: &[HashSet<u32>]) -> bool {
    let [v, w, p, q] = edge.around;
    let [a, b, c, d] = edge.around.map(|v| mesh.vertices[v as usize]);
    let normal = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a);
    let (old, new) = ([normal(a, b, c), normal(b, a, d)], [normal(d, c, a), normal(c, d, b)]);
    let cosine = |n: [DVec3; 2]| n[0].normalize_or_zero().dot(n[1].normalize_or_zero());
    let widest = [[a, d, c], [b, c, d], [d, a, c], [c, b, d], [c, d, a], [d, c, b]]
        .map(|[at, p, q]| (p - at).angle_between(q - at))
        .into_iter()
        .fold(0.0, f64::max);
    around[v as usize].len() > 3
        && around[w as usize].len() > 3
        && p != q
        && !around[p as usize].contains(&q)
        && new.iter().all(|n| n.length() > 0.0 && cosine([*n, old[0] + old[1]]) > 0.5)
        && cosine(new) >= cosine(old).min(0.8)
        && widest <= (-0.6_f64).acos()
}

/// A bijection of 32-bit numbers, as in `glsl/common/hash.glsl`.
pub fn hashed(mut x: u32) -> u32 {
    x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
    x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

/// The normal of a vertex: the mean of its triangles', by area.
pub fn vertex_normal(mesh: &TriMesh, v: u32) -> DVec3 {
    let own = mesh.triangles.iter().filter(|t| t.contains(&v));
    let [a, b, c] = [0, 1, 2];
    own.map(|t| t.map(|v| mesh.vertices[v as usize]))
        .map(|t| (t[b] - t[a]).cross(t[c] - t[a]))
        .sum::<DVec3>()
        .normalize_or_zero()
}

/// Where a vertex goes: 1.1 times the way to the mean of its neighbours, in its tangent plane. Neighbours
/// have weights by the wanted edge lengths.
pub fn goal(mesh: &TriMesh, v: u32, around: &HashSet<u32>, lengths: &[f64]) -> DVec3 {
    let here = mesh.vertices[v as usize];
    let weight = |w: u32| lengths[v as usize] / (0.5 * (lengths[v as usize] + lengths[w as usize]));
    let sum: DVec3 = around.iter().map(|w| weight(*w) * (mesh.vertices[*w as usize] - here)).sum();
    let step = sum / around.iter().map(|w| weight(*w)).sum::<f64>();
    here + 1.1 * step.reject_from_normalized(vertex_normal(mesh, v))
}

/// The closest point of a surface.
pub fn onto_surface(surface: &TriMesh, p: DVec3) -> DVec3 {
    let all = surface.triangles.iter().map(|t| onto_triangle(p, t.map(|v| surface.vertices[v as usize])));
    all.min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p))).unwrap()
}

/// Undoes moves until no triangle turns by 60 degrees from its vertices' normals or becomes flatter than a
/// fifth, unless it was so before. `normals` are those before the moves.
pub fn undo_bad_moves(mesh: &TriMesh, normals: &[DVec3], moved: &mut [DVec3]) -> usize {
    let mut undone = HashSet::new();
    let cosine = |n: DVec3, up: DVec3| n.normalize_or_zero().dot(up.normalize_or_zero());
    let doubled = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    let height = |t: [DVec3; 3]| {
        let sides = [t[0].distance(t[1]), t[1].distance(t[2]), t[2].distance(t[0])];
        doubled(t).length() / sides.into_iter().fold(0.0, f64::max).powi(2)
    };
    loop {
        let bad = mesh.triangles.iter().filter(|t| {
            let old = t.map(|v| mesh.vertices[v as usize]);
            let new = t.map(|v| moved[v as usize]);
            let up: DVec3 = t.iter().map(|v| normals[*v as usize]).sum();
            let turned =
                cosine(doubled(new), up) < 0.5 && cosine(doubled(new), up) <= cosine(doubled(old), up);
            let flat = height(new) < 0.2 && height(new) <= height(old);
            old != new && (turned || flat)
        });
        let bad: Vec<u32> = bad.flatten().copied().collect();
        if bad.is_empty() {
            return undone.len();
        }
        for v in bad {
            if moved[v as usize] != mesh.vertices[v as usize] {
                undone.insert(v);
            }
            moved[v as usize] = mesh.vertices[v as usize];
        }
    }
}
