//! Samples of the surface that tell how far the mesh has gone from it.
//!
//! An operation by itself compares what it makes with what was there, so that over many of them a mesh drifts
//! away. The samples stay where they are, each with a triangle of the mesh near it; after Borouchaki and
//! Frey, "Simplification of surface mesh using Hausdorff envelope", CMAME 2005.

use std::sync::Arc;

use glam::DVec3;
use smallvec::SmallVec;

use super::star_mesh::StarMesh;
use crate::TriMesh;
use crate::mesh::bvh::{Aabb, Bvh};
use crate::mesh::half_edges::{EdgeTable, HalfEdge};
use crate::mesh::sampling::PLANE_SEQUENCE;
use crate::mesh::triangle::{closest_on_triangle, corners_at, doubled_normal};

/// Samples on faces, and at most as many on edges, for each vertex of the mesh that is wanted.
const PER_VERTEX: usize = 12;
/// Distance of samples on boundaries and sharp edges, in spacings.
const STEP: f64 = 0.25;
/// Edges are sharp if the cosine between their triangles is below this.
const SHARP: f64 = 0.95;
/// A triangle is farther away if its box is beyond the best squared distance by this factor and by
/// [`ROUNDING`]: both are rounded.
const SLACK: f64 = 1.0 + 1e-9;
/// See [`SLACK`]; times the square of the largest coordinates. Points have an error of about 1e-16.
const ROUNDING: f64 = 1e-20;

/// Samples of the original surface, by triangles of the mesh.
#[derive(Debug, Clone)]
pub(super) struct SurfaceSamples {
    points: Arc<Vec<DVec3>>,
    /// The squared distance of each sample from its triangle.
    distances_sq: Vec<f64>,
    /// The samples of each triangle; shorter than the list of triangles if the last ones have none.
    of: Vec<Vec<u32>>,
    surface: Arc<Bvh>,
    /// The distance between mesh and surface to which operations may lead.
    pub tolerance: f64,
}

impl SurfaceSamples {
    /// For a mesh of `count` vertices with this spacing, which is the surface itself at first. The tolerance
    /// is 0.
    pub fn new(surface: &TriMesh, count: usize, spacing: f64) -> Self {
        let mut samples = Self {
            points: Arc::default(),
            distances_sq: Vec::new(),
            of: vec![Vec::new(); surface.triangles.len()],
            surface: Arc::new(Bvh::new(surface)),
            tolerance: 0.0,
        };
        samples.add_vertices(surface, PER_VERTEX * count);
        samples.add_on_edges(surface, PER_VERTEX * count, STEP * spacing);
        samples.add_on_faces(surface, PER_VERTEX * count);
        samples
    }

    fn add(&mut self, point: DVec3, t: usize) {
        self.of[t].push(self.points.len() as u32);
        Arc::make_mut(&mut self.points).push(point);
        self.distances_sq.push(0.0);
    }

    /// The vertices of the surface; only every second, third and so on if there are more than `most`.
    fn add_vertices(&mut self, surface: &TriMesh, most: usize) {
        let every = surface.vertices.len().div_ceil(most.max(1));
        let mut is_new: Vec<bool> = (0..surface.vertices.len()).map(|v| v % every.max(1) == 0).collect();
        for (t, triangle) in surface.triangles.iter().enumerate() {
            for v in triangle.map(|v| v as usize) {
                if std::mem::replace(&mut is_new[v], false) {
                    self.add(surface.vertices[v], t);
                }
            }
        }
    }

    /// Samples this far from each other inside boundaries and sharp edges, or farther if that would be more
    /// than `most`.
    fn add_on_edges(&mut self, surface: &TriMesh, most: usize, step: f64) {
        let normal = |edge: &HalfEdge| doubled_normal(surface.corners(edge.triangle())).normalize_or_zero();
        let is_sharp = |edge: &&[HalfEdge]| match edge {
            [one, two] => normal(one).dot(normal(two)) < SHARP,
            _ => true,
        };
        let table = EdgeTable::new(&surface.triangles);
        let at_ends =
            |edge: &[HalfEdge]| <[u32; 2]>::from(edge[0].ends()).map(|v| surface.vertices[v as usize]);
        let edges: Vec<(usize, [DVec3; 2])> =
            table.edges().filter(is_sharp).map(|edge| (edge[0].triangle(), at_ends(edge))).collect();
        let total: f64 = edges.iter().map(|(_, [a, b])| a.distance(*b)).sum();
        let step = step.max(total / most as f64);
        for (t, [a, b]) in edges {
            let parts = (a.distance(b) / step).ceil() as usize;
            (1..parts).for_each(|k| self.add(a.lerp(b, k as f64 / parts as f64), t));
        }
    }

