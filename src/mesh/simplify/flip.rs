//! Edge flips, so that collapses do not leave fans of needles.

use super::changes::Changes;
use super::graph::Graph;
use crate::mesh::triangle::doubled_normal;
use glam::DVec3;

/// Sweeps over all edges.
const SWEEPS: u32 = 6;
/// The two triangles agree by at least this cosine of their normals before, and the new ones with both.
const FLAT: f64 = 0.5;

/// Flips edges that are not Delaunay where the surface is nearly flat; no edge is repeated and no curve
/// crossed. What has not changed since it was last looked at is left out.
pub(super) fn flip(graph: &mut Graph, changes: &mut Changes) {
    for _ in 0..SWEEPS {
        let mut flips = 0;
        for t in 0..graph.triangles.len() as u32 {
            if graph.alive[t as usize] && changes.must_look_at(t, graph.triangles[t as usize]) {
                flips += (0..3).filter(|k| flip_side(graph, changes, t, *k)).count();
            }
        }
        if flips == 0 {
            return;
        }
    }
}

fn flip_side(graph: &mut Graph, changes: &mut Changes, t: u32, k: usize) -> bool {
    let triangle = graph.triangles[t as usize];
    let [a, b, c] = [0, 1, 2].map(|m| triangle[(k + m) % 3]);
    if a > b || graph.is_curve(a, b) {
        return false;
    }
    let other = graph.at_edge(a, b).find(|s| *s != t);
    let Some(s) = other else { return false };
    let Some(d) = graph.triangles[s as usize].into_iter().find(|v| *v != a && *v != b) else { return false };
    // What takes least time and fails most comes first.
    let (corners, apex) = (graph.corners([a, b, c]), graph.points[d as usize]);
    if c == d
        || !is_more_regular(corners, apex)
        || graph.at_edge(c, d).next().is_some()
        || !stays_flat(corners, apex)
    {
        return false;
    }
    changes.note([a, b, c, d]);
    graph.triangles[t as usize] = [a, d, c];
    graph.triangles[s as usize] = [d, b, c];
    graph.star[b as usize].retain(|x| *x != t);
    graph.star[a as usize].retain(|x| *x != s);
    graph.star[d as usize].push(t);
    graph.star[c as usize].push(s);
    true
}

/// Whether the edge from `c` to `d` makes better triangles than that from `a` to `b`.
fn is_more_regular([a, b, c]: [DVec3; 3], d: DVec3) -> bool {
    let cotangent = |at: DVec3, p: DVec3, q: DVec3| {
        let (u, v) = (p - at, q - at);
        u.dot(v) / u.cross(v).length().max(f64::MIN_POSITIVE)
    };
    cotangent(c, a, b) + cotangent(d, a, b) < -1e-6
}

/// Whether the edge from `c` to `d` is on the surface as much as that from `a` to `b`.
fn stays_flat([a, b, c]: [DVec3; 3], d: DVec3) -> bool {
    let normal = |p: DVec3, q: DVec3, r: DVec3| doubled_normal([p, q, r]).normalize_or_zero();
    let before = [normal(a, b, c), normal(b, a, d)];
    let after = [normal(a, d, c), normal(d, b, c)];
    let agree = |n: DVec3, m: DVec3| n.dot(m) > FLAT;
    // A needle's normal is rounding, so it may be missing.
    let flat = before.contains(&DVec3::ZERO) || agree(before[0], before[1]);
    let agrees = agree(after[0], after[1])
        && before.iter().filter(|n| **n != DVec3::ZERO).all(|n| after.iter().all(|m| agree(*n, *m)));
    flat && agrees
}
