//! Edge flips, so that collapses do not leave fans of needles.

use super::graph::Graph;
use crate::mesh::triangle::doubled_normal;
use glam::DVec3;

/// Sweeps over all edges.
const SWEEPS: u32 = 6;
/// The two triangles agree by at least this cosine of their normals before, and the new ones with both.
const FLAT: f64 = 0.5;

/// Flips edges that are not Delaunay where the surface is nearly flat; no edge is repeated and no curve
/// crossed.
pub(super) fn flip(graph: &mut Graph) {
    for _ in 0..SWEEPS {
        let mut flips = 0;
        for t in 0..graph.triangles.len() as u32 {
            for k in 0..3 {
                if graph.alive[t as usize] {
                    flips += u32::from(flip_side(graph, t, k));
                }
            }
        }
        if flips == 0 {
            return;
        }
    }
}

fn flip_side(graph: &mut Graph, t: u32, k: usize) -> bool {
    let triangle = graph.triangles[t as usize];
    let [a, b, c] = [0, 1, 2].map(|m| triangle[(k + m) % 3]);
    if a > b || graph.is_curve(a, b) {
        return false;
    }
    let other = graph.at_edge(a, b).find(|s| *s != t);
    let Some(s) = other else { return false };
    let Some(d) = graph.triangles[s as usize].into_iter().find(|v| *v != a && *v != b) else { return false };
    if c == d
        || graph.at_edge(c, d).next().is_some()
        || !is_better(graph.corners([a, b, c]), graph.points[d as usize])
    {
        return false;
    }
    graph.triangles[t as usize] = [a, d, c];
    graph.triangles[s as usize] = [d, b, c];
    graph.star[b as usize].retain(|x| *x != t);
    graph.star[a as usize].retain(|x| *x != s);
    graph.star[d as usize].push(t);
    graph.star[c as usize].push(s);
    true
}

/// Whether the edge from `c` to `d` is better than that from `a` to `b`, and on the surface as much.
fn is_better([a, b, c]: [DVec3; 3], d: DVec3) -> bool {
    let normal = |p: DVec3, q: DVec3, r: DVec3| doubled_normal([p, q, r]).normalize_or_zero();
    let cotangent = |at: DVec3, p: DVec3, q: DVec3| {
        let (u, v) = (p - at, q - at);
        u.dot(v) / u.cross(v).length().max(f64::MIN_POSITIVE)
    };
    let before = [normal(a, b, c), normal(b, a, d)];
    let after = [normal(a, d, c), normal(d, b, c)];
    let agree = |n: DVec3, m: DVec3| n.dot(m) > FLAT;
    // A needle's normal is rounding, so it may be missing.
    let flat = before.contains(&DVec3::ZERO) || agree(before[0], before[1]);
    let agrees = agree(after[0], after[1])
        && before.iter().filter(|n| **n != DVec3::ZERO).all(|n| after.iter().all(|m| agree(*n, *m)));
    flat && agrees && cotangent(c, a, b) + cotangent(d, a, b) < -1e-6
}