    fn add_on_faces(&mut self, surface: &TriMesh, count: usize) {
        let areas: Vec<f64> = (0..surface.triangles.len()).map(|t| surface.triangle_area(t)).collect();
        let total: f64 = areas.iter().sum();
        let (mut passed, mut added) = (0.0, 0);
        for (t, area) in areas.into_iter().enumerate() {
            passed += area;
            let [a, b, c] = surface.corners(t);
            let upto = ((passed / total * count as f64) as usize).clamp(added, count.max(added));
            for sample in added..upto {
                let [across, along] = PLANE_SEQUENCE.map(|step| ((sample + 1) as f64 * step).fract());
                self.add(a + ((b - a) * (1.0 - along) + (c - a) * along) * across.sqrt(), t);
            }
            added = upto;
        }
    }

    fn of_triangles(&self, triangles: &[u32]) -> impl Iterator<Item = u32> {
        triangles.iter().filter_map(|t| self.of.get(*t as usize)).flatten().copied()
    }

    /// Whether no sample of the triangles `old` is farther from `new` ones than the tolerance, or than the
    /// farthest of them was.
    fn are_near(&self, old: &[u32], new: &[[DVec3; 3]]) -> bool {
        let was = self.of_triangles(old).map(|sample| self.distances_sq[sample as usize]).fold(0.0, f64::max);
        let limit = was.max(self.tolerance.powi(2));
        let is_near = |p: DVec3, corners: &[DVec3; 3]| {
            closest_on_triangle(p, *corners).point.distance_squared(p) <= limit
        };
        (0..).zip(old).all(|(k, t)| {
            self.of_triangles(&[*t]).all(|sample| {
                let p = self.points[sample as usize];
                // Where a vertex moves, a sample mostly stays near the same triangle.
                new.get(k).is_some_and(|same| is_near(p, same)) || new.iter().any(|new| is_near(p, new))
            })
        })
    }

    /// Whether triangles are no farther from the surface than the tolerance, or than one of `old` was; both
    /// as far as the middles of sides and of triangles tell.
    fn is_near(&self, old: impl Iterator<Item = [DVec3; 3]>, new: &[[DVec3; 3]]) -> bool {
        let mut rank = 0;
        let mut farthest = |corners: [DVec3; 3], enough: f64| {
            let beyond = |p: DVec3| self.surface.distance_sq_beyond(p, &mut rank, enough);
            middles(corners).into_iter().filter_map(beyond).fold(0.0, f64::max)
        };
        let limit = self.tolerance.powi(2);
        let is = new.iter().map(|corners| farthest(*corners, limit)).fold(0.0, f64::max);
        is == 0.0 || is <= old.map(|corners| farthest(corners, limit)).fold(0.0, f64::max)
    }
}

/// The middles of a triangle and of its sides.
fn middles([a, b, c]: [DVec3; 3]) -> [DVec3; 4] {
    [(a + b + c) / 3.0, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)]
}

impl StarMesh {
    /// Whether the mesh stays as close to its surface as its samples are to tell, if it has any, with some
    /// triangles in place of others.
    pub fn stays_close(&self, old: &[u32], new: &[[DVec3; 3]]) -> bool {
        let Some(samples) = &self.samples else { return true };
        let before = old.iter().map(|t| self.corners(self.triangles[*t as usize]));
        samples.are_near(old, new) && samples.is_near(before, new)
    }

