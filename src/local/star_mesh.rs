//! Triangles with those around each vertex: any mesh, manifold or not.

use std::ops::Range;

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use smallvec::SmallVec;

use super::curve_edges::{CurveEdges, CurvePart};
use super::surface_samples::SurfaceSamples;
use super::{EdgeLengths, interpolated};
use crate::TriMesh;
use crate::mesh::NONE;
use crate::mesh::chunks::par_map_chunks;
use crate::mesh::features::Features;
use crate::mesh::half_edges::{EdgeTable, HalfEdge};
use crate::mesh::polyline::Polyline;
use crate::mesh::queue::Queue;
use crate::mesh::submesh::renumber;
use crate::mesh::triangle::{corners_at, doubled_normal};
use crate::polish::{ConstrainedMesh, CurveEdge, MeshCache, SlidingCurve, Target};

/// Where a vertex may go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place {
    /// Anywhere in its patch.
    Inside,
    /// Along its curve.
    Curve,
    /// Nowhere.
    Corner,
}

/// The triangles around a vertex: mostly few enough to need no allocation.
pub(super) type Star = SmallVec<[u32; 8]>;
/// The vertices around a vertex, likewise.
pub(super) type Ring = SmallVec<[u32; 24]>;

/// A mesh whose edges can be split, collapsed and flipped.
#[derive(Debug, Clone, Default)]
pub(super) struct StarMesh {
    pub points: Vec<DVec3>,
    /// [`NONE`] three times for one that is gone.
    pub triangles: Vec<[u32; 3]>,
    /// The patch of each triangle.
    pub patches: Vec<u32>,
    /// The triangles around each vertex.
    pub star: Vec<Star>,
    pub places: Vec<Place>,
    pub curves: CurveEdges,
    /// The relative target edge length at each vertex, the least one if it depends on the direction; empty if
    /// they are all equal.
    pub sizes: Vec<f64>,
    /// The map at each vertex in whose image edges of the target length are 1 long; empty if that does not
    /// depend on the direction.
    pub maps: Vec<DMat3>,
    /// Where the search for the surface below each vertex ended.
    pub ranks: Vec<usize>,
    /// Vertices that stay where they are, with the triangles around them.
    pub frozen: Vec<bool>,
    /// What keeps the mesh close to its surface; `None` if each operation has only to keep the shape as it
    /// is.
    pub samples: Option<SurfaceSamples>,
    pub(super) used: usize,
}

impl StarMesh {
    pub fn new(surface: &TriMesh, features: &Features, polylines: &[Polyline], lengths: &[f64]) -> Self {
        let mut star = vec![Star::new(); surface.vertices.len()];
        for (t, triangle) in (0..).zip(&surface.triangles) {
            triangle.iter().for_each(|v| star[*v as usize].push(t));
        }
        let mut places = vec![Place::Inside; star.len()];
        let mut curves = CurveEdges::default();
        for ((number, curve), line) in (0..).zip(&features.curves).zip(polylines) {
            for (k, [a, b]) in curve.edge_ends().enumerate() {
                let [from, to] = [k, k + 1].map(|k| line.arc_length_at(k));
                curves.insert(a, b, CurvePart { curve: number, from, to });
                places[a as usize] = Place::Curve;
                places[b as usize] = Place::Curve;
            }
        }
        features.corners.iter().for_each(|v| places[*v as usize] = Place::Corner);
        let used = star.iter().filter(|star| !star.is_empty()).count();
        Self {
            points: surface.vertices.clone(),
            triangles: surface.triangles.clone(),
            patches: features.patches.clone(),
            ranks: vec![0; star.len()],
            frozen: vec![false; star.len()],
            star,
            places,
            curves,
            sizes: lengths.to_vec(),
            maps: Vec::new(),
            samples: None,
            used,
        }
    }

