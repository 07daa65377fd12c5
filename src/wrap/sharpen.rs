//! Sharp edges of the triangles, put back where edges of a surface around these cut them off.

use std::collections::HashMap;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::contact::Contact;
use crate::mesh::TriMesh;
use crate::mesh::half_edges::{EdgeTable, edge_key};
use crate::mesh::triangle::doubled_normal;
use crate::{ProgressToken, Result};

/// An edge cuts a sharp edge off if its middle is farther from the triangles than this, in sides of the grid.
const LEAST: f64 = 0.02;
/// Where on an edge the planes at its ends are looked up: beside the ends, which may lie on the sharp edge.
const BESIDE: f64 = 0.1;
/// The cosine of the angle between planes from which their intersection is a sharp edge.
const SHARP: f64 = 0.87;
/// The determinant of the normals of three planes from which they meet at a corner.
const CORNER: f64 = 0.1;
/// How far a point of a sharp edge may be from what it replaces, and from the triangles, in sides.
const AWAY: f64 = 2.0;
/// See [`AWAY`].
const ON: f64 = 0.05;
/// A vertex closer to a sharp edge than this, in sides, moves onto it.
const CLOSE: f64 = 0.25;
/// Shares of the way of a vertex to a sharp edge.
const SHARES: [f64; 2] = [1.0, 0.0];

/// What tells where sharp edges are.
pub(super) struct Sharpener<'a> {
    /// The triangles, in the frame of the contact.
    pub triangles: &'a TriMesh,
    pub contact: &'a Contact<'a>,
    /// The side of the grid, in that frame.
    pub side: f64,
}

/// A plane through a point.
#[derive(Clone, Copy)]
struct Plane {
    point: DVec3,
    normal: DVec3,
}

/// An edge that cuts a sharp edge off.
struct Crossing {
    /// Ascending.
    ends: (u32, u32),
    /// A point on the sharp edge, in the unit frame.
    point: DVec3,
}

