//! Whether triangles near each other intersect.

use glam::DVec3;

use super::star_mesh::StarMesh;
use crate::mesh::intersections::{count_crossings, count_intersecting, intersecting_faces};
use crate::mesh::triangle::{corners_at, doubled_normal};
use crate::{ProgressToken, TriMesh};

/// Triangles up to which each is compared with each.
const FEW: usize = 150;

/// Below this cosine of the normals before and after, triangles may run into others around.
const APART: f64 = 0.95;

impl StarMesh {
    /// Whether all these triangles keep about their direction with their vertices `at` new places, so that
    /// they hardly run into others around.
    pub fn turn_little(
        &self,
        mut triangles: impl Iterator<Item = [u32; 3]>,
        at: impl Fn(u32) -> DVec3,
    ) -> bool {
        triangles.all(|triangle| {
            let n = doubled_normal(self.corners(triangle));
            let m = doubled_normal(corners_at(triangle, &at));
            let lengths = n.length() * m.length();
            lengths > 0.0 && n.dot(m) >= APART * lengths
        })
    }

    /// The triangles around the neighbours of some vertices, ascending.
    fn around(&self, vertices: &[u32]) -> Vec<u32> {
        let near = vertices.iter().flat_map(|v| self.neighbours(*v));
        let mut around: Vec<u32> = near.flat_map(|w| self.star[w as usize].iter().copied()).collect();
        around.sort_unstable();
        around.dedup();
        around
    }

    /// Whether no more pairs of triangles intersect around the neighbours of some vertices once triangles
    /// there, `old`, are replaced by `new` ones, with vertices `at` new places. No other triangle has a
    /// vertex that moves.
    pub fn change_stays_apart(
        &self,
        centre: &[u32],
        old: &[u32],
        new: &[[u32; 3]],
        at: impl Fn(u32) -> DVec3 + Copy + Sync,
    ) -> bool {
        let mut changed = old.to_vec();
        changed.sort_unstable();
        let others = self.around(centre).into_iter().filter(|t| changed.binary_search(t).is_err());
        let others: Vec<[u32; 3]> = others.map(|t| self.triangles[t as usize]).collect();
        // Mostly none do, and then those before need not be looked at.
        let after = count_crossings(new, &others, at);
        after == 0 || {
            let old: Vec<[u32; 3]> = old.iter().map(|t| self.triangles[*t as usize]).collect();
            after <= count_crossings(&old, &others, |v| self.points[v as usize])
        }
    }

    /// Whether no more triangles around `v` intersect others once it is at `to`.
    pub fn stays_apart_at(&self, v: u32, to: DVec3) -> bool {
        let star = &self.star[v as usize];
        let triangles: Vec<[u32; 3]> = star.iter().map(|t| self.triangles[*t as usize]).collect();
        let at = |w: u32| if w == v { to } else { self.points[w as usize] };
        self.change_stays_apart(&[v], star, &triangles, at)
    }

    /// Whether no more of the triangles `after`, with their vertices `at` new places, intersect than of those
    /// `before`.
    pub fn stays_apart(
        &self,
        before: &[[u32; 3]],
        after: &[[u32; 3]],
        at: impl Fn(u32) -> DVec3 + Copy,
    ) -> bool {
        // Mostly none do, and then those before need not be looked at.
        let after = intersecting(after, at);
        after == 0 || after <= intersecting(before, |w| self.points[w as usize])
    }
}

/// How many of these triangles intersect others of them.
pub(super) fn intersecting(triangles: &[[u32; 3]], at: impl Fn(u32) -> DVec3 + Copy) -> usize {
    if triangles.len() <= FEW {
        return count_intersecting(triangles, at);
    }
    let mut order: Vec<u32> = triangles.as_flattened().to_vec();
    order.sort_unstable();
    order.dedup();
    let number = |v: u32| order.binary_search(&v).unwrap_or(0) as u32;
    let mesh = TriMesh {
        vertices: order.iter().map(|v| at(*v)).collect(),
        triangles: triangles.iter().map(|t| t.map(number)).collect(),
    };
    // So small a mesh needs no cancelling.
    intersecting_faces(&mesh, &ProgressToken::default()).map_or(0, |faces| faces.len())
}
