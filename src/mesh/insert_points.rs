//! Points of a surface made vertices of its mesh; the surface stays the same.

use super::bvh::{Bvh, Closest};
use super::half_edges::{EdgeSet, edge_key};
use super::triangle::{closest_on_triangle, doubled_normal};
use super::unit_frame::UnitFrame;
use super::{NONE, TriMesh, position_key};
use crate::{Error, ProgressToken, Result};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use std::collections::{HashMap, HashSet};

/// Points this close to the surface, in diagonals, become vertices where they are; others do where the
/// surface is closest to them.
pub const ON_SURFACE: f64 = 1e-4;
/// Points farther away than this, in diagonals, become no vertices.
pub const FAR: f64 = 0.05;
/// Points this close to a vertex or an edge, in diagonals, are put there.
pub const NEAR: f64 = 1e-6;
/// So are those that are this many times as close to it as to the surface: triangles between them would be
/// steep.
const STEEP: f64 = 10.0;
/// Nor are triangles turned over by sharp edges that bend to a point in them: it is not farther from the edge
/// than this share of their height.
const MOST_OF_HEIGHT: f64 = 0.3;
/// Points between two polls.
const POLL: usize = 1024;

/// A mesh with more vertices. Those of the first one, and the triangles that no point is in, keep their
/// places; new ones follow.
#[derive(Debug, Clone, Default)]
pub struct Inserted {
    /// The mesh.
    pub mesh: TriMesh,
    /// For each triangle, the one that it is a part of.
    pub origin: Vec<u32>,
    /// For each new vertex the ends of the edge that it divides; [`NONE`] for one inside a triangle.
    pub divides: Vec<[u32; 2]>,
    /// The vertex of each point; [`NONE`] for those that are too far away.
    pub vertices: Vec<u32>,
    /// How far each point is from the surface, in diagonals of its box.
    pub distances: Vec<f64>,
}

/// Sharp edges and boundaries, and how close to them points are put there.
#[derive(Debug, Clone, Copy)]
pub struct Snapping {
    /// An edge is sharp where the surface turns by this angle or more; in degrees.
    pub feature_angle: f64,
    /// In the units of the mesh.
    pub distance: f64,
}

/// What of a mesh stays as it is when points become vertices of it.
#[derive(Debug, Clone, Copy)]
pub struct KeptParts<'a> {
    /// Vertices that do not move.
    pub vertices: &'a [u32],
    /// Edges that are not divided, each as its [`edge_key`].
    pub edges: &'a EdgeSet,
}

/// Points, and where the surface of a mesh is closest to them.
pub struct PointsOnSurface<'a> {
    mesh: &'a TriMesh,
    points: &'a [DVec3],
    frame: UnitFrame,
    /// The vertices of the mesh in the unit frame.
    unit: Vec<DVec3>,
    /// In the unit frame; none for points that are too far away.
    closest: Vec<Option<Closest>>,
    distances: Vec<f64>,
}

impl<'a> PointsOnSurface<'a> {
    /// Finds them.
    ///
    /// # Errors
    /// [`Error::Input`] for a mesh without extent, [`Error::Cancelled`].
    pub fn find(mesh: &'a TriMesh, points: &'a [DVec3], progress: &ProgressToken) -> Result<Self> {
        let frame = UnitFrame::of(mesh)?;
        let unit: Vec<DVec3> = mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect();
        let tree = Bvh::new(&TriMesh { vertices: unit.clone(), triangles: mesh.triangles.clone() });
        let (mut closest, mut distances) = (Vec::new(), Vec::new());
        let mut rank = 0;
        for (k, point) in points.iter().enumerate() {
            if k.is_multiple_of(POLL) {
                progress.poll()?;
            }
            let found = tree.closest_from(frame.to_unit(*point), &mut rank);
            let distance = found.map_or(f64::INFINITY, |found| found.distance_sq.sqrt());
            distances.push(distance);
            closest.push(found.filter(|_| distance <= FAR));
        }
        Ok(Self { mesh, points, frame, unit, closest, distances })
    }

    /// How many vertices these ones of the mesh and the points are together.
    pub fn count_with(&self, vertices: &[u32]) -> usize {
        let near = self.points.iter().zip(&self.closest).filter(|(_, closest)| closest.is_some());
        let own = vertices.iter().map(|v| &self.mesh.vertices[*v as usize]);
        own.chain(near.map(|(point, _)| point)).map(|p| position_key(*p)).collect::<HashSet<_>>().len()
    }