    /// The same mesh again.
    pub fn from_constrained(local: &ConstrainedMesh) -> Self {
        let ConstrainedMesh { mesh, patches, fixed, pinned, curve_edges, sliding_curves, lengths, .. } =
            local;
        let count = mesh.vertices.len();
        let mut star = vec![Star::new(); count];
        for (t, triangle) in (0..).zip(&mesh.triangles) {
            triangle.iter().for_each(|v| star[*v as usize].push(t));
        }
        let is_fixed = |v: usize| fixed.get(v).copied().unwrap_or(false);
        let mut places: Vec<Place> =
            (0..count).map(|v| if is_fixed(v) { Place::Corner } else { Place::Inside }).collect();
        let sliders = sliding_curves.iter().flat_map(|curve| &curve.sliders);
        sliders.for_each(|(v, _)| places[*v as usize] = Place::Curve);
        // Where no curve is known, boundaries and junctions stay.
        let is_odd = |edge: &&[HalfEdge]| edge.len() != 2;
        for edge in EdgeTable::new(&mesh.triangles).edges().filter(is_odd) {
            for v in <[u32; 2]>::from(edge[0].ends()).map(|v| v as usize) {
                if places[v] == Place::Inside {
                    places[v] = Place::Corner;
                }
            }
        }
        let mut curves = CurveEdges::default();
        for CurveEdge { ends: [a, b], curve, from, to } in curve_edges.iter().copied() {
            curves.insert(a, b, CurvePart { curve, from, to });
        }
        Self {
            points: mesh.vertices.clone(),
            triangles: mesh.triangles.clone(),
            patches: if patches.is_empty() { vec![0; mesh.triangles.len()] } else { patches.clone() },
            ranks: vec![0; count],
            frozen: (0..count).map(|v| pinned.get(v).copied().unwrap_or(false)).collect(),
            used: star.iter().filter(|star| !star.is_empty()).count(),
            star,
            places,
            curves,
            sizes: lengths.clone(),
            maps: Vec::new(),
            samples: None,
        }
    }

    /// The number of vertices with triangles.
    pub fn used(&self) -> usize {
        self.used
    }

    pub fn is_used(&self, v: u32) -> bool {
        !self.star[v as usize].is_empty()
    }