impl Sharpener<'_> {
    /// Moves vertices close to sharp edges onto these, and inserts others on them, and at corners. What would
    /// make triangles intersect or turn over stays where it was, or on the edge or triangle that it divides.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn sharpen(&self, mesh: &mut TriMesh, progress: &ProgressToken) -> Result<()> {
        let close = self.close_vertices(mesh);
        self.contact.settle(mesh, &close, &SHARES, progress)?;
        progress.poll()?;
        let crossings = self.crossings(mesh);
        let goals = self.divide(mesh, &crossings);
        self.contact.settle(mesh, &goals, &SHARES, progress)
    }

    /// Of each half-edge `3 * triangle + side` of a closed mesh, whether it lies on a sharp edge: whether the
    /// triangles on both sides lie on planes of the input that meet there. Needles have no certain normal of
    /// their own.
    pub fn sharp_edges(&self, mesh: &TriMesh) -> Vec<bool> {
        let normal = |t: usize| {
            let [a, b, c] = mesh.corners(t);
            let plane = self.plane(self.contact.frame.to_unit((a + b + c) / 3.0))?;
            let is_turned = doubled_normal([a, b, c]).dot(plane.normal) < 0.0;
            Some(if is_turned { -plane.normal } else { plane.normal })
        };
        let normals: Vec<Option<DVec3>> = (0..mesh.triangles.len()).into_par_iter().map(normal).collect();
        let mut sharp = vec![false; 3 * mesh.triangles.len()];
        for sides in EdgeTable::new(&mesh.triangles).edges() {
            let mut normals = sides.iter().map(|side| normals[side.triangle()]);
            if let (Some(Some(one)), Some(Some(two))) = (normals.next(), normals.next()) {
                sides.iter().for_each(|side| sharp[side.corners().0] = one.dot(two) < SHARP);
            }
        }
        sharp
    }

    /// For each vertex close to a sharp edge that one of its edges cuts off, a point on this.
    fn close_vertices(&self, mesh: &TriMesh) -> Vec<Option<DVec3>> {
        let close = self.contact.frame.scale * CLOSE * self.side;
        let mut found: Vec<Option<DVec3>> = vec![None; mesh.vertices.len()];
        for Crossing { ends, point } in self.crossings(mesh) {
            let point = self.contact.frame.to_input_units(point);
            for v in [ends.0, ends.1].map(|v| v as usize) {
                let before = found[v].map_or(close, |other| other.distance(mesh.vertices[v]));
                if point.distance(mesh.vertices[v]) < before {
                    found[v] = Some(point);
                }
            }
        }
        found
    }

    /// All edges of a closed mesh that cut sharp edges off.
    fn crossings(&self, mesh: &TriMesh) -> Vec<Crossing> {
        let edges = mesh.triangles.par_iter().flat_map_iter(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)]);
        // Of each edge, the half that ascends.
        edges.filter(|(a, b)| a < b).filter_map(|ends| self.crossing(mesh, ends)).collect()
    }

    fn crossing(&self, mesh: &TriMesh, ends: (u32, u32)) -> Option<Crossing> {
        let [a, b] = [ends.0, ends.1].map(|v| self.contact.frame.to_unit(mesh.vertices[v as usize]));
        let middle = a.midpoint(b);
        let gap = self.contact.input.closest(middle)?.distance_sq.sqrt();
        if gap < LEAST * self.side {
            return None;
        }
        // Edges that span gaps cut nothing off.
        let is_on = |p| {
            self.contact.input.closest(p).is_some_and(|found| found.distance_sq < (ON * self.side).powi(2))
        };
        if !(is_on(a) && is_on(b)) {
            return None;
        }
        let planes = [self.plane(a.lerp(b, BESIDE))?, self.plane(b.lerp(a, BESIDE))?];
        let [one, two] = planes.map(|plane| plane.normal);
        let cos = one.dot(two);
        if cos.abs() > SHARP {
            return None;
        }
        // The point on both planes that is closest to the middle: along both normals from there.
        let [to_one, to_two] = planes.map(|plane| (plane.point - middle).dot(plane.normal));
        let along = 1.0 - cos * cos;
        let by = one * ((to_one - cos * to_two) / along) + two * ((to_two - cos * to_one) / along);
        let point = self.on_triangles(middle, middle + by)?;
        Some(Crossing { ends, point })
    }

    /// The plane of the triangle that is closest.
    fn plane(&self, at: DVec3) -> Option<Plane> {
        let found = self.contact.input.closest(at)?;
        let normal = doubled_normal(self.triangles.corners(found.triangle as usize)).try_normalize()?;
        Some(Plane { point: found.point, normal })
    }

    /// A point on the triangles, unless it is far off them or from another.
    fn on_triangles(&self, from: DVec3, point: DVec3) -> Option<DVec3> {
        let found = self.contact.input.closest(point)?;
        let is_there = found.distance_sq < (ON * self.side).powi(2)
            && from.distance_squared(point) < (AWAY * self.side).powi(2);
        is_there.then_some(found.point)
    }

    /// Divides edges in their middles, and triangles all of whose edges are divided around a vertex of their
    /// own if their planes meet at a corner. Returns where the new vertices belong, for each vertex.
    fn divide(&self, mesh: &mut TriMesh, crossings: &[Crossing]) -> Vec<Option<DVec3>> {
        let mut goals = vec![None; mesh.vertices.len()];
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        for Crossing { ends, point } in crossings {
            let [a, b] = [ends.0, ends.1].map(|v| mesh.vertices[v as usize]);
            middles.insert(*ends, mesh.vertices.len() as u32);
            mesh.vertices.push(a.midpoint(b));
            goals.push(Some(self.contact.frame.to_input_units(*point)));
        }
        let mut divided = Vec::with_capacity(mesh.triangles.len() + 2 * crossings.len());
        for triangle in &mesh.triangles {
            let [a, b, c] = *triangle;
            let sides = [(a, b), (b, c), (c, a)].map(|(a, b)| middles.get(&edge_key(a, b)).copied());
            let [Some(ab), Some(bc), Some(ca)] = sides else {
                let at = |v: u32| goals[v as usize].unwrap_or(mesh.vertices[v as usize]);
                divided.extend(with_some_divided(*triangle, sides, at));
                continue;
            };
            divided.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc]]);
            let corners = [a, b, c].map(|v| mesh.vertices[v as usize]);
            let Some(corner) = self.corner(corners) else {
                divided.push([ab, bc, ca]);
                continue;
            };
            let z = mesh.vertices.len() as u32;
            mesh.vertices.push((corners[0] + corners[1] + corners[2]) / 3.0);
            goals.push(Some(corner));
            divided.extend([[ab, bc, z], [bc, ca, z], [ca, ab, z]]);
        }
        mesh.triangles = divided;
        goals
    }

    /// The corner that a triangle cuts off, in the unit of the input, if its three planes meet at one.
    fn corner(&self, corners: [DVec3; 3]) -> Option<DVec3> {
        let corners = corners.map(|p| self.contact.frame.to_unit(p));
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let mut normals = [DVec3::ZERO; 3];
        let mut along = [0.0; 3];
        for (k, corner) in corners.into_iter().enumerate() {
            let Plane { point, normal } = self.plane(corner.lerp(centre, BESIDE))?;
            (normals[k], along[k]) = (normal, (point - centre).dot(normal));
        }
        let rows = DMat3::from_cols_array_2d(&normals.map(|normal| normal.to_array())).transpose();
        let meet = rows.determinant().abs() > CORNER;
        let by = meet.then(|| rows.inverse() * DVec3::from_array(along))?;
        Some(self.contact.frame.to_input_units(self.on_triangles(centre, centre + by)?))
    }
}

/// The parts of a triangle of whose sides at most two are divided: by these vertices, that of the first side
/// between its first two corners.
fn with_some_divided(
    triangle: [u32; 3],
    sides: [Option<u32>; 3],
    at: impl Fn(u32) -> DVec3,
) -> impl Iterator<Item = [u32; 3]> {
    // Turned so that the last side is whole, and the first is divided if any is.
    let is_turned = |k: &usize| sides[(k + 2) % 3].is_none() && sides[*k].is_some();
    let first = (0..3).find(is_turned).unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|k| triangle[(first + k) % 3]);
    let parts = match [sides[first], sides[(first + 1) % 3]] {
        [Some(ab), Some(bc)] => {
            let is_first = at(ab).distance_squared(at(c)) < at(bc).distance_squared(at(a));
            let rest = if is_first { [[a, ab, c], [ab, bc, c]] } else { [[a, ab, bc], [a, bc, c]] };
            vec![[ab, b, bc], rest[0], rest[1]]
        }
        [Some(ab), None] => vec![[a, ab, c], [ab, b, c]],
        _ => vec![triangle],
    };
    parts.into_iter()
}
