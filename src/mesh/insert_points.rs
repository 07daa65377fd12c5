//! Points of a surface made vertices of its mesh; the surface stays the same.

use super::bvh::Bvh;
use super::half_edges::edge_key;
use super::triangle::{closest_on_triangle, doubled_normal};
use super::unit_frame::UnitFrame;
use super::{NONE, TriMesh};
use crate::{ProgressToken, Result};
use glam::DVec3;
use std::collections::HashMap;

/// Points this close to the surface, in diagonals, become vertices where they are; others do where the
/// surface is closest to them.
pub const ON_SURFACE: f64 = 1e-4;
/// Points farther away than this, in diagonals, become no vertices.
pub const FAR: f64 = 0.05;
/// Points this close to a vertex or an edge, in diagonals, are put there.
const NEAR: f64 = 1e-6;
/// So are those that are this many times as close to it as to the surface: triangles between them would be
/// steep.
const STEEP: f64 = 10.0;
/// Nor are triangles turned over by sharp edges that bend to a point in them: it is not farther from the edge
/// than this share of their height.
const MOST_OF_HEIGHT: f64 = 0.3;

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

/// Makes vertices of points. The vertices in `fixed` stay where they are, and a point there is one of them. A
/// point beside a sharp edge or a boundary is put there: the edge then bends by that much.
///
/// # Errors
/// [`crate::Error::Input`] for a mesh without extent, [`crate::Error::Cancelled`].
pub fn insert_points(
    mesh: &TriMesh,
    points: &[DVec3],
    fixed: &[u32],
    snapping: &Snapping,
    progress: &ProgressToken,
) -> Result<Inserted> {
    let frame = UnitFrame::of(mesh)?;
    let snapping = Snapping { distance: snapping.distance / frame.scale, ..*snapping };
    let unit: Vec<DVec3> = mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect();
    let tree = Bvh::new(&TriMesh { vertices: unit.clone(), triangles: mesh.triangles.clone() });
    let mut growing = Growing::new(mesh, unit, fixed, snapping);
    let (mut vertices, mut distances) = (Vec::new(), Vec::new());
    let mut rank = 0;
    for (k, point) in points.iter().enumerate() {
        if k.is_multiple_of(1024) {
            progress.poll()?;
        }
        let at = frame.to_unit(*point);
        let closest = tree.closest_from(at, &mut rank);
        let distance = closest.map_or(f64::INFINITY, |closest| closest.distance_sq.sqrt());
        distances.push(distance);
        vertices.push(match closest.filter(|_| distance <= FAR) {
            None => NONE,
            Some(closest) if distance <= ON_SURFACE => {
                growing.insert(closest.triangle, (at, *point), NEAR.max(STEEP * distance))
            }
            Some(closest) => {
                let there = (closest.point, frame.to_input_units(closest.point));
                growing.insert(closest.triangle, there, NEAR)
            }
        });
    }
    let Growing { mesh, origin, divides, .. } = growing;
    Ok(Inserted { mesh, origin, divides, vertices, distances })
}

/// A mesh that gets more vertices.
struct Growing {
    mesh: TriMesh,
    /// Its vertices in the unit frame.
    unit: Vec<DVec3>,
    origin: Vec<u32>,
    divides: Vec<[u32; 2]>,
    is_fixed: Vec<bool>,
    snapping: Snapping,
    /// Whether each vertex of the first mesh has a sharp edge or one at a boundary.
    is_sharp: Vec<bool>,
    /// The triangles that divided ones became.
    parts: HashMap<u32, Vec<u32>>,
    /// The triangles at each edge.
    at_edge: HashMap<(u32, u32), Vec<u32>>,
}

impl Growing {
    fn new(mesh: &TriMesh, unit: Vec<DVec3>, fixed: &[u32], snapping: Snapping) -> Self {
        let mut is_fixed = vec![false; unit.len()];
        fixed.iter().for_each(|v| is_fixed[*v as usize] = true);
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
            snapping,
            parts: HashMap::new(),
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

    /// Makes a vertex of a point of a triangle of the first mesh, given in the unit frame and in the units of
    /// the mesh.
    fn insert(&mut self, origin: u32, point: (DVec3, DVec3), near: f64) -> u32 {
        let at = point.0;
        let distance = |t: &u32| closest_on_triangle(at, self.corners(*t)).point.distance_squared(at);
        let parts = self.parts.get(&origin).map_or([origin].as_slice(), Vec::as_slice).to_vec();
        let closest = parts.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let t = closest.unwrap_or(origin);
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
        if corner(&nearest) <= if is_fixed { near } else { reach } {
            if !is_fixed {
                (self.unit[nearest as usize], self.mesh.vertices[nearest as usize]) = point;
                self.is_fixed[nearest as usize] = true;
            }
            return nearest;
        }
        let near_sides =
            sides.into_iter().zip(reaches).filter(|(side, reach)| self.distance(side, at) <= *reach);
        let by_distance = |a: &[u32; 2], b: &[u32; 2]| self.distance(a, at).total_cmp(&self.distance(b, at));
        let edge = near_sides.map(|(side, _)| side).min_by(by_distance);
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
        new
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
        self.mesh.triangles[t as usize] = [a, b, v];
        let [second, third] = [[b, c, v], [c, a, v]].map(|triangle| self.add(t, triangle));
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
            self.mesh.triangles[t as usize] = [x, v, z];
            let new = self.add(t, [v, y, z]);
            self.replace((y, z), t, new);
            for (end, triangle) in [(x, t), (y, new), (z, t), (z, new)] {
                self.at_edge.entry(edge_key(end, v)).or_default().push(triangle);
            }
        }
    }

    /// Adds a part of a triangle.
    fn add(&mut self, t: u32, triangle: [u32; 3]) -> u32 {
        let new = self.mesh.triangles.len() as u32;
        let origin = self.origin[t as usize];
        self.mesh.triangles.push(triangle);
        self.origin.push(origin);
        self.parts.entry(origin).or_insert_with(|| vec![origin]).push(new);
        new
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

    fn inserted(mesh: &TriMesh, points: &[DVec3]) -> Inserted {
        let found = insert_points(mesh, points, &[], &SNAPPING, &ProgressToken::default()).unwrap();
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
        let found = insert_points(&mesh, &points, &[], &SNAPPING, &ProgressToken::default()).unwrap();
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
        let found = insert_points(&mesh, &points, &[], &snapping, &ProgressToken::default()).unwrap();
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
}