    pub fn is_frozen(&self, v: u32) -> bool {
        self.frozen[v as usize]
    }

    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        corners_at(triangle, |v| self.points[v as usize])
    }

    /// The other vertices of the triangles around one, ascending.
    pub fn neighbours(&self, v: u32) -> Ring {
        let around = self.star[v as usize].iter().flat_map(|t| self.triangles[*t as usize]);
        let mut list: Ring = around.filter(|w| *w != v).collect();
        list.sort_unstable();
        list.dedup();
        list
    }

    /// The triangles at both vertices.
    pub fn at_edge(&self, a: u32, b: u32) -> impl Iterator<Item = u32> {
        self.star[a as usize].iter().copied().filter(move |t| self.triangles[*t as usize].contains(&b))
    }

    /// Like [`StarMesh::at_edge`], in no certain order, by way of the vertex with fewer triangles: some have
    /// thousands, as at the tips of long needles.
    pub fn at_edge_in_any_order(&self, a: u32, b: u32) -> impl Iterator<Item = u32> {
        let (few, many) =
            if self.star[b as usize].len() < self.star[a as usize].len() { (b, a) } else { (a, b) };
        self.at_edge(few, many)
    }

    /// Whether two vertices share an edge.
    pub fn has_edge(&self, a: u32, b: u32) -> bool {
        self.at_edge_in_any_order(a, b).next().is_some()
    }

    /// The triangles that are not gone.
    pub fn alive(&self) -> impl Iterator<Item = [u32; 3]> {
        self.triangles.iter().copied().filter(|triangle| triangle[0] != NONE)
    }

    /// All edges, each once, the smaller vertex first; ascending.
    pub fn edges(&self) -> Vec<(u32, u32)> {
        let mut edges = Vec::with_capacity(3 * self.triangles.len() / 2);
        let mut ends: Vec<u32> = Vec::new();
        for (v, star) in (0u32..).zip(&self.star) {
            ends.clear();
            ends.extend(star.iter().flat_map(|t| self.triangles[*t as usize]).filter(|w| *w > v));
            ends.sort_unstable();
            ends.dedup();
            edges.extend(ends.iter().map(|w| (v, *w)));
        }
        edges
    }

    /// A queue of the edges, each once, the smaller vertex first, for which `entry` gives a value.
    pub fn queue<T: Ord + Copy + Send + Sync>(
        &self,
        entry: impl Fn(&Self, u32, u32) -> Option<T> + Sync,
    ) -> Queue<T> {
        let sides = |t: usize| {
            let [a, b, c] = self.triangles[t];
            let is_alive = a != NONE;
            [(a, b), (b, c), (c, a)].into_iter().filter(move |_| is_alive)
        };
        let of = |part: Range<usize>| -> Vec<T> {
            part.flat_map(sides).filter_map(|(a, b)| entry(self, a.min(b), a.max(b))).collect()
        };
        // Mostly few have one, so that only these are sorted.
        Queue::new(par_map_chunks(self.triangles.len(), of).concat())
    }

    /// The relative target length of an edge.
    pub fn size(&self, a: u32, b: u32) -> f64 {
        if self.sizes.is_empty() {
            return 1.0;
        }
        0.5 * (self.sizes[a as usize] + self.sizes[b as usize])
    }

    /// The length of an edge over its relative target length.
    pub fn relative_length(&self, a: u32, b: u32) -> f64 {
        let [p, q] = [a, b].map(|v| self.points[v as usize]);
        match self.map_at([a, b]) {
            Some(map) => (map * (q - p)).length(),
            None => p.distance(q) / self.size(a, b),
        }
    }

    /// The relative target length of an edge in its own direction.
    pub fn size_along(&self, a: u32, b: u32) -> f64 {
        let Some(map) = self.map_at([a, b]) else { return self.size(a, b) };
        let edge = self.points[b as usize] - self.points[a as usize];
        let (length, mapped) = (edge.length(), (map * edge).length());
        if mapped > 0.0 { length / mapped } else { self.size(a, b) }
    }

    /// The map in the middle of some vertices; `None` if target lengths do not depend on the direction.
    pub fn map_at<const N: usize>(&self, vertices: [u32; N]) -> Option<DMat3> {
        if self.maps.is_empty() {
            return None;
        }
        let sum = vertices.iter().fold(DMat3::ZERO, |sum, v| sum + self.maps[*v as usize]);
        Some(sum * (1.0 / N as f64))
    }

    /// The sum of the normals around a vertex, and the share of their lengths that is left of it: 1 where the
    /// surface is flat, near 0 at the tip of a needle.
    pub fn normal(&self, v: u32) -> (DVec3, f64) {
        let (mut sum, mut lengths) = (DVec3::ZERO, 0.0);
        for t in &self.star[v as usize] {
            let normal = doubled_normal(self.corners(self.triangles[*t as usize]));
            sum += normal;
            lengths += normal.length();
        }
        (sum, if lengths > 0.0 { sum.length() / lengths } else { 1.0 })
    }

    /// The patch of a vertex inside one.
    pub fn patch_at(&self, v: u32) -> u32 {
        self.star[v as usize].first().map_or(0, |t| self.patches[*t as usize])
    }

    pub fn add_vertex(&mut self, at: DVec3, place: Place, size: f64) -> u32 {
        self.points.push(at);
        self.star.push(Star::new());
        self.places.push(place);
        self.ranks.push(0);
        self.frozen.push(false);
        if !self.sizes.is_empty() {
            self.sizes.push(size);
        }
        self.used += 1;
        self.points.len() as u32 - 1
    }

    pub fn add_triangle(&mut self, triangle: [u32; 3], patch: u32) {
        let new = self.triangles.len() as u32;
        self.triangles.push(triangle);
        self.patches.push(patch);
        triangle.iter().for_each(|v| self.star[*v as usize].push(new));
    }

    /// Replaces a triangle by another one.
    pub fn replace(&mut self, t: u32, triangle: [u32; 3]) {
        let old = std::mem::replace(&mut self.triangles[t as usize], triangle);
        old.iter().filter(|v| !triangle.contains(v)).for_each(|v| self.star[*v as usize].retain(|s| *s != t));
        triangle.iter().filter(|v| !old.contains(v)).for_each(|v| self.star[*v as usize].push(t));
    }

    pub fn remove_triangle(&mut self, t: u32) {
        let old = std::mem::replace(&mut self.triangles[t as usize], [NONE; 3]);
        old.iter().for_each(|v| self.star[*v as usize].retain(|s| *s != t));
    }

    /// Notes that a vertex has lost all its triangles.
    pub fn count_removed_vertex(&mut self) {
        self.used -= 1;
    }

    /// Brings the target lengths up to date with the places of the vertices; `wanted` are those at the
    /// vertices of the surface.
    pub fn refresh_sizes(&mut self, surface: &TriMesh, target: &Target, wanted: EdgeLengths) {
        let EdgeLengths { lengths, maps } = wanted;
        if lengths.is_empty() {
            return;
        }
        let places: Vec<_> = (self.points.par_iter().zip(&self.star))
            .map(|(p, star)| if star.is_empty() { None } else { target.corners_near(*p, surface) })
            .collect();
        for (v, (corners, weights)) in
            (0..).zip(places).filter_map(|(v, place): (usize, _)| Some((v, place?)))
        {
            self.sizes[v] = (0..3).map(|k| weights[k] * lengths[corners[k] as usize]).sum();
            if let Some(map) = self.maps.get_mut(v) {
                *map = interpolated(maps, corners, weights);
            }
        }
    }

    /// The vertices of each curve, in order along it, with their arc lengths.
    fn sliding_curves(&self, new: &[u32]) -> Vec<SlidingCurve> {
        let mut sliding: Vec<SlidingCurve> = Vec::new();
        for v in (0..self.points.len() as u32).filter(|v| self.is_used(*v)) {
            if self.places[v as usize] != Place::Curve {
                continue;
            }
            let part = self.neighbours(v).into_iter().find_map(|w| self.curves.get(v, w));
            let Some(CurvePart { curve, from, .. }) = part else { continue };
            let curve = curve as usize;
            if sliding.len() <= curve {
                sliding.resize(curve + 1, SlidingCurve { line: Polyline::default(), sliders: Vec::new() });
            }
            sliding[curve].sliders.push((new[v as usize], from));
        }
        sliding
    }

    /// The mesh without what is gone; the curves are without their lines.
    pub fn into_constrained(self, polylines: &[Polyline]) -> ConstrainedMesh {
        let used: Vec<bool> = self.star.iter().map(|star| !star.is_empty()).collect();
        let (new, old) = renumber(&used);
        let mut sliding_curves = self.sliding_curves(&new);
        sliding_curves
            .resize(polylines.len(), SlidingCurve { line: Polyline::default(), sliders: Vec::new() });
        for (curve, line) in sliding_curves.iter_mut().zip(polylines) {
            curve.line = line.clone();
            if line.is_closed() {
                curve.sliders.iter_mut().for_each(|(_, arc)| *arc = arc.rem_euclid(line.length()));
            }
            curve.sliders.sort_by(|a, b| a.1.total_cmp(&b.1));
        }
        let alive = (0..self.triangles.len()).filter(|t| self.triangles[*t][0] != NONE);
        let (triangles, patches) =
            alive.map(|t| (self.triangles[t].map(|v| new[v as usize]), self.patches[t])).unzip();
        let vertices = old.iter().map(|v| self.points[*v as usize]).collect();
        let fixed = old.iter().map(|v| self.places[*v as usize] != Place::Inside).collect();
        let pinned = match self.frozen.contains(&true) {
            true => old.iter().map(|v| self.frozen[*v as usize]).collect(),
            false => Vec::new(),
        };
        let lengths = if self.sizes.is_empty() {
            Vec::new()
        } else {
            old.iter().map(|v| self.sizes[*v as usize]).collect()
        };
        let renamed = |(a, b, CurvePart { curve, from, to })| {
            let ends = [a, b].map(|v: u32| new[v as usize]);
            CurveEdge { ends, curve, from, to }
        };
        let curve_edges = self.curves.by_curve(polylines.len()).into_iter().flatten().map(renamed).collect();
        let mesh = TriMesh { vertices, triangles };
        let cache = MeshCache::default();
        ConstrainedMesh { mesh, patches, fixed, pinned, curve_edges, sliding_curves, lengths, cache }
    }
}

/// The edges of some triangles, each once, the smaller vertex first; ascending.
pub(super) fn edges_of(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<(u32, u32)> {
    let mut edges: Vec<(u32, u32)> =
        triangles.flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)]).map(|(a, b)| (a.min(b), a.max(b))).collect();
    edges.par_sort_unstable();
    edges.dedup();
    edges
}