    /// Makes vertices of the points. A point beside a sharp edge or a boundary is put there: the edge then
    /// bends by that much.
    ///
    /// # Errors
    /// [`Error::Usage`] for a point too close to another one or to what is kept, [`Error::Cancelled`].
    pub fn insert(self, kept: KeptParts, snapping: &Snapping, progress: &ProgressToken) -> Result<Inserted> {
        let Self { mesh, points, frame, unit, closest, distances } = self;
        let snapping = Snapping { distance: snapping.distance / frame.scale, ..*snapping };
        let mut growing = Growing::new(mesh, unit, kept, snapping);
        let mut vertices = vec![NONE; points.len()];
        let mut point_of: HashMap<u32, usize> = HashMap::new();
        for (turn, k) in shuffled(points.len()).into_iter().enumerate() {
            if turn.is_multiple_of(POLL) {
                progress.poll()?;
            }
            let (Some(closest), point) = (closest[k], points[k]) else { continue };
            let (there, near) = match distances[k] {
                distance if distance <= ON_SURFACE => {
                    ((frame.to_unit(point), point), NEAR.max(STEEP * distance))
                }
                _ => ((closest.point, frame.to_input_units(closest.point)), NEAR),
            };
            let place = growing.insert(closest.triangle, there, near);
            let of_kept = |v: u32| growing.mesh.vertices[v as usize];
            vertices[k] = match place {
                Place::Vertex(v) => v,
                Place::Kept(v) => match point_of.get(&v) {
                    Some(other) if points[*other] == point => v,
                    Some(other) => return Err(too_close(point, "the point", points[*other])),
                    None if of_kept(v) == point => v,
                    None => return Err(too_close(point, "the vertex", of_kept(v))),
                },
                Place::KeptEdge([a, b]) => {
                    return Err(too_close(point, "the edge at", of_kept(a).midpoint(of_kept(b))));
                }
            };
            point_of.entry(vertices[k]).or_insert(k);
        }
        let Growing { mesh, origin, divides, .. } = growing;
        Ok(Inserted { mesh, origin, divides, vertices, distances })
    }
}

/// The numbers below `count` in an order that has nothing to do with the points: in that of a grid or a line,
/// the tree of a triangle's parts would be as deep as there are points in it.
fn shuffled(count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
    (1..count).rev().for_each(|k| order.swap(k, random.random_range(0..=k)));
    order
}

/// The error about a point next to something else that stays.
fn too_close(point: DVec3, what: &str, other: DVec3) -> Error {
    let [p, q] = [point, other].map(|DVec3 { x, y, z }| format!("({x}, {y}, {z})"));
    let problem = format!("the point {p} of `points` is too close to {what} {q}, which is kept as well");
    Error::option("points", problem, "remove one of them, or give both more exactly on the surface")
}

/// Where a point is put.
enum Place {
    /// It is this vertex, which is there for it.
    Vertex(u32),
    /// It would be this one, which stays where it is.
    Kept(u32),
    /// It would divide this edge, which stays whole.
    KeptEdge([u32; 2]),
}

/// A part of a triangle, and its own parts.
struct Part {
    corners: [u32; 3],
    /// Its triangle in the mesh, while it is not divided.
    triangle: u32,
    /// The numbers of its parts.
    parts: Vec<usize>,
}

/// A mesh that gets more vertices.
struct Growing<'a> {
    mesh: TriMesh,
    /// Its vertices in the unit frame.
    unit: Vec<DVec3>,
    origin: Vec<u32>,
    divides: Vec<[u32; 2]>,
    is_fixed: Vec<bool>,
    whole: &'a EdgeSet,
    snapping: Snapping,
    /// Whether each vertex of the first mesh has a sharp edge or one at a boundary.
    is_sharp: Vec<bool>,
    /// The triangles that were divided, with all their parts.
    parts: Vec<Part>,
    /// The part that each divided triangle of the first mesh is.
    first_part: HashMap<u32, usize>,
    /// The part that each triangle is, if it is one of a divided one.
    part_of: HashMap<u32, usize>,
    /// The triangles at each edge.
    at_edge: HashMap<(u32, u32), Vec<u32>>,
}

