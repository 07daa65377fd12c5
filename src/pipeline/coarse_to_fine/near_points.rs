//! Shorter edges at the user's points, where they are close to each other or to a curve: edges of the usual
//! length between them would make narrow triangles.

use crate::mesh::kd_tree::KdTree;
use crate::sites::surface_curves::SurfaceCurves;
use glam::DVec3;

/// Lengths at a point over its distance from another point.
const OF_POINT: f64 = 1.1;
/// Lengths at a point over its distance from a curve. Of the triangle over an edge 3.5 times as long as it is
/// high, the small angles are 30 degrees.
const OF_CURVE: f64 = 3.5;
/// Lengths above this many spacings are not shorter than others.
const USUAL: f64 = 0.7;
/// Lengths below this many spacings would take too many vertices.
const LEAST: f64 = 0.05;
/// By how much lengths grow from there, per unit of distance: few triangles are less even then.
pub(super) const GROWTH: f64 = 0.6;
/// Curves are searched by points of them that are this many spacings apart.
const STEP: f64 = 0.5;

/// Vertices of the surface with `curves` at which edges are shorter than others, and how long they are there.
pub(super) fn shorter_at_points(curves: &SurfaceCurves, spacing: f64) -> Vec<(u32, f64)> {
    if curves.points.is_empty() {
        return Vec::new();
    }
    let mut shorter = Vec::new();
    let at = |v: &u32| curves.vertices[*v as usize];
    let points: Vec<DVec3> = curves.points.iter().chain(&curves.corners).map(at).collect();
    let tree = KdTree::new(&points);
    let segments = segments(curves, STEP * spacing);
    let middles: Vec<DVec3> = segments.iter().map(|[a, b]| a.midpoint(*b)).collect();
    let of_curves = KdTree::new(&middles);
    for v in &curves.points {
        let p = at(v);
        let mut near = Vec::new();
        tree.nearest_few(p, 2, &mut near);
        let others = near.iter().map(|(_, k)| points[*k as usize].distance(p)).filter(|d| *d > 0.0);
        let to_point = others.fold(f64::INFINITY, f64::min);
        let mut close = Vec::new();
        of_curves.nearest_few(p, 4, &mut close);
        let to_curve =
            close.iter().map(|(_, k)| distance(p, segments[*k as usize])).fold(f64::INFINITY, f64::min);
        let length = (OF_POINT * to_point).min(OF_CURVE * to_curve);
        if (LEAST * spacing..USUAL * spacing).contains(&length) {
            shorter.push((*v, length));
        }
    }
    shorter
}

/// Pieces of all curves, none longer than `longest`.
fn segments(curves: &SurfaceCurves, longest: f64) -> Vec<[DVec3; 2]> {
    let mut segments = Vec::new();
    for vertices in curves.vertices() {
        for pair in vertices.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|v| curves.vertices[v as usize]);
            let count = (a.distance(b) / longest).ceil().max(1.0);
            let part = |k: f64| a.lerp(b, k / count);
            segments.extend((0..count as usize).map(|k| [part(k as f64), part(k as f64 + 1.0)]));
        }
    }
    segments
}

fn distance(p: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let share = ((p - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    a.lerp(b, share).distance(p)
}
