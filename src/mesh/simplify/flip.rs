//! Edge flips, so that collapses do not leave fans of needles.

use super::apart::stays_apart;
use super::changes::Changes;
use super::graph::Graph;
use crate::mesh::triangle::doubled_normal;
use glam::DVec3;

/// Sweeps over all edges.
const SWEEPS: u32 = 6;
/// The two triangles agree by at least this cosine of their normals before, and the new ones with both.
const FLAT: f64 = 0.5;

/// Flips edges that are not Delaunay where the surface is nearly flat; no edge is repeated and no curve
/// crossed, and with `apart` no flip makes triangles around intersect. What has not changed since it was last
/// looked at is left out.
pub(super) fn flip(graph: &mut Graph, changes: &mut Changes, apart: bool) {
    for _ in 0..SWEEPS {
        let mut flips = 0;
        for t in 0..graph.triangles.len() as u32 {
            if graph.alive[t as usize] && changes.must_look_at(t, graph.triangles[t as usize]) {
                flips += (0..3).filter(|k| flip_side(graph, changes, apart, t, *k)).count();
            }
        }
        if flips == 0 {
            return;
        }
    }
}

fn flip_side(graph: &mut Graph, changes: &mut Changes, apart: bool, t: u32, k: usize) -> bool {
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
    let new = [[a, d, c], [d, b, c]];
    let is_old = |triangle: &[u32; 3]| triangle.contains(&a) && triangle.contains(&b);
    if apart && !stays_apart(graph, &[a, b, c, d], is_old, &new) {
        return false;
    }
    changes.note([a, b, c, d]);
    [graph.triangles[t as usize], graph.triangles[s as usize]] = new;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriMesh;
    use crate::mesh::simplify::Preserved;

    /// A roof, whose ridge is to become a valley, over a spike that begins at one end of the ridge.
    #[test]
    fn nothing_is_flipped_through_what_is_beside_it() {
        let [a, b, c, d] = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.4, -0.1], [0.0, -0.4, -0.1]];
        let (p, q) = ([1.2, 0.05, -0.12], [1.2, -0.05, -0.12]);
        let vertices = [a, b, c, d, p, q].map(DVec3::from_array).to_vec();
        let roof = vec![[0, 1, 2], [1, 0, 3]];
        let spiked = [roof.clone(), vec![[0, 5, 4]]].concat();
        let flipped = [[0, 3, 2], [3, 1, 2]];
        for (triangles, apart, is_flipped) in
            [(&roof, false, true), (&roof, true, true), (&spiked, false, true), (&spiked, true, false)]
        {
            let mesh = TriMesh { vertices: vertices.clone(), triangles: triangles.clone() };
            let mut graph = Graph::new(&mesh, Preserved::default());
            let mut changes = Changes::new(&graph);
            flip(&mut graph, &mut changes, apart);
            assert_eq!(graph.triangles[..2] == flipped, is_flipped, "{triangles:?}, {apart}");
            assert_eq!(graph.triangles[..2] == roof, !is_flipped, "{triangles:?}, {apart}");
        }
    }
}