impl<'a> Growing<'a> {
    fn new(mesh: &TriMesh, unit: Vec<DVec3>, kept: KeptParts<'a>, snapping: Snapping) -> Self {
        let mut is_fixed = vec![false; unit.len()];
        kept.vertices.iter().for_each(|v| is_fixed[*v as usize] = true);
        let mut at_edge: HashMap<(u32, u32), Vec<u32>> = HashMap::with_capacity(3 * mesh.triangles.len() / 2);
        for (t, [a, b, c]) in (0..).zip(&mesh.triangles) {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                at_edge.entry(edge_key(*a, *b)).or_default().push(t);
            }
        }
        let mut growing = Self {
            mesh: mesh.clone(),
            is_sharp: vec![false; unit.len()],
            unit,
            origin: (0..mesh.triangles.len() as u32).collect(),
            divides: Vec::new(),
            is_fixed,
            whole: kept.edges,
            snapping,
            parts: Vec::new(),
            first_part: HashMap::new(),
            part_of: HashMap::new(),
            at_edge,
        };
        let sharp = growing.at_edge.iter().filter(|(_, around)| !growing.is_smooth(around));
        let ends: Vec<u32> = sharp.flat_map(|((a, b), _)| [*a, *b]).collect();
        ends.into_iter().for_each(|v| growing.is_sharp[v as usize] = true);
        growing
    }

    fn corners(&self, t: u32) -> [DVec3; 3] {
        self.mesh.triangles[t as usize].map(|v| self.unit[v as usize])
    }

    /// The triangle that a point of a triangle of the first mesh is on, or is closest to.
    fn find(&self, origin: u32, at: DVec3) -> u32 {
        let distance = |corners: [u32; 3]| {
            let corners = corners.map(|v| self.unit[v as usize]);
            closest_on_triangle(at, corners).point.distance_squared(at)
        };
        let of_triangle = |t: u32| distance(self.mesh.triangles[t as usize]);
        let mut triangle = origin;
        let mut next = self.first_part.get(&origin).copied();
        while let Some(part) = next.map(|part| &self.parts[part]) {
            triangle = part.triangle;
            let of_part = |part: &usize| distance(self.parts[*part].corners);
            next = part.parts.iter().copied().min_by(|a, b| of_part(a).total_cmp(&of_part(b)));
        }
        // Parts lie over each other slightly where points are off the surface.
        loop {
            let [a, b, c] = self.mesh.triangles[triangle as usize];
            let around = [(a, b), (b, c), (c, a)].into_iter().flat_map(|(a, b)| {
                self.at_edge.get(&edge_key(a, b)).into_iter().flatten().copied().collect::<Vec<u32>>()
            });
            let of_same = around.filter(|t| self.origin[*t as usize] == origin);
            let closest = of_same.min_by(|a, b| of_triangle(*a).total_cmp(&of_triangle(*b)));
            match closest.filter(|t| of_triangle(*t) < of_triangle(triangle)) {
                Some(closer) => triangle = closer,
                None => return triangle,
            }
        }
    }

    /// Makes a vertex of a point of a triangle of the first mesh, given in the unit frame and in the units of
    /// the mesh.
    fn insert(&mut self, origin: u32, point: (DVec3, DVec3), near: f64) -> Place {
        let at = point.0;
        let t = self.find(origin, at);
        let [a, b, c] = self.mesh.triangles[t as usize];
        let sides = [[a, b], [b, c], [c, a]];
        let reaches = sides.map(|side| self.reach_of(side, t).max(near));
        let corner = |v: &u32| self.unit[*v as usize].distance(at);
        let is_nearer = |a: &u32, b: &u32| corner(a).total_cmp(&corner(b));
        let nearest = [a, b, c].into_iter().min_by(is_nearer).unwrap_or(a);
        let length = |[a, b]: [u32; 2]| self.unit[a as usize].distance(self.unit[b as usize]);
        let shortest = sides.map(length).into_iter().fold(f64::INFINITY, f64::min);
        let reach = match self.is_sharp.get(nearest as usize) {
            Some(true) => self.snapping.distance.min(MOST_OF_HEIGHT * shortest).max(near),
            _ => near,
        };
        let is_fixed = self.is_fixed[nearest as usize];
        if is_fixed && corner(&nearest) <= near {
            return Place::Kept(nearest);
        }
        if !is_fixed && corner(&nearest) <= reach {
            (self.unit[nearest as usize], self.mesh.vertices[nearest as usize]) = point;
            self.is_fixed[nearest as usize] = true;
            return Place::Vertex(nearest);
        }
        let near_sides =
            sides.into_iter().zip(reaches).filter(|(side, reach)| self.distance(side, at) <= *reach);
        let by_distance = |a: &[u32; 2], b: &[u32; 2]| self.distance(a, at).total_cmp(&self.distance(b, at));
        let edge = near_sides.map(|(side, _)| side).min_by(by_distance);
        let is_whole = |[a, b]: &[u32; 2]| self.whole.contains(&edge_key(*a, *b));
        if let Some(edge) = edge.filter(is_whole) {
            return Place::KeptEdge(edge);
        }
        let new = self.unit.len() as u32;
        self.unit.push(point.0);
        self.mesh.vertices.push(point.1);
        self.is_fixed.push(true);
        if let Some(edge) = edge {
            self.divides.push(edge);
            self.divide_edge(edge, new);
        } else {
            self.divides.push([NONE; 2]);
            self.divide_triangle(t, new);
        }
        Place::Vertex(new)
    }

    /// How far a point is from an edge.
    fn distance(&self, [a, b]: &[u32; 2], at: DVec3) -> f64 {
        let [p, q] = [*a, *b].map(|v| self.unit[v as usize]);
        let share = ((at - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
        p.lerp(q, share).distance(at)
    }

    /// Whether the triangles at an edge are two that meet without a crease.
    fn is_smooth(&self, around: &[u32]) -> bool {
        let normal = |t: u32| doubled_normal(self.corners(t));
        matches!(*around, [one, other]
            if normal(one).angle_between(normal(other)).to_degrees() < self.snapping.feature_angle)
    }

    /// How close to an edge points of triangle `t` are put on it because it is sharp or at a boundary; 0 if
    /// it is not.
    fn reach_of(&self, edge: [u32; 2], t: u32) -> f64 {
        let around = self.at_edge.get(&edge_key(edge[0], edge[1])).map_or(&[] as &[u32], Vec::as_slice);
        if self.is_smooth(around) {
            return 0.0;
        }
        let [p, q] = edge.map(|v| self.unit[v as usize]);
        let height = doubled_normal(self.corners(t)).length() / p.distance(q);
        self.snapping.distance.min(MOST_OF_HEIGHT * height)
    }

    fn divide_triangle(&mut self, t: u32, v: u32) {
        let [a, b, c] = self.mesh.triangles[t as usize];
        let [second, third] = self.divide(t, [[a, b, v], [b, c, v], [c, a, v]])[..] else { return };
        self.replace((b, c), t, second);
        self.replace((c, a), t, third);
        for (end, pair) in [(a, [t, third]), (b, [t, second]), (c, [second, third])] {
            self.at_edge.insert(edge_key(end, v), pair.to_vec());
        }
    }

    fn divide_edge(&mut self, [a, b]: [u32; 2], v: u32) {
        let around = self.at_edge.remove(&edge_key(a, b)).unwrap_or_default();
        for t in around {
            let mut triangle = self.mesh.triangles[t as usize];
            while [a, b].contains(&triangle[2]) {
                triangle.rotate_left(1);
            }
            let [x, y, z] = triangle;
            let [new] = self.divide(t, [[x, v, z], [v, y, z]])[..] else { return };
            self.replace((y, z), t, new);
            for (end, triangle) in [(x, t), (y, new), (z, t), (z, new)] {
                self.at_edge.entry(edge_key(end, v)).or_default().push(triangle);
            }
        }
    }

    /// Replaces a triangle by parts of it, of which the first takes its number; returns the others' numbers.
    fn divide<const N: usize>(&mut self, t: u32, parts: [[u32; 3]; N]) -> Vec<u32> {
        let (origin, corners) = (self.origin[t as usize], self.mesh.triangles[t as usize]);
        let divided = self.part_of.get(&t).copied().unwrap_or_else(|| {
            self.first_part.insert(t, self.parts.len());
            self.parts.push(Part { corners, triangle: t, parts: Vec::new() });
            self.parts.len() - 1
        });
        let mut added = Vec::new();
        for (k, corners) in parts.into_iter().enumerate() {
            let triangle = if k == 0 { t } else { self.mesh.triangles.len() as u32 };
            if k == 0 {
                self.mesh.triangles[t as usize] = corners;
            } else {
                self.mesh.triangles.push(corners);
                self.origin.push(origin);
                added.push(triangle);
            }
            let number = self.parts.len();
            self.part_of.insert(triangle, number);
            self.parts[divided].parts.push(number);
            self.parts.push(Part { corners, triangle, parts: Vec::new() });
        }
        added
    }

    fn replace(&mut self, (a, b): (u32, u32), old: u32, new: u32) {
        let list = self.at_edge.entry(edge_key(a, b)).or_default();
        list.iter_mut().filter(|t| **t == old).for_each(|t| *t = new);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::mesh::topology::topology;

    const SNAPPING: Snapping = Snapping { feature_angle: 40.0, distance: 0.0 };

    fn try_insert(mesh: &TriMesh, points: &[DVec3], vertices: &[u32], by: &Snapping) -> Result<Inserted> {
        let progress = ProgressToken::default();
        let located = PointsOnSurface::find(mesh, points, &progress)?;
        located.insert(KeptParts { vertices, edges: &EdgeSet::new() }, by, &progress)
    }

    fn inserted(mesh: &TriMesh, points: &[DVec3]) -> Inserted {
        let found = try_insert(mesh, points, &[], &SNAPPING).unwrap();
        let (before, after) = (topology(mesh), topology(&found.mesh));
        assert_eq!(
            (before.components, before.euler, before.boundary_loops),
            (after.components, after.euler, after.boundary_loops)
        );
        assert!(after.is_closed_manifold() && after.duplicate_faces == 0, "{after:?}");
        assert!((found.mesh.area() / mesh.area() - 1.0).abs() < 1e-9);
        for (t, origin) in found.origin.iter().enumerate() {
            let [one, other] = [found.mesh.doubled_normal(t), mesh.doubled_normal(*origin as usize)];
            assert!(one.normalize().dot(other.normalize()) > 1.0 - 1e-9, "{t}");
        }
        found
    }

    #[test]
    fn points_in_triangles_on_edges_and_at_vertices_become_vertices() {
        let mesh = sample("box").unwrap();
        let [x, y] = [0.3, 0.6];
        let points = [
            DVec3::new(x, y, 1.0),
            DVec3::new(x, y + 0.1, 1.0),
            DVec3::new(x, 0.0, 0.0),
            DVec3::new(0.2, 0.0, 0.0),
            DVec3::new(0.25, 0.25, 1.0),
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::new(x, y, 1.0),
        ];
        let found = inserted(&mesh, &points);
        for (point, v) in points.iter().zip(&found.vertices) {
            assert_eq!(found.mesh.vertices[*v as usize], *point);
        }
        assert_eq!(found.vertices[0], found.vertices[6]);
        assert!(found.vertices[5] < 8 && found.mesh.vertices.len() == 13);
        let on_edges = found.divides.iter().filter(|ends| **ends != [NONE; 2]).count();
        assert!((2..=3).contains(&on_edges), "{on_edges}");
    }

    #[test]
    fn points_off_the_surface_are_projected_or_left_out() {
        let mesh = sample("box").unwrap();
        let points = [DVec3::new(0.3, 0.6, 1.0001), DVec3::new(0.3, 0.4, 1.01), DVec3::new(0.0, 0.0, 9.0)];
        let found = try_insert(&mesh, &points, &[], &SNAPPING).unwrap();
        let at = |k: usize| found.mesh.vertices[found.vertices[k] as usize];
        assert_eq!(at(0), points[0]);
        assert!(at(1).distance(DVec3::new(0.3, 0.4, 1.0)) < 1e-9);
        assert_eq!(found.vertices[2], NONE);
        assert!((found.distances[1] * 3f64.sqrt() - 0.01).abs() < 1e-9);
    }

    #[test]
    fn sharp_edges_bend_to_points_beside_them_and_others_do_not() {
        let mesh = sample("box").unwrap();
        let snapping = Snapping { feature_angle: 40.0, distance: 0.02 };
        let points = [DVec3::new(0.3, 0.01, 1.0), DVec3::new(0.99, 0.99, 1.0), DVec3::new(0.3, 0.1, 1.0)];
        let found = try_insert(&mesh, &points, &[], &snapping).unwrap();
        assert!(found.divides[0] != [NONE; 2] && found.divides.len() == 2, "{:?}", found.divides);
        assert!(found.vertices[1] < 8 && found.divides[1] == [NONE; 2], "{:?}", found.vertices);
        for (point, v) in points.iter().zip(&found.vertices) {
            assert_eq!(found.mesh.vertices[*v as usize], *point);
        }
    }

    #[test]
    fn many_points_in_one_triangle_keep_the_surface() {
        let mesh = sample("box").unwrap();
        let point = |k: u32| {
            let [x, y] = [0.618_034, 0.754_878].map(|r| (f64::from(k) * r).fract());
            DVec3::new(x, y, 1.0)
        };
        let points: Vec<DVec3> = (1..300).map(point).collect();
        let found = inserted(&mesh, &points);
        assert_eq!(found.mesh.vertices.len(), 8 + 299);
    }

    #[test]
    fn points_too_close_to_others_are_refused_by_name() {
        let mesh = sample("box").unwrap();
        // Both are off the surface, by a tenth of what is between them.
        let points = [DVec3::new(0.3, 0.6, 1.0001), DVec3::new(0.3005, 0.6, 1.0001)];
        let refused = try_insert(&mesh, &points, &[], &SNAPPING).unwrap_err().to_string();
        assert!(refused.contains("(0.3, 0.6, 1.0001)") && refused.contains("(0.3005, 0.6, 1.0001)"));
        // One above the other, which has a vertex there.
        let above = [DVec3::new(0.3, 0.6, 1.001), DVec3::new(0.3, 0.6, 1.002)];
        assert!(try_insert(&mesh, &above, &[], &SNAPPING).is_err());
        let apart = [points[0], DVec3::new(0.302, 0.6, 1.0001)];
        let found = try_insert(&mesh, &apart, &[], &SNAPPING).unwrap();
        assert!(found.vertices.iter().zip(apart).all(|(v, p)| found.mesh.vertices[*v as usize] == p));
        let beside = mesh.vertices[7] - DVec3::new(1e-7, 0.0, 0.0);
        let refused = try_insert(&mesh, &[beside], &[7], &SNAPPING).unwrap_err().to_string();
        assert!(refused.contains("the vertex (1, 0, 1)"), "{refused}");
        let there = try_insert(&mesh, &[mesh.vertices[7]], &[7], &SNAPPING).unwrap();
        assert_eq!(there.vertices, [7]);
    }

    #[test]
    fn edges_that_are_kept_are_not_divided() {
        let mesh = sample("box").unwrap();
        let on_edge = [DVec3::new(0.5, 0.0, 0.0)];
        let ends = |v: usize| mesh.vertices[v];
        let is_it = |a: usize, b: usize| ends(a).midpoint(ends(b)) == on_edge[0];
        let edges = (0..8).flat_map(|b| (0..b).map(move |a| (a, b))).filter(|(a, b)| is_it(*a, *b));
        let edges: EdgeSet = edges.map(|(a, b)| edge_key(a as u32, b as u32)).collect();
        let progress = ProgressToken::default();
        let kept = KeptParts { vertices: &[], edges: &edges };
        let located = PointsOnSurface::find(&mesh, &on_edge, &progress).unwrap();
        let refused = located.insert(kept, &SNAPPING, &progress).unwrap_err().to_string();
        assert!(edges.len() == 1 && refused.contains("the edge at (0.5, 0, 0)"), "{refused}");
    }

    #[test]
    fn the_parts_of_a_triangle_are_found_in_few_steps() {
        let mesh = sample("box").unwrap();
        // In the order of a line, which would make a tree as deep as there are points.
        let points: Vec<DVec3> =
            (0..20_000).map(|k| DVec3::new(0.1 + 4e-5 * f64::from(k), 0.05, 1.0)).collect();
        let progress = ProgressToken::default();
        let edges = EdgeSet::new();
        let unit = mesh.vertices.clone();
        let mut growing = Growing::new(&mesh, unit, KeptParts { vertices: &[], edges: &edges }, SNAPPING);
        let located = PointsOnSurface::find(&mesh, &points, &progress).unwrap();
        for k in shuffled(points.len()) {
            let there = (points[k], points[k]);
            assert!(matches!(
                growing.insert(located.closest[k].unwrap().triangle, there, 1e-9),
                Place::Vertex(_)
            ));
        }
        let mut depth = vec![0u32; growing.parts.len()];
        for (k, part) in growing.parts.iter().enumerate() {
            part.parts.iter().for_each(|own| depth[*own] = depth[k] + 1);
        }
        let deepest = depth.iter().max().unwrap();
        assert!(*deepest < 80, "{deepest}");
    }
}
