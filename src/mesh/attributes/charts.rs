//! Texture coordinates for the corners of new triangles, each triangle in one chart of the old texture.
//!
//! The chart of a new triangle is what is connected, without a seam, to the old triangle under its centre and
//! is not farther away than its corners. This limit keeps the two sides of a seam apart if they belong to one
//! piece of texture, as on a cylinder that is cut open once.

use glam::DVec3;

use super::CornerUv;
use super::seams::{join_coincident, seams_of};
use crate::mesh::NONE;
use crate::mesh::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::correspondence::{Correspondence, SurfacePoint};
use crate::mesh::half_edges::{next, twins};
use crate::mesh::triangle::{closest_on_triangle, doubled_normal};
use rayon::prelude::*;

/// How far the chart of a face is searched, relative to the distance of its corners.
const REACH: f64 = 1.25;
/// Twice the area of a triangle over its longest side squared, below which its plane says nothing about its
/// surroundings.
const THIN: f64 = 1e-3;
/// A texture is not extended beyond a triangle by more than this many times its size.
const FARTHEST: f64 = 1e3;

/// The texture of a mesh, ready to be asked.
struct Charts<'a> {
    input: &'a TriMesh,
    uv: &'a CornerUv,
    /// Across each half-edge, [`NONE`] at seams as well.
    twins: Vec<u32>,
    /// The seams and open edges as triangles without area, moved by `centre` and divided by `size`; `None`
    /// without seams.
    seams: Option<Bvh>,
    centre: DVec3,
    size: f64,
}

/// The texture coordinates of the corners of `output`, which lies at `correspondence` on `input`.
pub(crate) fn corner_uv(
    input: &TriMesh,
    uv: &CornerUv,
    correspondence: &Correspondence,
    output: &TriMesh,
) -> CornerUv {
    let charts = Charts::new(input, uv);
    let values = (0..output.triangles.len()).into_par_iter().flat_map_iter(|t| {
        let points = output.triangles[t].map(|v| correspondence.vertices[v as usize]);
        charts.of_face(output.corners(t), points, correspondence.faces[t].triangle)
    });
    CornerUv { kind: uv.kind, values: values.collect() }
}

impl<'a> Charts<'a> {
    fn new(input: &'a TriMesh, uv: &'a CornerUv) -> Self {
        let triangles = join_coincident(input);
        let mut twins = twins(&triangles);
        for cut in seams_of(&triangles, uv) {
            twins[cut as usize] = NONE;
        }
        let [low, high] = input.bounds().unwrap_or_default();
        let (centre, size) = (0.5 * low + 0.5 * high, (0.5 * high - 0.5 * low).max_element());
        let size = if size > 0.0 { size } else { 1.0 };
        // Boundary edges too: what is beyond a crack that was closed is another piece of texture.
        let cuts: Vec<u32> =
            (0..).zip(&twins).filter(|(_, twin)| **twin == NONE).map(|(half, _)| half).collect();
        let corners = input.triangles.as_flattened();
        let ends = cuts.iter().flat_map(|half| [*half, next(*half)]);
        let seams = TriMesh {
            vertices: ends.map(|c| (input.vertices[corners[c as usize] as usize] - centre) / size).collect(),
            triangles: (0..cuts.len() as u32).map(|k| [2 * k, 2 * k + 1, 2 * k + 1]).collect(),
        };
        let seams = (!cuts.is_empty()).then(|| Bvh::new(&seams));
        Self { input, uv, twins, seams, centre, size }
    }

    fn of_face(&self, corners: [DVec3; 3], points: [SurfacePoint; 3], under: u32) -> [[f64; 2]; 3] {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        // The points on the input may be farther apart than the corners, which may have left it.
        let places = points.map(|point| point.position(self.input));
        let far = corners.iter().chain(&places).map(|p| p.distance(middle)).fold(0.0, f64::max);
        let reach = REACH * far;
        if self.is_far_from_seams(middle, reach) {
            return points.map(|point| self.at(point.triangle, point.barycentric));
        }
        let chart = self.around(under, middle, reach);
        std::array::from_fn(|k| {
            if chart.contains(&points[k].triangle) {
                return self.at(points[k].triangle, points[k].barycentric);
            }
            self.beside(&chart, places[k])
        })
    }

    fn is_far_from_seams(&self, middle: DVec3, reach: f64) -> bool {
        let Some(seams) = &self.seams else { return true };
        let nearest = seams.closest((middle - self.centre) / self.size);
        nearest.is_none_or(|nearest| nearest.distance_sq.sqrt() * self.size > reach)
    }

    /// Triangles that are connected to `start` and come nearer than `reach`.
    fn around(&self, start: u32, middle: DVec3, reach: f64) -> Vec<u32> {
        let mut chart = vec![start];
        let mut known = std::collections::HashSet::from([start]);
        let mut next = 0;
        while let Some(triangle) = chart.get(next).copied() {
            next += 1;
            for half in 3 * triangle..3 * triangle + 3 {
                let twin = self.twins[half as usize];
                if twin == NONE || !known.insert(twin / 3) {
                    continue;
                }
                let corners = self.input.corners(twin as usize / 3);
                if closest_on_triangle(middle, corners).point.distance(middle) <= reach {
                    chart.push(twin / 3);
                }
            }
        }
        chart
    }

    /// The texture at a place that no triangle of the chart covers: the nearest one's, extended.
    fn beside(&self, chart: &[u32], place: DVec3) -> [f64; 2] {
        let near = chart.iter().map(|t| (*t, closest_on_triangle(place, self.input.corners(*t as usize))));
        let distance = |point: DVec3| point.distance_squared(place);
        let nearest =
            near.reduce(|best, new| if distance(new.1.point) < distance(best.1.point) { new } else { best });
        let Some((triangle, found)) = nearest else { return [0.0; 2] };
        let extended = extended(self.input.corners(triangle as usize), place).unwrap_or(found.barycentric);
        self.at(triangle, extended)
    }

    fn at(&self, triangle: u32, weights: [f64; 3]) -> [f64; 2] {
        let uv = [0, 1, 2].map(|k| self.uv.values[3 * triangle as usize + k]);
        // From one corner, so that what is the same at all of them stays the same.
        std::array::from_fn(|k| {
            uv[0][k] + weights[1] * (uv[1][k] - uv[0][k]) + weights[2] * (uv[2][k] - uv[0][k])
        })
    }
}

/// The weights of a place in the plane of a triangle, inside or not; `None` for a triangle that says little
/// about it.
fn extended([a, b, c]: [DVec3; 3], place: DVec3) -> Option<[f64; 3]> {
    let longest_sq = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    let (ab, ac, ap) = (b - a, c - a, place - a);
    let normal = doubled_normal([a, b, c]);
    if normal.length() <= THIN * longest_sq {
        return None;
    }
    let v = ap.cross(ac).dot(normal) / normal.length_squared();
    let w = ab.cross(ap).dot(normal) / normal.length_squared();
    (v.abs().max(w.abs()) <= FARTHEST).then_some([1.0 - v - w, v, w])
}
