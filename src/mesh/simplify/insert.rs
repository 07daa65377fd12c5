//! Inserts vertices at given points of the surface.

use super::graph::Graph;
use super::split::split_edge;
use crate::mesh::triangle::closest_on_triangle;
use glam::DVec3;

/// A point on a triangle of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Where it is; what is off the triangle is moved onto it.
    pub at: DVec3,
    /// The triangle.
    pub triangle: u32,
}

/// A point whose barycentric coordinate is below this is on the side across.
const NEAR: f64 = 1e-3;

/// Adds the sites; one close to a vertex is that vertex. The vertices, without repetition as long as there is
/// none among the sites.
pub(super) fn insert(graph: &mut Graph, sites: &[Site]) -> Vec<u32> {
    // The triangles that each of the surface's has become; splits of edges reach neighbours, so they are
    // looked for.
    let mut parts: Vec<Vec<u32>> = (0..graph.triangles.len() as u32).map(|t| vec![t]).collect();
    sites.iter().map(|site| insert_one(graph, &mut parts, site)).collect()
}

fn insert_one(graph: &mut Graph, parts: &mut [Vec<u32>], site: &Site) -> u32 {
    let nearest = parts[site.triangle as usize]
        .iter()
        .map(|t| (closest_on_triangle(site.at, graph.corners(graph.triangles[*t as usize])), *t))
        .min_by(|(a, _), (b, _)| {
            let off = |p: DVec3| p.distance_squared(site.at);
            let inside = |weights: [f64; 3]| weights.iter().copied().fold(1.0, f64::min);
            // On a common side, the first is as good as the other.
            off(a.point)
                .total_cmp(&off(b.point))
                .then(inside(b.barycentric).total_cmp(&inside(a.barycentric)))
        });
    let Some((closest, t)) = nearest else { return graph.triangles[site.triangle as usize][0] };
    let corners = graph.triangles[t as usize];
    let weights = closest.barycentric;
    let low: Vec<usize> = (0..3).filter(|k| weights[*k] < NEAR).collect();
    let first_new = graph.triangles.len();
    let vertex = match *low.as_slice() {
        [] => {
            let [a, b, c] = corners;
            let middle = graph.add_vertex(closest.point);
            graph.triangles[t as usize] = [a, b, middle];
            graph.star[c as usize].retain(|s| *s != t);
            graph.star[middle as usize].push(t);
            graph.add_triangle([b, c, middle], graph.origin[t as usize]);
            graph.add_triangle([c, a, middle], graph.origin[t as usize]);
            middle
        }
        [k] => {
            let [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
            let [p, q] = [a, b].map(|v| graph.points[v as usize]);
            let share = weights[(k + 2) % 3] / (weights[(k + 1) % 3] + weights[(k + 2) % 3]);
            split_edge(graph, a, b, p.lerp(q, share))
        }
        _ => {
            let largest = (0..3).max_by(|a, b| weights[*a].total_cmp(&weights[*b])).unwrap_or(0);
            corners[largest]
        }
    };
    for new in first_new..graph.triangles.len() {
        parts[graph.origin[new] as usize].push(new as u32);
    }
    vertex
}
