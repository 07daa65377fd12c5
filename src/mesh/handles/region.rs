//! The connected part of a surface around a vertex.

use super::SPREAD;
use crate::mesh::half_edges::{next, previous};
use crate::mesh::{NONE, TriMesh};

/// In place of a region's number, for triangles that belong to no region any more.
const CHANGED: u32 = u32::MAX;

/// Finds regions, one after the other.
pub(super) struct Regions<'a> {
    twins: &'a [u32],
    /// A triangle at each vertex; [`NONE`] without any.
    at: Vec<u32>,
    /// The number of the last region that each triangle was in, from 1; [`CHANGED`] where the surface has
    /// changed since.
    of_triangle: Vec<u32>,
    /// The number of the last region that each vertex was in.
    of_vertex: Vec<u32>,
    /// The number of the last region whose boundary each vertex was on.
    of_boundary: Vec<u32>,
    /// The number of the last region whose walk around the boundary passed each half-edge.
    of_walk: Vec<u32>,
    number: u32,
}

/// A connected part of a surface.
#[derive(Debug, Default)]
pub(super) struct Region {
    /// In the order in which they were reached.
    pub triangles: Vec<u32>,
    pub vertices: Vec<u32>,
    /// Of each vertex, whether all triangles around it are in the region.
    pub is_inside: Vec<bool>,
    /// The half-edges on its boundary, by loop.
    pub boundary: Vec<Vec<u32>>,
}

impl Region {
    /// Its handles, once each boundary loop is capped.
    pub fn genus(&self) -> usize {
        let boundary: usize = self.boundary.iter().map(Vec::len).sum();
        let inside = self.is_inside.iter().filter(|is_inside| **is_inside).count();
        // A vertex where the boundary passes twice counts twice.
        let vertices = inside + boundary;
        let edges = (3 * self.triangles.len() + boundary) / 2;
        (2 + edges).saturating_sub(self.boundary.len() + vertices + self.triangles.len()) / 2
    }
}

impl<'a> Regions<'a> {
    pub fn new(mesh: &TriMesh, twins: &'a [u32]) -> Self {
        let mut at = vec![NONE; mesh.vertices.len()];
        for (t, corners) in (0..).zip(&mesh.triangles) {
            corners.iter().for_each(|v| at[*v as usize] = t);
        }
        let vertices = mesh.vertices.len();
        Self {
            twins,
            at,
            of_triangle: vec![0; mesh.triangles.len()],
            of_vertex: vec![0; vertices],
            of_boundary: vec![0; vertices],
            of_walk: vec![0; twins.len()],
            number: 0,
        }
    }

    /// Leaves the triangles of a region, in which the surface was cut, out of further ones.
    pub fn leave_out(&mut self, region: &Region) {
        region.triangles.iter().for_each(|t| self.of_triangle[*t as usize] = CHANGED);
    }

    /// Whether regions may begin at a vertex.
    pub fn is_free(&self, v: u32) -> bool {
        let t = self.at[v as usize];
        t != NONE && self.of_triangle[t as usize] != CHANGED
    }

    /// A triangle at a vertex; [`NONE`] without any.
    pub fn triangle_at(&self, v: u32) -> u32 {
        self.at[v as usize]
    }

    /// The triangles whose corners are all within `radius` of a vertex, as far as they are connected with it.
    /// Tells of the vertices that are well inside.
    pub fn around(
        &mut self,
        mesh: &TriMesh,
        seed: u32,
        radius: f64,
        mut well_inside: impl FnMut(u32),
    ) -> Region {
        self.number += 1;
        let number = self.number;
        let centre = mesh.vertices[seed as usize];
        let (limit, spread) = (radius * radius, (SPREAD * radius).powi(2));
        let mut region = Region::default();
        let mut reached = vec![self.at[seed as usize]];
        self.of_triangle[reached[0] as usize] = number;
        while let Some(t) = reached.pop() {
            region.triangles.push(t);
            for (k, v) in (0..).zip(mesh.triangles[t as usize]) {
                if self.of_vertex[v as usize] != number {
                    self.of_vertex[v as usize] = number;
                    region.vertices.push(v);
                    if mesh.vertices[v as usize].distance_squared(centre) <= spread {
                        well_inside(v);
                    }
                }
                let twin = self.twins[(3 * t + k) as usize];
                let Some(beyond) = (twin != NONE).then_some(twin / 3) else { continue };
                if [number, CHANGED].contains(&self.of_triangle[beyond as usize]) {
                    continue;
                }
                let tip = mesh.triangles.as_flattened()[previous(twin) as usize];
                if mesh.vertices[tip as usize].distance_squared(centre) <= limit {
                    self.of_triangle[beyond as usize] = number;
                    reached.push(beyond);
                }
            }
        }
        self.find_boundary(mesh, &mut region);
        region
    }

    fn is_in(&self, half_edge: u32) -> bool {
        half_edge != NONE && self.of_triangle[half_edge as usize / 3] == self.number
    }

    fn find_boundary(&mut self, mesh: &TriMesh, region: &mut Region) {
        let corners = mesh.triangles.as_flattened();
        for first in region.triangles.iter().flat_map(|t| 3 * t..3 * t + 3) {
            let is_end = !self.is_in(self.twins[first as usize]);
            if !is_end || self.of_walk[first as usize] == self.number {
                continue;
            }
            let mut around = Vec::new();
            let mut at = first;
            while self.of_walk[at as usize] != self.number {
                self.of_walk[at as usize] = self.number;
                self.of_boundary[corners[at as usize] as usize] = self.number;
                around.push(at);
                at = next(at);
                while self.is_in(self.twins[at as usize]) {
                    at = next(self.twins[at as usize]);
                }
            }
            region.boundary.push(around);
        }
        region.is_inside =
            region.vertices.iter().map(|v| self.of_boundary[*v as usize] != self.number).collect();
    }
}