    /// Whether it stays so close with a vertex at another place.
    pub fn stays_close_at(&self, v: u32, to: DVec3) -> bool {
        if self.samples.is_none() {
            return true;
        }
        let star = &self.star[v as usize];
        let at = |w: u32| if w == v { to } else { self.points[w as usize] };
        let new: Vec<[DVec3; 3]> = star.iter().map(|t| self.triangles[*t as usize].map(at)).collect();
        self.stays_close(star, &new)
    }

    /// Moves a vertex.
    pub fn move_to(&mut self, v: u32, to: DVec3) {
        let passed = self.passed_at(v, to);
        self.move_with(v, to, passed);
    }

    /// Where the samples around a vertex belong once it is at another place, for [`StarMesh::move_with`].
    pub fn passed_at(&self, v: u32, to: DVec3) -> Vec<PassedSample> {
        let star = &self.star[v as usize];
        self.passed(star, star, |w| if w == v { to } else { self.points[w as usize] })
    }

    /// Moves a vertex, and passes the samples around it.
    pub fn move_with(&mut self, v: u32, to: DVec3, passed: Vec<PassedSample>) {
        self.points[v as usize] = to;
        let star = &self.star[v as usize];
        if let Some(samples) = &mut self.samples {
            samples.pass(star, self.triangles.len(), passed);
        }
    }

    /// Passes the samples of triangles that have changed or gone to the nearest of `new`.
    pub fn pass_samples(&mut self, old: &[u32], new: &[u32]) {
        let passed = self.passed(old, new, |v| self.points[v as usize]);
        if let Some(samples) = &mut self.samples {
            samples.pass(old, self.triangles.len(), passed);
        }
    }

    /// The nearest of the triangles `new` to each sample of `old` ones, with vertices `at` some places.
    fn passed(&self, old: &[u32], new: &[u32], at: impl Fn(u32) -> DVec3) -> Vec<PassedSample> {
        let Some(samples) = &self.samples else { return Vec::new() };
        let corners = |t: &u32| corners_at(self.triangles[*t as usize], &at);
        let new: SmallVec<[(u32, [DVec3; 3], Aabb); 16]> = new
            .iter()
            .map(|t| (*t, corners(t)))
            .map(|(t, corners)| (t, corners, Aabb::of(corners)))
            .collect();
        let largest = |bounds: &Aabb| bounds.min.abs().max(bounds.max.abs()).length_squared();
        let rounding = ROUNDING * new.iter().map(|new| largest(&new.2)).fold(0.0, f64::max);
        let nearest = |(t, sample): (u32, u32)| {
            let p = samples.points[sample as usize];
            let distance_sq = |k: usize| closest_on_triangle(p, new[k].1).point.distance_squared(p);
            // Mostly the same one stays the nearest, and then the boxes of most others are farther away.
            let first = new.iter().position(|new| new.0 == t).unwrap_or(0);
            new.get(first)?;
            let mut best = (distance_sq(first), first);
            for k in (0..new.len()).filter(|k| *k != first) {
                if new[k].2.distance_sq(p) <= SLACK * best.0 + rounding {
                    let other = (distance_sq(k), k);
                    let is_nearer = other.0.total_cmp(&best.0).then(k.cmp(&best.1)).is_lt();
                    best = if is_nearer { other } else { best };
                }
            }
            Some(PassedSample { sample, triangle: new[best.1].0, distance_sq: best.0 })
        };
        let of = |t: u32| {
            samples
                .of
                .get(t as usize)
                .into_iter()
                .flatten()
                .map(|sample| (t, *sample))
                .collect::<SmallVec<[(u32, u32); 16]>>()
        };
        old.iter().flat_map(|t| of(*t)).filter_map(nearest).collect()
    }
}

/// A sample with the triangle that it belongs to from now on.
#[derive(Debug, Clone, Copy)]
pub(super) struct PassedSample {
    sample: u32,
    triangle: u32,
    distance_sq: f64,
}

impl SurfaceSamples {
    /// Takes the samples of triangles `old` off them; `passed` is where they belong now, and `triangles` how
    /// many there are.
    fn pass(&mut self, old: &[u32], triangles: usize, passed: Vec<PassedSample>) {
        self.of.resize(triangles.max(self.of.len()), Vec::new());
        old.iter().for_each(|t| self.of[*t as usize].clear());
        for PassedSample { sample, triangle, distance_sq } in passed {
            self.distances_sq[sample as usize] = distance_sq;
            self.of[triangle as usize].push(sample);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ProgressToken;
    use crate::local::collapse::Limits;
    use crate::mesh::features::{FeatureOptions, find_features};
    use crate::mesh::samples::sample;
    use crate::mesh::spacing;
    use crate::polish::Target;

    /// The torus with a tolerance, after all collapses that it allows.
    fn collapsed(tolerance: f64) -> (TriMesh, StarMesh, SurfaceSamples) {
        let surface = sample("torus").unwrap();
        let features = find_features(&surface, &FeatureOptions::new(0.1)).unwrap();
        let mut mesh = StarMesh::new(&surface, &features, &[], &[]);
        let spacing = spacing(surface.area(), 200);
        let mut samples = SurfaceSamples::new(&surface, 200, spacing);
        samples.tolerance = tolerance;
        mesh.samples = Some(samples.clone());
        let (target, progress) = (Target::new(&surface), ProgressToken::default());
        mesh.split_long(0.5 * spacing, 5000, &[]);
        mesh.flip(&progress).unwrap();
        mesh.relax(&target, &[], &progress).unwrap();
        let limits = Limits::close(0.1, tolerance, true);
        mesh.collapse_edges(f64::INFINITY, 4, &limits, &[], &progress).unwrap();
        (surface, mesh, samples)
    }

    #[test]
    fn a_mesh_is_as_close_as_it_is_to_be_after_any_number_of_operations() {
        let mut before = usize::MAX;
        for tolerance in [0.005, 0.02, 0.08] {
            let (surface, mesh, _) = collapsed(tolerance);
            let tree =
                Bvh::new(&TriMesh { vertices: mesh.points.clone(), triangles: mesh.alive().collect() });
            let distance = |p: &DVec3| tree.closest(*p).unwrap().distance_sq.sqrt();
            let farthest = surface.vertices.iter().map(distance).fold(0.0, f64::max);
            assert!(farthest <= tolerance, "{tolerance}: {farthest}");
            assert!(mesh.used() < before.min(surface.vertices.len()), "{tolerance}: {}", mesh.used());
            before = mesh.used();
        }
    }

    #[test]
    fn each_sample_belongs_to_a_triangle_whose_distance_is_known() {
        let (_, mesh, start) = collapsed(0.03);
        let samples = mesh.samples.as_ref().unwrap();
        let mut seen = vec![false; start.points.len()];
        for (t, list) in samples.of.iter().enumerate() {
            for sample in list.iter().map(|sample| *sample as usize) {
                assert!(!std::mem::replace(&mut seen[sample], true), "sample {sample} is there twice");
                let (p, corners) = (samples.points[sample], mesh.corners(mesh.triangles[t]));
                let distance_sq = closest_on_triangle(p, corners).point.distance_squared(p);
                assert!((distance_sq - samples.distances_sq[sample]).abs() < 1e-15, "sample {sample}");
            }
        }
        assert!(seen.into_iter().all(|seen| seen));
    }

    #[test]
    fn samples_are_on_faces_sharp_edges_and_vertices() {
        let surface = sample("box").unwrap();
        let samples = SurfaceSamples::new(&surface, 100, 0.1);
        let tree = Bvh::new(&surface);
        assert!(samples.points.iter().all(|p| tree.closest(*p).unwrap().distance_sq < 1e-20));
        let [lo, hi] = surface.bounds().unwrap();
        let at_ends =
            |p: &DVec3| (0..3).filter(|k| (p[*k] - lo[*k]).min(hi[*k] - p[*k]).abs() < 1e-9).count();
        let of = |ends: usize| samples.points.iter().filter(|p| at_ends(p) >= ends).count();
        // Corners, edges, all.
        assert!(of(3) == 8 && of(2) > 100 && of(1) == samples.points.len(), "{} {}", of(3), of(2));
        assert!(of(1) >= of(2) + PER_VERTEX * 100 - 1);
    }
}
